//! An elastic bar that vibrates for a million substeps.
//!
//! The bar of `verification::bar`, held at one end, in its first mode. Its energy must stay, and the
//! velocities must stay smooth: what alternates from point to point (the chessboard mode) is invisible to the
//! grid, so nothing would ever take it away. Its share is the rms of (-v₋ + 2 v - v₊)/4 over that of v, along
//! the bar and likewise across it.

use super::{Setting, Sheet};
use crate::dimension::PlaneStrain;
use crate::grid::FixedNodes;
use crate::grid::shape_function::Gimp;
use crate::simulation::{PointView, Solver};
use crate::study::body_setup::{
    BodySetup, NO_MOTION, distant_tool, elastic, kinetic, lattice, points, steel, total,
};
use crate::study::verification::bar::{LENGTH, SPEED, constants, exact_period};
use std::f64::consts::FRAC_PI_2;

/// Rows of points across the bar.
const ROWS: usize = 4;

/// Sums over looks at the bar.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    looks: f64,
    energy: f64,
    velocity: f64,
    along: f64,
    across: f64,
}

impl Sums {
    fn look(&mut self, now: &[PointView]) {
        self.looks += 1.0;
        self.energy += total(now, |p| kinetic(p, [0.0; 3]) + elastic(p));
        let columns = now.len() / ROWS;
        let v = |column: usize, row: usize, axis: usize| now[column * ROWS + row].velocity[axis];
        let square = |a: f64, b: f64, c: f64| (0.25 * (2.0 * b - a - c)).powi(2);
        for column in 1..columns - 1 {
            for row in 1..ROWS - 1 {
                for axis in 0..2 {
                    let here = v(column, row, axis);
                    self.velocity += here * here;
                    self.along += square(v(column - 1, row, axis), here, v(column + 1, row, axis));
                    self.across += square(v(column, row - 1, axis), here, v(column, row + 1, axis));
                }
            }
        }
    }
}

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let (cells, steps) = setting.pick((64, 100_000), (128, 1_000_000));
    let cell = LENGTH / f64::from(cells);
    let rows = ROWS as f64 / 2.0;
    let mut setup = BodySetup::around([0.0; 2], [LENGTH, rows * cell], cell);
    let wall = setup.node(0, 0.0);
    setup.fixed.push(FixedNodes { low: [0; 3], high: [wall, setup.nodes[1], 0], axes: [true; 3] });
    let mut seeds = lattice([0.0; 3], [2 * cells as usize, ROWS, 1], cell / 2.0, 2);
    for seed in &mut seeds {
        seed.velocity[0] = SPEED * (FRAC_PI_2 * seed.position[0] / LENGTH).sin();
    }
    let parts = (Gimp::new(2), steel(&constants()));
    let mut bar = setup.simulation::<PlaneStrain, _, _>(parts, distant_tool(), &seeds, |_, _, _| {});
    let period = exact_period();
    let (mut first, mut last, mut error) = (Sums::default(), Sums::default(), String::new());
    // Half a cell of sound at a time.
    let per_period = (8.0 * f64::from(cells)) as u32;
    for step in 1..=steps {
        if let Err(e) = bar.step(&NO_MOTION, false) {
            error = e.to_string();
            break;
        }
        if step % 4 == 0 && bar.progress().clock < period {
            first.look(&points(&bar));
        } else if step % 4 == 0 && step > steps - per_period {
            last.look(&points(&bar));
        }
    }
    let none_if_ended = |value: f64| if error.is_empty() { value } else { f64::NAN };
    let retries = i32::try_from(bar.progress().retries).unwrap_or(i32::MAX);
    let drift = 100.0 * (last.energy / last.looks / (first.energy / first.looks) - 1.0);
    let periods = bar.progress().clock / period;
    let figure = sheet.at_most(
        format!("bar of {cells} cells, {steps} substeps, {periods:.0} periods: change of the energy"),
        none_if_ended(drift),
        "%",
        0.5,
    );
    figure.retried(retries).remarked(error.clone());
    let share = none_if_ended(100.0 * (last.along.max(last.across) / last.velocity).sqrt());
    sheet.at_most("chessboard mode's share of the velocities at the end", share, "%", 1.0).retried(retries);
    let share = 100.0 * (first.along.max(first.across) / first.velocity).sqrt();
    sheet.show("the same in the first period", share, "%");
}
