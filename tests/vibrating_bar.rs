//! An elastic bar, fixed at one end and free at the other, in its first mode.

mod common;

use common::{Lattice, NO_DRIVE, SteelState, distant_tool, points};
use std::f64::consts::{FRAC_PI_2, TAU};
use swarf::dimension::PlaneStrain;
use swarf::grid::FixedNodes;
use swarf::scene::Constants;
use swarf::shape::{Gimp, Linear, ShapeFunction};
use swarf::simulation::Solver;

/// Length of the bar (m) and largest speed at the start (m/s), as in the reference: reference/analytic_reference.json,
/// vibrating_bar_fixed_free.
const LENGTH: f64 = 0.025;
const SPEED: f64 = 0.1;

/// Mean period (s) over five cycles of a bar of `cells` cells, over the exact one, less one; and its amplitude at the
/// end over that at the start.
fn period_error<F: ShapeFunction<f64>>(cells: i32, shape: F) -> (f64, f64) {
    // No transverse strain, so the plane problem is one-dimensional.
    let constants = common::never_yielding(Constants { poissons_ratio: 0.0, ..common::steel_4340() });
    let wall = FixedNodes { low: [4, 0, 0], high: [6, 19, 0], axes: [true; 3] };
    let lattice = Lattice {
        domain: [cells + 20, 20, 1],
        corner: [6, 8, 0],
        cells: [cells, 3, 1],
        per_edge: 2,
        cell: LENGTH / f64::from(cells),
        fixed: vec![wall],
        courant: 0.5,
    };
    let mode = |x: f64| (FRAC_PI_2 * x / LENGTH).sin();
    let mut bar = lattice.build::<PlaneStrain, F>(
        &constants,
        shape,
        distant_tool(),
        |x, _: &mut SteelState<PlaneStrain>, _| [SPEED * mode(x[0]), 0.0, 0.0],
    );
    let weights: Vec<f64> = points(&bar).iter().map(|p| mode(p.position[0])).collect();
    let scale: f64 = weights.iter().map(|w| w * w).sum::<f64>();
    // Speed of the first mode: it is cos ωt.
    let amplitude = |solver: &dyn Solver| {
        let speeds = points(solver);
        speeds.iter().zip(&weights).map(|(p, w)| p.velocity[0] * w).sum::<f64>() / scale / SPEED
    };
    let exact = 4.0 * LENGTH / (constants.youngs_modulus / constants.density).sqrt();
    let mut before = (0.0, amplitude(&bar));
    let (mut crossings, mut peak) = (Vec::new(), 0.0_f64);
    while crossings.len() < 11 {
        bar.step(&NO_DRIVE, false).expect("a stable step");
        let now = (bar.progress().clock, amplitude(&bar));
        if before.1 * now.1 < 0.0 {
            crossings.push(before.0 + (now.0 - before.0) * before.1 / (before.1 - now.1));
        }
        if now.0 > 4.5 * exact {
            peak = peak.max(now.1.abs());
        }
        before = now;
    }
    // A stored velocity belongs to the middle of a substep, which moves every crossing alike.
    let period = (crossings[10] - crossings[0]) / 5.0;
    let exact_here = TAU / 323_060.722_540_362_74;
    assert!((exact / exact_here - 1.0).abs() < 1e-12, "period {exact} s, in the reference {exact_here} s");
    (period / exact - 1.0, peak)
}

/// The bar's period is 4 L √(ρ/E) (strains stay below 2e-5, so the law is linear); 0.2 % is the acceptance.
#[test]
fn the_first_period_is_within_two_per_mille() {
    for (name, cells, (error, amplitude)) in [
        ("GIMP", 50, period_error(50, Gimp::new(2))),
        ("GIMP", 100, period_error(100, Gimp::new(2))),
        ("linear", 50, period_error(50, Linear)),
        ("linear", 100, period_error(100, Linear)),
    ] {
        println!(
            "{name}, {cells} cells: period {:+.4} %, amplitude after 5 cycles {amplitude:.4}",
            100.0 * error
        );
        assert!(error.abs() < 2e-3, "{name}, {cells} cells: period wrong by {error:e}");
        // FLIP keeps the motion: only its filter of short waves takes energy.
        assert!(
            (0.97..1.01).contains(&amplitude),
            "{name}, {cells} cells: amplitude {amplitude} after five cycles"
        );
    }
}

/// The error is that of the scheme: it falls as the cells get smaller.
#[test]
fn the_period_converges() {
    let errors: Vec<f64> =
        [25, 50, 100].into_iter().map(|cells| period_error(cells, Gimp::new(2)).0.abs()).collect();
    println!("period errors with 25, 50 and 100 cells: {errors:.5?}");
    assert!(
        errors[2] < 0.7 * errors[1] && errors[1] < 0.7 * errors[0],
        "period errors {errors:?} do not fall"
    );
}
