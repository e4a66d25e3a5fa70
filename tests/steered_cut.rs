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

/// Without and with the speed-ups that move with the tool: ahead of it in feeds (`numerics.active_window`),
/// and above it.
const SPEEDUPS: [f64; 2] = [0.0, 3.0];

/// A tool at a negative feed stands above the surface and passes over all of the workpiece without a touch.
#[test]
fn a_tool_above_the_surface_feels_nothing() {
    for reach in SPEEDUPS {
        let mut scene = scene(4e-5, 0.2, 0.0, -1e-4);
        (scene.tool.edge_radius, scene.numerics.active_window, scene.numerics.active_chip) =
            (2e-5, reach, reach);
        let mut session = Session::new(&scene, 0.0).expect("a good scene");
        let told = session.take_warnings();
        assert!(
            told.len() == 1 && told[0].starts_with("tool.edge_radius = 20 µm holds 0.5 point"),
            "{told:?}"
        );
        assert!((session.outputs().tool_position_y - 1.1e-3).abs() < 1e-15);
        advance(&mut session, 80e-6);
        let o = session.outputs();
        // 4 mm of 3 mm.
        assert!(o.tool_position_x < 0.0, "the tool stands at {} m", o.tool_position_x);
        let felt = (o.cutting_force, o.thrust_force, o.tool_work, o.plastic_work, o.tool_lag);
        assert_eq!(felt, (0.0, 0.0, 0.0, 0.0, 0.0), "reach {reach}");
        assert_eq!((o.chip_state, o.force_error_band), (ChipState::Approaching, 1.0));
        assert_eq!(session.take_warnings(), Vec::<String>::new());
    }
}

/// A tool that goes back and is lifted by the workpiece's height carries nothing, whatever is left of the
/// chip; let down again it cuts again.
#[test]
fn a_lifted_tool_is_free_and_can_come_back() {
    for reach in SPEEDUPS {
        let mut scene = scene(4e-5, 0.2, 0.0, 3e-4);
        (scene.numerics.active_window, scene.numerics.active_chip) = (reach, reach);
        scene.tool.feed_rate_limit = 100.0;
        let mut session = cutting(&scene);
        let lifted = Inputs { tool_velocity: -10.0, feed: -1e-3, ..scene.inputs };
        session.set_inputs(lifted, NO_SLOPE).expect("good inputs");
        let too_high = Inputs { feed: -1.01e-3, ..lifted };
        let refusal = session.set_inputs(too_high, NO_SLOPE).unwrap_err().to_string();
        assert!(refusal.starts_with("feed = -0.00101 m is outside [-0.001, "), "{refusal}");
        // 1.3 mm at 100 m/s, and some communication steps more.
        advance(&mut session, 25e-6);
        advance(&mut session, 26e-6);
        let o = session.outputs();
        assert!((o.tool_position_y - 2e-3).abs() < 1e-12, "the tip stands at {} m", o.tool_position_y);
        let felt = (o.cutting_force, o.thrust_force, o.cutting_power, o.contact_length);
        assert_eq!(felt, (0.0, 0.0, 0.0, 0.0), "reach {reach}");
        assert_eq!(o.chip_state, ChipState::Left);
        assert!(o.balance_error.abs() < 0.01, "ledger {}", o.balance_error);
        let work = o.tool_work;
        let again = Inputs { tool_velocity: 20.0, feed: 2e-4, ..scene.inputs };
        session.set_inputs(again, NO_SLOPE).expect("good inputs");
        advance(&mut session, 46e-6);
        let o = session.outputs();
        assert!(o.cutting_force > 0.0 && o.tool_work > work, "no cut after the tool was let down");
        assert!(o.balance_error.abs() < 0.01, "ledger {}", o.balance_error);
    }
}

/// A jump of the feed is not followed at once: the output tells how far the tool lags, and it is said once.
#[test]
fn a_lag_behind_the_feed_is_told() {
    let mut scene = scene(4e-5, 0.2, 0.0, 3e-4);
    scene.tool.feed_rate_limit = 10.0;
    let mut session = cutting(&scene);
    assert_eq!(session.outputs().tool_lag, 0.0);
    // Less than a spacing is not worth a word.
    session.set_inputs(Inputs { feed: 3.3e-4, ..scene.inputs }, NO_SLOPE).expect("good inputs");
    advance(&mut session, 14e-6);
    assert_eq!(session.take_warnings(), Vec::<String>::new());
    session.set_inputs(Inputs { feed: 0.0, ..scene.inputs }, NO_SLOPE).expect("good inputs");
    for k in 1..=4 {
        advance(&mut session, f64::from(14 + k) * STEP);
        let o = session.outputs();
        let lag = (1e-3 - 0.0) - o.tool_position_y;
        assert!((o.tool_lag + lag).abs() < 1e-15, "lag {} m, the tip is {lag} m too low", o.tool_lag);
        // 10 m/s, less than a substep ahead or behind.
        let expected = -(3.3e-4 - 1e-5 * f64::from(k));
        assert!((o.tool_lag - expected).abs() < 20.0 * o.time_step, "{} m against {expected}", o.tool_lag);
        let told = session.take_warnings();
        assert_eq!(told.len(), usize::from(k == 1), "{told:?}");
        assert!(told.iter().all(|text| text.contains("tool.feed_rate_limit = 10 m/s")), "{told:?}");
    }
}

/// Where the left side is held the tool stops one feed before it, says so, and the run goes on with a tool at
/// rest: no force rises beyond what it was two feeds before. It can go back.
#[test]
fn the_tool_stops_before_a_held_side() {
    for rake in [0.0, -20.0] {
        let mut scene = scene(4e-5, 0.2, rake, 3e-4);
        scene.workpiece.length = 1e-3;
        let mut session = Session::new(&scene, 0.0).expect("a good scene");
        let mut told = Vec::new();
        for k in 1..=30 {
            advance(&mut session, f64::from(k) * STEP);
            told.extend(session.take_warnings());
        }
        assert_eq!(told.len(), 2, "{told:?}");
        assert!(told[0].contains("less than 2 feeds are left"), "{told:?}");
        assert!(
            told[1].contains("stopped 1 feed before the workpiece's left side, which is held"),
            "{told:?}"
        );
        let o = session.outputs().clone();
        // A face that leans forward is foremost at the surface.
        let foremost = o.tool_position_x + 3e-4 * rake.to_radians().tan().min(0.0);
        let slack = SPEED * o.time_step;
        assert!((foremost - 3e-4).abs() < 2.0 * slack, "rake {rake}: the tool stopped {foremost} m before");
        assert_eq!((o.chip_state, o.cutting_power), (ChipState::Cutting, 0.0), "rake {rake}");
        assert!(o.balance_error.abs() < 0.01 && o.min_jacobian > 0.3, "ledger {}", o.balance_error);
        // Neither further nor deeper, but back.
        let deeper = Inputs { feed: 4e-4, ..scene.inputs };
        session.set_inputs(deeper, NO_SLOPE).expect("good inputs");
        advance(&mut session, 32e-6);
        let now = session.outputs();
        let place = (now.tool_position_x, now.tool_position_y);
        assert_eq!(place, (o.tool_position_x, o.tool_position_y));
        let told = session.take_warnings();
        assert!(told.len() == 1 && told[0].contains("the tool lags"), "{told:?}");
        session.set_inputs(Inputs { tool_velocity: -SPEED, ..scene.inputs }, NO_SLOPE).expect("good inputs");
        advance(&mut session, 36e-6);
        let back = session.outputs().tool_position_x - place.0;
        assert!((back - 4.0 * SPEED * STEP).abs() < 2.0 * slack, "the tool went back by {back} m");
        assert_eq!(session.take_warnings().len(), 0, "said once");
    }
}

/// A state that is restored says nothing twice.
#[test]
fn a_restored_run_does_not_repeat_its_warnings() {
    let mut scene = scene(4e-5, 0.2, 0.0, 3e-4);
    scene.workpiece.length = 1e-3;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    advance(&mut session, 10e-6);
    assert_eq!(session.take_warnings().len(), 1);
    let mut again = Session::restore(&session.save()).expect("a good state");
    advance(&mut again, 12e-6);
    assert_eq!(again.take_warnings(), Vec::<String>::new());
}

/// Where the left side is free the tool leaves there: it pushes the last of the workpiece out, and carries
/// nothing then.
#[test]
fn the_tool_leaves_at_a_free_side() {
    for reach in SPEEDUPS {
        let mut scene = scene(4e-5, 0.2, 0.0, 3e-4);
        (scene.workpiece.length, scene.workpiece.held_side) = (1e-3, false);
        (scene.numerics.active_window, scene.numerics.active_chip) = (reach, reach);
        let mut session = Session::new(&scene, 0.0).expect("a good scene");
        for k in 1..=60 {
            advance(&mut session, f64::from(k) * STEP);
            let error = session.outputs().balance_error;
            assert!(error.abs() < 0.01, "{k} µs: ledger {error}");
        }
        let o = session.outputs();
        assert!(o.tool_position_x < -1.9e-3, "the tool stands at {} m", o.tool_position_x);
        assert_eq!((o.cutting_force, o.thrust_force), (0.0, 0.0), "reach {reach}");
        assert_eq!(o.chip_state, ChipState::Left);
        assert_eq!(session.take_warnings(), Vec::<String>::new());
        // What stood to the left of the workpiece has moved there: a burr, or a piece that flies.
        let fields = session.point_fields();
        let leftmost = fields.position.iter().map(|position| position[0]).fold(f64::MAX, f64::min);
        assert!(leftmost < 0.0, "no point left the left side: {leftmost} m");
    }
}
