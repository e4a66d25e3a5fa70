//! A flat rigid punch on a half space that is nearly rigid and perfectly plastic: Prandtl's limit load.
//!
//! In plane strain the mean pressure under a flat punch reaches (2 + π) k, k = Y/√3, whatever its friction
//! (Prandtl 1920; Hill 1950, The Mathematical Theory of Plasticity, chapter IX). Plastic flow keeps its
//! volume, and a scheme that locks shows it here: the load rises above the limit and pressures of opposite
//! sign appear on neighbouring points.
//!
//! Half of the problem is computed; nodes on the plane of symmetry slide along it. The punch comes slowly and
//! softly.

use super::Report;
use super::report::{line, panel};
use crate::dimension::PlaneStrain;
use crate::grid::FixedNodes;
use crate::grid::shape_function::Gimp;
use crate::scene::Constants;
use crate::simulation::{PointView, Solver, ToolMotion};
use crate::study::body_setup::{
    self, BodySetup, Contact, lattice, perfectly_plastic, points, steel, steel_4340,
};
use crate::tool::RigidTool;
use std::f64::consts::PI;

/// Half the punch's width (m).
const HALF_WIDTH: f64 = 1.6e-4;
/// Yield stress (Pa): a thousandth of Young's modulus, so that little settlement is needed.
const YIELD_STRESS: f64 = 2e8;

/// What keeps points of a cell from volumes of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Volumes {
    /// Nothing: the paper's plain scheme.
    Own,
    /// The locking control (`stabilization::volumetric_locking`).
    Limited,
    /// Mean dilatation (`transfer::cell_average`).
    Shared,
}

/// What a run gives.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Mean pressure over (2 + π) k, mean over the last fifth of the way (-).
    pub load: f64,
    /// The same over the settlement in half widths.
    pub history: Vec<(f64, f64)>,
    /// Root mean square of the difference of points' pressures from the mean around them, over (2 + π) k (-).
    pub noise: f64,
    /// Pressure over (2 + π) k of the points next to the plane of symmetry, over their depth in half widths.
    pub column: Vec<(f64, f64)>,
}

/// Presses to a settlement of `settlement` half widths on a grid of `cells` cells under half the punch, at up
/// to `speed` (m/s).
///
/// # Panics
/// When the run becomes unstable.
pub fn run(cells: i32, points_touch: bool, volumes: Volumes, settlement: f64, speed: f64) -> Outcome {
    let constants =
        perfectly_plastic(Constants { yield_stress: YIELD_STRESS, poissons_ratio: 0.3, ..steel_4340() });
    let cell = HALF_WIDTH / f64::from(cells);
    let (width, depth) = (5.0 * HALF_WIDTH, 4.0 * HALF_WIDTH);
    let mut setup = BodySetup::around([0.0, -depth], [width, 0.5 * HALF_WIDTH], cell);
    setup.locking_control = volumes == Volumes::Limited;
    setup.averages_cells = volumes == Volumes::Shared;
    let everything = i32::MAX / 2;
    let mut hold = |low: [i32; 2], high: [i32; 2], axes: [bool; 3]| {
        setup.fixed.push(FixedNodes { low: [low[0], low[1], 0], high: [high[0], high[1], 0], axes });
    };
    let [left, right] = [0.0, width].map(|x| ((x - setup.origin[0]) / cell).round() as i32);
    let bottom = ((-depth - setup.origin[1]) / cell).round() as i32;
    hold([-everything; 2], [left, everything], [true, false, false]);
    hold([right, -everything], [everything; 2], [true, false, false]);
    hold([-everything; 2], [everything, bottom], [false, true, false]);
    let count = [width, depth].map(|length| (2.0 * length / cell).round() as usize);
    let seeds = lattice([0.0, -depth, 0.0], [count[0], count[1], 1], cell / 2.0, 2);
    let behind = 20.0 * cell;
    let tool = RigidTool {
        shape: body_setup::upright_block(behind + HALF_WIDTH, HALF_WIDTH),
        // Nodes on the faces at the start count as inside for any rounding.
        position: [-behind * (1.0 - 1e-9), -1e-9 * cell],
        velocity: [0.0; 2],
        friction: 0.0,
    };
    let mut body =
        setup.simulation::<PlaneStrain, _, _>((Gimp::new(2), steel(&constants)), tool, &seeds, |_, _, _| {});
    let limit = (2.0 + PI) * YIELD_STRESS / 3_f64.sqrt();
    let end = settlement * HALF_WIDTH;
    let (mut way, mut last, mut history) = (0.0, (0.0, 0.0, 0.0), Vec::new());
    body.contact = if points_touch { Contact::Surface } else { Contact::NodesInside }.law();
    while way < end {
        let time = body.progress().clock;
        // Full speed after a tenth of the way: x = v²/(2 a).
        let ramp = 0.2 * end / speed;
        let now = speed * (time / ramp).clamp(0.01, 1.0);
        body.step(&ToolMotion { velocity: [0.0, -now], friction: 0.0 }, false).expect("a stable step");
        way += now * body.progress().last_step;
        if way - last.0 > end / 100.0 {
            let (time, impulse) = (body.progress().clock, body.progress().ledger.tool_impulse[1]);
            // Down on the body.
            let force = (last.2 - impulse) / (time - last.1);
            history.push((0.5 * (way + last.0) / HALF_WIDTH, force / HALF_WIDTH / limit));
            last = (way, time, impulse);
        }
    }
    let steady: Vec<f64> =
        history.iter().filter(|entry| entry.0 > 0.8 * settlement).map(|entry| entry.1).collect();
    let now = points(&body);
    Outcome {
        load: steady.iter().sum::<f64>() / steady.len() as f64,
        noise: pressure_noise(&now, cell) / limit,
        column: now
            .iter()
            .filter(|p| p.position[0] < 0.5 * cell)
            .map(|p| (-p.position[1] / HALF_WIDTH, pressure(p) / limit))
            .collect(),
        history,
    }
}

/// Pressure (Pa).
fn pressure(point: &PointView) -> f64 {
    -point.report.stress[..3].iter().sum::<f64>() / 3.0
}

/// Root mean square of p − p̄ (Pa), p̄ the mean of the points within one cell, over the points under the
/// punch that are further than three cells from its corner, where the exact pressure jumps.
fn pressure_noise(now: &[PointView], cell: f64) -> f64 {
    let near = |p: &PointView| p.position[0] < 1.5 * HALF_WIDTH && p.position[1] > -1.5 * HALF_WIDTH;
    let around: Vec<&PointView> = now.iter().filter(|p| near(p)).collect();
    let (mut sum, mut count) = (0.0, 0);
    for p in &around {
        let [x, y, _] = p.position;
        if x > HALF_WIDTH || y < -HALF_WIDTH || (x - HALF_WIDTH).hypot(y) < 3.0 * cell {
            continue;
        }
        let neighbours: Vec<f64> = around
            .iter()
            .filter(|q| (q.position[0] - x).hypot(q.position[1] - y) < cell)
            .map(|q| pressure(q))
            .collect();
        let mean = neighbours.iter().sum::<f64>() / neighbours.len() as f64;
        sum += (pressure(p) - mean).powi(2);
        count += 1;
    }
    (sum / f64::from(count)).sqrt()
}

/// Why the load is off the limit when points touch.
pub const WIDE: &str = "of first order in the cell: the punch presses as if about one cell wider";
/// Why the load is off the limit when nodes touch.
pub const NARROW: &str = "contact loosens as the punch's face nears the next line of nodes";
/// Why the locking control changes nothing.
pub const BELOW: &str = "the control limits what deviates by more than the pressure under the punch itself";

/// Why mean dilatation is not exact either.
pub const WIDER: &str = "of first order in the cell, though less than with volumes of the points' own";
/// Why pressures still differ with it.
pub const SHEAR: &str =
    "points keep shear stresses and pressures of their own; the forces have the mean alone";

/// With locking control, mean dilatation and neither, and with both ways of contact.
pub fn verify(report: &mut Report) {
    const SETTLEMENT: f64 = 0.04;
    let (mut loads, mut columns, mut controlled) = (Vec::new(), Vec::new(), Vec::new());
    let cases = [
        (8, true, Volumes::Limited),
        (16, true, Volumes::Limited),
        (32, true, Volumes::Limited),
        (16, true, Volumes::Own),
        (16, false, Volumes::Limited),
        (16, false, Volumes::Own),
        (8, true, Volumes::Shared),
        (16, true, Volumes::Shared),
    ];
    for (cells, points_touch, volumes) in cases {
        let outcome = run(cells, points_touch, volumes, SETTLEMENT, 2.0);
        let way_of_contact = if points_touch { "points" } else { "nodes" };
        let control = match volumes {
            Volumes::Own => "no control",
            Volumes::Limited => "control",
            Volumes::Shared => "mean dilatation",
        };
        let name = format!("{way_of_contact} touch, {cells} cells under half the punch, {control}");
        let (load, noise) = (100.0 * (outcome.load - 1.0), 100.0 * outcome.noise);
        let texts = [
            format!("{name}: load over the limit, less one"),
            format!("{name}: pressure noise over the limit"),
        ];
        let [load_text, noise_text] = texts;
        if volumes != Volumes::Own {
            let bound = if cells == 8 { 6.0 } else { 3.0 };
            let (wide, noisy) = if volumes == Volumes::Shared { (WIDER, SHEAR) } else { (WIDE, BELOW) };
            report.at_most(load_text, load, "%", bound, if points_touch { wide } else { NARROW });
            report.at_most(noise_text, noise, "%", 5.0, noisy);
            if points_touch && cells == 16 {
                report.at_most(format!("{name}: the same load, on the way to 3 %"), load, "%", 5.0, wide);
            }
        } else {
            report.show(load_text, load, "%", "");
            report.show(noise_text, noise, "%", "");
        }
        if points_touch && volumes == Volumes::Limited {
            controlled.push(load);
        }
        if cells == 16 {
            columns.push(line(format!("{way_of_contact} touch, {control}"), outcome.column));
        }
        loads.push(line(format!("{way_of_contact}, {cells}, {control}"), outcome.history));
    }
    let text = "points touch, control: excess of the load with 32 cells over that with 16, in size";
    report.at_most(text, controlled[2].abs() / controlled[1].abs(), "", 1.0, "");
    let extrapolated = 2.0 * controlled[2] - controlled[1];
    let text = "points touch, 16 and 32 cells extrapolated at first order: load over the limit, less one";
    report.show(text, extrapolated, "%", "");
    report.plot(
        "punch_load.png",
        "Flat punch: what touches, cells under half the punch, locking control",
        "settlement (half widths)",
        vec![panel("mean pressure over (2 + π) k", loads)],
    );
    report.plot(
        "punch_pressure.png",
        "Flat punch: points next to the plane of symmetry, 16 cells under half the punch",
        "depth (half widths)",
        vec![panel("pressure over (2 + π) k", columns)],
    );
}
