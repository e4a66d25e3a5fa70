//! The speed-ups of `numerics.speed`: what each may change in a cut, and what each must keep.
//!
//! What the levels together keep is tested beside the reference cut itself (`reference_cut.rs`);
//! `book/src/evidence/performance.md` has more frictions, feeds and rakes.

use std::collections::HashMap;
use swarf::scene::{Formulation, Inputs, Precision, Scene};
use swarf::session::{Advance, Session};

const SPEED: f64 = 50.0;
const STEP: f64 = 1e-6;

/// The reference cut at a spacing of its points (m).
fn scene(spacing: f64, friction: f64) -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = spacing;
    scene.numerics.threads = 1;
    scene.inputs = Inputs { tool_velocity: SPEED, feed: 3e-4, friction };
    scene
}

/// What a speed-up may change, and what it saves.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Mean over 1.0 to 1.6 mm of travel (N).
    force: f64,
    /// Substeps, and the most points moved in one.
    substeps: i64,
    active: i32,
}

/// Cuts 1.6 mm; the ledger closes on the way and no point is lost.
fn cut(scene: &Scene) -> Cut {
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    let mut cut = Cut { force: 0.0, substeps: 0, active: 0 };
    for k in 1..=32 {
        let advance = session.advance_to(f64::from(k) * STEP, &mut |_| true).expect("a stable run");
        assert_eq!(advance, Advance::Reached);
        let o = session.outputs();
        assert!(
            o.balance_error.abs() < 0.01,
            "{k} µs: {} of the tool's work is unaccounted for",
            o.balance_error
        );
        assert_eq!(o.retired_points, 0, "{k} µs: points left");
        cut.substeps += i64::from(o.substeps);
        cut.active = cut.active.max(o.active_points);
        if k > 20 {
            cut.force += o.cutting_force / 12.0;
        }
    }
    println!("{cut:.4?}");
    cut
}

/// The chip of a heavier material carries more momentum away: 1.2 (s − 1) ρ v² t per width. The bound of 25 %
/// is a percent of the force. With s = 4 the substeps are half as many. Without a window: with one of 4 feeds
/// the scaled cut takes another, cheaper shape of chip (book, performance). In the plain formulation, whose
/// runs without friction do not scatter; those of the other do, by some tenths of a percent of the force.
#[test]
fn scaled_mass_adds_the_momentum_it_should() {
    let mut scene = scene(1e-5, 0.0);
    scene.numerics.formulation = Formulation::Plain;
    scene.numerics.precision = Precision::Single;
    let exact = cut(&scene);
    scene.numerics.mass_scaling = 4.0;
    let heavy = cut(&scene);
    let predicted = 1.2 * 3.0 * 7830.0 * SPEED * SPEED * 3e-4 * 1e-3;
    let surplus = heavy.force - exact.force;
    println!("surplus force {surplus:.2} N, predicted {predicted:.2} N");
    assert!((surplus - predicted).abs() < 0.25 * predicted, "{surplus} N instead of {predicted} N");
    assert_eq!(exact.active, heavy.active, "both cuts move all points");
    let ratio = exact.substeps as f64 / heavy.substeps as f64;
    assert!((1.9..2.05).contains(&ratio), "{ratio} times fewer substeps");
}

/// The guard on stray velocities lets those pass that it would let pass without scaling. With the limit of
/// the scaled density it brought back 1,221 here, which drags on the tool's face.
#[test]
fn scaled_mass_does_not_lower_the_limit_of_strays() {
    let mut scene = scene(2e-5, 0.6);
    scene.inputs.tool_velocity = 3.33;
    (scene.numerics.mass_scaling, scene.numerics.active_window) = (50.0, 3.0);
    scene.numerics.precision = Precision::Single;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    session.advance_to(2e-4 / 3.33, &mut |_| true).expect("a stable run");
    let o = session.outputs();
    println!("{} velocities brought back", o.stray_velocities);
    assert!(o.cut_length > 1.9e-4 && o.stray_velocities < 100, "{} velocities", o.stray_velocities);
}

/// The window holds the part of the workpiece that it says, and the rest is not integrated.
#[test]
fn a_window_of_four_feeds_holds_a_third_of_the_points() {
    let mut scene = scene(1e-5, 0.0);
    scene.numerics.active_window = 4.0;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    session.advance_to(1e-8, &mut |_| true).expect("a stable run");
    // 1.2 mm ahead, and 24 cells, more than a third of that, below the tool: 1.2 by 0.78 mm of 3 by 1 mm.
    let (active, expected) = (f64::from(session.outputs().active_points), 0.312 * 30_000.0);
    assert!((active / expected - 1.0).abs() < 0.05, "{active} points instead of {expected}");
}

/// The chip's tail goes about where it would have gone, and the force is the same within half a percent.
/// In the plain formulation without friction, where runs do not scatter.
///
/// A chip that swings no tail around curls a little tighter: the tail ends 0.12 mm (3 cells) from where it
/// ends in the cut that integrates all of the chip. Turned the other way it would be 0.7 mm off, left where
/// it joined 1.3 mm.
#[test]
fn the_tail_goes_on_as_it_would_have() {
    let mut scene = scene(2e-5, 0.0);
    scene.numerics.formulation = Formulation::Plain;
    let whole = cut_and_look(&scene);
    scene.numerics.active_chip = 2.0;
    let short = cut_and_look(&scene);
    let change = short.force / whole.force - 1.0;
    println!("force {} and {} N: {:.2} %", whole.force, short.force, 1e2 * change);
    assert!(change.abs() < 0.005, "the force changes by {change}");
    assert_eq!(whole.active, 7500);
    let tail = whole.ids_above(0.8e-3);
    println!("{} points of tail are looked at; {} of 7,500 points move", tail.len(), short.active);
    assert!(tail.len() > 100 && usize::try_from(short.active).unwrap() < 7500 - tail.len());
    let apart = tail.iter().map(|id| {
        let ([a, b], [c, d]) = (whole.positions[id], short.positions[id]);
        (a - c).hypot(b - d)
    });
    let apart = apart.sum::<f64>() / tail.len() as f64;
    println!("the tail stands {apart:.3e} m from where it would have been");
    assert!(apart < 1.6e-4, "{apart} m");
}

/// A finished cut of 1.6 mm, and where its points are.
struct Look {
    /// Mean over 1.2 to 1.6 mm (N).
    force: f64,
    active: i32,
    positions: HashMap<u32, [f64; 2]>,
}

impl Look {
    /// Points higher than this above the machined surface (m).
    fn ids_above(&self, height: f64) -> Vec<u32> {
        let surface = 1e-3 - 3e-4;
        let mut ids: Vec<u32> =
            self.positions.iter().filter(|(_, at)| at[1] > surface + height).map(|(&id, _)| id).collect();
        ids.sort_unstable();
        ids
    }
}

fn cut_and_look(scene: &Scene) -> Look {
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    let mut force = 0.0;
    for k in 1..=32 {
        session.advance_to(f64::from(k) * STEP, &mut |_| true).expect("a stable run");
        let o = session.outputs();
        assert!(o.balance_error.abs() < 0.01, "{k} µs: ledger {}", o.balance_error);
        assert_eq!(o.retired_points, 0, "{k} µs: points left");
        if k > 24 {
            force += o.cutting_force / 8.0;
        }
    }
    let mut copy = Session::restore(&session.save()).expect("a saved state");
    for session in [&mut copy, &mut session] {
        session.advance_to(32.3 * STEP, &mut |_| true).expect("a stable run");
    }
    assert!(copy.save() == session.save(), "the restored state goes on otherwise");
    let fields = session.point_fields();
    assert_eq!(fields.id.len(), 7500, "every point is there, those of the tail too");
    let positions = fields.id.iter().zip(&fields.position).map(|(&id, at)| (id, [at[0], at[1]])).collect();
    Look { force, active: session.outputs().active_points, positions }
}

/// So little of the chip that the workpiece's bulge might be taken for it is refused, with what is allowed.
#[test]
fn too_short_a_chip_is_refused() {
    let mut scene = scene(2e-5, 0.2);
    scene.numerics.active_chip = 1.2;
    let error = Session::new(&scene, 0.0).err().expect("refused").to_string();
    assert!(error.contains("numerics.active_chip = 1.2 is below 2 feeds"), "{error}");
}

/// Automatic scaling follows a tool that slows down, and the ledger holds the kinetic energy that this moves.
/// A saved state goes on with the same bits.
#[test]
fn automatic_scaling_follows_the_speed() {
    let mut scene = scene(2e-5, 0.2);
    (scene.numerics.mass_scaling, scene.numerics.active_window) = (0.0, 3.0);
    scene.numerics.precision = Precision::Single;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    let no_slope = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };
    let (mut factors, mut travel) = (vec![], 0.0);
    let mut time = 0.0;
    for speed in [50.0, 20.0, 8.0, 30.0] {
        session.set_inputs(Inputs { tool_velocity: speed, ..scene.inputs }, no_slope).expect("good inputs");
        time += 1e-4 / speed;
        travel += 1e-4;
        session.advance_to(time, &mut |_| true).expect("a stable run");
        let mut copy = Session::restore(&session.save()).expect("a saved state");
        assert_eq!(copy.save(), session.save(), "{speed} m/s: the restored state is another");
        time += 1e-5 / speed;
        for session in [&mut copy, &mut session] {
            session.advance_to(time, &mut |_| true).expect("a stable run");
        }
        assert_eq!(copy.save(), session.save(), "{speed} m/s: the restored state goes on otherwise");
        let o = session.outputs();
        assert!(o.balance_error.abs() < 0.01, "{speed} m/s: ledger {}", o.balance_error);
        let surplus = o.kinetic_energy * (1.0 - 1.0 / o.mass_factor);
        assert_eq!(o.surplus_kinetic_energy, surplus);
        factors.push(o.mass_factor);
        println!(
            "{speed} m/s: factor {:.3}, scaling brought in {:.3e} J of {:.3e} J",
            o.mass_factor, o.mass_scaling_energy, o.tool_work
        );
    }
    // The share of the force is proportional to (s − 1) v²; the factor moves in steps of 4 %.
    assert!(
        factors[2] > factors[1] && factors[1] > factors[0] && factors[3] < factors[1],
        "{factors:?} over {travel} m"
    );
    let shares: Vec<f64> = factors.iter().zip([50.0, 20.0, 8.0]).map(|(s, v)| (s - 1.0) * v * v).collect();
    assert!(
        shares.iter().all(|share| (0.7..=1.01).contains(&(share / (0.005 * 1.35e9 / (1.2 * 7830.0))))),
        "{shares:?}"
    );
}

/// A rigid tail curls on through the chip that it came from, and must not thicken it: over 4 mm the thickness
/// is that of the whole chip, within what a chip without its tail's inertia differs by.
#[test]
fn the_rigid_tail_does_not_thicken_the_chip() {
    let thickness = |reach: f64| {
        let mut scene = scene(2.5e-5, 0.2);
        (scene.workpiece.length, scene.workpiece.height) = (5.5e-3, 6e-4);
        scene.inputs.feed = 2e-4;
        (scene.numerics.active_window, scene.numerics.active_chip) = (1.25 * reach, reach);
        let mut session = Session::new(&scene, 0.0).expect("a good scene");
        let (mut mean, mut most) = (0.0, 0.0_f64);
        for k in 1..=80 {
            let advance = session.advance_to(f64::from(k) * STEP, &mut |_| true).expect("a stable run");
            assert_eq!(advance, Advance::Reached);
            let thickness = session.outputs().chip_thickness / 2e-4;
            if k > 40 {
                (mean, most) = (mean + thickness / 40.0, most.max(thickness));
            }
        }
        println!("reach {reach}: thickness over feed {mean:.3}, at most {most:.3}");
        [mean, most]
    };
    let ([whole, _], [mean, most]) = (thickness(0.0), thickness(2.0));
    // Where the tail counted, it went up to 1.7 times the whole chip's mean; the whole chip itself to 1.15.
    assert!((mean / whole - 1.0).abs() < 0.2, "{mean} instead of {whole} feeds");
    assert!(most < 1.5 * whole, "at most {most}, the whole chip has {whole} feeds");
}
