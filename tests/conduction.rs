//! The conduction pass: exact solutions, conservation, and what it must not depend on.

mod common;

use common::{Lattice, ROOM, Random, distant_tool, never_yielding, points, steel_4340};
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::grid::shape_function::{Gimp, Linear, ShapeFunction};
use swarf::heat::HeatTotals;
use swarf::simd::Real;
use swarf::simulation::Solver;
use swarf::study::verification::heat::{Case, conduction, erfc, run};

/// The reference's rows: case, x (m), t (s), rise (K). Their origin is in tests/data/README.md.
fn reference() -> Vec<(Case, f64, f64, f64)> {
    let rows = include_str!("data/heat_reference.csv").lines().skip(1);
    rows.map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let number = |k: usize| cells[k].parse().expect("a number");
        (Case::named(cells[0]).expect("a known case"), number(1), number(2), number(3))
    })
    .collect()
}

/// The exact solutions that the runs are compared with are the reference's.
#[test]
fn exact_solutions_are_those_of_the_reference() {
    assert!(
        (erfc(0.5) - 0.479_500_122_186_953_5).abs() < 1e-15
            && (erfc(2.0) / erfc(1.999_999) - 1.0).abs() < 1e-5
    );
    for (case, x, t, rise) in reference() {
        let exact = case.exact(x, t);
        // erfc loses up to six digits where it is 1e-12 of the amplitude.
        assert!((exact - rise).abs() < 1e-12 * case.amplitude(t), "{case:?}, x {x}, t {t}: {exact}, {rise}");
    }
}

/// At 50 cells every temperature of the reference is met to 0.1 % of the amplitude.
#[test]
fn fifty_cells_meet_the_reference_to_a_tenth_of_a_percent() {
    let mut runs = Vec::new();
    for (case, x, t, rise) in reference() {
        if !runs.iter().any(|&(c, time, _)| c == case && time == t) {
            runs.push((case, t, run::<PlaneStrain>(case, 50, t)));
        }
        let (_, _, outcome) = runs.last().expect("just run");
        let error = (outcome.at(x) - rise).abs() / case.amplitude(t);
        println!("{case:?} x {x} t {t}: error {error:.2e}, {} passes", outcome.passes);
        // Beyond the strip the exact solution has only the digits that its length leaves.
        assert!(error < 1e-3, "{case:?} at x = {x} m, t = {t} s: {} K, exact {rise} K", outcome.at(x));
        assert!(outcome.imbalance.abs() < 1e-12, "{case:?}: heat is off by {:.2e}", outcome.imbalance);
    }
}

/// Halving the cell quarters the error, at every point of the strip, the surface included.
#[test]
fn conduction_is_of_second_order() {
    for (case, t) in [(Case::Cosine, 1e-3), (Case::Jump, 4e-5), (Case::Flux, 4e-5)] {
        let errors = [25, 50].map(|cells| run::<PlaneStrain>(case, cells, t).largest_error(case, t));
        let order = (errors[0] / errors[1]).log2();
        assert!(order > 1.8, "{case:?}: order {order} of errors {errors:?} K");
    }
}

/// A block with a random temperature at every point, disordered by random motion.
fn noisy<R: Real, D: Dimension, F: ShapeFunction<R>>(shape: F, substeps: usize) -> common::BlockIn<R, D, F> {
    let mut random = Random(7);
    let lattice = Lattice {
        domain: if D::AXES == 2 { [40, 36, 1] } else { [30, 26, 26] },
        corner: [10, 10, 10],
        cells: if D::AXES == 2 { [12, 8, 1] } else { [6, 5, 4] },
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.3,
    };
    let model = common::steel::<R>(&never_yielding(steel_4340()));
    let mut block = lattice.build_in::<R, D, F>(
        &never_yielding(steel_4340()),
        shape,
        distant_tool(),
        |x, state, lane| {
            let temperature = random.within(ROOM, ROOM + 800.0);
            swarf::material::ConstitutiveModel::<R, D>::set_temperature(&model, state, lane, temperature);
            [4e5 * x[1], -3e5 * x[0], 1e5 * x[1]]
        },
    );
    for _ in 0..substeps {
        block.step(&common::NO_MOTION, false).expect("a stable step");
    }
    block
}

/// Σ C_p T_p (J) with T from the start, and the largest deviation of a temperature from their mean (K).
fn heat_and_spread(solver: &dyn Solver) -> (f64, f64) {
    let all = points(solver);
    let heat = common::total(&all, |p| p.volume * p.report.heat);
    let volume = common::total(&all, |p| p.volume);
    let capacity = steel_4340().density * steel_4340().specific_heat;
    let mean = ROOM + heat / (capacity * volume);
    (heat, all.iter().map(|p| (p.report.temperature - mean).abs()).fold(0.0, f64::max))
}

/// Noise of any pattern, those within a cell included, dies out; nothing is lost, in either precision; no
/// pass makes the extremes worse by more than the planes overshoot.
fn check_noise<R: Real, D: Dimension, F: ShapeFunction<R>>(shape: F, substeps: usize, name: &str) {
    let mut block = noisy::<R, D, F>(shape, substeps);
    let mut pass = conduction();
    let mut totals = HeatTotals::default();
    let dt = 0.25 * pass.limit::<D>(&block.partition.layout);
    let (before, start) = heat_and_spread(&block);
    let mut last = start;
    for k in 0..400 {
        pass.conduct(&mut block.partition, &block.shape, &block.model, dt, &mut totals);
        let (heat, spread) = heat_and_spread(&block);
        let loss = (heat + totals.carry - before) / before;
        assert!(loss.abs() < 1e-12, "{name}: {loss:.2e} of the heat is lost after pass {k}");
        assert!(spread < 1.1 * last, "{name}: the spread grows from {last} to {spread} K in pass {k}");
        last = spread;
    }
    // The slowest mode, of twice the block's length, has decayed to exp(-π² κ t/L²).
    let length = if D::AXES == 2 { 12.0 } else { 6.0 };
    let slowest = (-9.87 * 400.0 * 0.25 / (2.0 * D::AXES as f64) / (length * length)).exp();
    assert!(
        last < 0.5 * start * slowest,
        "{name}: {last} K of {start} K are left, the slowest mode keeps {slowest}"
    );
}

/// See `check_noise`.
#[test]
fn noise_dies_out_and_heat_is_kept() {
    check_noise::<f64, PlaneStrain, _>(Gimp::new(2), 100, "plane, double");
    check_noise::<f32, PlaneStrain, _>(Gimp::new(2), 100, "plane, single");
    check_noise::<f64, ThreeDimensional, _>(Gimp::new(2), 100, "space, double");
    check_noise::<f32, ThreeDimensional, _>(Gimp::new(2), 100, "space, single");
    check_noise::<f64, PlaneStrain, _>(Linear, 0, "plane, linear");
}
