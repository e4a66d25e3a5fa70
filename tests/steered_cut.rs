//! Inputs that change during a cut: feed at its limited rate and along a ramp, friction switched on, the tool
//! reversed.

use swarf::scene::{Inputs, Scene};
use swarf::session::Session;
use swarf::variables::ChipState;

mod cut;
use cut::{SPEED, STEP, advance, scene};

/// Inputs that stay as they are.
const NO_SLOPE: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// A session in the middle of a cut, at 10 µs.
fn cutting(scene: &Scene) -> Session {
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    advance(&mut session, 10e-6);
    session
}

/// A jump of the feed moves the tool at `tool.feed_rate_limit`, over as many communication steps as that
/// takes, and stops at the new feed. Rounding of some thousand substeps, and one substep's way at the end.
#[test]
fn a_jump_of_the_feed_is_limited_in_rate() {
    let mut scene = scene(2e-5, 0.0, 0.0, 3e-4);
    scene.tool.feed_rate_limit = 10.0;
    let mut session = cutting(&scene);
    let start = session.outputs().tool_position_y;
    assert!((start - 0.7e-3).abs() < 1e-12, "the tip stands at {start} m");
    session.set_inputs(Inputs { feed: 3.25e-4, ..scene.inputs }, NO_SLOPE).expect("good inputs");
    for k in 1..=5 {
        advance(&mut session, f64::from(10 + k) * STEP);
        let o = session.outputs();
        let way = start - o.tool_position_y;
        let expected = (10.0 * f64::from(k) * STEP).min(2.5e-5);
        // The tool stands where the solver's clock is: less than a substep ahead.
        let slack = 2.0 * 10.0 * o.time_step;
        assert!(
            (way - expected).abs() <= slack,
            "after {k} µs the tool moved {way} m instead of {expected} m"
        );
    }
    let rest = session.outputs().tool_position_y - (1e-3 - 3.25e-4);
    assert!(rest.abs() < 1e-12, "the tool stopped {rest} m from the new feed");
}

/// With an input derivative the tool follows the ramp exactly, however steep: at its own clock the tip is
/// where the input is. Rounding of the sum over some hundred substeps.
#[test]
fn a_ramp_of_the_feed_is_followed_exactly() {
    let scene = scene(2e-5, 0.0, 0.0, 3e-4);
    let mut session = cutting(&scene);
    // Steeper than the limit of 10 m/s, and of the velocity at the same time.
    for (k, slope) in [(0, 15.0), (1, -15.0), (2, 4.0)] {
        let feed = 1e-3 - session.outputs().tool_position_y;
        let x = session.outputs().tool_position_x;
        // The tool stands at the solver's clock, which runs ahead of the communication point: the input
        // counts there.
        let (begin, clock) = (session.time(), session.point_fields().time);
        let feed_now = feed - slope * (clock - begin);
        let inputs = Inputs { feed: feed_now, ..scene.inputs };
        let slopes = Inputs { tool_velocity: 2e6, feed: slope, friction: 0.0 };
        session.set_inputs(inputs, slopes).expect("good inputs");
        advance(&mut session, f64::from(11 + k) * STEP);
        let (o, end) = (session.outputs(), session.point_fields().time);
        let (down, expected) = (1e-3 - o.tool_position_y - feed, slope * (end - clock));
        assert!(
            (down - expected).abs() < 1e-12,
            "slope {slope} m/s: the tip went {down} m down instead of {expected} m"
        );
        // The speed is that at the start of each substep: half a substep's acceleration less than the
        // integral.
        let (a, b) = (clock - begin, end - begin);
        let way = SPEED * (end - clock) + 1e6 * (b * b - a * a);
        let lag = 1e6 * o.time_step * (end - clock);
        let moved = x - o.tool_position_x;
        assert!(
            (moved - way + lag).abs() < 0.1 * lag,
            "the tool went {moved} m instead of {way} m less {lag} m"
        );
    }
}

/// Friction may change at any communication point: the force goes over to the one with friction, and friction
/// work starts.
#[test]
fn friction_can_be_switched_on_the_way() {
    let scene = scene(2e-5, 0.0, 0.0, 3e-4);
    let mut session = cutting(&scene);
    let (friction, work) = (session.outputs().friction_work, session.outputs().tool_work);
    assert!(friction.abs() < 1e-12 * work, "friction work {friction} J without friction, of {work} J");
    let mut thrust = [0.0; 2];
    for (phase, friction) in [0.0, 0.2].into_iter().enumerate() {
        session.set_inputs(Inputs { friction, ..scene.inputs }, NO_SLOPE).expect("good inputs");
        for _ in 0..10 {
            let next = session.time() + STEP;
            advance(&mut session, next);
            thrust[phase] += session.outputs().thrust_force / session.outputs().cutting_force / 10.0;
            let error = session.outputs().balance_error;
            assert!(error.abs() < 0.01, "{} s: ledger {error}", session.time());
        }
    }
    println!("thrust over cutting {:.3} before and {:.3} after friction 0.2", thrust[0], thrust[1]);
    assert!(session.outputs().friction_work > 0.0, "no friction work");
    // 0 and 0.2, each within the 0.04 and a little for the transition.
    assert!(thrust[0].abs() < 0.04 && (thrust[1] - 0.2).abs() < 0.06, "thrust over cutting: {thrust:?}");
}

/// A tool that goes back loses the chip at once; its flank rubs over the surface, which has sprung back above
/// its tip, until it has left where it came in. Every force on the way is against the motion.
#[test]
fn a_reversed_tool_leaves_the_workpiece() {
    let scene = scene(2e-5, 0.2, 0.0, 3e-4);
    let mut session = cutting(&scene);
    let mut work = session.outputs().tool_work;
    session.set_inputs(Inputs { tool_velocity: -SPEED, ..scene.inputs }, NO_SLOPE).expect("good inputs");
    for k in 11..=24 {
        advance(&mut session, f64::from(k) * STEP);
        let o = session.outputs();
        println!(
            "{k} µs: force {:.1}, thrust {:.1} N, state {:?}",
            o.cutting_force, o.thrust_force, o.chip_state
        );
        // In the first step the workpiece springs back with the tool and may return elastic energy.
        assert!(k == 11 || o.tool_work >= work, "{k} µs: tool work fell from {work} to {} J", o.tool_work);
        assert!(k < 13 || o.contact_length == 0.0, "{k} µs: {} m of rake face in contact", o.contact_length);
        assert!(o.balance_error.abs() < 0.01, "{k} µs: ledger {}", o.balance_error);
        work = o.tool_work;
    }
    // Retraced after 20 µs; what has been pushed out at the right side takes a little longer.
    let free = session.outputs().clone();
    assert_eq!(free.chip_state, ChipState::Left, "chip.state of a tool that has left");
    advance(&mut session, 25e-6);
    let o = session.outputs();
    assert_eq!(
        (o.cutting_force, o.thrust_force, o.contact_length),
        (0.0, 0.0, 0.0),
        "force on a tool in air"
    );
    assert_eq!((o.cut_length, o.tool_work), (free.cut_length, free.tool_work), "a tool in air cuts");
}
