//! What the work–precision study runs.
//!
//! No full factorial (shape × transfer × contact × spacing × Courant × precision × speed would be 3,000 cuts)
//! but lines around the default method: each changes one thing and is followed over the spacings 40, 20 and
//! 10 µm. The finest, 5 µm, costs as much as all others together: only the two
//! lines that are judged for convergence have it, each against its own finest run: the default one, adiabatic,
//! and the same cut with conduction, whose layer at the rake face has a thickness of its own. They are run
//! from several starts, shifted by parts of a cell, which gives the scatter.

use super::queue::Task;
use super::run::{Problem, Settings, set};
use crate::scene::presets::PRESETS;

/// Settings and spacings of one line of the plot.
#[derive(Clone, Debug)]
pub struct Method {
    /// Name in table and plot.
    pub name: &'static str,
    /// What it changes.
    pub settings: Settings,
    /// Distances between points (m), from coarse to fine.
    pub spacings: Vec<f64>,
    /// Which of the two panels shows it: schemes, or speed-ups.
    pub is_lever: bool,
    /// The effect of heat whose convergence it shows: such a line is run from several starts, and its errors
    /// are against its own finest run. Errors of the others are against that of the first line.
    pub heat: Option<&'static str>,
}

/// The whole study.
#[derive(Clone, Debug)]
pub struct Design {
    /// Settings of every cut.
    pub base: Settings,
    /// Travel over which outputs are averaged (m).
    pub span: [f64; 2],
    /// The lines; the first is the default.
    pub methods: Vec<Method>,
    /// Number of shifted starts of the lines judged for convergence, per spacing.
    pub starts: Vec<usize>,
    /// Cells of the manufactured solution.
    pub axis_aligned: Vec<i32>,
    /// Cells of the piston's bar.
    pub piston: Vec<i32>,
}

/// Gap before the tool at the start (m), without a shift.
const GAP: f64 = 1e-6;

impl Design {
    /// The study as documented.
    pub fn full() -> Design {
        let common = [4e-5, 2e-5, 1e-5];
        let all = [4e-5, 2e-5, 1e-5, 5e-6];
        Design {
            base: vec![],
            span: [1.0e-3, 1.6e-3],
            methods: methods(&common, &all),
            starts: vec![4, 4, 2, 1],
            axis_aligned: vec![8, 16, 32, 64],
            piston: vec![50, 100, 200],
        }
    }

    /// The same lines on a block of a third of the length, with spacings that take seconds; its figures mean
    /// nothing.
    pub fn quick() -> Design {
        let common = [5e-5, 4e-5];
        let all = [5e-5, 4e-5, 2.5e-5];
        let base = vec![set("workpiece.length", 1e-3), set("workpiece.height", 8e-4)];
        Design {
            base,
            span: [1.5e-4, 2.5e-4],
            methods: methods(&common, &all),
            starts: vec![2, 2, 2],
            axis_aligned: vec![8, 16],
            piston: vec![25, 50],
        }
    }

    /// The cut of a line at a spacing, from a start shifted by `shift` cells.
    pub fn cut(&self, settings: &[(String, String)], spacing: Option<f64>, shift: f64) -> Problem {
        let mut all = self.base.clone();
        let mut span = self.span;
        if let Some(spacing) = spacing {
            // Two points along an edge of a cell.
            let way = shift * 2.0 * spacing;
            span = span.map(|travel| travel + way);
            all.push(set("numerics.point_spacing", format!("{spacing:e}")));
            if way > 0.0 {
                all.push(set("tool.initial_gap", format!("{:e}", GAP + way)));
            }
        }
        all.extend(settings.iter().cloned());
        Problem::Cut { settings: all, span }
    }

    /// Shifts (cells) of a line's starts at its `k`-th spacing.
    pub fn shifts(&self, method: &Method, k: usize) -> Vec<f64> {
        let starts = self.starts.get(k).copied().unwrap_or(1);
        let count = if method.heat.is_some() { starts } else { 1 };
        (0..count).map(|j| j as f64 / count as f64).collect()
    }

    /// The cut of a preset, as a user names it.
    pub fn preset(&self, name: &str, heat: &str) -> Problem {
        self.cut(&[set("numerics.accuracy", name), set("effects.heat", heat)], None, 0.0)
    }

    /// The lines judged for convergence, with their effect of heat.
    pub fn judged(&self) -> impl Iterator<Item = (&'static str, &Method)> {
        self.methods.iter().filter_map(|method| Some((method.heat?, method)))
    }

    /// Lines of the verification problems: problem, method and its runs from coarse to fine.
    pub fn verification(&self) -> Vec<(&'static str, String, Vec<Problem>)> {
        let mut lines = Vec::new();
        for (name, linear) in [("gimp", false), ("linear", true)] {
            let runs =
                self.axis_aligned.iter().map(|&cells| Problem::AxisAligned { linear, cells }).collect();
            lines.push(("axis-aligned solution", name.to_owned(), runs));
        }
        for (name, points_touch) in [("points touch", true), ("nodes touch", false)] {
            for courant in [0.25, 0.5] {
                let runs = self
                    .piston
                    .iter()
                    .map(|&cells| Problem::Piston { points_touch, cells, courant })
                    .collect();
                lines.push(("piston shock", format!("{name}; Courant {courant}"), runs));
            }
        }
        lines
    }

    /// Every run.
    pub fn tasks(&self) -> Vec<Task> {
        let mut tasks = Vec::new();
        for method in &self.methods {
            for (k, &spacing) in method.spacings.iter().enumerate() {
                for shift in self.shifts(method, k) {
                    let start = if shift > 0.0 {
                        format!("; start shifted by {shift:.2} cells")
                    } else {
                        String::new()
                    };
                    let label = format!("{} at {} µm{start}", method.name, micrometres(spacing));
                    tasks.push(Task { label, problem: self.cut(&method.settings, Some(spacing), shift) });
                }
            }
        }
        for (heat, _) in self.judged() {
            for preset in PRESETS {
                // Presets belong to the reference cut: the quick study does not pay for them.
                if self.base.is_empty() {
                    let label = format!("preset {}; {heat}", preset.name);
                    tasks.push(Task { label, problem: self.preset(preset.name, heat) });
                }
            }
        }
        for (problem, method, runs) in self.verification() {
            for (k, run) in runs.into_iter().enumerate() {
                tasks.push(Task { label: format!("{problem}; {method}; step {}", k + 1), problem: run });
            }
        }
        tasks
    }
}

/// A spacing (m) in micrometres, for reading.
pub fn micrometres(spacing: f64) -> String {
    format!("{:.3}", 1e6 * spacing).trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn methods(common: &[f64], all: &[f64]) -> Vec<Method> {
    let line = |name: &'static str, spacings: &[f64], is_lever: bool, settings: &[(&str, &str)]| Method {
        name,
        settings: settings.iter().map(|(name, value)| set(name, value)).collect(),
        spacings: spacings.to_vec(),
        is_lever,
        heat: None,
    };
    let judged = |name, heat: &'static str, settings: &[_]| Method {
        heat: Some(heat),
        ..line(name, all, false, settings)
    };
    vec![
        judged("default", "adiabatic", &[]),
        judged("conduction", "conduction", &[("effects.heat", "conduction")]),
        line("formulation plain", common, false, &[("numerics.formulation", "plain")]),
        line("transfer apic", common, false, &[("numerics.transfer", "apic")]),
        line("contact distance", common, false, &[("numerics.contact", "distance")]),
        line("contact velocity", common, false, &[("numerics.contact", "velocity")]),
        line("shape linear", common, false, &[("numerics.shape_function", "linear")]),
        line(
            "plain, no locking control",
            common,
            false,
            &[("numerics.formulation", "plain"), ("effects.volumetric_locking_control", "false")],
        ),
        line("Courant 0.25", common, true, &[("numerics.courant", "0.25")]),
        line("Courant 0.54", common, true, &[("numerics.courant", "0.54")]),
        line("single precision", common, true, &[("numerics.precision", "single")]),
        line("speed balanced", common, true, &[("numerics.speed", "balanced")]),
        line("speed fast", common, true, &[("numerics.speed", "fast")]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A preset and the same values set one by one are one run, which is made once; other values are another
    /// run.
    #[test]
    fn a_preset_is_the_run_of_its_values() {
        let design = Design::full();
        let fine = PRESETS.iter().find(|preset| preset.name == "fine").unwrap();
        let level = crate::scene::Speed::ALL.iter().find(|(_, speed)| *speed == fine.speed).unwrap().0;
        let same = design.cut(&[set("numerics.speed", level)], Some(fine.point_spacing), 0.0);
        assert_eq!(design.preset("fine", "adiabatic").identity(), same.identity());
        let shifted = design.cut(&[set("numerics.speed", level)], Some(fine.point_spacing), 0.25);
        assert_ne!(design.preset("fine", "adiabatic").identity(), shifted.identity());
    }
}
