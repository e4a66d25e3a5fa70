//! Random small scenes and input histories: no panic, no value that is no number, and every end is a time
//! reached or an error that names its cause.
//!
//! `PROPTEST_CASES` sets their number (`cargo xtask hard-cases` runs 2,000). A scene that fails shrinks to
//! the smallest that still does; its seed goes to tests/data/random_scenes.regressions, which every later run
//! begins with.

use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;
use std::sync::atomic::{AtomicU32, Ordering};
use swarf::scene::{
    ContactChoice, DimensionChoice, Heat, Inputs, Law, Precision, Scene, ShapeChoice, Speed, TransferChoice,
};
use swarf::session::{Advance, Session};
use swarf::study::hard_cases::misuse::names_a_cause;
use swarf::study::hard_cases::monitor::{not_finite, outputs_not_finite};

/// Scenes of a run that does not say how many.
const FEW: u32 = 150;
/// Most points of a scene: a few hundred substeps of them take milliseconds.
const MOST_POINTS: f64 = 1500.0;

/// What happens between two communication points.
#[derive(Clone, Copy, Debug)]
struct Stage {
    inputs: Inputs,
    slopes: Inputs,
    /// Length (s).
    duration: f64,
}

/// A number between two, evenly by its logarithm.
fn scaled(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

/// A factor that is mostly 1, else within a decade or at the ends of what the interface takes.
fn factor() -> impl Strategy<Value = f64> {
    prop_oneof![6 => Just(1.0), 3 => scaled(0.3, 3.0), 1 => scaled(1e-3, 1e3)]
}

fn workshop() -> impl Strategy<Value = Scene> {
    let block = (scaled(2e-4, 1.5e-3), scaled(1e-4, 1e-3), scaled(5e-6, 5e-5), 1..=4_i32);
    let tool =
        (-60.0..60.0_f64, 0.0..45.0_f64, prop_oneof![Just(0.0), scaled(1e-7, 2e-4)], scaled(2e-5, 1e-3));
    let start =
        (prop_oneof![Just(0.0), Just(1e-6), scaled(1e-9, 1e-4)], scaled(1e-3, 500.0), 1.0..3000.0_f64);
    (block, tool, start).prop_map(|(block, tool, start)| {
        let mut scene = Scene::default();
        (scene.workpiece.length, scene.workpiece.height) = (block.0, block.1);
        scene.numerics.point_spacing = block.2;
        scene.numerics.points_per_cell_edge = block.3;
        scene.tool.rake_angle = tool.0.to_radians();
        scene.tool.clearance_angle = tool.1.to_radians();
        (scene.tool.edge_radius, scene.tool.length, scene.tool.height) = (tool.2, tool.3, 2.0 * tool.3);
        (scene.tool.initial_gap, scene.tool.feed_rate_limit) = (start.0, start.1);
        if start.2 < 1500.0 {
            scene.workpiece.initial_temperature = start.2;
        }
        scene
    })
}

fn material(scene: Scene) -> impl Strategy<Value = Scene> {
    const NAMES: [&str; 7] =
        ["AISI 4340", "AISI 1045", "Ti-6Al-4V", "Al 2024-T351", "OFHC copper", "custom", "custom"];
    let name = prop::sample::select(&NAMES[..]);
    let factors = prop::collection::vec(factor(), 12);
    (name, factors, 0.0..0.495_f64, [prop::bool::weighted(0.2), prop::bool::weighted(0.5)]).prop_map(
        move |(name, f, nu, [tanh, other_ratio])| {
            let mut scene = scene.clone();
            scene.material.name = name.into();
            scene.material.law = if tanh { Law::JohnsonCookTanh } else { Law::JohnsonCook };
            if name == "custom" {
                let c = &mut scene.material.constants;
                c.density = (c.density * f[0]).clamp(100.0, 3e4);
                c.youngs_modulus = (c.youngs_modulus * f[1]).clamp(1e6, 2e12);
                c.yield_stress = (c.yield_stress * f[2]).clamp(1e4, 1e11);
                c.hardening_modulus = (c.hardening_modulus * f[3]).min(1e11);
                c.hardening_exponent = (c.hardening_exponent * f[4]).min(2.0);
                c.rate_coefficient = (c.rate_coefficient * f[5]).min(1.0);
                c.reference_rate *= f[6];
                c.thermal_exponent = (c.thermal_exponent * f[7]).clamp(0.05, 10.0);
                c.specific_heat = (c.specific_heat * f[8]).clamp(1.0, 1e5);
                c.conductivity = (c.conductivity * f[9]).min(5000.0);
                c.thermal_expansion = (c.thermal_expansion * f[10]).min(1e-3);
                c.fracture_energy *= f[11];
                if other_ratio {
                    c.poissons_ratio = nu;
                }
            }
            scene
        },
    )
}

fn effects(scene: Scene) -> impl Strategy<Value = Scene> {
    let heats = prop::sample::select(&[Heat::None, Heat::Adiabatic, Heat::Adiabatic, Heat::Conduction][..]);
    let speeds = prop::sample::select(&[Speed::Exact, Speed::Exact, Speed::Balanced, Speed::Fast][..]);
    let flags = prop::collection::vec(prop::bool::weighted(0.25), 11);
    let numbers =
        (0.05..0.6_f64, prop_oneof![Just(1.0), Just(0.0), scaled(0.5, 1e3)], 0.0..8.0_f64, 1..=2_i32);
    (heats, speeds, flags, numbers).prop_map(move |(heat, speed, flag, numbers)| {
        let mut scene = scene.clone();
        let (effects, numerics) = (&mut scene.effects, &mut scene.numerics);
        effects.heat = heat;
        (effects.rate, effects.thermal_softening) = (!flag[0], !flag[1]);
        (effects.tool_heat, effects.thermal_expansion) = (flag[2] && heat == Heat::Conduction, flag[3]);
        (effects.damage, effects.artificial_viscosity) = (flag[4], flag[5]);
        effects.volumetric_locking_control = !flag[6];
        numerics.transfer = if flag[7] { TransferChoice::Apic } else { TransferChoice::Flip };
        numerics.shape_function = if flag[7] && flag[8] { ShapeChoice::Linear } else { ShapeChoice::Gimp };
        numerics.precision = if flag[8] { Precision::Single } else { Precision::Double };
        effects.sticking = flag[9];
        numerics.contact = match (flag[10], flag[9]) {
            (false, _) => ContactChoice::Surface,
            (true, false) => ContactChoice::Distance,
            (true, true) => ContactChoice::Velocity,
        };
        numerics.speed = speed;
        (numerics.courant, numerics.mass_scaling) = (numbers.0, numbers.1);
        numerics.active_window = if numbers.2 > 4.0 { numbers.2 } else { 0.0 };
        numerics.active_chip = if (2.0..6.0).contains(&numbers.2) { numbers.2 } else { 0.0 };
        numerics.threads = numbers.3;
        // What must wait longer than this for a machine is not what is looked for here.
        numerics.wall_time_limit = 2.0;
        scene
    })
}

/// Takes out of a scene what does not go together, and brings its block into bounds.
fn fit(scene: &mut Scene) {
    let Scene { workpiece, effects, numerics, material, .. } = scene;
    material.law = match (material.law, material.name.as_str()) {
        (Law::JohnsonCookTanh, "Ti-6Al-4V" | "custom") => Law::JohnsonCookTanh,
        (Law::JohnsonCookTanh | Law::ZerilliArmstrong, "AISI 1045") => Law::ZerilliArmstrong,
        _ => Law::JohnsonCook,
    };
    let is_other_law = material.law != Law::JohnsonCook;
    effects.thermal_softening |= is_other_law;
    effects.damage &= material.law != Law::ZerilliArmstrong;
    effects.thermal_expansion &= effects.heat != Heat::None && !effects.damage;
    effects.artificial_viscosity &= !is_other_law && !effects.damage;
    let is_plain = !(is_other_law || effects.damage || effects.artificial_viscosity);
    if numerics.shape_function == ShapeChoice::Linear || numerics.transfer == TransferChoice::Apic {
        (numerics.precision, numerics.speed) = (Precision::Double, Speed::Exact);
    }
    if !is_plain {
        numerics.shape_function = ShapeChoice::Gimp;
    }
    if numerics.points_per_cell_edge != 2 {
        numerics.contact = ContactChoice::Surface;
    }
    if numerics.contact != ContactChoice::Surface {
        (effects.sticking, effects.tool_heat) = (false, false);
    }
    let is_affine = is_plain
        && numerics.shape_function == ShapeChoice::Gimp
        && numerics.dimension == DimensionChoice::PlaneStrain
        && effects.rate
        && effects.heat == Heat::Adiabatic
        && effects.thermal_softening;
    if !is_affine {
        numerics.transfer = TransferChoice::Flip;
    }
    let mut shortest = workpiece.length.min(workpiece.height);
    if numerics.dimension == DimensionChoice::ThreeDimensional {
        shortest = shortest.min(workpiece.width);
    }
    numerics.point_spacing =
        numerics.point_spacing.min(0.2 * shortest / f64::from(numerics.points_per_cell_edge));
}

/// Mostly scenes that are taken, so that most of them run; one in ten as it was drawn.
fn scenes() -> impl Strategy<Value = Scene> {
    let drawn = workshop().prop_flat_map(material).prop_flat_map(effects);
    (drawn, prop::bool::weighted(0.1), prop::bool::weighted(0.9)).prop_map(|(mut scene, is_deep, fits)| {
        let (length, height) = (scene.workpiece.length, scene.workpiece.height);
        let mut least = (length * height / MOST_POINTS).sqrt();
        if is_deep {
            scene.numerics.dimension = DimensionChoice::ThreeDimensional;
            scene.workpiece.width = 0.5 * length.min(height);
            least = (length * height * scene.workpiece.width / MOST_POINTS).cbrt();
        }
        scene.numerics.point_spacing = scene.numerics.point_spacing.max(least);
        if fits {
            fit(&mut scene);
        }
        scene
    })
}

/// What happens over a workpiece that may be cut `deepest` (m) deep; one feed in fifty is deeper.
fn stages(deepest: f64) -> impl Strategy<Value = Vec<Stage>> {
    let velocity = prop_oneof![4 => 1.0..200.0_f64, 1 => Just(0.0), 2 => -500.0..500.0_f64];
    let friction = prop_oneof![2 => 0.0..1.0_f64, 1 => Just(0.0), 1 => 0.0..10.0_f64];
    let slopes = prop_oneof![3 => Just([0.0; 3]), 1 => [-1e8..1e8_f64, -20.0..20.0_f64, -1e6..1e6_f64]];
    let part = prop_oneof![49 => 0.0..1.0_f64, 1 => 1.0..2.0_f64];
    let stage = (velocity, part, friction, slopes, scaled(1e-10, 1e-6)).prop_map(move |values| {
        let (tool_velocity, part, friction, [dv, df, dm], duration) = values;
        let inputs = Inputs { tool_velocity, feed: part * deepest, friction };
        Stage { inputs, slopes: Inputs { tool_velocity: dv, feed: df, friction: dm }, duration }
    });
    prop::collection::vec(stage, 1..8)
}

fn runs() -> impl Strategy<Value = (Scene, Vec<Stage>)> {
    scenes().prop_flat_map(|scene| {
        let cell = scene.numerics.point_spacing * f64::from(scene.numerics.points_per_cell_edge);
        let stages = stages((scene.workpiece.height - 2.0 * cell).max(0.0));
        (Just(scene), stages, prop::bool::weighted(0.3)).prop_map(|(mut scene, stages, is_smoothed)| {
            scene.inputs = stages[0].inputs;
            if is_smoothed {
                scene.numerics.smoothed_increments = true;
                scene.numerics.courant *= 2.0;
            }
            (scene, stages)
        })
    })
}

/// How runs ended: refused, stopped by a guard, at their end.
static ENDS: [AtomicU32; 3] = [const { AtomicU32::new(0) }; 3];

fn count(end: usize) {
    ENDS[end].fetch_add(1, Ordering::Relaxed);
}

/// Runs the stages and holds what must hold.
fn perform(scene: &Scene, stages: &[Stage]) -> Result<(), TestCaseError> {
    let mut session = match Session::new(scene, 0.0) {
        Ok(session) => session,
        Err(error) => {
            prop_assert!(names_a_cause(&error), "the refusal names no cause: {error}");
            count(0);
            return Ok(());
        }
    };
    for stage in stages {
        if let Err(error) = session.set_inputs(stage.inputs, stage.slopes) {
            prop_assert!(names_a_cause(&error), "the refusal names no cause: {error}");
            continue;
        }
        let time = session.time() + stage.duration;
        match session.advance_to(time, &mut |_| true) {
            Ok(Advance::Reached) => {}
            // The wall time limit; the state is sound.
            Ok(Advance::StoppedAt(reached)) => {
                prop_assert!(reached < time, "stopped at {reached} s of {time} s")
            }
            Err(error) => {
                prop_assert!(names_a_cause(&error), "the error names no cause: {error}");
                count(1);
                return Ok(());
            }
        }
        let (outputs, points) = (outputs_not_finite(session.outputs()), not_finite(&session.point_fields()));
        prop_assert!(
            outputs + points == 0,
            "{outputs} outputs and {points} numbers of points are not finite"
        );
    }
    count(2);
    Ok(())
}

/// Nobody can list all scenes; drawn ones find what a list forgets. Half of them must run to their end, or
/// nothing was tried.
#[test]
fn random_scenes_end_in_a_time_reached_or_a_named_error() {
    let cases = std::env::var("PROPTEST_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(FEW);
    let kept = FileFailurePersistence::Direct("tests/data/random_scenes.regressions");
    let config =
        ProptestConfig { cases, failure_persistence: Some(Box::new(kept)), ..ProptestConfig::default() };
    proptest!(config, |(run in runs())| perform(&run.0, &run.1)?);
    let [refused, stopped, ran] = ENDS.each_ref().map(|count| count.load(Ordering::Relaxed));
    println!("{cases} runs: {ran} to their end, {stopped} stopped by a guard, {refused} refused");
    assert!(2 * ran > cases, "only {ran} of {cases} runs came to their end");
}
