//! An elastic bar in its first mode, held at one end and in flight (`study::verification::bar`).

use swarf::grid::shape_function::{Gimp, Linear};
use swarf::study::verification::bar::{Bar, Outcome, exact_period, run};

/// Prints and checks period and energy.
fn check(name: &str, outcome: &Outcome, bound: f64) {
    println!(
        "{name}: period {:+.4} %, energy drift {:+.4} % over ten periods, {:.0} cells crossed",
        100.0 * outcome.period_error,
        100.0 * outcome.energy_drift,
        outcome.crossed
    );
    assert!(outcome.period_error.abs() < bound, "{name}: period wrong by {:e}", outcome.period_error);
    assert!(outcome.energy_drift.abs() < bound, "{name}: energy drifts by {:e}", outcome.energy_drift);
}

/// The bar's period is 4 L √(ρ/E), strains stay below 2e-5; 0.1 % at 32 cells, and of energy over ten
/// periods, are the acceptance.
#[test]
fn period_and_energy_are_within_one_per_mille_at_32_cells() {
    // Its source: reference/analytic_reference.json, vibrating_bar_fixed_free.
    let (exact, printed) = (exact_period(), 1.944_892_977_943_047_4e-5);
    assert!((exact / printed - 1.0).abs() < 1e-12, "period {exact} s, in the reference {printed} s");
    check("GIMP", &run(Bar::Held, 32, Gimp::new(2)), 1e-3);
    check("linear", &run(Bar::Held, 32, Linear), 1e-3);
}

/// Physics does not know the grid's frame: two bars joined at their held ends vibrate the same while they fly
/// across some forty cells.
#[test]
fn a_flying_bar_vibrates_like_a_held_one() {
    let outcome = run(Bar::Flying([160.0, 70.0]), 32, Gimp::new(2));
    check("flying", &outcome, 1e-3);
    assert!(outcome.crossed > 30.0, "only {} cells were crossed", outcome.crossed);
}

/// The scheme is of second order in space and time.
#[test]
fn the_period_converges_at_second_order() {
    for (name, bar) in [("held", Bar::Held), ("flying", Bar::Flying([160.0, 0.0]))] {
        let errors = [16, 32, 64].map(|cells| run(bar, cells, Gimp::new(2)).period_error);
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{name}: period errors {errors:.6?}, orders {orders:.3?}");
        // 0.1 for the terms of higher order that are still seen.
        assert!(orders.iter().all(|&order| order > 1.9), "{name}: errors {errors:?}, orders {orders:?}");
    }
}
