//! Tables and plots of the work–precision study, and the price list that follows from them.

use super::convergence::{Convergence, Station, judge};
use super::design::{Design, Method, micrometres};
use super::run::{Ending, Measured, Problem};
use super::store::Store;
use crate::Error;
use crate::output::plot::{Chart, Provenance, draw_charts};
use crate::scene::Speed;
use crate::scene::presets::{PRESET, PRESET_WITH_CONDUCTION, PRESETS, Price};
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
    /// The lines judged for convergence whose runs are there, the default one first.
    judged: Vec<Judged>,
}

/// A line judged for convergence.
struct Judged {
    /// Its effect of heat.
    heat: &'static str,
    /// Its name.
    name: &'static str,
    /// Spacings with the runs of all starts that went to their end.
    stations: Vec<(f64, Vec<Measured>)>,
    /// Convergence of each output.
    convergence: Vec<Convergence>,
}

impl Judged {
    /// Values at the finest spacing.
    fn finest(&self) -> [f64; 5] {
        std::array::from_fn(|k| self.convergence[k].means[self.stations.len() - 1])
    }
}

impl<'a> Report<'a> {
    /// Reads the finished runs.
    pub fn new(design: &'a Design, store: &'a Store) -> Self {
        let mut report = Report { design, store, judged: Vec::new() };
        for (heat, method) in design.judged() {
            let Some(stations) = report.stations(method) else { continue };
            let convergence = (0..OUTPUTS.len()).map(|k| {
                let of =
                    |s: &(f64, Vec<Measured>)| Station { values: s.1.iter().map(|m| m.outputs[k]).collect() };
                judge(&stations.iter().map(of).collect::<Vec<_>>())
            });
            let convergence = convergence.collect();
            report.judged.push(Judged { heat, name: method.name, stations, convergence });
        }
        report
    }

    fn ending(&self, problem: &Problem) -> Option<&Ending> {
        self.store.get(&problem.identity())
    }

    fn measured(&self, problem: &Problem) -> Option<&Measured> {
        self.ending(problem).and_then(Ending::measured)
    }

    /// Spacings of a line with the runs of all starts that went to their end; `None` where a spacing has
    /// none.
    fn stations(&self, method: &Method) -> Option<Vec<(f64, Vec<Measured>)>> {
        let mut stations = Vec::new();
        for (k, &spacing) in method.spacings.iter().enumerate() {
            let shifts = self.design.shifts(method, k);
            let runs: Vec<Measured> = shifts
                .iter()
                .filter_map(|&shift| {
                    self.measured(&self.design.cut(&method.settings, Some(spacing), shift)).cloned()
                })
                .collect();
            if runs.is_empty() {
                return None;
            }
            stations.push((spacing, runs));
        }
        (stations.len() >= 2).then_some(stations)
    }

    /// Values that errors of a method refer to: the finest of its own line where that is judged, of the
    /// default line otherwise.
    fn reference(&self, method: &Method) -> Option<[f64; 5]> {
        let heat = method.heat.or(self.design.methods.first()?.heat)?;
        self.judged.iter().find(|line| line.heat == heat).map(Judged::finest)
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
        for method in &self.design.methods {
            let reference = self.reference(method);
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
        if self.judged.is_empty() {
            return "The default line is not complete.\n".into();
        }
        let mut text = String::new();
        for line in &self.judged {
            let _ = write!(text, "The line `{}`:\n\n| output |", line.name);
            for (spacing, runs) in &line.stations {
                let _ = write!(text, " {} µm ({} starts) |", micrometres(*spacing), runs.len());
            }
            text.push_str(" verdict |\n|---|");
            text.push_str(&"---|".repeat(line.stations.len() + 1));
            text.push('\n');
            for ((name, unit, factor), c) in OUTPUTS.iter().zip(&line.convergence) {
                let _ = write!(text, "| {name} ({}) |", if unit.is_empty() { "-" } else { unit });
                for k in 0..c.means.len() {
                    let (mean, scatter) = (factor * c.means[k], factor * c.scatter[k]);
                    let _ =
                        write!(text, " {} ± {}, band {} |", three(mean), three(scatter), band(c.bands[k]));
                }
                let _ = writeln!(text, " {} |", c.verdict);
            }
            text.push('\n');
        }
        text
    }

    /// The price list: spacings, speed levels and presets. `None` while runs that it needs are missing.
    pub fn prices(&self) -> Option<Vec<Price>> {
        if self.judged.len() < self.design.judged().count() {
            return None;
        }
        let default = self.judged.first()?;
        let mut prices = Vec::new();
        for line in &self.judged {
            for (k, (point_spacing, runs)) in line.stations.iter().enumerate() {
                let cpu_seconds = runs.iter().map(|m| m.cpu_seconds).sum::<f64>() / runs.len() as f64;
                prices.push(Price {
                    kind: "spacing".into(),
                    name: line.heat.into(),
                    point_spacing: *point_spacing,
                    cpu_seconds,
                    bands: line.convergence.iter().map(|c| c.bands[k]).collect::<Vec<_>>().try_into().ok()?,
                });
            }
        }
        for level in ["balanced", "fast"] {
            let bands = self.level_bands(level, &default.finest())?;
            let (kind, name) = ("speed".to_owned(), level.to_owned());
            prices.push(Price { kind, name, point_spacing: 0.0, cpu_seconds: 0.0, bands });
        }
        for line in &self.judged {
            let presets = PRESETS.iter().filter_map(|preset| {
                let own = self.measured(&self.design.preset(preset.name, line.heat))?;
                let of_spacing = prices
                    .iter()
                    .find(|price| price.name == line.heat && price.point_spacing == preset.point_spacing)?;
                let level = Speed::ALL.iter().find(|(_, speed)| *speed == preset.speed)?.0;
                let of_level =
                    prices.iter().find(|price| price.name == level).map_or([0.0; 5], |price| price.bands);
                Some(Price {
                    kind: if line.heat == default.heat {
                        PRESET.into()
                    } else {
                        PRESET_WITH_CONDUCTION.into()
                    },
                    name: preset.name.into(),
                    point_spacing: preset.point_spacing,
                    cpu_seconds: own.cpu_seconds,
                    bands: std::array::from_fn(|output| of_spacing.bands[output] + of_level[output]),
                })
            });
            let presets: Vec<Price> = presets.collect();
            prices.extend(presets);
        }
        Some(prices)
    }

    /// What a speed level changes at most at the spacings where it ran beside the default line, over
    /// `reference` (-).
    fn level_bands(&self, level: &str, reference: &[f64; 5]) -> Option<[f64; 5]> {
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
        Some(bands)
    }

    /// Draws the Pareto plots into a folder.
    ///
    /// # Errors
    /// `Error::File` when a picture cannot be written.
    pub fn draw(&self, folder: &Path) -> Result<(), Error> {
        let provenance = Provenance::default();
        if !self.judged.is_empty() {
            let charts = [false, true].map(|is_lever| self.chart(is_lever));
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

    /// One panel: schemes, or speed-ups; the default line stands in both.
    fn chart(&self, is_lever: bool) -> Chart {
        let shown = |(index, method): &(usize, &Method)| *index == 0 || method.is_lever == is_lever;
        let lines = self.design.methods.iter().enumerate().filter(shown).filter_map(|(_, method)| {
            let reference = self.reference(method)?[0];
            let mut runs = self.line_of(method);
            if method.heat.is_some() {
                // Its finest run is the reference itself, whose error says nothing.
                runs.pop();
            }
            let points = runs.into_iter().filter_map(|(_, ending)| {
                let m = ending.and_then(Ending::measured)?;
                let error = 100.0 * (m.outputs[0] / reference - 1.0).abs();
                Some((m.cpu_seconds, error.max(0.01)))
            });
            let points = logarithms(points);
            (!points.is_empty()).then(|| line(method.name, points))
        });
        panel("log10 error of the cutting force (%)", lines.collect())
    }

    /// Every output over the spacing, relative to the finest: a panel for each judged line.
    fn draw_convergence(&self, folder: &Path) -> Result<(), Error> {
        let charts = self.judged.iter().map(|judged| {
            let finest = judged.finest();
            let lines = OUTPUTS.iter().enumerate().map(|(k, (name, ..))| {
                let means = judged.stations.iter().zip(&judged.convergence[k].means);
                let at = |((spacing, _), mean): (&(f64, Vec<Measured>), &f64)| {
                    ((1e6 * spacing).log10(), 100.0 * (mean / finest[k] - 1.0))
                };
                line(*name, means.map(at).collect())
            });
            panel(format!("{}: difference to the finest (%)", judged.name), lines.collect())
        });
        let charts: Vec<Chart> = charts.collect();
        let title = "Reference cut: outputs over the spacing of the points";
        let x_label = "log10 of the spacing (µm)";
        draw_charts(&folder.join("convergence.png"), title, x_label, &charts, &Provenance::default())
    }
}

/// A price list for readers.
pub fn price_table(prices: &[Price]) -> String {
    let mut text = String::from(
        "| preset | spacing (µm) | CPU time (s) | cutting force | thrust | chip thickness | chip heating | p99.9 strain |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for price in prices.iter().filter(|price| price.kind.starts_with(PRESET)) {
        let heat = if price.kind == PRESET { "" } else { " with conduction" };
        let bands: Vec<String> = price.bands.iter().map(|share| format!("±{}", band(*share))).collect();
        let _ = writeln!(
            text,
            "| `{}`{heat} | {} | {:.1} | {} |",
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
