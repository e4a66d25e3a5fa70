//! What a scene may ask of the material: combinations that run, those that are refused, and their ledgers.

use swarf::scene::{Formulation, Heat, Inputs, Law, Precision, Scene, ShapeChoice};
use swarf::session::{Advance, Session};

/// A small titanium cut at 20 m/s.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.material.name = "Ti-6Al-4V".into();
    (scene.workpiece.length, scene.workpiece.height) = (1e-3, 4e-4);
    scene.numerics.point_spacing = 1e-5;
    scene.numerics.threads = 1;
    scene.inputs = Inputs { tool_velocity: 20.0, feed: 1.5e-4, friction: 0.2 };
    scene
}

/// Outputs after a time (s), every communication step with a closed ledger.
fn run(scene: &Scene, end: f64) -> swarf::variables::Outputs {
    let mut session = Session::new(scene, 0.0).expect("a scene that runs");
    println!("{}", session.effects_summary());
    for k in 1..=10 {
        let advance = session.advance_to(end * f64::from(k) / 10.0, &mut |_| true).expect("a stable run");
        assert_eq!(advance, Advance::Reached);
    }
    let outputs = session.outputs().clone();
    println!("{outputs:?}");
    // The reference cut's bound (tests/reference_cut.rs).
    assert!(outputs.balance_error.abs() < 0.01, "ledger off by {}", outputs.balance_error);
    outputs
}

/// The law softens with strain, so the force of the same cut is lower; nothing of damage or viscosity is in
/// its ledger.
#[test]
fn the_tanh_law_cuts_with_less_force() {
    let force = |law: Law| {
        let mut scene = scene();
        scene.material.law = law;
        let o = run(&scene, 1.5e-5);
        assert_eq!((o.damage_work, o.viscous_work), (0.0, 0.0));
        o.plastic_work
    };
    let (plain, softening) = (force(Law::JohnsonCook), force(Law::JohnsonCookTanh));
    assert!(softening < 0.97 * plain, "plastic work {softening} J with softening, {plain} J without");
}

/// Damage spends energy of its own and loses no mass; in both precisions the same within what chaos leaves.
#[test]
fn a_cut_with_damage_closes_its_ledger() {
    for (law, precision) in [(Law::JohnsonCook, Precision::Double), (Law::JohnsonCookTanh, Precision::Single)]
    {
        let mut scene = scene();
        scene.material.law = law;
        scene.numerics.precision = precision;
        scene.effects.damage = true;
        let o = run(&scene, 1.5e-5);
        assert!(o.damage_work > 0.0, "no damage: {o:?}");
        assert_eq!(o.retired_points, 0);
    }
}

/// Viscosity takes energy of its own, and is the same material otherwise.
#[test]
fn a_cut_with_viscosity_closes_its_ledger() {
    let mut scene = scene();
    scene.effects.artificial_viscosity = true;
    let o = run(&scene, 1e-5);
    assert!(o.viscous_work > 0.0, "no viscous work: {o:?}");
    scene.effects.artificial_viscosity = false;
    let plain = run(&scene, 1e-5);
    let change = o.plastic_work / plain.plastic_work - 1.0;
    assert!(change.abs() < 0.05, "plastic work changed by {change}");
}

/// What no kernel of its own stands for is the same material without the effect: no heat, no rate, no
/// softening.
#[test]
fn effects_that_a_damaged_scene_lacks_are_off() {
    let mut scene = scene();
    scene.effects.damage = true;
    // Rounding is all that may differ, and the separated formulation makes more of it.
    scene.numerics.formulation = Formulation::Plain;
    // Out of reach: the same run as without damage, whose kernels exist for every combination.
    scene.material.name = "custom".into();
    scene.material.constants.damage = [100.0, 0.0, 0.0, 0.0, 0.0];
    for (heat, rate, softening) in
        [(Heat::None, true, true), (Heat::Adiabatic, false, true), (Heat::Adiabatic, true, false)]
    {
        scene.effects.heat = heat;
        (scene.effects.rate, scene.effects.thermal_softening) = (rate, softening);
        scene.effects.damage = true;
        let with = run(&scene, 4e-6);
        scene.effects.damage = false;
        let without = run(&scene, 4e-6);
        // The factors that replace the effects are exactly one, but constant softening is computed for each
        // point.
        let change = with.plastic_work / without.plastic_work - 1.0;
        assert!(
            change.abs() < 1e-6,
            "{heat:?}, rate {rate}, softening {softening}: plastic work off by {change}"
        );
        assert!((with.chip_temperature_peak - without.chip_temperature_peak).abs() < 1e-6);
    }
}

/// Rare combinations have no kernel, and a library material without the constants has no law; the refusal
/// says so.
#[test]
fn combinations_without_a_kernel_are_refused_in_words() {
    let refused = |change: fn(&mut Scene), parts: &[&str]| {
        let mut scene = scene();
        change(&mut scene);
        let text = Session::new(&scene, 0.0).err().expect("a refusal").to_string();
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    };
    refused(
        |scene| {
            scene.material.name = "AISI 4340".into();
            scene.material.law = Law::JohnsonCookTanh;
        },
        &["johnson_cook_tanh", "AISI 4340", "Ti-6Al-4V", "custom"],
    );
    refused(
        |scene| {
            scene.material.law = Law::JohnsonCookTanh;
            scene.effects.thermal_softening = false;
        },
        &["johnson_cook_tanh", "effects.thermal_softening = true"],
    );
    refused(
        |scene| {
            scene.effects.damage = true;
            scene.numerics.shape_function = ShapeChoice::Linear;
        },
        &["effects.damage = true", "gimp"],
    );
    refused(
        |scene| (scene.effects.damage, scene.effects.artificial_viscosity) = (true, true),
        &["effects.artificial_viscosity", "effects.damage = false"],
    );
}
