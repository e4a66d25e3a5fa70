//! Tables and plots of the work–precision study, and the price list that follows from them.

use super::convergence::{Convergence, Station, judge};
use super::design::{Design, Method, micrometres};
use super::run::{Ending, Measured, Problem};
use super::store::Store;
use crate::Error;
use crate::plot::{Chart, Provenance, draw_charts};
use crate::price_list::{PRESETS, Price};
use crate::scene::Speed;
use crate::study::verification::report::{line, logarithms, panel};
use std::fmt::Write;
use std::path::Path;

/// Outputs in the tables: name, unit and factor from SI.
const OUTPUTS: [(&str, &str, f64); 5] = [
    ("cutting force", "N/mm", 1.0),
    ("thrust", "N/mm", 1.0),
    ("chip thickness", "mm", 1e3),
    ("chip heating", "K", 1.0),
    ("p99.9 strain", "", 1.0),
];

/// What the study found.
pub struct Report<'a> {
    design: &'a Design,
    store: &'a Store,
    /// Convergence of each output on the default line; none while runs of it are missing.
    convergence: Option<Vec<Convergence>>,
}

impl<'a> Report<'a> {
    /// Reads the finished runs.
    pub fn new(design: &'a Design, store: &'a Store) -> Self {
        let mut report = Report { design, store, convergence: None };
        report.convergence = report.stations().map(|stations| {
            (0..OUTPUTS.len())
                .map(|k| {
                    let of = |s: &(f64, Vec<Measured>)| Station {
                        spacing: s.0,
                        values: s.1.iter().map(|m| m.outputs[k]).collect(),
                    };
                    judge(&stations.iter().map(of).collect::<Vec<_>>())
                })
                .collect()
        });
        report
    }

    fn ending(&self, problem: &Problem) -> Option<&Ending> {
        self.store.get(&problem.identity())
    }

    fn measured(&self, problem: &Problem) -> Option<&Measured> {
        self.ending(problem).and_then(Ending::measured)
    }

    /// The default line: spacings with the runs of all starts that went to their end.
    fn stations(&self) -> Option<Vec<(f64, Vec<Measured>)>> {
        let default = self.design.methods.first()?;
        let mut stations = Vec::new();
        for (k, &spacing) in default.spacings.iter().enumerate() {
            let shifts = self.design.shifts(k);
            let runs: Vec<Measured> = shifts
                .iter()
                .filter_map(|&shift| {
                    self.measured(&self.design.cut(&default.settings, Some(spacing), shift)).cloned()
                })
                .collect();
            if runs.is_empty() {
                return None;
            }
            stations.push((spacing, runs));
        }
        (stations.len() >= 2).then_some(stations)
    }

    /// Values at the finest spacing of the default line, which errors refer to.
    fn reference(&self) -> Option<[f64; 5]> {
        let convergence = self.convergence.as_ref()?;
        Some(std::array::from_fn(|k| convergence[k].means[convergence[k].means.len() - 1]))
    }

    /// The runs of a method: spacing and how each ended.
    fn line_of(&self, method: &Method) -> Vec<(f64, Option<&Ending>)> {
        let at =
            |&spacing: &f64| (spacing, self.ending(&self.design.cut(&method.settings, Some(spacing), 0.0)));
        method.spacings.iter().map(at).collect()
    }

    /// Work and precision of every run on the cut.
    pub fn work_precision(&self) -> String {
        let mut text = String::from(
            "| method | spacing (µm) | CPU (s) | over estimate | cutting force (N/mm) | its error | thrust | chip thickness | chip heating | p99.9 strain | ledger |\n\
             |---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        let reference = self.reference();
        for method in &self.design.methods {
            for (spacing, ending) in self.line_of(method) {
                let head = format!("| {} | {} |", method.name, micrometres(spacing));
                let _ = match ending {
                    Some(Ending::Done(m)) => {
                        let error =
                            |k: usize| reference.map_or("".into(), |r| percent(m.outputs[k] / r[k] - 1.0));
                        let errors: Vec<String> = (1..5).map(error).collect();
                        writeln!(
                            text,
                            "{head} {:.2} | {:.2} | {:.1} | {} | {} | {} |",
                            m.cpu_seconds,
                            m.cpu_seconds / m.estimated,
                            m.outputs[0],
                            error(0),
                            errors.join(" | "),
                            percent(m.balance_error)
                        )
                    }
                    Some(Ending::Failed(why, m)) => {
                        writeln!(text, "{head} {:.2} | | failed: {why} | | | | | | |", m.cpu_seconds)
                    }
                    Some(Ending::Refused(why)) => {
                        writeln!(text, "{head} | | not available: {why} | | | | | | |")
                    }
                    None => writeln!(text, "{head} | | not run (or not available) | | | | | | |"),
                };
            }
        }
        text
    }

    /// Work and precision on the problems with exact solutions.
    pub fn verification(&self) -> String {
        let mut text =
            String::from("| problem | method | CPU (s) | error, coarse to fine |\n|---|---|---|---|\n");
        for (problem, method, runs) in self.design.verification() {
            let endings: Vec<Option<&Ending>> = runs.iter().map(|run| self.ending(run)).collect();
            let (times, errors): (Vec<String>, Vec<String>) = endings
                .iter()
                .map(|ending| match ending {
                    Some(Ending::Done(m)) => (format!("{:.2}", m.cpu_seconds), percent(m.error)),
                    Some(Ending::Failed(why, m)) => {
                        (format!("{:.2}", m.cpu_seconds), format!("failed: {why}"))
                    }
                    _ => ("-".into(), "not run".into()),
                })
                .unzip();
            let _ = writeln!(text, "| {problem} | {method} | {} | {} |", times.join(", "), errors.join(", "));
        }
        text
    }

    /// Values, scatter and band of every output over the spacings.
    pub fn convergence(&self) -> String {
        let (Some(convergence), Some(stations)) = (&self.convergence, self.stations()) else {
            return "The default line is not complete.\n".into();
        };
        let mut text = String::from("| output |");
        for (spacing, runs) in &stations {
            let _ = write!(text, " {} µm ({} starts) |", micrometres(*spacing), runs.len());
        }
        text.push_str(" verdict |\n|---|");
        text.push_str(&"---|".repeat(stations.len() + 1));
        text.push('\n');
        for ((name, unit, factor), c) in OUTPUTS.iter().zip(convergence) {
            let _ = write!(text, "| {name} ({}) |", if unit.is_empty() { "-" } else { unit });
            for k in 0..c.means.len() {
                let (mean, scatter) = (factor * c.means[k], factor * c.scatter[k]);
                let _ = write!(text, " {} ± {}, band {} |", three(mean), three(scatter), band(c.bands[k]));
            }
            let _ = writeln!(text, " {} |", c.verdict);
        }
        text
    }

    /// The price list: spacings, speed levels and presets. `None` while runs that it needs are missing.
    pub fn prices(&self) -> Option<Vec<Price>> {
        let convergence = self.convergence.as_ref()?;
        let stations = self.stations()?;
        let reference = self.reference()?;
        let mut prices = Vec::new();
        let of_spacing = |k: usize| std::array::from_fn(|output| convergence[output].bands[k]);
        for (k, (spacing, runs)) in stations.iter().enumerate() {
            let cpu_seconds = runs.iter().map(|m| m.cpu_seconds).sum::<f64>() / runs.len() as f64;
            let (kind, name) = ("spacing".to_owned(), String::new());
            prices.push(Price { kind, name, point_spacing: *spacing, cpu_seconds, bands: of_spacing(k) });
        }
        for level in ["balanced", "fast"] {
            let method = self.design.methods.iter().find(|m| m.name == format!("speed {level}"))?;
            let mut bands = [0.0_f64; 5];
            for (spacing, ending) in self.line_of(method) {
                let exact = self.measured(&self.design.cut(&[], Some(spacing), 0.0));
                // A study that was ended early lacks the finest.
                let (Some(measured), Some(exact)) = (ending.and_then(Ending::measured), exact) else {
                    continue;
                };
                for k in 0..5 {
                    let change = (measured.outputs[k] - exact.outputs[k]).abs() / reference[k].abs();
                    bands[k] = bands[k].max(change);
                }
            }
            let (kind, name) = ("speed".to_owned(), level.to_owned());
            prices.push(Price { kind, name, point_spacing: 0.0, cpu_seconds: 0.0, bands });
        }
        for preset in PRESETS {
            let Some(k) = stations.iter().position(|station| station.0 == preset.point_spacing) else {
                continue;
            };
            // A preset without levers is the default line, whichever of its starts has run.
            let of_starts = (preset.speed == Speed::Exact).then_some(prices[k].cpu_seconds);
            let own = self.measured(&self.design.preset(preset.name)).map(|measured| measured.cpu_seconds);
            let Some(cpu_seconds) = own.or(of_starts) else { continue };
            let level = Speed::ALL.iter().find(|(_, speed)| *speed == preset.speed)?.0;
            let of_level =
                prices.iter().find(|price| price.name == level).map_or([0.0; 5], |price| price.bands);
            let spacing: [f64; 5] = of_spacing(k);
            prices.push(Price {
                kind: "preset".into(),
                name: preset.name.into(),
                point_spacing: preset.point_spacing,
                cpu_seconds,
                bands: std::array::from_fn(|output| spacing[output] + of_level[output]),
            });
        }
        Some(prices)
    }

    /// Draws the Pareto plots into a folder.
    ///
    /// # Errors
    /// `Error::File` when a picture cannot be written.
    pub fn draw(&self, folder: &Path) -> Result<(), Error> {
        let provenance = Provenance::default();
        if let Some(reference) = self.reference() {
            let charts = [false, true].map(|is_lever| self.chart(is_lever, reference[0]));
            let title = "Reference cut: error of the cutting force over CPU time";
            draw_charts(
                &folder.join("pareto_cut.png"),
                title,
                "log10 of CPU time (s)",
                &charts,
                &provenance,
            )?;
            self.draw_convergence(folder)?;
        }
        let mut charts: Vec<Chart> = Vec::new();
        for problem in ["axis-aligned solution", "piston shock"] {
            let lines = self.design.verification().into_iter().filter(|entry| entry.0 == problem);
            let lines = lines.map(|(_, method, runs)| {
                let measured = runs.iter().filter_map(|run| self.measured(run));
                line(method, logarithms(measured.map(|m| (m.cpu_seconds, 100.0 * m.error))))
            });
            charts.push(panel(format!("{problem}: log10 error (%)"), lines.collect()));
        }
        let title = "Problems with exact solutions: error over CPU time";
        draw_charts(&folder.join("pareto_exact.png"), title, "log10 of CPU time (s)", &charts, &provenance)
    }

    /// One panel: schemes, or levers of speed; the default line stands in both.
    fn chart(&self, is_lever: bool, reference: f64) -> Chart {
        let shown = |(index, method): &(usize, &Method)| *index == 0 || method.is_lever == is_lever;
        let lines = self.design.methods.iter().enumerate().filter(shown).filter_map(|(_, method)| {
            let points = self.line_of(method).into_iter().filter_map(|(_, ending)| {
                let m = ending.and_then(Ending::measured)?;
                // The finest default run is the reference within its scatter: an error of 0 has no logarithm.
                let error = 100.0 * (m.outputs[0] / reference - 1.0).abs();
                Some((m.cpu_seconds, error.max(0.01)))
            });
            let points = logarithms(points);
            (!points.is_empty()).then(|| line(method.name, points))
        });
        panel("log10 error of the cutting force (%)", lines.collect())
    }

    /// Every output over the spacing, relative to the finest, with the starts' scatter as thin lines.
    fn draw_convergence(&self, folder: &Path) -> Result<(), Error> {
        let (Some(stations), Some(reference)) = (self.stations(), self.reference()) else { return Ok(()) };
        let lines = OUTPUTS.iter().enumerate().map(|(k, (name, ..))| {
            let mean = |runs: &[Measured]| runs.iter().map(|m| m.outputs[k]).sum::<f64>() / runs.len() as f64;
            let at =
                |s: &(f64, Vec<Measured>)| ((1e6 * s.0).log10(), 100.0 * (mean(&s.1) / reference[k] - 1.0));
            line(*name, stations.iter().map(at).collect())
        });
        let chart = panel("difference to the finest (%)", lines.collect());
        let title = "Reference cut: outputs over the spacing of the points";
        let x_label = "log10 of the spacing (µm)";
        draw_charts(&folder.join("convergence.png"), title, x_label, &[chart], &Provenance::default())
    }
}

/// A price list for readers.
pub fn price_table(prices: &[Price]) -> String {
    let mut text = String::from(
        "| preset | spacing (µm) | CPU time (s) | cutting force | thrust | chip thickness | chip heating | p99.9 strain |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for price in prices.iter().filter(|price| price.kind == "preset") {
        let bands: Vec<String> = price.bands.iter().map(|share| format!("±{}", band(*share))).collect();
        let _ = writeln!(
            text,
            "| `{}` | {} | {:.1} | {} |",
            price.name,
            micrometres(price.point_spacing),
            price.cpu_seconds,
            bands.join(" | ")
        );
    }
    text
}

/// A share with its sign, in percent.
fn percent(share: f64) -> String {
    let value = 100.0 * share;
    let decimals = if value.abs() < 0.1 { 3 } else { 1 };
    format!("{value:+.decimals$} %").replace('-', "−")
}

/// A band in percent.
fn band(share: f64) -> String {
    if share < 0.0995 { format!("{:.1} %", 100.0 * share) } else { format!("{:.0} %", 100.0 * share) }
}

/// Three digits.
fn three(value: f64) -> String {
    let decimals = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 4) as usize;
    format!("{value:.decimals$}")
}
