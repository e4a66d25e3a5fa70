//! Where a cut ends: before a held side, out at a free one, and by lifting the tool.

use swarf::scene::{Inputs, Scene};
use swarf::session::{Advance, Session};
use swarf::variables::ChipState;

const NONE: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// A short workpiece, 40 x 20 cells, 100 m/s.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.workpiece.length = 1.6e-3;
    scene.workpiece.height = 8e-4;
    scene.inputs.feed = 2e-4;
    scene.inputs.tool_velocity = 100.0;
    scene.numerics.point_spacing = 2e-5;
    scene.numerics.threads = 1;
    scene
}

fn advance(session: &mut Session, time: f64) {
    let advance = session.advance_to(time, &mut |_| true).expect("a stable run");
    assert_eq!(advance, Advance::Reached);
}

/// A tool that is driven against the held side stops one feed before it: the forces stay those of a cut
/// instead of growing without bound, the ledger closes, and each thing is said once. Without that the run
/// ended in an error.
#[test]
fn a_tool_stops_one_feed_before_the_held_side() {
    let scene = scene();
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    let (mut said, mut largest) = (Vec::new(), 0.0_f64);
    // 2.5 mm of travel, if nothing stopped it.
    for k in 1..=25 {
        advance(&mut session, 1e-6 * f64::from(k));
        largest = largest.max(session.outputs().cutting_force);
        said.extend(session.take_warnings());
    }
    let outputs = session.outputs();
    println!("stands at {} m, largest force {largest} N, {said:#?}", outputs.tool_position_x);
    let left = outputs.tool_position_x / scene.inputs.feed;
    // It stops in the first substep below one feed; a substep is some 0.1 µm of travel.
    assert!((0.99..1.0).contains(&left), "{left} feeds are left");
    // The shear plane's force at this feed is about 350 N; one feed before the wall it is half as much again.
    assert!(largest < 1000.0, "{largest} N on the way");
    assert!(outputs.balance_error.abs() < 0.01, "ledger {}", outputs.balance_error);
    assert_eq!(said.len(), 2, "said: {said:#?}");
    assert!(said[0].contains("less than 2 feeds") && said[1].contains("held_side"), "{said:#?}");
    // It can go back.
    session.set_inputs(Inputs { tool_velocity: -100.0, ..scene.inputs }, NONE).expect("good inputs");
    advance(&mut session, 2.6e-5);
    assert!(session.outputs().tool_position_x > scene.inputs.feed, "the tool is stuck");
}

/// Where the side is free the tool leaves the workpiece there, and then nothing acts on it.
#[test]
fn a_tool_leaves_at_a_free_side() {
    let mut scene = scene();
    scene.workpiece.held_side = false;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    advance(&mut session, 1.2e-5);
    assert_eq!(session.outputs().chip_state, ChipState::Cutting);
    advance(&mut session, 2.6e-5);
    advance(&mut session, 2.7e-5);
    let outputs = session.outputs();
    assert!(outputs.tool_position_x < -5e-4, "the tool stands at {} m", outputs.tool_position_x);
    assert_eq!(outputs.chip_state, ChipState::Left, "{} N", outputs.cutting_force);
    assert_eq!(outputs.cutting_force, 0.0);
    assert!(outputs.balance_error.abs() < 0.01, "ledger {}", outputs.balance_error);
    assert!(session.take_warnings().is_empty());
}

/// A feed below zero lifts the tool clear of the surface, as fast as it may: no force is left, where a feed
/// of zero leaves the tool rubbing on what stands up. The tool's lag is told until it is there.
#[test]
fn a_lifted_tool_feels_nothing() {
    let mut scene = scene();
    scene.tool.feed_rate_limit = 200.0;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    advance(&mut session, 6e-6);
    assert!(session.outputs().cutting_force > 100.0, "{} N", session.outputs().cutting_force);
    assert_eq!(session.outputs().tool_lag, 0.0);
    // Back out of the cut, and up.
    let up = Inputs { tool_velocity: -50.0, feed: -3e-4, friction: 0.2 };
    session.set_inputs(up, NONE).expect("a feed that lifts the tool");
    advance(&mut session, 6.5e-6);
    let lag = session.outputs().tool_lag;
    assert!((-5e-4..-3e-4).contains(&lag), "the tool lags by {lag} m");
    assert_eq!(session.take_warnings().len(), 1);
    advance(&mut session, 1.2e-5);
    advance(&mut session, 1.3e-5);
    let outputs = session.outputs();
    assert_eq!((outputs.cutting_force, outputs.thrust_force), (0.0, 0.0));
    assert!(outputs.tool_lag.abs() < 1e-9, "the tool lags by {} m", outputs.tool_lag);
    assert!((outputs.tool_position_y - 1.1e-3).abs() < 1e-9, "the edge is at {} m", outputs.tool_position_y);
    assert_eq!(outputs.chip_state, ChipState::Left);
    assert!(outputs.balance_error.abs() < 0.01, "ledger {}", outputs.balance_error);
    let error =
        session.check_inputs(&Inputs { feed: -8.1e-4, ..up }).expect_err("higher than the workpiece is high");
    assert!(error.to_string().contains("feed"), "{error}");
}
