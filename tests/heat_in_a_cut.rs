//! Heat in a cut: where it goes, what the ledger says, and what the state must not depend on.

use swarf::scene::{Heat, Precision, Scene};
use swarf::session::{Advance, Outputs, PointFields};
use swarf::{Error, Session};

/// A coarse cut with everything that heats: 1,875 points, conduction passes made frequent by a conductivity
/// of copper's.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.workpiece.length = 1.5e-3;
    scene.workpiece.height = 5e-4;
    scene.inputs.feed = 2e-4;
    scene.numerics.point_spacing = 2e-5;
    scene.material.name = "custom".into();
    scene.material.constants.conductivity = 400.0;
    scene.effects.heat = Heat::Conduction;
    scene
}

/// Runs to `end` (s) in steps of `step` (s).
fn run(scene: &Scene, end: f64, step: f64) -> Session {
    let mut session = Session::new(scene, 0.0).expect("a scene that can be built");
    advance(&mut session, end, step).expect("a stable run");
    session
}

fn advance(session: &mut Session, end: f64, step: f64) -> Result<(), Error> {
    while session.time() < end - 1e-3 * step {
        let next = (session.time() + step).min(end);
        assert_eq!(session.advance_to(next, &mut |_| true)?, Advance::Reached);
    }
    Ok(())
}

/// Heat in the workpiece and in the tool over plastic heat and friction work, less one.
fn heat_imbalance(outputs: &Outputs, taylor_quinney: f64) -> f64 {
    let sources = taylor_quinney * outputs.plastic_work + outputs.friction_work;
    (outputs.thermal_energy + outputs.tool_heat) / sources - 1.0
}

/// Every part of the plastic and friction work is found again as heat, in double precision to rounding.
#[test]
fn heat_is_what_plastic_and_friction_work_give() {
    for (expands, into_tool) in [(false, false), (true, false), (false, true)] {
        let mut scene = scene();
        scene.effects.thermal_expansion = expands;
        scene.effects.tool_heat = into_tool;
        let session = run(&scene, 6e-6, 1e-6);
        let outputs = session.outputs();
        assert!(outputs.friction_work > 0.01 * outputs.plastic_work, "too little friction: {outputs:?}");
        let imbalance = heat_imbalance(outputs, 0.9);
        println!(
            "expansion {expands}: heat off by {imbalance:.2e}, energy by {:.3e}, thermoelastic {:.3e} of the \
             work, tool {:.3} of friction, peaks {} and {} K",
            outputs.balance_error,
            outputs.thermoelastic / outputs.tool_work,
            outputs.tool_heat / outputs.friction_work,
            outputs.chip_temperature_peak,
            outputs.tool_temperature_peak
        );
        assert_eq!(
            outputs.tool_temperature_peak > 300.0,
            into_tool,
            "tool at {} K",
            outputs.tool_temperature_peak
        );
        assert!(imbalance.abs() < 1e-10, "expansion {expands}: heat is off by {imbalance:.2e}");
        // As the same cut without heat flow (tests/reference_cut.rs asks 1 %).
        assert!(outputs.balance_error.abs() < 0.01, "the ledger is off by {}", outputs.balance_error);
        assert_eq!(outputs.thermoelastic != 0.0, expands);
    }
}

/// Without the thermoelastic entry the ledger of an expanding cut would not close as it does.
#[test]
fn expansion_has_its_entry_in_the_ledger() {
    let mut scene = scene();
    // A hundredfold expansion makes the entry large beside the errors of the scheme.
    scene.material.constants.thermal_expansion = 2e-4;
    scene.effects.thermal_expansion = true;
    let session = run(&scene, 4e-6, 1e-6);
    let outputs = session.outputs();
    let entry = outputs.thermoelastic / outputs.tool_work;
    println!("entry {entry:.3e}, ledger off by {:.3e}", outputs.balance_error);
    assert!(entry.abs() > 0.01, "the entry is only {entry} of the work: {outputs:?}");
    assert!(
        outputs.balance_error.abs() < 0.2 * entry.abs(),
        "the ledger is off by {}",
        outputs.balance_error
    );
}

fn assert_same(a: &PointFields, b: &PointFields, what: &str) {
    // Not `assert_eq`, whose message would list every point.
    assert!(a.id == b.id, "{what}: points differ");
    assert!(a.position == b.position, "{what}: positions differ");
    assert!(a.temperature == b.temperature, "{what}: temperatures differ");
    assert!(a.stress == b.stress, "{what}: stresses differ");
}

/// Passes and waiting friction heat belong to the state: threads, communication steps and a restore in
/// between change no bit, in either precision and with the active window.
#[test]
fn the_state_depends_on_nothing_but_the_scene() {
    for precision in [Precision::Double, Precision::Single] {
        let mut scene = scene();
        scene.effects.thermal_expansion = true;
        scene.effects.tool_heat = true;
        scene.numerics.precision = precision;
        // Long enough that two threads pay (12,500 points), or with the window.
        (scene.workpiece.length, scene.workpiece.height) = (5e-3, 1e-3);
        scene.numerics.active_window = if precision == Precision::Single { 3.0 } else { 0.0 };
        scene.numerics.threads = 1;
        let end = 3e-6;
        let reference = run(&scene, end, end).point_fields();
        scene.numerics.threads = 2;
        assert_same(&run(&scene, end, 3e-7).point_fields(), &reference, "threads and steps");
        let half = run(&scene, 1.37e-6, 1e-6);
        let mut restored = Session::restore(&half.save()).expect("a whole state");
        advance(&mut restored, end, 1e-6).expect("a stable run");
        assert_same(&restored.point_fields(), &reference, "restore");
    }
}

/// Where nothing heats no pass runs: the state is that of the adiabatic scene, bit by bit.
#[test]
fn nothing_flows_where_nothing_heats() {
    let mut scene = scene();
    scene.material.constants.taylor_quinney = 0.0;
    scene.inputs.friction = 0.0;
    let conducted = run(&scene, 2e-6, 1e-6);
    scene.effects.heat = Heat::Adiabatic;
    let adiabatic = run(&scene, 2e-6, 1e-6);
    assert_same(&conducted.point_fields(), &adiabatic.point_fields(), "conducted and adiabatic");
}
