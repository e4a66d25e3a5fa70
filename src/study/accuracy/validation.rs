//! Validation: four measured cuts of AISI 1045, and the single shear plane of least work.
//!
//! The measurements give neither friction nor edge radius. One friction coefficient and one radius for all
//! cuts are fitted to three of them and predict the fourth, in turn. Each cut is run over a grid of frictions
//! and radii; between them forces are interpolated (bilinear), and the fit is the pair with the smallest
//!
//! Σ ((F − F_m) / 0.1 F_m)² + ((T − T_m) / 0.25 T_m)²
//!
//! over the cuts fitted to, F and T cutting force and thrust, the weights those of the criterion: 10 % and 25
//! %. Cuts run with conduction where this version has it, at speed level `balanced` with a window of 6 feeds
//! and automatic mass scaling.

use super::queue::{Task, run_all};
use super::run::{Ending, Problem, Settings, set};
use super::store::{self, Store};
use super::{Options, failed, write};
use crate::Error;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Measured cuts (secondary source named in the file).
const MEASURED: &str = include_str!("../../../tests/data/cutting_experiments_1045.csv");
/// Forces of the single shear plane (quadrature of the Johnson–Cook law).
const SHEAR_PLANE: &str = include_str!("../../../tests/data/cutting_single_plane_JC.csv");
/// Bounds of the mean errors: cutting force and thrust (-).
const BOUNDS: [f64; 2] = [0.10, 0.25];
/// Travel over which forces are averaged, in feeds.
const SPAN: [f64; 2] = [2.5, 4.0];

/// One measured cut.
#[derive(Clone, Debug)]
pub struct Cut {
    name: String,
    /// Cutting speed (m/s).
    speed: f64,
    /// Feed (m).
    feed: f64,
    /// Rake angle (deg).
    rake: f64,
    /// Cutting force and thrust (N/mm).
    forces: [f64; 2],
}

/// The measured cuts of the file.
pub fn cuts() -> Vec<Cut> {
    MEASURED
        .lines()
        .skip(1)
        .filter_map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let number = |k: usize| fields.get(k).and_then(|text| text.parse::<f64>().ok());
            Some(Cut {
                name: fields.first()?.to_string(),
                speed: number(2)? / 60.0,
                feed: number(3)? * 1e-3,
                rake: number(5)?,
                forces: [number(10)?, number(11)?],
            })
        })
        .collect()
}

/// Cutting force and thrust (N/mm) by the cut's name and the places of friction and radius in the grid. Made
/// once: telling a run's identity takes milliseconds, and fits ask ten thousands of times.
type Table = BTreeMap<(String, usize, usize), [f64; 2]>;

/// Frictions, edge radii (m) and points per feed of the study.
struct Grid {
    frictions: Vec<f64>,
    radii: Vec<f64>,
    /// Of the grid, and of the check on convergence.
    per_feed: [f64; 2],
    heat: &'static str,
}

impl Grid {
    fn new(is_quick: bool) -> Grid {
        let has_conduction = super::run::scene_of(&[set("effects.heat", "conduction")])
            .and_then(|scene| crate::setup::checks::check(&scene))
            .is_ok();
        let heat = if has_conduction { "conduction" } else { "adiabatic" };
        if is_quick {
            return Grid { frictions: vec![0.3, 0.6], radii: vec![0.0, 4e-5], per_feed: [6.0, 8.0], heat };
        }
        let frictions = vec![0.15, 0.3, 0.45, 0.6, 0.75, 0.9];
        Grid { frictions, radii: vec![0.0, 2e-5, 4e-5, 6e-5], per_feed: [16.0, 32.0], heat }
    }

    fn run(&self, cut: &Cut, friction: f64, radius: f64, per_feed: f64) -> Problem {
        let feed = cut.feed;
        let settings: Settings = vec![
            set("material.name", "AISI 1045"),
            set("effects.heat", self.heat),
            set("tool_velocity", cut.speed),
            set("feed", feed),
            set("friction", format!("{friction:.4}")),
            set("tool.rake_angle", format!("{} deg", cut.rake)),
            set("tool.edge_radius", format!("{radius:.3e}")),
            set("workpiece.length", 6.0 * feed),
            set("workpiece.height", 3.0 * feed),
            set("numerics.point_spacing", format!("{:.6e}", feed / per_feed)),
            set("numerics.speed", "balanced"),
            // The level's 3 feeds take 2 % of the force off the thrust at a friction of 0.6
            // (book/src/evidence/performance.md).
            set("numerics.active_window", 6),
            // The whole chip: of the level's 3 feeds nothing is known at these materials and speeds.
            set("numerics.active_chip", 1000),
            set("numerics.mass_scaling", 0),
        ];
        Problem::Cut { settings, span: SPAN.map(|feeds| feeds * feed) }
    }

    fn tasks(&self, cuts: &[Cut]) -> Vec<Task> {
        let mut tasks = Vec::new();
        for cut in cuts {
            for &friction in &self.frictions {
                for &radius in &self.radii {
                    let label = format!("{}; friction {friction}; edge radius {radius:e} m", cut.name);
                    tasks.push(Task { label, problem: self.run(cut, friction, radius, self.per_feed[0]) });
                }
            }
        }
        tasks
    }

    /// Forces of all runs of the grid that went to their end.
    fn table(&self, store: &Store, cuts: &[Cut]) -> Table {
        let mut table = Table::new();
        for cut in cuts {
            for (i, &friction) in self.frictions.iter().enumerate() {
                for (j, &radius) in self.radii.iter().enumerate() {
                    if let Some(outputs) = outputs(store, &self.run(cut, friction, radius, self.per_feed[0]))
                    {
                        table.insert((cut.name.clone(), i, j), [outputs[0], outputs[1]]);
                    }
                }
            }
        }
        table
    }

    /// Forces of a cut between the grid's runs (N/mm); none where a run of the cell failed.
    fn forces(&self, table: &Table, cut: &Cut, friction: f64, radius: f64) -> Option<[f64; 2]> {
        let cell = |values: &[f64], x: f64| {
            let k = values.partition_point(|value| *value < x).clamp(1, values.len() - 1);
            (k - 1, ((x - values[k - 1]) / (values[k] - values[k - 1])).clamp(0.0, 1.0))
        };
        let ((i, a), (j, b)) = (cell(&self.frictions, friction), cell(&self.radii, radius));
        let mut forces = [0.0; 2];
        for (di, wi) in [(0, 1.0 - a), (1, a)] {
            for (dj, wj) in [(0, 1.0 - b), (1, b)] {
                if wi * wj > 0.0 {
                    let corner = table.get(&(cut.name.clone(), i + di, j + dj))?;
                    (0..2).for_each(|k| forces[k] += wi * wj * corner[k]);
                }
            }
        }
        Some(forces)
    }

    /// Friction and edge radius that fit some cuts best.
    fn fit(&self, table: &Table, cuts: &[&Cut]) -> Option<[f64; 2]> {
        const STEPS: usize = 60;
        let at = |values: &[f64], k: usize| {
            values[0] + (values[values.len() - 1] - values[0]) * k as f64 / STEPS as f64
        };
        let mut best: Option<(f64, [f64; 2])> = None;
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let (friction, radius) = (at(&self.frictions, i), at(&self.radii, j));
                let mut misfit = 0.0;
                for cut in cuts {
                    let Some(forces) = self.forces(table, cut, friction, radius) else {
                        misfit = f64::MAX;
                        break;
                    };
                    misfit += (0..2).map(|k| (error(forces, cut, k) / BOUNDS[k]).powi(2)).sum::<f64>();
                }
                if misfit < best.map_or(f64::MAX, |best| best.0) {
                    best = Some((misfit, [friction, radius]));
                }
            }
        }
        best.map(|best| best.1)
    }
}

/// Error of a force relative to the measurement (-).
fn error(forces: [f64; 2], cut: &Cut, k: usize) -> f64 {
    forces[k] / cut.forces[k] - 1.0
}

fn outputs(store: &Store, problem: &Problem) -> Option<[f64; 5]> {
    store.get(&problem.identity()).and_then(Ending::measured).map(|measured| measured.outputs)
}

/// Runs the comparison into a folder, or what is left of it: `runs.csv`, then `validation.md`.
///
/// # Errors
/// `Error::File` when something cannot be written.
pub fn study(folder: &Path, options: Options, tell: &(dyn Fn(String) + Sync)) -> Result<String, Error> {
    fs::create_dir_all(folder).map_err(|e| failed(folder, &e))?;
    let program = store::program();
    let mut store = Store::open(&folder.join("runs.csv"), &program)?;
    let (cuts, grid) = (cuts(), Grid::new(options.is_quick));
    let planes = shear_planes(options.is_quick);
    if options.runs {
        let mut tasks = grid.tasks(&cuts);
        tasks
            .extend(planes.iter().map(|plane| Task { label: plane.label(), problem: plane.problem.clone() }));
        run_all(&tasks, &mut store, options.threads, tell)?;
    }
    let mut text = format!(
        "Written by `cargo xtask validate` of swarf {program}; heat: {}; {} points per feed.\n\n",
        grid.heat, grid.per_feed[0]
    );
    let all: Vec<&Cut> = cuts.iter().collect();
    let table = grid.table(&store, &cuts);
    let fitted = grid.fit(&table, &all);
    if let Some([friction, radius]) = fitted {
        let runs = |per_feed: f64| cuts.iter().map(move |cut| (cut, per_feed));
        let checks: Vec<(&Cut, f64)> = grid.per_feed.iter().flat_map(|&n| runs(n)).collect();
        if options.runs {
            let task = |&(cut, n): &(&Cut, f64)| Task {
                label: format!("{}; fitted to all; {n} points per feed", cut.name),
                problem: grid.run(cut, friction, radius, n),
            };
            run_all(&checks.iter().map(task).collect::<Vec<_>>(), &mut store, options.threads, tell)?;
        }
    }
    text.push_str(&leave_one_out(&grid, &table, &cuts));
    if let Some(fitted) = fitted {
        text.push_str(&convergence(&grid, &store, &cuts, fitted));
    }
    text.push_str(&shear_plane_table(&planes, &store));
    write(&folder.join("validation.md"), &text)?;
    Ok(text)
}

/// Each cut predicted by a fit to the others, the mean errors, and the signs of the trends.
fn leave_one_out(grid: &Grid, table: &Table, cuts: &[Cut]) -> String {
    let mut text = String::from(
        "## Measured cuts of AISI 1045, each predicted from the others\n\n\
         | cut | speed (m/s), feed (mm), rake (deg) | friction, edge radius (µm) fitted to the others | cutting force, measured and predicted (N/mm) | error | thrust | error |\n\
         |---|---|---|---|---|---|---|\n",
    );
    let mut predicted = Vec::new();
    for cut in cuts {
        let others: Vec<&Cut> = cuts.iter().filter(|other| other.name != cut.name).collect();
        let fit = grid.fit(table, &others);
        let forces = fit.and_then(|[friction, radius]| grid.forces(table, cut, friction, radius));
        let conditions = format!("{:.2}, {}, {}", cut.speed, 1e3 * cut.feed, cut.rake);
        if let (Some([friction, radius]), Some(forces)) = (fit, forces) {
            let pair = |k: usize| {
                format!("{:.0}, {:.0} | {:+.1} %", cut.forces[k], forces[k], 100.0 * error(forces, cut, k))
            };
            let _ = writeln!(
                text,
                "| {} | {conditions} | {friction:.2}, {:.0} | {} | {} |",
                cut.name,
                1e6 * radius,
                pair(0),
                pair(1)
            );
            predicted.push((cut, forces));
        } else {
            let _ = writeln!(text, "| {} | {conditions} | runs are missing or failed | | | | |", cut.name);
        }
    }
    if predicted.len() < cuts.len() {
        return text + "\nWithout all predictions there is no mean.\n";
    }
    for (k, name) in ["cutting force", "thrust"].iter().enumerate() {
        let mean = predicted.iter().map(|(cut, f)| error(*f, cut, k).abs()).sum::<f64>() / cuts.len() as f64;
        let verdict = if mean <= BOUNDS[k] { "met" } else { "**not met**" };
        let (mean, bound) = (100.0 * mean, 100.0 * BOUNDS[k]);
        let _ = writeln!(
            text,
            "\nMean error of the predicted {name}: {mean:.1} % (at most {bound:.0} %: {verdict})."
        );
    }
    text.push_str(
        "\n| trend | measured change of cutting force, thrust (N/mm) | predicted | sign \
        |\n|---|---|---|---|\n",
    );
    type IsHigh = fn(&Cut) -> bool;
    type Force<'a> = &'a dyn Fn(&(&Cut, [f64; 2])) -> f64;
    let trends: [(&str, IsHigh); 3] = [
        ("rake from −7 to 5 degrees", |cut| cut.rake > 0.0),
        ("feed from 0.15 to 0.3 mm", |cut| cut.feed > 2e-4),
        ("speed from 3.3 to 6.7 m/s", |cut| cut.speed > 5.0),
    ];
    for (name, is_high) in trends {
        // Two of four cuts are high in each: the mean difference is the main effect of half a factorial
        // design.
        let effect = |of: Force<'_>| {
            predicted.iter().map(|entry| if is_high(entry.0) { 0.5 } else { -0.5 } * of(entry)).sum::<f64>()
        };
        let measured: [f64; 2] = std::array::from_fn(|k| effect(&|entry| entry.0.forces[k]));
        let model: [f64; 2] = std::array::from_fn(|k| effect(&|entry| entry.1[k]));
        let sign = |k: usize| if measured[k] * model[k] > 0.0 { "right" } else { "**wrong**" };
        let _ = writeln!(
            text,
            "| {name} | {:+.0}, {:+.0} | {:+.0}, {:+.0} | {}, {} |",
            measured[0],
            measured[1],
            model[0],
            model[1],
            sign(0),
            sign(1)
        );
    }
    text
}

/// The cuts at the pair fitted to all of them, at two spacings.
fn convergence(grid: &Grid, store: &Store, cuts: &[Cut], [friction, radius]: [f64; 2]) -> String {
    let mut text = format!(
        "\nFitted to all four: friction {friction:.2}, edge radius {:.0} µm. The same at two spacings:\n\n\
         | cut | cutting force, thrust at {} points per feed | at {} | change |\n|---|---|---|---|\n",
        1e6 * radius,
        grid.per_feed[0],
        grid.per_feed[1]
    );
    for cut in cuts {
        let [coarse, fine] = grid.per_feed.map(|n| outputs(store, &grid.run(cut, friction, radius, n)));
        let _ = match (coarse, fine) {
            (Some(coarse), Some(fine)) => writeln!(
                text,
                "| {} | {:.0}, {:.0} | {:.0}, {:.0} | {:+.1} %, {:+.1} % |",
                cut.name,
                coarse[0],
                coarse[1],
                fine[0],
                fine[1],
                100.0 * (fine[0] / coarse[0] - 1.0),
                100.0 * (fine[1] / coarse[1] - 1.0)
            ),
            _ => writeln!(text, "| {} | a run is missing or failed | | |", cut.name),
        };
    }
    text
}

/// One row of the shear plane's table, and the cut that goes with it.
struct Plane {
    feed: f64,
    friction: f64,
    rake: f64,
    forces: [f64; 2],
    problem: Problem,
}

impl Plane {
    fn label(&self) -> String {
        format!("shear plane; feed {} mm; friction {}; rake {} deg", self.feed, self.friction, self.rake)
    }
}

/// The rows of the shear plane without and with friction, rakes 0 and 10 degrees, both feeds.
fn shear_planes(is_quick: bool) -> Vec<Plane> {
    let spacing = if is_quick { 5e-5 } else { 1e-5 };
    let span = if is_quick { [4e-4, 6e-4] } else { [1.0e-3, 1.6e-3] };
    let rows = SHEAR_PLANE.lines().skip(1).filter_map(|line| {
        let n: Vec<f64> = line.split(',').map(|text| text.parse().ok()).collect::<Option<_>>()?;
        let (feed, friction, rake) = (n[0], n[1], n[2]);
        let is_wanted = [0.0, 0.2, 0.5].contains(&friction) && [0.0, 10.0].contains(&rake);
        let settings = vec![
            set("feed", format!("{feed} mm")),
            set("friction", friction),
            set("tool.rake_angle", format!("{rake} deg")),
            set("numerics.point_spacing", format!("{spacing:e}")),
            set("numerics.speed", "balanced"),
        ];
        let problem = Problem::Cut { settings, span };
        is_wanted.then_some(Plane { feed, friction, rake, forces: [n[10], n[11]], problem })
    });
    rows.collect()
}

/// Forces over those of the shear plane, and the trends: each row over the row without friction and rake.
fn shear_plane_table(planes: &[Plane], store: &Store) -> String {
    let mut text = String::from(
        "\n## Single shear plane of least work (AISI 4340, 50 m/s)\n\n\
         | feed (mm) | friction | rake (deg) | cutting force, plane and run (N/mm) | over the row with friction 0 and rake 0 | thrust over cutting force |\n\
         |---|---|---|---|---|---|\n",
    );
    for plane in planes {
        let base = planes.iter().find(|p| p.feed == plane.feed && p.friction == 0.0 && p.rake == 0.0);
        let head = format!("| {} | {} | {} |", plane.feed, plane.friction, plane.rake);
        let runs = base
            .and_then(|base| Some((base, outputs(store, &plane.problem)?, outputs(store, &base.problem)?)));
        let _ = match runs {
            Some((base, now, first)) => writeln!(
                text,
                "{head} {:.0}, {:.0} | {:.2}, {:.2} | {:.3}, {:.3} |",
                plane.forces[0],
                now[0],
                plane.forces[0] / base.forces[0],
                now[0] / first[0],
                plane.forces[1] / plane.forces[0],
                now[1] / now[0]
            ),
            None => writeln!(text, "{head} a run is missing or failed | | |"),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four cuts, two of them high in rake, feed and speed each, so that main effects can be told apart.
    #[test]
    fn the_measured_cuts_are_half_a_factorial_design() {
        let cuts = cuts();
        assert_eq!(cuts.len(), 4);
        for is_high in [|c: &Cut| c.rake > 0.0, |c: &Cut| c.feed > 2e-4, |c: &Cut| c.speed > 5.0] {
            assert_eq!(cuts.iter().filter(|cut| is_high(cut)).count(), 2, "{cuts:?}");
        }
        assert!(
            (cuts[0].speed - 10.0 / 3.0).abs() < 1e-12 && cuts[0].forces == [381.2, 281.2],
            "{:?}",
            cuts[0]
        );
    }
}
