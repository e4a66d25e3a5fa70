//! The cut itself: forces against the shear plane of least work, friction, feed, and what must never happen
//! on the way.
//!
//! Most cuts run at spacing 2e-5 (7,500 points), in seconds; where that is too coarse for the bounds
//! (the effect of friction and feed on the force, 1.29 and 1.53 there) three run at the 30,000 points of the
//! reference.

use std::collections::HashMap;
use std::sync::{Mutex, OnceLock};
use swarf::output::point_fields::PointFields;
use swarf::output::profiles::lowest_point;
use swarf::output::segmentation::{Bands, bands, fibre};
use swarf::scene::lattice::StartLattice;
use swarf::scene::{Scene, Speed};
use swarf::session::Session;
use swarf::variables::{ChipState, Outputs};

mod cut;
use cut::{SPEED, STEP, advance, scene};

/// Forces of a finished cut (N per mm of width), means over 1.0 to 1.6 mm of travel.
#[derive(Clone, Copy, Debug)]
struct Forces {
    cutting: f64,
    thrust: f64,
    /// Contrast of the chip's shear bands (-).
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
    let is_exact = scene.numerics.speed == Speed::Exact;
    let mut pulled = scene.clone();
    swarf::scene::speed_levels::apply(&mut pulled);
    let ahead = pulled.numerics.active_window * scene.inputs.feed;
    let is_long = ahead >= scene.workpiece.length;
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    let count = session.point_fields().id.len();
    let (mut impulse, mut worst_balance, mut worst_pressure, mut smallest) =
        ([0.0; 2], 0.0_f64, 0.0_f64, 1.0_f64);
    let mut outside = 0;
    for k in 1..=32 {
        advance(&mut session, f64::from(k) * STEP);
        let o = session.outputs();
        check_outputs(o, count, (is_long, is_exact), k, &name);
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
        "{name}: cutting {cutting:.1}, thrust {thrust:.1} N/mm, ratio {:.4}; ledger {:.2} %, J ≥ \
         {smallest:.3}, {outside} of {count} outside 0.7–1.3, pressure ≤ {:.1} GPa, chip {:.0} K, {:.2} mm \
         thick, peak strain {:.1}, 99.9 % {:.2}",
        thrust / cutting,
        1e2 * worst_balance,
        1e-9 * worst_pressure,
        o.chip_temperature,
        1e3 * o.chip_thickness,
        o.peak_strain,
        o.peak_strain_p999
    );
    assert_eq!(o.chip_state, ChipState::Cutting, "{name}: the tool is not cutting");
    let end = session.point_fields();
    let found = shear_bands(scene, &end);
    let bands = found.contrast;
    let is_chip = |strain: f64, y: f64| strain > 0.05 && y > o.tool_position_y;
    let chip: Vec<f64> = (end.plastic_strain.iter().zip(&end.position))
        .filter_map(|(&strain, position)| is_chip(strain, position[1]).then_some(strain))
        .collect();
    let strain = chip.iter().sum::<f64>() / chip.len() as f64;
    let rise = o.chip_temperature - scene.workpiece.initial_temperature;
    println!("{name}: mean strain of the chip {strain:.4}, rise of temperature {rise:.1} K");
    println!("{name}: {found:?}");
    Forces { cutting, thrust, bands, strain, rise }
}

/// The chip's shear bands at the end of a cut.
fn shear_bands(scene: &Scene, end: &PointFields) -> Bands {
    let workpiece = &scene.workpiece;
    let size = [workpiece.length, workpiece.height, workpiece.width];
    let lattice = StartLattice::new(size, scene.numerics.point_spacing, 2);
    let [edge, plane] = lowest_point(&end.tool_outline).expect("a tool");
    let strain = fibre(end, &lattice, plane, scene.inputs.feed, edge);
    bands(&strain, lattice.step[0], scene.inputs.feed)
}

/// What holds at every communication point, by the acceptance.
fn check_outputs(o: &Outputs, count: usize, (is_long, is_exact): (bool, bool), k: i32, name: &str) {
    assert!(
        o.balance_error.abs() < 0.01,
        "{name}, {k} µs: {} of the tool's work is unaccounted for",
        o.balance_error
    );
    assert!(o.min_jacobian > 0.3, "{name}, {k} µs: a volume ratio of {}", o.min_jacobian);
    // A window that is shorter than the workpiece leaves points at rest from the start, a longer one behind
    // the tool.
    let active = o.active_points as usize;
    let all_there = match (is_exact, is_long) {
        (true, _) => active == count,
        (false, true) => active <= count,
        (false, false) => active < count,
    };
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

/// The shear plane of least work leaves out what bends the chip, accelerates it and makes bands, so it lies
/// below a cut, and not far below: the material flows as it likes, but hardly otherwise.
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
            (1.0..1.2).contains(&share),
            "friction {friction}, rake {rake}: {force} N/mm, shear plane {plane}"
        );
    }
    for (friction, feed) in [(0.0, 3e-4), (0.2, 3e-4), (0.0, 5e-4)] {
        let (force, plane) =
            (forces(REFERENCE, friction, 0.0, feed).cutting, shear_plane(friction, 0.0, feed));
        let share = force / plane;
        println!(
            "30,000 points, friction {friction}, feed {feed} m: {force:.1} N/mm, {share:.3} of the shear \
             plane"
        );
        assert!(
            (1.0..1.2).contains(&share),
            "friction {friction}, feed {feed} m: {force} N/mm, shear plane {plane}"
        );
    }
}

/// All force on the tool comes from its rake face (sharp tool, clearance), so its direction is that of the
/// normal turned by the friction angle: thrust / cutting = tan(atan μ − γ). ±0.04 is the acceptance.
#[test]
fn the_force_is_inclined_by_friction_angle_less_rake() {
    for (friction, rake) in [(0.0_f64, 0.0_f64), (0.0, 10.0), (0.2, 0.0), (0.2, 10.0)] {
        let Forces { cutting, thrust, .. } = forces(COARSE, friction, rake, 3e-4);
        let (ratio, exact) = (thrust / cutting, (friction.atan() - rake.to_radians()).tan());
        println!("friction {friction}, rake {rake}: thrust over cutting {ratio:.4}, exact {exact:.4}");
        assert!((ratio - exact).abs() < 0.04, "friction {friction}, rake {rake}: {ratio} instead of {exact}");
    }
}

/// Friction on the rake face adds its own work and thickens the chip: by the shear plane 21.5 % for 0.2, which
/// a cut has to follow within 2 % where locking and tearing do not add their own.
#[test]
fn friction_raises_the_cutting_force() {
    let ratio = forces(REFERENCE, 0.2, 0.0, 3e-4).cutting / forces(REFERENCE, 0.0, 0.0, 3e-4).cutting;
    println!("friction 0.2 over 0: {ratio:.4}");
    assert!((ratio / 1.215 - 1.0).abs() < 0.02, "friction 0.2 raises the force by a factor of {ratio}");
}

/// Almost in proportion to the feed (5/3), a little less because a deeper cut strains more slowly; 1.55 to
/// 1.72 is the acceptance.
#[test]
fn cutting_force_grows_with_the_feed() {
    let ratio = forces(REFERENCE, 0.0, 0.0, 5e-4).cutting / forces(REFERENCE, 0.0, 0.0, 3e-4).cutting;
    println!("feed 0.5 over 0.3 mm: {ratio:.4}");
    assert!((1.55..1.72).contains(&ratio), "feed 0.5 mm over 0.3 mm: {ratio}");
}

/// The reference at its own 30,000 points, without friction. Two programs of some 150 lines each, written by
/// others for the same cure of locking and tearing (one with a moving grid, one with fitted rows), give 449 to
/// 474 N/mm at 20 to 5 µm.
#[test]
fn the_reference_cut_takes_what_two_other_programs_give() {
    let Forces { cutting, thrust, .. } = forces(REFERENCE, 0.0, 0.0, 3e-4);
    assert!((449.0..474.0).contains(&cutting), "cutting force {cutting} N/mm, thrust {thrust}");
}

/// Friction brings adiabatic shear bands into the reference chip: plastic strain rises and falls along it by
/// a tenth. A scheme that dissipates too much smooths them away: a locking control that evened out every
/// difference left 0.03.
#[test]
fn the_reference_chip_has_shear_bands() {
    let bands = forces(REFERENCE, 0.2, 0.0, 3e-4).bands;
    assert!(bands > 0.06, "contrast of the shear bands {bands}");
}

/// What a level may change, over the exact run's: cutting force, thrust, mean strain and rise of temperature
/// of the chip; of the thrust 1 % of the cutting force is always allowed. The bounds: 0.5 % of the
/// force, 3 % of the thrust and 1 % of strain and temperature for `balanced`; 2 % and 6 % for `fast`, here
/// with 2 % for the means.
const BOUNDS: [(Speed, [f64; 3]); 2] =
    [(Speed::Balanced, [0.005, 0.03, 0.01]), (Speed::Fast, [0.02, 0.06, 0.02])];

/// Excess of a level's figures over the bounds, by figure.
fn excess(exact: [f64; 4], level: [f64; 4], [force, thrust, mean]: [f64; 3]) -> [f64; 4] {
    let allowed =
        [force * exact[0], (thrust * exact[1].abs()).max(0.01 * exact[0]), mean * exact[2], mean * exact[3]];
    std::array::from_fn(|k| (level[k] - exact[k]).abs() - allowed[k])
}

impl Forces {
    /// What levels are judged by.
    fn judged(self) -> [f64; 4] {
        [self.cutting, self.thrust, self.strain, self.rise]
    }
}

/// Without friction runs do not scatter, so each is judged by itself. At 30,000 points a window of 2.25 feeds
/// with the mass scaling of `fast` took another history, with a force 3 % lower: a fragment stayed under the
/// flank.
#[test]
fn levels_keep_what_they_promise_without_friction() {
    for (spacing, rake, feed) in
        [(COARSE, 0.0, 3e-4), (COARSE, 10.0, 3e-4), (COARSE, 0.0, 5e-4), (REFERENCE, 0.0, 3e-4)]
    {
        let exact = forces(spacing, 0.0, rake, feed).judged();
        for (speed, bounds) in BOUNDS {
            let mut scene = scene(spacing, 0.0, rake, feed);
            scene.numerics.speed = speed;
            let level = cut(&scene).judged();
            println!("{speed:?}, {spacing} m, rake {rake}, feed {feed} m: {level:.4?}, exact {exact:.4?}");
            let excess = excess(exact, level, bounds);
            assert!(excess.iter().all(|&over| over <= 0.0), "{speed:?}: {level:?}, exact {exact:?}");
        }
    }
}

/// With friction a point or two stick to the tool next to its edge, and which ones hangs on rounding (book,
/// contact): the chip's mean strain scatters by half a percent. So means over runs with slightly smaller time
/// steps are compared.
#[test]
fn levels_keep_what_they_promise_with_friction() {
    let one = |speed, factor| {
        if speed == Speed::Exact && factor == 1.0 {
            return forces(REFERENCE, 0.2, 0.0, 3e-4).judged();
        }
        let mut scene = scene(REFERENCE, 0.2, 0.0, 3e-4);
        scene.numerics.speed = speed;
        swarf::scene::speed_levels::apply(&mut scene);
        scene.numerics.courant *= factor;
        scene.numerics.threads = 1;
        cut(&scene).judged()
    };
    // All at once, so that the long ones do not wait for each other.
    let [exact, levels @ ..] = std::thread::scope(|scope| {
        [Speed::Exact, Speed::Balanced, Speed::Fast]
            .map(|speed| [0.94, 0.97, 1.0].map(|factor| scope.spawn(move || one(speed, factor))))
            .map(|runs| runs.map(|run| run.join().expect("a run that ended")))
    });
    let mean = |runs: &[[f64; 4]]| -> [f64; 4] {
        std::array::from_fn(|k| runs.iter().map(|run| run[k]).sum::<f64>() / runs.len() as f64)
    };
    println!("exact: {exact:.4?}");
    for ((speed, bounds), runs) in BOUNDS.into_iter().zip(levels) {
        let (exact, level) = (mean(&exact), mean(&runs));
        println!("{speed:?}: {runs:.4?}\n means {level:.4?}, exact {exact:.4?}");
        let excess = excess(exact, level, bounds);
        assert!(excess.iter().all(|&over| over <= 0.0), "{speed:?}: {level:?}, exact {exact:?}");
    }
}
