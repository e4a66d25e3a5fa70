//! Points with few neighbours: alone, one per cell, exactly on cell faces, reaching into cells that are all
//! but empty.
//!
//! A node that a point hardly reaches has next to no mass, and force falls more slowly than mass: where that
//! is not looked after, such nodes throw points away. The bound is physical: a point alone keeps its
//! velocity, and in a bar that vibrates freely in its first mode, u = cos(π x/L) at ν = 0, no point is faster
//! than the fastest at the start.

use super::{Form, Setting, Sheet};
use crate::dimension::PlaneStrain;
use crate::grid::shape_function::Gimp;
use crate::scene::Constants;
use crate::setup::courant_limit;
use crate::simulation::Solver;
use crate::study::body_setup::{BodySetup, NO_MOTION, Seed, distant_tool, elastic, kinetic, lattice, steel};
use crate::study::verification::bar::constants;
use std::f64::consts::PI;

/// Cell length (m).
const CELL: f64 = 2e-5;
/// Largest speed of the vibration (m/s).
const SPEED: f64 = 0.1;
/// Substeps of a block on the grid's lines.
const STEPS: u32 = 10_000;
/// Substeps between two looks at the points.
const LOOK: u32 = 25;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let steps = setting.pick(20_000, 100_000);
    lone(sheet, steps);
    for (name, per_edge, shift) in [
        ("one point per cell", 1, 0.0),
        ("one point per cell, on cell faces", 1, 0.5),
        ("points on cell faces", 2, 0.25),
        ("reaching 1e-9 cells into empty ones", 2, -1e-9),
        ("reaching 1e-4 cells into empty ones", 2, -1e-4),
        ("reaching 1e-2 cells into empty ones", 2, -1e-2),
    ] {
        bar(sheet, name, steps, per_edge, shift, [0.0; 2]);
    }
    bar(sheet, "one point per cell, in flight", steps, 1, 0.3, [5.0, 3.0]);
    bar(sheet, "four points per cell, in flight", steps, 2, 0.3, [5.0, 3.0]);
    aligned(sheet, "block of 32 by 16 cells", [32, 16], Some(0.5), "");
    if setting.form == Form::Full {
        aligned(sheet, "block of 32 by 16 cells", [32, 16], None, "");
        aligned(sheet, "bar two cells thick", [32, 2], None, "");
        aligned(sheet, "bar one cell thick", [32, 1], None, THIN);
        aligned(sheet, "bar one cell thick", [32, 1], Some(0.43), "");
        beyond(sheet);
    }
}

/// Why the thinnest bar fails.
const THIN: &str = "the limit is that of straight rows; points that have moved unevenly have others, a \
     little lower at the least (src/stability.rs). A scene has at least four cells";

/// A block at ν = 0.3 whose sides lie on lines of nodes, as a workpiece's do, in small vibration: its energy
/// may not grow.
///
/// * `courant`: at the limit of stability where none is given
fn aligned(sheet: &mut Sheet, name: &str, size: [usize; 2], courant: Option<f64>, remark: &str) {
    let limit =
        courant_limit::largest_courant::<PlaneStrain, _>(&Gimp::new(2), 2, [size[0], size[1], 1], 0.3, false);
    let number = courant.map_or(format!("{limit:.4}, the limit of stability"), |courant| courant.to_string());
    let (most, retries, error) = vibrate(size, courant.unwrap_or(limit));
    let (most, remark) =
        if error.is_empty() { (most, String::new()) } else { (f64::NAN, format!("{remark}: {error}")) };
    let name = format!(
        "{name} on the grid's lines, Courant number {number}, {STEPS} substeps: energy over that at the start"
    );
    sheet.at_most(name, most, "", 1.05).retried(retries).remarked(remark);
}

/// The block past the limit, where a guard must end it.
fn beyond(sheet: &mut Sheet) {
    let (_, retries, error) = vibrate([32, 16], 0.6);
    let name = "the block at a Courant number of 0.6, past the limit: ends in an error that names its cause";
    let is_told = f64::from(u8::from(error.contains("feeds itself")));
    sheet.at_least(name, is_told, "", 1.0).retried(retries).remarked(error);
}

/// Largest energy over that at the start in `STEPS` substeps, retries, and the error that ended the run.
fn vibrate(size: [usize; 2], courant: f64) -> (f64, i32, String) {
    let mut setup = BodySetup::around([0.0; 2], size.map(|cells| (cells + 1) as f64 * CELL), CELL);
    setup.courant = courant;
    let mut seeds = lattice([0.0; 3], [2 * size[0], 2 * size[1], 1], CELL / 2.0, 2);
    let length = size[0] as f64 * CELL;
    for seed in &mut seeds {
        seed.velocity[0] = SPEED * (PI * seed.position[0] / length).cos();
    }
    let model = steel(&Constants { poissons_ratio: 0.3, ..constants() });
    let mut solver =
        setup.simulation::<PlaneStrain, _, _>((Gimp::new(2), model), distant_tool(), &seeds, |_, _, _| {});
    let energy = |solver: &dyn Solver| {
        let mut sum = 0.0;
        solver.visit_points(&mut |point| sum += kinetic(point, [0.0; 3]) + elastic(point));
        sum
    };
    let start = energy(&solver);
    let (mut most, mut error) = (1.0_f64, String::new());
    for step in 1..=STEPS {
        if let Err(e) = solver.step(&NO_MOTION, false) {
            error = e.to_string();
            break;
        }
        if step % LOOK == 0 {
            most = most.max(energy(&solver) / start);
        }
    }
    (most, i32::try_from(solver.progress().retries).unwrap_or(i32::MAX), error)
}

/// Points far apart that fly over the grid's faces, each at another place in its cell.
fn lone(sheet: &mut Sheet, steps: u32) {
    const FLIGHT: [f64; 2] = [50.0, 20.0];
    // Substeps are half a cell of sound each.
    let sound = (constants().youngs_modulus / constants().density).sqrt();
    let cells = FLIGHT.map(|v| 0.5 * f64::from(steps) * v / sound);
    let high = [(cells[0] + 60.0) * CELL, (cells[1] + 60.0) * CELL];
    let setup = BodySetup::around([0.0; 2], high, CELL);
    let mut seeds = Vec::new();
    for k in 0..16 {
        let (column, row) = (f64::from(k % 4), f64::from(k / 4));
        // Faces, corners and any place between them.
        let inside = [0.25 * column, [0.0, 0.5, 1e-12, 0.37][k as usize / 4]];
        let position = [(10.0 * column + inside[0]) * CELL, (10.0 * row + inside[1]) * CELL, 0.0];
        let velocity = [FLIGHT[0], FLIGHT[1], 0.0];
        seeds.push(Seed { position, velocity, volume: 0.25 * CELL * CELL });
    }
    let bound = FLIGHT[0].hypot(FLIGHT[1]);
    measure(sheet, "lone points in flight", &setup, &seeds, 2, (steps, [0.0; 2], bound));
}

/// A bar of 12 by 3 cells, its corner shifted by part of a cell, flying at some velocity (m/s).
fn bar(sheet: &mut Sheet, name: &str, steps: u32, per_edge: i32, shift: f64, flight: [f64; 2]) {
    const SIZE: [usize; 2] = [12, 3];
    let sound = (constants().youngs_modulus / constants().density).sqrt();
    let cells = flight.map(|v| 0.5 * f64::from(steps) * v / sound);
    let high = [0, 1].map(|axis| (SIZE[axis] as f64 + cells[axis] + 2.0) * CELL);
    let setup = BodySetup::around([0.0; 2], high, CELL);
    let spacing = CELL / f64::from(per_edge);
    let count = SIZE.map(|cells| cells * per_edge as usize);
    let mut seeds = lattice([0.0; 3], [count[0], count[1], 1], spacing, 2);
    let length = SIZE[0] as f64 * CELL;
    for seed in &mut seeds {
        let speed = SPEED * (PI * seed.position[0] / length).cos();
        seed.velocity = [flight[0] + speed, flight[1], 0.0];
        seed.position[0] += shift * CELL;
        seed.position[1] += shift * CELL;
    }
    measure(sheet, name, &setup, &seeds, per_edge, (steps, flight, SPEED));
}

/// Runs `steps` substeps and sets the fastest point, in a frame that moves at `flight`, against the bound
/// (m/s).
fn measure(
    sheet: &mut Sheet,
    name: &str,
    setup: &BodySetup,
    seeds: &[Seed],
    per_edge: i32,
    (steps, flight, bound): (u32, [f64; 2], f64),
) {
    let parts = (Gimp::new(per_edge), steel(&constants()));
    let mut solver = setup.simulation::<PlaneStrain, _, _>(parts, distant_tool(), seeds, |_, _, _| {});
    let (mut fastest, mut error) = (0.0_f64, String::new());
    for step in 1..=steps {
        if let Err(e) = solver.step(&NO_MOTION, false) {
            error = e.to_string();
            break;
        }
        if step % LOOK == 0 {
            solver.visit_points(&mut |point| {
                let speed = (point.velocity[0] - flight[0]).hypot(point.velocity[1] - flight[1]);
                fastest = fastest.max(speed);
            });
        }
    }
    let excess = if error.is_empty() { fastest / bound } else { f64::NAN };
    let retries = i32::try_from(solver.progress().retries).unwrap_or(i32::MAX);
    let figure =
        sheet.at_most(format!("{name}, {steps} substeps: fastest point over the bound"), excess, "", 1.05);
    figure.retried(retries).remarked(error);
}
