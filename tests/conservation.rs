//! What the solver must conserve: mass, momentum, energy, and a block that flies undeformed.

mod common;

use common::{
    Lattice, NO_MOTION, Random, SteelBlock, SteelState, distant_tool, elastic, kinetic, points, total,
};
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::grid::FixedNodes;
use swarf::grid::shape_function::{Gimp, Linear, ShapeFunction};
use swarf::scene::Constants;
use swarf::simulation::{PointView, Solver};

/// A free block that is strained, stressed, turning, and shaken at random.
fn shaken_block<D: Dimension, F: ShapeFunction<f64>>(
    constants: &Constants,
    shape: F,
    seed: u64,
) -> SteelBlock<D, F> {
    let (domain, cells) = if D::AXES == 2 { ([60, 50, 1], [18, 14, 1]) } else { ([30, 30, 30], [8, 7, 6]) };
    let lattice = Lattice {
        domain,
        corner: [10, 10, if D::AXES == 2 { 0 } else { 10 }],
        cells,
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    let mut random = Random(seed);
    lattice.build(constants, shape, distant_tool(), |x, state: &mut SteelState<D>, lane| {
        for component in 0..D::DEVIATOR {
            state.deviator[component][lane] = random.within(-3e8, 3e8);
        }
        state.jacobian[lane] = 1.0 + random.within(-2e-3, 2e-3);
        // 30 m/s of flight, a turning rate of 1e5 1/s, and noise.
        [
            30.0 - 1e5 * x[1] + random.within(-5.0, 5.0),
            17.0 + 1e5 * x[0] + random.within(-5.0, 5.0),
            random.within(-5.0, 5.0),
        ]
    })
}

/// Momentum along each axis (kg m/s).
fn momentum(points: &[PointView]) -> [f64; 3] {
    std::array::from_fn(|axis| total(points, |p| p.mass * p.velocity[axis]))
}

/// Runs a shaken block and checks after every tenth substep that momentum is what it was; returns the largest
/// change over Σ m |v|.
fn momentum_drift<D: Dimension, F: ShapeFunction<f64>>(shape: F, substeps: usize) -> f64 {
    let mut worst = 0.0_f64;
    for seed in 0..3 {
        let mut block = shaken_block::<D, F>(&common::steel_4340(), shape, seed);
        let start = points(&block);
        let (before, scale) =
            (momentum(&start), total(&start, |p| p.mass * kinetic(p).sqrt() / (0.5 * p.mass).sqrt()));
        for k in 0..substeps {
            block.step(&NO_MOTION, false).expect("a stable step");
            if k % 10 == 0 {
                let now = momentum(&points(&block));
                for axis in 0..3 {
                    worst = worst.max((now[axis] - before[axis]).abs() / scale);
                }
            }
        }
    }
    worst
}

/// Internal forces sum to zero because the slopes around a point do, and the grid gives its increments back
/// to the points with the same weights: momentum without contact is constant. The bound of 1e-12 is the
/// issue's acceptance.
///
/// Linear functions run only until a point on the surface crosses a cell: there they are unstable (see the
/// book, limits).
#[test]
fn momentum_is_conserved_without_contact() {
    let drifts = [
        ("GIMP, plane strain", momentum_drift::<PlaneStrain, _>(Gimp::new(2), 400)),
        ("linear, plane strain", momentum_drift::<PlaneStrain, _>(Linear, 25)),
        ("GIMP, three dimensions", momentum_drift::<ThreeDimensional, _>(Gimp::new(2), 100)),
        ("linear, three dimensions", momentum_drift::<ThreeDimensional, _>(Linear, 25)),
    ];
    println!("momentum change over Σ m|v|: {drifts:?}");
    for (name, drift) in drifts {
        assert!(drift < 1e-12, "{name}: momentum changed by {drift:e} of Σ m|v|");
    }
}

/// Points carry their mass unchanged, and the grid receives all of it at every substep.
#[test]
fn mass_is_conserved() {
    let mut block = shaken_block::<PlaneStrain, _>(&common::steel_4340(), Gimp::new(2), 5);
    let start = points(&block);
    let mass = total(&start, |p| p.mass);
    for _ in 0..300 {
        block.step(&NO_MOTION, false).expect("a stable step");
        let on_grid: f64 = block.partition.incoming.iter().flat_map(|run| &run.mass).sum();
        // About 1000 points in 9 nodes each, added one after another.
        assert!((on_grid / mass - 1.0).abs() < 1e-13, "grid has {on_grid} kg of {mass} kg");
    }
    let end = points(&block);
    assert_eq!(end.len(), start.len());
    for (a, b) in start.iter().zip(&end) {
        assert!(a.id == b.id && a.volume.to_bits() == b.volume.to_bits(), "point {} became {}", a.id, b.id);
    }
}

/// Largest imbalance of a free block's ledger over its energy at the start.
fn imbalance<D: Dimension, F: ShapeFunction<f64>>(constants: &Constants, shape: F, substeps: usize) -> f64 {
    let mut block = shaken_block::<D, F>(constants, shape, 11);
    let scale = block.progress().ledger.initial_energy;
    let mut worst = 0.0_f64;
    for _ in 0..substeps {
        block.step(&NO_MOTION, false).expect("a stable step");
        let now = points(&block);
        let ledger = &block.progress().ledger;
        worst = worst.max((ledger.imbalance(total(&now, kinetic), total(&now, elastic)) / scale).abs());
    }
    let ledger = &block.progress().ledger;
    println!(
        "imbalance {worst:.2e}; shares of the start energy: damping {:.3}, plastic {:.3}",
        ledger.damping / scale,
        ledger.plastic_work / scale
    );
    worst
}

/// Every term of the ledger is computed from what it names, so its sum is a test. What is left is of second
/// order in the increments of a substep; 1 % is the bound for a cut, a shaken block without friction
/// stays well below.
#[test]
fn the_ledger_of_a_free_block_closes() {
    let steel = common::steel_4340();
    let elastic = common::never_yielding(steel.clone());
    for (name, error) in [
        ("elastic, GIMP", imbalance::<PlaneStrain, _>(&elastic, Gimp::new(2), 400)),
        ("elastic, linear", imbalance::<PlaneStrain, _>(&elastic, Linear, 25)),
        ("plastic, GIMP", imbalance::<PlaneStrain, _>(&steel, Gimp::new(2), 400)),
        ("plastic, space", imbalance::<ThreeDimensional, _>(&steel, Gimp::new(2), 100)),
    ] {
        assert!(error < 2e-3, "{name}: {error:e} of the energy is unaccounted for");
    }
}

/// Weights sum to one and slopes to zero: a translation strains nothing and slows nothing, in whatever cells
/// it is.
fn fly<D: Dimension, F: ShapeFunction<f64>>(shape: F) -> (f64, f64, f64) {
    let velocity: [f64; 3] =
        std::array::from_fn(|axis| if axis < D::AXES { [400.0, 170.0, -90.0][axis] } else { 0.0 });
    let lattice = Lattice {
        domain: [60, 40, if D::AXES == 2 { 1 } else { 40 }],
        corner: [5, 5, if D::AXES == 2 { 0 } else { 25 }],
        cells: [8, 6, 5],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    let mut block = lattice.build::<D, F>(&common::steel_4340(), shape, distant_tool(), |_, _, _| velocity);
    let start = points(&block);
    let mut clock = 0.0;
    // 20 cells along x, 8.5 along y.
    while clock < 20.0 * 2e-5 / velocity[0] {
        block.step(&NO_MOTION, false).expect("a stable step");
        clock = block.progress().clock;
    }
    let (mut shape_error, mut speed_error, mut stress) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (a, b) in start.iter().zip(points(&block)) {
        for axis in 0..3 {
            let expected = a.position[axis] + clock * velocity[axis];
            shape_error = shape_error.max((b.position[axis] - expected).abs() / 2e-5);
            speed_error = speed_error.max((b.velocity[axis] - velocity[axis]).abs() / velocity[0]);
        }
        stress = b.report.stress.iter().fold(stress, |worst, s| worst.max(s.abs()));
    }
    (shape_error, speed_error, stress / common::steel_4340().youngs_modulus)
}

/// See `fly`. Rounding of every substep adds up: a few hundred substeps of a few ε each.
#[test]
fn a_flying_block_keeps_its_shape_and_speed_across_cells() {
    for (name, (shape, speed, stress)) in [
        ("GIMP, plane strain", fly::<PlaneStrain, _>(Gimp::new(2))),
        ("GIMP, three dimensions", fly::<ThreeDimensional, _>(Gimp::new(2))),
    ] {
        println!("{name}: position {shape:.1e} cells, speed {speed:.1e} of it, stress {stress:.1e} E");
        assert!(shape < 1e-9, "{name}: a point is {shape:e} cells from where it should be");
        assert!(speed < 1e-10, "{name}: a speed changed by {speed:e} of it");
        assert!(stress < 1e-10, "{name}: stress {stress:e} E in a block that only flies");
    }
}

/// Points that leave the domain are counted, with their mass and energy; the ledger stays closed without
/// them.
#[test]
fn points_that_leave_the_domain_stay_in_the_ledger() {
    let lattice = Lattice {
        domain: [40, 30, 1],
        corner: [24, 12, 0],
        cells: [8, 6, 1],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    let mut block = lattice.build::<PlaneStrain, _>(
        &common::never_yielding(common::steel_4340()),
        Gimp::new(2),
        distant_tool(),
        // A pressure that is the same everywhere would burst the block; a small one lets it breathe on its
        // way.
        |_, state: &mut SteelState<PlaneStrain>, lane| {
            state.jacobian[lane] = 0.9999;
            [300.0, 0.0, 0.0]
        },
    );
    let start = points(&block);
    let (count, mass) = (start.len(), total(&start, |p| p.mass));
    let energy = block.progress().ledger.initial_energy;
    let mut seen_partly = false;
    for _ in 0..2000 {
        block.step(&NO_MOTION, false).expect("a stable step");
        let now = points(&block);
        let ledger = &block.progress().ledger;
        assert_eq!(now.len() + ledger.retired_points as usize, count, "points are missing");
        let all = total(&now, |p| p.mass) + ledger.retired_mass;
        assert!((all / mass - 1.0).abs() < 1e-12, "mass {all} kg of {mass} kg");
        let open = ledger.imbalance(total(&now, kinetic), total(&now, elastic)) / energy;
        // The energy is almost all kinetic and the ledger's own error lies in the elastic part, a few 1e-4 of
        // it.
        assert!(open.abs() < 1e-5, "imbalance {open:e} with {} points retired", ledger.retired_points);
        seen_partly |= ledger.retired_points > 0 && !now.is_empty();
        if now.is_empty() {
            break;
        }
    }
    let ledger = &block.progress().ledger;
    assert!(seen_partly, "the block never stood partly outside");
    assert_eq!(ledger.retired_points as usize, count, "some points never left");
    let share = ledger.retired_energy / energy;
    assert!((share - 1.0).abs() < 1e-2, "retired points took {share} of the energy");
    assert_eq!(points(&block).len(), 0);
    // An empty domain goes on without fuss.
    block.step(&NO_MOTION, false).expect("a step without points");
}

/// Fixed nodes give momentum to the wall and take no work: a block thrown at one bounces, and the ledger
/// stays closed.
#[test]
fn a_block_bounces_off_fixed_nodes_with_a_closed_ledger() {
    let wall = FixedNodes { low: [8, 0, 0], high: [8, 49, 0], axes: [true, false, false] };
    let lattice = Lattice {
        domain: [60, 50, 1],
        corner: [9, 18, 0],
        cells: [12, 10, 1],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![wall],
        courant: 0.5,
    };
    let mut block = lattice.build::<PlaneStrain, _>(
        &common::never_yielding(common::steel_4340()),
        Gimp::new(2),
        distant_tool(),
        |_, _, _| [-20.0, 0.0, 0.0],
    );
    let start = points(&block);
    let before = momentum(&start);
    let energy = block.progress().ledger.initial_energy;
    let mut worst = 0.0_f64;
    for _ in 0..600 {
        block.step(&NO_MOTION, false).expect("a stable step");
        let now = points(&block);
        let open = block.progress().ledger.imbalance(total(&now, kinetic), total(&now, elastic)) / energy;
        worst = worst.max(open.abs());
    }
    let after = momentum(&points(&block));
    let ledger = &block.progress().ledger;
    println!(
        "rebound at {:.3} of the speed, contact loss {:.4}, damping {:.4}, imbalance {worst:.1e}",
        -after[0] / before[0],
        ledger.contact_loss / energy,
        ledger.damping / energy
    );
    assert!(after[0] > 0.3 * before[0].abs(), "momentum {} after {}", after[0], before[0]);
    // Symmetric about the middle line: nothing pushes along the wall.
    assert!(after[1].abs() < 1e-9 * before[0].abs(), "momentum along the wall {}", after[1]);
    assert!(worst < 5e-3, "imbalance {worst:e}");
}

/// No material moves at five times its speed of sound: such speeds come of an instability, and substeps that
/// shrink with them would never end. At Courant 0.5 such a point is stopped by how far it goes; at 0.05 only
/// by its speed.
#[test]
fn points_far_faster_than_sound_stop_the_run() {
    let mut block = shaken_block::<PlaneStrain, _>(&common::steel_4340(), Gimp::new(2), 1);
    block.step(&NO_MOTION, false).expect("a stable step");
    block.options.courant = 0.05;
    block.progress.fastest = 4e4;
    for points in block.partition.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
        points.velocity[0].fill(4e4);
    }
    // The first substep has the momentum of the last deposit and finds nothing; the second goes a third of a
    // cell.
    let outcome = (0..3).find_map(|_| block.step(&NO_MOTION, false).err());
    let text = outcome.expect("an error").to_string();
    assert!(text.contains("times the speed of sound"), "{text}");
}
