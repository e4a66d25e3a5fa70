//! The cut itself: forces against the shear plane of least work, friction, feed, and what must never happen on the way.
//!
//! Most cuts run at spacing 2e-5 (7,500 points), in seconds; where that is too coarse for the bounds (the
//! effect of friction and feed on the force, 1.29 and 1.53 there) three run at the 30,000 points of the reference.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, OnceLock};
use swarf::fields::{Outputs, PointFields};
use swarf::scene::{Inputs, Scene, Speed};
use swarf::session::{Advance, Session};

/// Speed of the tool (m/s) and communication step (s): 0.05 mm of travel.
const SPEED: f64 = 50.0;
const STEP: f64 = 1e-6;
const NO_SLOPE: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// The reference cut at another spacing (m).
fn scene(spacing: f64, friction: f64, rake_degrees: f64, feed: f64) -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = spacing;
    scene.numerics.threads = 1;
    scene.inputs = Inputs { tool_velocity: SPEED, feed, friction };
    scene.tool.rake_angle = rake_degrees.to_radians();
    scene
}

fn advance(session: &mut Session, time: f64) {
    let advance = session.advance_to(time, &mut |_| true).expect("a stable run");
    assert_eq!(advance, Advance::Reached);
}

/// Forces of a finished cut (N per mm of width), means over 1.0 to 1.6 mm of travel.
#[derive(Clone, Copy, Debug)]
struct Forces {
    cutting: f64,
    thrust: f64,
    /// Contrast of the chip's shear bands (-), see `band_contrast`.
    bands: f64,
    /// Mean plastic strain of the chip (-) and its mean rise of temperature (K) at the end.
    strain: f64,
    rise: f64,
}

/// Cuts 1.6 mm and checks at every communication point what must hold in any cut.
fn cut(scene: &Scene) -> Forces {
    let name = format!(
        "spacing {} µm, friction {}, rake {:.0}°, feed {} mm",
        1e6 * scene.numerics.point_spacing,
        scene.inputs.friction,
        scene.tool.rake_angle.to_degrees(),
        1e3 * scene.inputs.feed
    );
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    let start = session.point_fields();
    let count = start.id.len();
    let (mut impulse, mut worst_balance, mut worst_pressure, mut smallest) =
        ([0.0; 2], 0.0_f64, 0.0_f64, 1.0_f64);
    let mut outside = 0;
    for k in 1..=32 {
        advance(&mut session, f64::from(k) * STEP);
        let o = session.outputs();
        let is_exact = scene.numerics.speed == Speed::Exact;
        check_outputs(o, count, is_exact, k, &name);
        worst_balance = worst_balance.max(o.balance_error.abs());
        smallest = smallest.min(o.min_jacobian);
        let (far, pressure) = check_points(&session, k, &name);
        outside = outside.max(far);
        worst_pressure = worst_pressure.max(pressure);
        if k > 20 {
            impulse[0] += o.cutting_force * STEP;
            impulse[1] += o.thrust_force * STEP;
        }
    }
    let [cutting, thrust] = impulse.map(|sum| sum / (12.0 * STEP) / (1e3 * scene.workpiece.width));
    let o = session.outputs();
    println!(
        "{name}: cutting {cutting:.1}, thrust {thrust:.1} N/mm, ratio {:.4}; ledger {:.2} %, J ≥ {smallest:.3}, {outside} of {count} \
         outside 0.7–1.3, pressure ≤ {:.1} GPa, chip {:.0} K, {:.2} mm thick, peak strain {:.1}, 99.9 % {:.2}",
        thrust / cutting,
        1e2 * worst_balance,
        1e-9 * worst_pressure,
        o.chip_temperature,
        1e3 * o.chip_thickness,
        o.peak_strain,
        o.peak_strain_p999
    );
    assert_eq!(o.chip_state, 3, "{name}: the tool is not cutting");
    let end = session.point_fields();
    let bands = band_contrast(scene, &start, &end);
    let is_chip = |strain: f64, y: f64| strain > 0.05 && y > o.tool_position_y;
    let chip: Vec<f64> = (end.plastic_strain.iter().zip(&end.position))
        .filter_map(|(&strain, position)| is_chip(strain, position[1]).then_some(strain))
        .collect();
    let strain = chip.iter().sum::<f64>() / chip.len() as f64;
    let rise = o.chip_temperature - scene.workpiece.initial_temperature;
    println!("{name}: mean strain of the chip {strain:.4}, rise of temperature {rise:.1} K");
    println!("{name}: contrast of the shear bands {bands:.3}");
    Forces { cutting, thrust, bands, strain, rise }
}

/// Contrast of the chip's shear bands: rms of the plastic strain along a fibre of the chip, less its moving mean over
/// 0.24 mm, over its mean (-).
///
/// The fibre stood 0.10 to 0.14 mm above the cutting plane and 0.3 to 1.25 mm from the right side before the cut.
fn band_contrast(scene: &Scene, start: &PointFields, end: &PointFields) -> f64 {
    let spacing = scene.numerics.point_spacing;
    let plane = scene.workpiece.height - scene.inputs.feed;
    let mut bins: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    for (position, strain) in start.position.iter().zip(&end.plastic_strain) {
        let (along, above) = (scene.workpiece.length - position[0], position[1] - plane);
        if (1.0e-4..1.4e-4).contains(&above) && (3e-4..12.5e-4).contains(&along) {
            let bin = bins.entry((along / spacing) as i64).or_default();
            *bin = (bin.0 + strain, bin.1 + 1.0);
        }
    }
    let strain: Vec<f64> = bins.values().map(|(sum, count)| sum / count).collect();
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let window = 2 * (1.2e-4 / spacing) as usize + 1;
    let squares: Vec<f64> =
        strain.windows(window).map(|part| (part[window / 2] - mean(part)).powi(2)).collect();
    mean(&squares).sqrt() / mean(&strain)
}

/// What holds at every communication point, by the acceptance.
fn check_outputs(o: &Outputs, count: usize, is_exact: bool, k: i32, name: &str) {
    assert!(
        o.balance_error.abs() < 0.01,
        "{name}, {k} µs: {} of the tool's work is unaccounted for",
        o.balance_error
    );
    assert!(o.min_jacobian > 0.3, "{name}, {k} µs: a volume ratio of {}", o.min_jacobian);
    // A level's window leaves points at rest.
    let active = o.active_points as usize;
    let all_there = if is_exact { active == count } else { active < count };
    assert!(all_there && o.retired_points == 0, "{name}, {k} µs: {active} of {count} points move");
    // Forces, chip and energies are numbers and have the sign they must have.
    for (what, value) in [
        ("tool work", o.tool_work),
        ("kinetic", o.kinetic_energy),
        ("elastic", o.elastic_energy),
        ("plastic", o.plastic_work),
        ("friction", o.friction_work),
        ("heat", o.thermal_energy),
    ] {
        // Without friction its work is the rounding of a product of perpendicular vectors.
        assert!(value >= -1e-12 * o.tool_work, "{name}, {k} µs: {what} = {value} J");
    }
    assert!(o.cutting_force >= 0.0, "{name}, {k} µs: cutting force {} N", o.cutting_force);
    // Nine tenths of the plastic work is stored as heat, and nothing else heats.
    let heat = 0.9 * o.plastic_work;
    // In single precision a substep's rise of some 1e-2 K is rounded to 3e-5 K, up and down.
    let rounding = if is_exact { 1e-9 } else { 1e-4 };
    assert!(
        (o.thermal_energy - heat).abs() <= rounding * heat,
        "{name}, {k} µs: heat {} J of {heat} J",
        o.thermal_energy
    );
    // The tool's force works over its way.
    assert!(
        (o.cutting_power - o.cutting_force * SPEED).abs() <= 1e-6 * o.cutting_power.abs(),
        "{name}: {} W",
        o.cutting_power
    );
}

/// Checks the points; returns how many have a volume ratio outside 0.7–1.3, and the largest pressure (Pa).
fn check_points(session: &Session, k: i32, name: &str) -> (usize, f64) {
    let f = session.point_fields();
    let outside = f.jacobian.iter().filter(|&&j| !(0.7..=1.3).contains(&j)).count();
    // 99.99 % within: of 7,500 points at most one may lie outside (0.75 rounded up).
    let allowed = (1e-4 * f.jacobian.len() as f64).ceil() as usize;
    assert!(outside <= allowed, "{name}, {k} µs: {outside} volume ratios outside 0.7–1.3, {allowed} allowed");
    let pressures = f.stress.iter().map(|s| ((s[0] + s[1] + s[2]) / 3.0).abs());
    let pressure = pressures.fold(0.0, f64::max);
    // 10 GPa is the acceptance.
    assert!(pressure < 10e9, "{name}, {k} µs: a pressure of {pressure} Pa");
    let finite = |x: &[f64; 3]| x.iter().all(|x| x.is_finite());
    assert!(f.position.iter().all(finite) && f.velocity.iter().all(finite), "{name}, {k} µs: not a number");
    assert!(
        f.temperature.iter().all(|t| (298.0..1573.16).contains(t)),
        "{name}, {k} µs: a temperature beyond melting"
    );
    (outside, pressure)
}

/// Spacings of 7,500 and 30,000 points (m).
const COARSE: f64 = 2e-5;
const REFERENCE: f64 = 1e-5;

/// The forces of a cut; each runs once for all tests, and two tests may run different cuts at a time.
fn forces(spacing: f64, friction: f64, rake_degrees: f64, feed: f64) -> Forces {
    type Cuts = Mutex<HashMap<String, &'static OnceLock<Forces>>>;
    static CUTS: OnceLock<Cuts> = OnceLock::new();
    let key = format!("{spacing} {friction} {rake_degrees} {feed}");
    let cell = *CUTS
        .get_or_init(Cuts::default)
        .lock()
        .expect("no panic while it is held")
        .entry(key)
        .or_insert_with(|| Box::leak(Box::default()));
    *cell.get_or_init(|| {
        let mut scene = scene(spacing, friction, rake_degrees, feed);
        // The tests run side by side; threads that wait for each other would only slow them down.
        scene.numerics.threads = 1;
        cut(&scene)
    })
}

/// Cutting force (N/mm) of the minimum-work shear plane, tests/data/cutting_single_plane_JC.csv.
fn shear_plane(friction: f64, rake_degrees: f64, feed: f64) -> f64 {
    let text = include_str!("data/cutting_single_plane_JC.csv");
    let rows = text
        .lines()
        .skip(1)
        .map(|line| -> Vec<f64> { line.split(',').map(|x| x.parse().expect("a number")).collect() });
    let same = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let row =
        rows.into_iter().find(|r| same(r[0], 1e3 * feed) && same(r[1], friction) && same(r[2], rake_degrees));
    row.expect("a row of the reference")[10]
}

/// The shear plane of least work leaves out what bends the chip, accelerates it and makes bands, so it lies below a cut.
/// How far depends on the spacing: 1.15 to 1.20 of it were seen at 30,000 points (README), 1.28 to 1.38 at 7,500, where a
/// shear band is as wide as the cells.
#[test]
fn cutting_force_lies_above_the_shear_plane_of_least_work() {
    for (friction, rake) in [(0.0, 0.0), (0.0, 10.0), (0.2, 0.0), (0.2, 10.0)] {
        let (force, plane) =
            (forces(COARSE, friction, rake, 3e-4).cutting, shear_plane(friction, rake, 3e-4));
        println!(
            "friction {friction}, rake {rake}: {force:.1} N/mm, {:.3} of the shear plane",
            force / plane
        );
        let share = force / plane;
        assert!(
            (1.05..1.5).contains(&share),
            "friction {friction}, rake {rake}: {force} N/mm, shear plane {plane}"
        );
    }
    for (friction, feed) in [(0.0, 3e-4), (0.2, 3e-4), (0.0, 5e-4)] {
        let (force, plane) =
            (forces(REFERENCE, friction, 0.0, feed).cutting, shear_plane(friction, 0.0, feed));
        let share = force / plane;
        println!(
            "30,000 points, friction {friction}, feed {feed} m: {force:.1} N/mm, {share:.3} of the shear plane"
        );
        assert!(
            (1.05..1.3).contains(&share),
            "friction {friction}, feed {feed} m: {force} N/mm, shear plane {plane}"
        );
    }
}

/// All force on the tool comes from its rake face (sharp tool, clearance), so its direction is that of the normal turned by
/// the friction angle: thrust / cutting = tan(atan μ − γ). ±0.04 is the acceptance.
#[test]
fn the_force_is_inclined_by_friction_angle_less_rake() {
    for (friction, rake) in [(0.0_f64, 0.0_f64), (0.0, 10.0), (0.2, 0.0), (0.2, 10.0)] {
        let Forces { cutting, thrust, .. } = forces(COARSE, friction, rake, 3e-4);
        let (ratio, exact) = (thrust / cutting, (friction.atan() - rake.to_radians()).tan());
        println!("friction {friction}, rake {rake}: thrust over cutting {ratio:.4}, exact {exact:.4}");
        assert!((ratio - exact).abs() < 0.04, "friction {friction}, rake {rake}: {ratio} instead of {exact}");
    }
}

/// Friction on the rake face adds its own work and thickens the chip; 12 to 22 % for 0.2 is the acceptance;
/// the shear plane gives 21.5 %.
#[test]
fn friction_raises_the_cutting_force() {
    let ratio = forces(REFERENCE, 0.2, 0.0, 3e-4).cutting / forces(REFERENCE, 0.0, 0.0, 3e-4).cutting;
    println!("friction 0.2 over 0: {ratio:.4}");
    assert!((1.12..1.22).contains(&ratio), "friction 0.2 raises the force by a factor of {ratio}");
}

/// Almost in proportion to the feed (5/3), a little less because a deeper cut strains more slowly; 1.55 to 1.72 is the
/// issue's acceptance.
#[test]
fn cutting_force_grows_with_the_feed() {
    let ratio = forces(REFERENCE, 0.0, 0.0, 5e-4).cutting / forces(REFERENCE, 0.0, 0.0, 3e-4).cutting;
    println!("feed 0.5 over 0.3 mm: {ratio:.4}");
    assert!((1.55..1.72).contains(&ratio), "feed 0.5 mm over 0.3 mm: {ratio}");
}

/// The reference at its own 30,000 points: 470 to 540 N/mm is the acceptance.
#[test]
fn the_reference_cut_takes_470_to_540_newtons_per_millimetre() {
    let Forces { cutting, thrust, .. } = forces(REFERENCE, 0.0, 0.0, 3e-4);
    assert!((470.0..540.0).contains(&cutting), "cutting force {cutting} N/mm, thrust {thrust}");
}

/// Friction brings adiabatic shear bands into the reference chip: plastic strain rises and falls along it by a tenth. A
/// scheme that dissipates too much smooths them away: a locking control that evened out every difference left 0.03.
#[test]
fn the_reference_chip_has_shear_bands() {
    let bands = forces(REFERENCE, 0.2, 0.0, 3e-4).bands;
    assert!(bands > 0.06, "contrast of the shear bands {bands}");
}

/// The bounds of the levels are the issue's: 0.5 % of the force, 3 % of the thrust or 1 % of the force, 1 % of mean strain and
/// temperature for `balanced`; 2 % and 6 % for `fast`, here with 2 % for the means.
#[test]
fn levels_keep_what_they_promise() {
    let exact = forces(REFERENCE, 0.2, 0.0, 3e-4);
    for (speed, [force, thrust, mean]) in
        [(Speed::Balanced, [0.005, 0.03, 0.01]), (Speed::Fast, [0.02, 0.06, 0.02])]
    {
        let mut scene = scene(REFERENCE, 0.2, 0.0, 3e-4);
        scene.numerics.speed = speed;
        let level = cut(&scene);
        println!("{speed:?}: {level:?}, exact {exact:?}");
        let change = |a: f64, b: f64| (b - a).abs() / a.abs();
        assert!(change(exact.cutting, level.cutting) <= force, "{speed:?}: {level:?}, exact {exact:?}");
        let allowed = (thrust * exact.thrust.abs()).max(0.01 * exact.cutting);
        assert!((level.thrust - exact.thrust).abs() <= allowed, "{speed:?}: {level:?}, exact {exact:?}");
        assert!(change(exact.strain, level.strain) <= mean, "{speed:?}: {level:?}, exact {exact:?}");
        assert!(change(exact.rise, level.rise) <= mean, "{speed:?}: {level:?}, exact {exact:?}");
    }
}

/// A session in the middle of a cut, at 10 µs.
fn cutting(scene: &Scene) -> Session {
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    advance(&mut session, 10e-6);
    session
}

/// A jump of the feed moves the tool at `tool.feed_rate_limit`, over as many communication steps as that takes, and
/// stops at the new feed. Rounding of some thousand substeps, and one substep's way at the end.
#[test]
fn a_jump_of_the_feed_is_limited_in_rate() {
    let mut scene = scene(2e-5, 0.0, 0.0, 3e-4);
    scene.tool.feed_rate_limit = 10.0;
    let mut session = cutting(&scene);
    let start = session.outputs().tool_position_y;
    assert!((start - 0.7e-3).abs() < 1e-12, "the tip stands at {start} m");
    session.set_inputs(Inputs { feed: 3.25e-4, ..scene.inputs }, NO_SLOPE);
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

/// With an input derivative the tool follows the ramp exactly, however steep: at its own clock the tip is where the input
/// is. Rounding of the sum over some hundred substeps.
#[test]
fn a_ramp_of_the_feed_is_followed_exactly() {
    let scene = scene(2e-5, 0.0, 0.0, 3e-4);
    let mut session = cutting(&scene);
    // Steeper than the limit of 10 m/s, and of the velocity at the same time.
    for (k, slope) in [(0, 15.0), (1, -15.0), (2, 4.0)] {
        let feed = 1e-3 - session.outputs().tool_position_y;
        let x = session.outputs().tool_position_x;
        // The tool stands at the solver's clock, which runs ahead of the communication point: the input counts there.
        let (begin, clock) = (session.time(), session.point_fields().time);
        let feed_now = feed - slope * (clock - begin);
        session.set_inputs(
            Inputs { feed: feed_now, ..scene.inputs },
            Inputs { tool_velocity: 2e6, feed: slope, friction: 0.0 },
        );
        advance(&mut session, f64::from(11 + k) * STEP);
        let (o, end) = (session.outputs(), session.point_fields().time);
        let (down, expected) = (1e-3 - o.tool_position_y - feed, slope * (end - clock));
        assert!(
            (down - expected).abs() < 1e-12,
            "slope {slope} m/s: the tip went {down} m down instead of {expected} m"
        );
        // The speed is that at the start of each substep: half a substep's acceleration less than the integral.
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

/// Friction may change at any communication point: the force goes over to the one with friction, and friction work starts.
#[test]
fn friction_can_be_switched_on_the_way() {
    let scene = scene(2e-5, 0.0, 0.0, 3e-4);
    let mut session = cutting(&scene);
    let (friction, work) = (session.outputs().friction_work, session.outputs().tool_work);
    assert!(friction.abs() < 1e-12 * work, "friction work {friction} J without friction, of {work} J");
    let mut thrust = [0.0; 2];
    for (phase, friction) in [0.0, 0.2].into_iter().enumerate() {
        session.set_inputs(Inputs { friction, ..scene.inputs }, NO_SLOPE);
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

/// A tool that goes back loses the chip at once; its flank rubs over the surface, which has sprung back above its tip, until
/// it has left where it came in. Every force on the way is against the motion.
#[test]
fn a_reversed_tool_leaves_the_workpiece() {
    let scene = scene(2e-5, 0.2, 0.0, 3e-4);
    let mut session = cutting(&scene);
    let mut work = session.outputs().tool_work;
    session.set_inputs(Inputs { tool_velocity: -SPEED, ..scene.inputs }, NO_SLOPE);
    for k in 11..=24 {
        advance(&mut session, f64::from(k) * STEP);
        let o = session.outputs();
        println!(
            "{k} µs: force {:.1}, thrust {:.1} N, state {}",
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
    assert_eq!(free.chip_state, 4, "chip.state of a tool that has left");
    advance(&mut session, 25e-6);
    let o = session.outputs();
    assert_eq!(
        (o.cutting_force, o.thrust_force, o.contact_length),
        (0.0, 0.0, 0.0),
        "force on a tool in air"
    );
    assert_eq!((o.cut_length, o.tool_work), (free.cut_length, free.tool_work), "a tool in air cuts");
}
