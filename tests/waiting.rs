//! Waiting costs nothing: substeps in which nothing can happen pass without a look at a point, and leave the
//! state that they would have left.

mod common;

use common::{Lattice, NO_MOTION, steel_4340};
use swarf::dimension::PlaneStrain;
use swarf::grid::shape_function::Gimp;
use swarf::scene::{Heat, Inputs, Scene};
use swarf::session::{Advance, Session};
use swarf::simulation::{Solver, ToolMotion};
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

/// A block of 12 x 8 cells of 20 µm, a tool `gap` (m) beside it.
fn block(gap: f64) -> Box<dyn Solver> {
    let lattice = Lattice {
        domain: [80, 40, 1],
        corner: [20, 10, 0],
        cells: [12, 8, 1],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    let shape = ToolShape::new(0.0, 0.0873, 0.0, 5e-4, 1e-3).expect("a plain wedge");
    let tool = RigidTool { shape, position: [12.0 * 2e-5 + gap, 8e-5], velocity: [0.0; 2], friction: 0.2 };
    Box::new(lattice.build::<PlaneStrain, _>(&steel_4340(), Gimp::new(2), tool, |_, _, _| [0.0; 3]))
}

/// A substep that passes is the substep itself: clock, tool, totals and every point, bit by bit, from far off
/// until the tool has cut in.
#[test]
fn a_substep_that_passes_leaves_what_the_substep_leaves() {
    let (mut passing, mut stepping) = (block(4e-4), block(4e-4));
    let mut passed = 0;
    for substep in 0..6000 {
        // Rest, an approach, rest a little nearer, the cut.
        let speed = if substep % 1500 < 500 { 0.0 } else { 80.0 };
        let motion = ToolMotion { velocity: [-speed, 0.0], friction: 0.2 };
        if passing.pass(&motion) {
            passed += 1;
        } else {
            passing.step(&motion, false).expect("a stable run");
        }
        stepping.step(&motion, false).expect("a stable run");
        assert!(passing.progress() == stepping.progress(), "substep {substep}: {:?}", passing.progress());
        if substep % 500 == 499 {
            assert!(passing.state_bytes() == stepping.state_bytes(), "points after substep {substep}");
        }
    }
    assert!(passing.progress().touches.ever, "the tool has not come near");
    assert!(passed > 500, "{passed} substeps passed");
}

/// A tool at rest within a cell of the block is found harmless by one substep; then time passes.
#[test]
fn a_tool_at_rest_beside_the_block_waits() {
    let mut solver = block(1e-6);
    let mut full = 0;
    for _ in 0..1000 {
        if !solver.pass(&NO_MOTION) {
            solver.step(&NO_MOTION, false).expect("a stable run");
            full += 1;
        }
    }
    assert_eq!(full, 1, "substeps in full");
}

/// A block that moves or is stressed is never passed over.
#[test]
fn what_moves_does_not_wait() {
    let lattice = Lattice {
        domain: [80, 40, 1],
        corner: [20, 10, 0],
        cells: [12, 8, 1],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    let mut simulation =
        lattice.build::<PlaneStrain, _>(&steel_4340(), Gimp::new(2), common::distant_tool(), |_, _, _| {
            [1e-3, 0.0, 0.0]
        });
    for _ in 0..10 {
        assert!(!simulation.pass(&NO_MOTION));
        simulation.step(&NO_MOTION, false).expect("a stable run");
    }
}

fn scene(heat: Heat) -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = 5e-5;
    scene.numerics.threads = 1;
    scene.effects.heat = heat;
    scene.inputs = Inputs { tool_velocity: 0.0, ..scene.inputs };
    scene
}

fn advance(session: &mut Session, time: f64) {
    let advance = session.advance_to(time, &mut |_| true).expect("a stable run");
    assert_eq!(advance, Advance::Reached);
}

/// The tool rests for 0.2 ms, then cuts: nearly every substep of the wait costs nothing, and how the wait is
/// cut into communication steps, or whether it is interrupted by a saved state, is not seen in the state.
#[test]
fn a_wait_is_the_same_however_it_is_cut_and_costs_nothing() {
    for heat in [Heat::Adiabatic, Heat::Conduction] {
        let wait = 2e-4;
        let run = |steps: i32, saves: bool| {
            let mut session = Session::new(&scene(heat), 0.0).expect("a good scene");
            for k in 1..=steps {
                advance(&mut session, wait * (f64::from(k) / f64::from(steps)));
                if saves {
                    session = Session::restore(&session.save()).expect("own bytes");
                }
            }
            let passed = session.passed_substeps();
            let inputs = Inputs { tool_velocity: 50.0, ..session.scene().inputs };
            let none = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };
            session.set_inputs(inputs, none).expect("good inputs");
            advance(&mut session, wait + 3e-6);
            (session, passed)
        };
        let (one, passed) = run(1, false);
        assert!(one.outputs().cutting_force > 100.0, "the tool does not cut: {:?}", one.outputs());
        assert!(passed > 1000, "{passed} substeps passed");
        for (steps, saves) in [(7, false), (50, false), (5, true)] {
            let other = run(steps, saves).0;
            // The inputs' last change and the communication points are the same.
            assert_eq!(one.outputs(), other.outputs(), "{steps} steps, {heat:?}");
            assert!(one.save() == other.save(), "state after {steps} steps, {heat:?}");
        }
    }
}
