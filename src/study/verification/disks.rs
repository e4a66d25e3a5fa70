//! Two elastic disks that fly into each other and part again.
//!
//! Disks of 0.2 m radius, E 1000 Pa, ν 0.3, ρ 1000 kg/m3, 0.1 m/s along each axis towards each other (Sulsky,
//! Chen and Schreyer 1994, doi:10.1016/0045-7825(94)90112-0). They touch through the grid, which cannot tell
//! one from the other: no contact law takes part, all forces are internal, and momentum stays zero. The
//! material (`neo_hookean`) stores energy and dissipates none, so what is lost is the scheme's.

use super::Report;
use super::neo_hookean::NeoHookean;
use super::report::{line, logarithms, panel};
use crate::dimension::PlaneStrain;
use crate::grid::shape_function::Gimp;
use crate::material::ConstitutiveModel;
use crate::simulation::{PointView, Solver};
use crate::study::body_setup::{
    BodySetup, NO_MOTION, Seed, distant_tool, elastic, kinetic, lattice, points, total,
};
use crate::transfer::apic::Affine;

/// Radius (m) and speed along each axis (m/s).
const RADIUS: f64 = 0.2;
const SPEED: f64 = 0.1;

/// What a run gives.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Largest |Σ m v| over Σ m |v| at the start (-).
    pub momentum_drift: f64,
    /// Kinetic and elastic energy lost at the end over the energy at the start (-).
    pub energy_loss: f64,
    /// Speed of the disks' centres at the end over that at the start (-).
    pub restitution: f64,
    /// Kinetic, elastic and total energy over the energy at the start, over time (s).
    pub history: [Vec<(f64, f64)>; 3],
}

/// How a run is set up.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Points along a cell's edge.
    pub per_edge: i32,
    /// Cells per metre.
    pub cells: i32,
    /// Courant number (-).
    pub courant: f64,
    /// Part of the flight that is left out (s); the disks touch at about 1.55 s.
    pub from: f64,
    /// End (s); the disks part at about 2.45 s.
    pub end: f64,
}

/// Lets the disks collide.
///
/// # Panics
/// When the run becomes unstable.
pub fn run(settings: Settings) -> Outcome {
    collide(settings, material())
}

/// The same with the affine transfer, whose points keep part of their kinetic energy as an affine field:
/// energies are without it.
///
/// # Panics
/// When the run becomes unstable.
pub fn run_affine(settings: Settings) -> Outcome {
    collide(settings, Affine(material()))
}

fn material() -> NeoHookean {
    let mut model = NeoHookean::new(1e3, 0.3, 1e3);
    model.largest_stretch = 1.3;
    model
}

fn collide<M: ConstitutiveModel<f64, PlaneStrain>>(settings: Settings, model: M) -> Outcome {
    let Settings { per_edge, cells, courant, from, end } = settings;
    let cell = 1.0 / f64::from(cells);
    let mut setup = BodySetup::around([-0.1; 2], [1.1; 2], cell);
    setup.courant = courant;
    let mut seeds: Vec<Seed> = Vec::new();
    for (centre, direction) in [(0.2 + SPEED * from, 1.0), (0.8 - SPEED * from, -1.0)] {
        // A lattice of its own, with nodes of the grid or not: the centres lie where they lie.
        let spacing = cell / f64::from(per_edge);
        let count = (2.0 * RADIUS / spacing).ceil() as usize;
        let low = centre - 0.5 * spacing * count as f64;
        let mut disk = lattice([low, low, 0.0], [count, count, 1], spacing, 2);
        disk.retain(|seed| (seed.position[0] - centre).hypot(seed.position[1] - centre) < RADIUS);
        disk.iter_mut().for_each(|seed| seed.velocity = [direction * SPEED, direction * SPEED, 0.0]);
        seeds.extend(disk);
    }
    let half = seeds.len() / 2;
    let mut disks = setup.simulation::<PlaneStrain, _, _>(
        (Gimp::new(per_edge), model),
        distant_tool(),
        &seeds,
        |_, _, _| {},
    );
    let scale = total(&points(&disks), |p| p.mass * p.velocity[0].hypot(p.velocity[1]));
    let energies = |now: &[PointView]| [total(now, |p| kinetic(p, [0.0; 3])), total(now, elastic)];
    let initial: f64 = energies(&points(&disks)).iter().sum();
    let mut outcome =
        Outcome { momentum_drift: 0.0, energy_loss: 0.0, restitution: 0.0, history: Default::default() };
    while from + disks.progress().clock < end {
        disks.step(&NO_MOTION, false).expect("a stable step");
        let (time, now) = (from + disks.progress().clock, points(&disks));
        for axis in 0..2 {
            let momentum = total(&now, |p| p.mass * p.velocity[axis]);
            outcome.momentum_drift = outcome.momentum_drift.max(momentum.abs() / scale);
        }
        let [kinetic, elastic] = energies(&now).map(|energy| energy / initial);
        for (line, value) in outcome.history.iter_mut().zip([kinetic, elastic, kinetic + elastic]) {
            line.push((time, value));
        }
        outcome.energy_loss = 1.0 - kinetic - elastic;
        let speed = |axis: usize| total(&now[..half], |p| p.velocity[axis]) / half as f64;
        outcome.restitution = speed(0).hypot(speed(1)) / (SPEED * 2_f64.sqrt());
    }
    outcome
}

/// Where the energy goes.
const LOST: &str = "the scheme's damping: it falls with the cell, the points' spacing and the substep";

/// The collision on four grids, and at the finest settings.
pub fn verify(report: &mut Report) {
    let settings = |per_edge, cells, courant| Settings { per_edge, cells, courant, from: 0.0, end: 3.5 };
    let mut lines = Vec::new();
    for (per_edge, courant) in [(2, 0.4), (2, 0.1), (4, 0.1)] {
        let runs = [20, 40, 80].map(|cells| (cells, run(settings(per_edge, cells, courant))));
        let name = format!("{per_edge} x {per_edge} points per cell, Courant number {courant}");
        let (_, finest) = &runs[2];
        let at_parting = finest.history[2].iter().rfind(|entry| entry.0 <= 2.6).map_or(1.0, |entry| entry.1);
        if per_edge == 4 {
            report.at_most(format!("{name}, 80 cells per m: momentum"), finest.momentum_drift, "", 1e-13, "");
            report.at_most(
                format!("{name}, 80 cells per m: energy lost at 2.6 s"),
                100.0 * (1.0 - at_parting),
                "%",
                1.0,
                LOST,
            );
            report.at_most(
                format!("{name}, 80 cells per m: energy lost at 3.5 s"),
                100.0 * finest.energy_loss,
                "%",
                1.0,
                LOST,
            );
            report.show(
                "speed of the centres after the collision over before",
                finest.restitution,
                "",
                "the rest is vibration",
            );
            let names = ["kinetic", "elastic", "total"];
            let parts =
                names.into_iter().zip(finest.history.clone()).map(|(name, points)| line(name, points));
            report.plot(
                "disks.png",
                "Two elastic disks, 80 cells per metre",
                "time (s)",
                vec![panel("energy over that at the start", parts.collect())],
            );
        } else {
            report.show(
                format!("{name}, 80 cells per m: energy lost at 3.5 s"),
                100.0 * finest.energy_loss,
                "%",
                LOST,
            );
        }
        lines.push(line(
            name,
            logarithms(runs.iter().map(|(cells, run)| (1.0 / f64::from(*cells), run.energy_loss))),
        ));
    }
    report.plot(
        "disks_loss.png",
        "Two elastic disks: energy lost at 3.5 s",
        "log10 of the cell (m)",
        vec![panel("log10 of the loss over the energy at the start", lines)],
    );
}
