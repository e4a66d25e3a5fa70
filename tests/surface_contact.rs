//! The contact laws of scenes (`contact::surface`, `contact::nodal`): what they must conserve, and that
//! threads do not change them.

mod common;

use common::{Lattice, SteelBlock, SteelState, elastic, kinetic, points, total};
use swarf::contact;
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::grid::shape_function::Gimp;
use swarf::scene::{ContactChoice, Scene};
use swarf::session::Session;
use swarf::simulation::{Solver, ToolMotion};
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

/// The laws of `numerics.contact`.
const LAWS: [ContactChoice; 3] = [ContactChoice::Surface, ContactChoice::Distance, ContactChoice::Velocity];

/// A block thrown obliquely at a leaning rake face with friction.
fn thrown<D: Dimension>(law: ContactChoice) -> SteelBlock<D, Gimp<f64>> {
    thrown_of(law, [8, 10, 4])
}

/// The same with another size (cells).
fn thrown_of<D: Dimension>(law: ContactChoice, cells: [i32; 3]) -> SteelBlock<D, Gimp<f64>> {
    let deep = D::AXES == 3;
    let lattice = Lattice {
        domain: [50, 50, if deep { 30 } else { 1 }],
        corner: [12, 14, if deep { 12 } else { 0 }],
        cells,
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
    block.contact = contact::law(law, false);
    block
}

/// A tool that comes to meet it.
const MOTION: ToolMotion = ToolMotion { velocity: [-15.0, 0.0], friction: 0.3 };

/// Contact is an exchange: what the block's momentum changes by is the tool's impulse (rounding of a thousand
/// substeps), and the ledger stays closed, with 0.5 % for what a block that bounces off fixed nodes leaves
/// open too.
fn check<D: Dimension>(space: &str, law: ContactChoice) {
    let name = format!("{space}, {law:?}");
    let mut block = thrown::<D>(law);
    let momentum = |solver: &dyn Solver, axis: usize| total(&points(solver), |p| p.mass * p.velocity[axis]);
    let before = [momentum(&block, 0), momentum(&block, 1)];
    let energy = block.progress().ledger.initial_energy;
    let mut worst = 0.0_f64;
    for _ in 0..300 {
        block.step(&MOTION, false).expect("a stable step");
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
    for law in LAWS {
        check::<PlaneStrain>("plane strain", law);
        check::<ThreeDimensional>("three dimensions", law);
    }
}

/// Contact is solved on one thread in the order of memory, so spreading the rest over threads changes no bit.
#[test]
fn threads_change_nothing() {
    for law in LAWS {
        let (mut one, mut two) = (thrown::<PlaneStrain>(law), thrown::<PlaneStrain>(law));
        for _ in 0..300 {
            one.step(&MOTION, false).expect("a stable step");
            two.step(&MOTION, true).expect("a stable step");
        }
        assert!(one.progress().touches.ever, "{law:?}: the tool was never touched");
        assert_eq!(one.progress(), two.progress(), "{law:?}");
        assert!(one.state_bytes() == two.state_bytes(), "{law:?}: the states differ");
    }
}

/// Friction heat by node is what the friction work of the substep is made of: never negative, and the same
/// sum but for the rounding of some hundred terms. Asking for it changes nothing else, and without asking
/// there is none.
#[test]
fn friction_heat_adds_up_to_friction_work() {
    for law in LAWS {
        let (mut asked, mut silent) = (thrown::<PlaneStrain>(law), thrown::<PlaneStrain>(law));
        asked.wants_friction_heat = true;
        let mut before = 0.0;
        for _ in 0..300 {
            asked.step(&MOTION, false).expect("a stable step");
            silent.step(&MOTION, false).expect("a stable step");
            let heat = &asked.touched().friction_heat;
            assert!(heat.iter().all(|entry| entry.1 >= 0.0), "{law:?}: negative heat: {heat:?}");
            assert!(heat.is_sorted_by_key(|entry| entry.0), "{law:?}: nodes out of order");
            let sum: f64 = heat.iter().map(|entry| entry.1).sum();
            let work = asked.progress().ledger.friction_work - before;
            before = asked.progress().ledger.friction_work;
            assert!((sum - work).abs() <= 1e-12 * before, "{law:?}: heat {sum} J of {work} J friction work");
            assert!(silent.touched().friction_heat.is_empty(), "{law:?}: heat that nobody asked for");
        }
        assert!(before > 0.0, "{law:?}: no friction at all");
        assert_eq!(asked.progress(), silent.progress(), "{law:?}");
    }
}

/// Sweeps start from the last substep's forces, so these are part of a saved state; laws on nodes keep
/// nothing. A run that goes on from a state is the same to the bit, also through sorts.
#[test]
fn a_restored_run_is_the_same_to_the_bit() {
    for law in LAWS {
        let mut first = thrown::<PlaneStrain>(law);
        // In the middle of contact, which comes and goes as the block vibrates.
        let mut touching = 0;
        while touching < 20 {
            first.step(&MOTION, false).expect("a stable step");
            touching += usize::from(first.progress().touches.now);
            assert!(first.progress().substeps < 300, "{law:?}: the tool is hardly touched");
        }
        let mut second = thrown::<PlaneStrain>(law);
        second.restore(&first.state_bytes(), first.progress()).expect("a good state");
        assert!(first.state_bytes() == second.state_bytes(), "{law:?}: the state itself differs");
        for _ in 0..300 {
            first.step(&MOTION, false).expect("a stable step");
            second.step(&MOTION, false).expect("a stable step");
        }
        assert_eq!(first.progress(), second.progress(), "{law:?}");
        assert!(first.state_bytes() == second.state_bytes(), "{law:?}: the states differ");
    }
}

/// In plane strain the width only scales: a point is as wide in the plane, and touches as early, whatever the
/// depth that its volume is for. A power of two scales every number without rounding.
#[test]
fn twice_the_width_is_twice_the_force() {
    let run = |width: f64| {
        let mut scene = Scene::default();
        scene.workpiece.length = 1e-3;
        scene.workpiece.height = 8e-4;
        scene.workpiece.width = width;
        scene.numerics.point_spacing = 4e-5;
        let mut session = Session::new(&scene, 0.0).expect("a good scene");
        session.advance_to(2e-6, &mut |_| true).expect("a stable run");
        session.outputs().clone()
    };
    let (narrow, wide) = (run(1.0), run(0.25));
    assert!(narrow.cutting_force > 0.0, "the tool was never touched");
    assert_eq!(narrow.cutting_force, 4.0 * wide.cutting_force);
    assert_eq!(narrow.peak_strain, wide.peak_strain);
}

/// Where points have left the grid has fewer nodes after a sort; what contact noted of nodes that are gone is
/// forgotten with them.
#[test]
fn a_grid_that_shrinks_while_the_tool_touches_is_no_surprise() {
    let mut large = thrown::<PlaneStrain>(ContactChoice::Surface);
    while large.contact.cost().touching == 0 {
        large.step(&MOTION, false).expect("a stable step");
        assert!(large.progress().substeps < 300, "the tool is never touched");
    }
    let mut small = thrown_of::<PlaneStrain>(ContactChoice::Surface, [2, 2, 4]);
    small.contact = large.contact;
    small.contact.note_sort();
    small.step(&MOTION, false).expect("a stable step");
}
