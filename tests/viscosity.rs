//! Artificial viscosity on the piston shock.

use swarf::material::viscosity::Viscous;
use swarf::study::body_setup::steel;
use swarf::study::verification::piston::{Outcome, Piston, SPEED, run, run_with};

/// By how much the compressive stress exceeds its plateau at most, over the half of the way from the piston
/// to the plastic front that is nearer to the front (-): what the start left at the piston's face is another
/// matter.
fn overshoot(outcome: &Outcome) -> f64 {
    let front = outcome.fronts[1] / outcome.exact.plastic_front;
    assert!((front - 1.0).abs() < 0.02, "the plastic front is off: {front}");
    let depth = outcome.profile.iter().rfind(|layer| layer[1] > 0.5 * SPEED).map_or(0.0, |layer| layer[0]);
    let behind = outcome.profile.iter().filter(|layer| (0.5 * depth..depth).contains(&layer[0]));
    behind.map(|layer| layer[2]).fold(0.0, f64::max) / outcome.exact.plateau - 1.0
}

/// Pressure that grows with the rate of compression damps what a front leaves behind it, exchanges momentum
/// inside the body only, and takes its energy into an entry of its own.
#[test]
fn viscosity_calms_the_shock_and_closes_the_ledger() {
    for cells in [200, 400] {
        let plain = run(Piston::AtRest, true, cells, 0.5);
        let viscous = run_with(Piston::AtRest, true, cells, 0.5, |constants, cell| {
            Viscous::new(steel(constants), 0.06, 1.2, cell)
        });
        let (before, after) = (overshoot(&plain), overshoot(&viscous));
        println!(
            "{cells} cells: overshoot {before:.4} became {after:.4}; viscous work {:.4} of the plastic work, \
             ledger off by {:.1e} (plain {:.1e}), momentum by {:.1e}, plateau off by {:.4} (plain {:.4})",
            viscous.viscous_work,
            viscous.imbalance,
            plain.imbalance,
            viscous.momentum_error,
            viscous.plateau / viscous.exact.plateau - 1.0,
            plain.plateau / plain.exact.plateau - 1.0
        );
        assert!(after < 0.7 * before, "overshoot {before} became {after}");
        assert_eq!(plain.viscous_work, 0.0);
        assert!(viscous.viscous_work > 0.0, "viscous work {}", viscous.viscous_work);
        // Bound of the piston's momentum as without viscosity; a ledger of these runs closes to rounding and
        // to the difference between the work of the mean stress and the energy taken up
        // (tests/material_point.rs, 1e-3).
        assert!(viscous.momentum_error < 1e-10, "momentum less impulse {:e}", viscous.momentum_error);
        assert!(viscous.imbalance.abs() < 1e-3, "imbalance {:e}", viscous.imbalance);
        let plateau = viscous.plateau / viscous.exact.plateau - 1.0;
        assert!(plateau.abs() < if cells == 200 { 0.01 } else { 0.005 }, "plateau off by {plateau}");
    }
}
