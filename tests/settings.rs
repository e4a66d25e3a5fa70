//! The parameter `settings`, as a master that knows Strings alone sees it.

mod importer;

use importer::{Slave, Status, reference};
use std::ffi::CString;
use swarf::fmi::abi::*;
use swarf::scene::Scene;
use swarf::session::Session;

fn set_text(slave: &Slave, name: &str, text: &str) -> Status {
    let text = CString::new(text).expect("no zero in it");
    // SAFETY: the component is alive, the arrays have one entry each.
    unsafe { fmi2SetString(slave.component, &reference(name), 1, &text.as_ptr()) }
}

/// Leaves initialization mode.
fn leave_initialization(slave: &Slave) -> Status {
    // SAFETY: the component is alive and this is the only call on it.
    unsafe {
        assert_eq!(fmi2SetupExperiment(slave.component, 0, 0.0, 0.0, 0, 0.0), Status::Ok);
        assert_eq!(fmi2EnterInitializationMode(slave.component), Status::Ok);
        fmi2ExitInitializationMode(slave.component)
    }
}

/// A master that can set one String has the run of one that sets every variable by itself, bit by bit.
#[test]
fn settings_make_the_run_that_single_variables_make() {
    let one = Slave::new(true);
    let text =
        "numerics.point_spacing=50um; feed=0.2 mm; material.name=aisi_1045; effects.heat=2; tool_velocity=60";
    assert_eq!(set_text(&one, "settings", text), Status::Ok);
    // Set by itself: the 60 m/s of the settings do not count.
    assert_eq!(one.set("tool_velocity", 40.0), Status::Ok);
    assert_eq!(leave_initialization(&one), Status::Ok, "{}", one.log());
    let log = one.log();
    assert!(log.contains("settings taken over: numerics.point_spacing = 5e-5, feed = 2e-4"), "{log}");
    assert!(log.contains("tool_velocity stays 40 as set by itself, not 60"), "{log}");
    assert!(log.contains("material.name = AISI 1045"), "the library's name: {log}");

    let many = Slave::new(false);
    for (name, value) in [("numerics.point_spacing", 5e-5), ("feed", 2e-4), ("tool_velocity", 40.0)] {
        assert_eq!(many.set(name, value), Status::Ok, "{}", many.log());
    }
    assert_eq!(set_text(&many, "material.name", "AISI 1045"), Status::Ok);
    assert_eq!(leave_initialization(&many), Status::Ok, "{}", many.log());
    for name in ["feed", "numerics.point_spacing", "material.yield_stress", "tool_position_y"] {
        assert_eq!(one.get(name).to_bits(), many.get(name).to_bits(), "{name}");
    }
    for slave in [&one, &many] {
        assert_eq!(slave.step(0.0, 2e-6), Status::Ok, "{}", slave.log());
    }
    assert!(one.get("cutting_force") > 50.0, "the tool does not cut: {} N", one.get("cutting_force"));
    assert_eq!(one.outputs(), many.outputs());
}

/// A wrong entry is refused by name when initialization is left, and can be mended there.
#[test]
fn a_wrong_entry_is_refused_by_name_and_can_be_mended() {
    let slave = Slave::new(false);
    assert_eq!(set_text(&slave, "settings", "numerics.accuracy=finest"), Status::Ok);
    assert_eq!(leave_initialization(&slave), Status::Error);
    let log = slave.log();
    assert!(log.contains("settings: numerics.accuracy=finest") && log.contains("fine (3)"), "{log}");
    assert_eq!(set_text(&slave, "settings", "numerics.point_spacing=40 um"), Status::Ok);
    // SAFETY: the component is alive and this is the only call on it.
    let status = unsafe { fmi2ExitInitializationMode(slave.component) };
    assert_eq!(status, Status::Ok, "{}", slave.log());
    assert!((slave.get("numerics.point_spacing") / 4e-5 - 1.0).abs() < 1e-15, "one division by a million");
}

/// The same for who uses the library.
#[test]
fn a_session_takes_settings_over() {
    let scene = Scene {
        settings: "numerics.point_spacing=5e-5; workpiece.initial_temperature=100 degC".into(),
        ..Scene::default()
    };
    let session = Session::new(&scene, 0.0).expect("a good scene");
    assert_eq!(session.scene().workpiece.initial_temperature, 373.15);
    assert_eq!(session.outputs().chip_temperature, 373.15);
    // A state holds the settings beside what came of them.
    let restored = Session::restore(&session.save()).expect("own bytes");
    assert_eq!(restored.scene(), session.scene());
}
