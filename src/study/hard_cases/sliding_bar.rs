//! A stressed elastic bar that slides through a thousand cells.
//!
//! A body force that travels with the bar, b = -σ₀ π/(ρ L) cos(π X/L), holds it at the stress σ_xx = σ₀ sin(π
//! X/L), which is 0 at its free ends (ν = 0, σ₀ = -1e-5 E; the terms left out are of the order of the
//! strain). In the bar's frame nothing happens; what the points see of the grid that passes under them is
//! noise. (Such a force holds a bar in no stable place: under pressure it turns, under tension it runs away,
//! slowly at so little stress.)

use super::{Form, Setting, Sheet};
use crate::dimension::PlaneStrain;
use crate::grid::shape_function::Gimp;
use crate::simulation::Solver;
use crate::study::body_setup::{BodySetup, NO_MOTION, distant_tool, lattice, points, steel};
use crate::study::verification::bar::constants;
use std::f64::consts::PI;
use std::sync::Arc;

/// Stress in the middle over Young's modulus (-).
const STRAIN: f64 = -1e-5;
/// Cells that the bar slides through.
const WAY: f64 = 1000.0;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let plain = |courant| Scheme { courant, smoothed: false };
    slide(sheet, "100 m/s", 128, [100.0, 0.0], plain(0.5), "");
    if setting.form == Form::Full {
        slide(sheet, "50 m/s", 128, [50.0, 0.0], plain(0.5), "");
        slide(sheet, "50 m/s at 30° to the grid", 128, [43.3, 25.0], plain(0.5), "");
        slide(sheet, "500 m/s", 128, [500.0, 0.0], plain(0.5), GROWS);
        slide(sheet, "500 m/s, Courant number 0.25", 128, [500.0, 0.0], plain(0.25), "");
        let smoothed = Scheme { courant: 1.1, smoothed: true };
        slide(sheet, "50 m/s, smoothed increments, Courant number 1.1", 128, [50.0, 0.0], smoothed, "");
        slide(sheet, "100 m/s, smoothed increments, Courant number 1.1", 128, [100.0, 0.0], smoothed, QUIET);
    }
}

/// How time advances.
#[derive(Clone, Copy)]
struct Scheme {
    courant: f64,
    /// Whether increments are smoothed.
    smoothed: bool,
}

/// Why the fast bar fails.
const GROWS: &str = "the points' passing from cell to cell feeds some wave; at 350 m/s 390 % with a Courant \
    number of 0.5 and 1.3 % with 0.25; within 1 % at up to 100 m/s";
/// Why the bar with smoothed increments fails.
const QUIET: &str = "the points' passing from cell to cell feeds waves, and what damps them with plain \
    increments is what smoothing takes away (src/smoothing.rs); it stays off";

/// A bar of `cells` by two cells.
fn slide(sheet: &mut Sheet, name: &str, cells: usize, flight: [f64; 2], scheme: Scheme, remark: &str) {
    let c = constants();
    let (modulus, density) = (c.youngs_modulus, c.density);
    let cell = 1e-3 / cells as f64;
    let length = 1e-3;
    let speed = flight[0].hypot(flight[1]);
    let end = WAY * cell / speed;
    let way = flight.map(|v| v * end);
    let mut setup = BodySetup::around([0.0; 2], [length + way[0], 2.0 * cell + way[1]], cell);
    (setup.courant, setup.smoothed_increments) = (scheme.courant, scheme.smoothed);
    let mut seeds = lattice([0.0; 3], [2 * cells, 4, 1], cell / 2.0, 2);
    let places: Vec<f64> = seeds.iter().map(|seed| seed.position[0]).collect();
    let strain = |x: f64| STRAIN * (PI * x / length).sin();
    for seed in &mut seeds {
        seed.position[0] -= STRAIN * length / PI * (PI * seed.position[0] / length).cos();
        seed.velocity = [flight[0], flight[1], 0.0];
    }
    let model = steel(&c);
    let shear = 0.5 * modulus;
    let mut bar = setup.simulation::<PlaneStrain, _, _>(
        (Gimp::new(2), model),
        distant_tool(),
        &seeds,
        |state, lane, number| {
            let strain = strain(places[number]);
            state.jacobian[lane] = 1.0 + strain;
            // Deviator of a strain along x: two thirds, and minus a third of it.
            state.deviator[0][lane] = 4.0 / 3.0 * shear * strain;
            state.deviator[1][lane] = -2.0 / 3.0 * shear * strain;
        },
    );
    let size = -STRAIN * modulus * PI / (density * length);
    bar.body_force = Some(Arc::new(move |position: [f64; 3], time: f64| {
        [size * (PI * (position[0] - flight[0] * time) / length).cos(), 0.0, 0.0]
    }));
    let centre = |now: &[crate::simulation::PointView], axis: usize| {
        now.iter().map(|p| p.position[axis]).sum::<f64>() / now.len() as f64
    };
    let start = [0, 1].map(|axis| centre(&points(&bar), axis));
    let (mut squares, mut count, mut worst, mut error) = (0.0, 0.0, 0.0_f64, String::new());
    let mut step = 0_u32;
    while bar.progress().clock < end {
        if let Err(e) = bar.step(&NO_MOTION, false) {
            error = e.to_string();
            break;
        }
        step += 1;
        if step.is_multiple_of(7) {
            bar.visit_points(&mut |point| {
                let exact = modulus * strain(places[point.id as usize]);
                let noise = (point.report.stress[0] - exact) / (STRAIN * modulus);
                squares += noise * noise;
                count += 1.0;
                worst = worst.max(noise.abs());
            });
        }
    }
    let none_if_ended = |value: f64| if error.is_empty() { value } else { f64::NAN };
    let retries = i32::try_from(bar.progress().retries).unwrap_or(i32::MAX);
    let noise = none_if_ended(100.0 * (squares / count).sqrt());
    let figure = sheet.at_most(format!("{name}, {cells} cells long: stress noise, rms"), noise, "%", 1.0);
    figure.retried(retries).remarked(if error.is_empty() { remark.to_string() } else { error.clone() });
    sheet.show(
        format!("{name}, {cells} cells long: stress noise, largest"),
        none_if_ended(100.0 * worst),
        "%",
    );
    let (now, time) = (points(&bar), bar.progress().clock);
    let off = [0, 1].map(|axis| centre(&now, axis) - start[axis] - flight[axis] * time);
    let position = none_if_ended(off[0].hypot(off[1]) / (speed * time));
    let figure = sheet.at_most(
        format!("{name}, {cells} cells long: error of the position over the way"),
        position,
        "",
        1e-6,
    );
    figure.retried(retries);
}
