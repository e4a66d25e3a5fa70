//! An elastic bar in its first longitudinal mode: held at one end, or flying across the grid.
//!
//! Strains stay below 2e-5 and ν = 0, so the plane problem is the linear one-dimensional one, and the period
//! is 4 L √(ρ/E). Fixed nodes cannot fly: the flying bar is two bars of length L joined at their held ends,
//! where neither moves.

use super::Report;
use super::report::{line, panel};
use crate::dimension::PlaneStrain;
use crate::grid::FixedNodes;
use crate::grid::shape_function::{Gimp, ShapeFunction};
use crate::scene::Constants;
use crate::simulation::{PointView, Solver};
use crate::study::body_setup::{
    BodySetup, NO_MOTION, Seed, distant_tool, elastic, kinetic, lattice, never_yielding, points, steel,
    steel_4340, total,
};
use std::f64::consts::FRAC_PI_2;

/// Length of the bar (m) and largest speed of the vibration at the start (m/s).
pub const LENGTH: f64 = 0.025;
/// See `LENGTH`.
pub const SPEED: f64 = 0.1;

/// How the bar is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bar {
    /// Left end held.
    Held,
    /// Two of them joined at the held ends, and flying at a velocity (m/s).
    Flying([f64; 2]),
}

/// What ten periods of vibration give.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Mean period over the exact one, less one (-).
    pub period_error: f64,
    /// Mean energy of vibration over the tenth period, over that of the first, less one (-).
    pub energy_drift: f64,
    /// Cells that the bar has crossed on its way.
    pub crossed: f64,
    /// Amplitude of the first mode's speed over that at the start, over time in periods.
    pub amplitude: Vec<(f64, f64)>,
    /// Energy of vibration over that at the start, over time in periods.
    pub energy: Vec<(f64, f64)>,
}

/// The bar's material.
pub fn constants() -> Constants {
    never_yielding(Constants { poissons_ratio: 0.0, ..steel_4340() })
}

/// Exact period (s).
pub fn exact_period() -> f64 {
    let c = constants();
    4.0 * LENGTH / (c.youngs_modulus / c.density).sqrt()
}

/// Ten periods of a bar of `cells` by three cells, or of two such bars.
///
/// # Panics
/// When the run becomes unstable.
pub fn run<F: ShapeFunction<f64>>(bar: Bar, cells: i32, shape: F) -> Outcome {
    /// Periods that are followed.
    const PERIODS: usize = 10;
    let exact = exact_period();
    let cell = LENGTH / f64::from(cells);
    let flight = if let Bar::Flying(velocity) = bar { velocity } else { [0.0; 2] };
    let way = flight.map(|v| v * (PERIODS as f64 + 0.7) * exact);
    let bars = if bar == Bar::Held { 1 } else { 2 };
    let left = -LENGTH * f64::from(bars - 1);
    let mut setup = BodySetup::around([left, 0.0], [LENGTH + way[0], 3.0 * cell + way[1]], cell);
    let mode = |x: f64| (FRAC_PI_2 * x / LENGTH).sin();
    if bar == Bar::Held {
        let wall = setup.node(0, 0.0);
        setup.fixed.push(FixedNodes { low: [0; 3], high: [wall, setup.nodes[1], 0], axes: [true; 3] });
    }
    let places = lattice([left, 0.0, 0.0], [(2 * bars * cells) as usize, 6, 1], cell / 2.0, 2);
    let weights: Vec<f64> = places.iter().map(|seed| mode(seed.position[0])).collect();
    let scale: f64 = weights.iter().map(|w| w * w).sum();
    let seeds: Vec<Seed> = places
        .iter()
        .zip(&weights)
        .map(|(seed, w)| Seed { velocity: [flight[0] + SPEED * w, flight[1], 0.0], ..*seed })
        .collect();
    let mut solver = setup.simulation::<PlaneStrain, F, _>(
        (shape, steel(&constants())),
        distant_tool(),
        &seeds,
        |_, _, _| {},
    );
    let measure = |now: &[PointView]| {
        let speed = now.iter().zip(&weights).map(|(p, w)| (p.velocity[0] - flight[0]) * w).sum::<f64>();
        let energy = total(now, |p| kinetic(p, [flight[0], flight[1], 0.0]) + elastic(p));
        (speed / scale / SPEED, energy)
    };
    let (mut before, initial) = measure(&points(&solver));
    let mut outcome =
        Outcome { period_error: 0.0, energy_drift: 0.0, crossed: 0.0, amplitude: vec![], energy: vec![] };
    let (mut crossings, mut clock) = (Vec::new(), 0.0);
    while crossings.len() < 2 * PERIODS + 1 {
        solver.step(&NO_MOTION, false).expect("a stable step");
        let time = solver.progress().clock;
        let (now, energy) = measure(&points(&solver));
        if before * now < 0.0 {
            crossings.push(clock + (time - clock) * before / (before - now));
        }
        outcome.amplitude.push((time / exact, now));
        outcome.energy.push((time / exact, energy / initial));
        (before, clock) = (now, time);
    }
    // A stored velocity belongs to the middle of a substep, which moves every crossing alike.
    let period = (crossings[2 * PERIODS] - crossings[0]) / PERIODS as f64;
    let mean = |from: usize| {
        let range = crossings[2 * from] / exact..crossings[2 * from + 2] / exact;
        let inside: Vec<f64> =
            outcome.energy.iter().filter(|entry| range.contains(&entry.0)).map(|entry| entry.1).collect();
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    outcome.period_error = period / exact - 1.0;
    outcome.energy_drift = mean(PERIODS - 1) / mean(0) - 1.0;
    outcome.crossed = flight[0].hypot(flight[1]) * clock / cell;
    outcome
}

/// The bar at rest and in flight at three resolutions.
pub fn verify(report: &mut Report) {
    let (mut amplitudes, mut energies) = (Vec::new(), Vec::new());
    for (bar, name) in [(Bar::Held, "held"), (Bar::Flying([160.0, 70.0]), "flying")] {
        let runs = [16, 32, 64].map(|cells| run(bar, cells, Gimp::new(2)));
        let middle = &runs[1];
        let name =
            if bar == Bar::Held { name.into() } else { format!("{name} across {:.0} cells", middle.crossed) };
        report.at_most(format!("{name}, 32 cells: period"), 100.0 * middle.period_error, "%", 0.1, "");
        report.at_most(
            format!("{name}, 32 cells: energy drift over ten periods"),
            100.0 * middle.energy_drift,
            "%",
            0.1,
            "",
        );
        let order = (runs[1].period_error / runs[2].period_error).abs().log2();
        report.at_least(format!("{name}: order of the period, 32 to 64 cells"), order, 1.9, "");
        amplitudes.push(line(name.clone(), middle.amplitude.clone()));
        energies.push(line(name, middle.energy.clone()));
    }
    report.plot(
        "bar.png",
        "Elastic bar of 32 cells in its first mode",
        "time (periods)",
        vec![panel("speed of the mode over its start", amplitudes), panel("energy over its start", energies)],
    );
}
