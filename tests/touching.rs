//! Contact of the tool with the points themselves (`touching`): what it must conserve, and that threads do not change it.

mod common;

use common::{Lattice, SteelBlock, SteelState, elastic, kinetic, points, total};
use swarf::contact::RigidTool;
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::shape::Gimp;
use swarf::simulation::{Drive, Solver};
use swarf::tool_shape::ToolShape;

/// A block thrown obliquely at a leaning rake face with friction.
fn thrown<D: Dimension>() -> SteelBlock<D, Gimp<f64>> {
    let deep = D::AXES == 3;
    let lattice = Lattice {
        domain: [50, 50, if deep { 30 } else { 1 }],
        corner: [12, 14, if deep { 12 } else { 0 }],
        cells: [8, 10, 4],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    let shape = ToolShape::new(0.2, 0.0873, 0.0, 3e-4, 6e-4).expect("a plain wedge");
    let tool = RigidTool { shape, position: [1.3e-4, -2e-4], velocity: [0.0; 2], friction: 0.3 };
    let constants = common::never_yielding(common::steel_4340());
    let mut block =
        lattice.build(&constants, Gimp::new(2), tool, |_, _: &mut SteelState<D>, _| [25.0, 10.0, 0.0]);
    block.points_touch = true;
    block
}

/// A tool that comes to meet it.
const DRIVE: Drive = Drive { velocity: [-15.0, 0.0], friction: 0.3 };

/// Contact is an exchange: what the block's momentum changes by is the tool's impulse (rounding of a thousand substeps), and
/// the ledger stays closed, with 0.5 % for what a block that bounces off fixed nodes leaves open too.
fn check<D: Dimension>(name: &str) {
    let mut block = thrown::<D>();
    let momentum = |solver: &dyn Solver, axis: usize| total(&points(solver), |p| p.mass * p.velocity[axis]);
    let before = [momentum(&block, 0), momentum(&block, 1)];
    let energy = block.progress().ledger.initial_energy;
    let mut worst = 0.0_f64;
    for _ in 0..300 {
        block.step(&DRIVE, false).expect("a stable step");
        let now = points(&block);
        let open = block.progress().ledger.imbalance(total(&now, kinetic), total(&now, elastic)) / energy;
        worst = worst.max(open.abs());
    }
    let ledger = &block.progress().ledger;
    println!(
        "{name}: imbalance {worst:.1e}, friction {:.3}, damping {:.3} of the energy",
        ledger.friction_work / energy,
        ledger.damping / energy
    );
    for axis in 0..2 {
        let gained = momentum(&block, axis) - before[axis];
        let impulse = ledger.tool_impulse[axis];
        assert!(
            (gained - impulse).abs() < 1e-12 * before[0],
            "{name}: momentum along axis {axis} changed by {gained}, the tool's impulse is {impulse}"
        );
    }
    assert!(ledger.tool_impulse[0] < -0.5 * before[0], "{name}: the block hardly met the tool");
    assert!(ledger.friction_work > 0.0, "{name}: friction gave {} J", ledger.friction_work);
    assert!(worst < 5e-3, "{name}: imbalance {worst:e}");
}

/// See `check`.
#[test]
fn momentum_and_energy_are_accounted_for() {
    check::<PlaneStrain>("plane strain");
    check::<ThreeDimensional>("three dimensions");
}

/// Contact is solved on one thread in the order of memory, so spreading the rest over threads changes no bit.
#[test]
fn threads_change_nothing() {
    let (mut one, mut two) = (thrown::<PlaneStrain>(), thrown::<PlaneStrain>());
    for _ in 0..300 {
        one.step(&DRIVE, false).expect("a stable step");
        two.step(&DRIVE, true).expect("a stable step");
    }
    assert!(one.progress().touches[1], "the tool was never touched");
    assert_eq!(one.progress(), two.progress());
    assert!(one.bulk() == two.bulk(), "the states differ");
}
