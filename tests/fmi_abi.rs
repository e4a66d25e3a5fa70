//! The FMU's C functions through whole lives: values, steps, states, threads.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]

mod importer;

use importer::{COARSE, Messages, Slave, Status, callbacks, reference};
use std::ffi::{CStr, CString, c_char};
use std::ptr::null;
use swarf::fmi::abi::*;
use swarf::fmi::description::guid;

/// The plain course of a simulation, with a value of each type.
#[test]
fn a_whole_life_runs() {
    let slave = Slave::new(true);
    let component = slave.component;
    let name = CString::new("AISI 1045").unwrap();
    // SAFETY: the component is alive, the arrays have one entry each.
    unsafe {
        assert_eq!(CStr::from_ptr(fmi2GetVersion()), c"2.0");
        assert_eq!(CStr::from_ptr(fmi2GetTypesPlatform()), c"default");
        assert_eq!(fmi2SetString(component, &reference("material.name"), 1, &name.as_ptr()), Status::Ok);
        assert_eq!(fmi2SetBoolean(component, &reference("effects.rate"), 1, &0), Status::Ok);
        assert_eq!(fmi2SetInteger(component, &reference("numerics.threads"), 1, &1), Status::Ok);
        assert_eq!(fmi2SetInteger(component, &reference("numerics.shape_function"), 1, &2), Status::Ok);
    }
    assert_eq!(slave.set("numerics.point_spacing", 5e-5), Status::Ok);
    slave.initialize();
    for index in 0..3 {
        assert_eq!(slave.step(f64::from(index) * 1e-6, 1e-6), Status::Ok, "{}", slave.log());
    }
    assert!(slave.get_integer("numerics.substeps") > 0);
    assert!(slave.get("tool_position_x") < 3e-3);
    let mut text: *const c_char = null();
    let mut truth = -1;
    // SAFETY: the component is alive, the arrays have one entry each; the text lives until the next such
    // call.
    unsafe {
        assert_eq!(fmi2GetString(component, &reference("material.name"), 1, &raw mut text), Status::Ok);
        assert_eq!(CStr::from_ptr(text), c"AISI 1045");
        assert_eq!(fmi2GetBoolean(component, &reference("effects.rate"), 1, &raw mut truth), Status::Ok);
        assert_eq!(truth, 0);
        assert_eq!(fmi2Terminate(component), Status::Ok);
    }
    let log = slave.log();
    assert!(log.contains("slave 0 logEvents swarf ") && log.contains("material.name = AISI 1045"), "{log}");
    assert!(!log.contains("FORMAT"), "a format other than %s was passed: {log}");
}

/// The standard wants start outputs in initialization mode, before the model is built.
#[test]
fn initialization_mode_shows_the_start_outputs_and_building_keeps_them() {
    let slave = Slave::new(false);
    for (name, value) in COARSE.iter().chain(&[("workpiece.initial_temperature", 350.0), ("feed", 2e-4)]) {
        assert_eq!(slave.set(name, *value), Status::Ok);
    }
    // SAFETY: the component is alive.
    assert_eq!(unsafe { fmi2EnterInitializationMode(slave.component) }, Status::Ok);
    let names = ["cutting_force", "chip_temperature", "tool_position_x", "tool_position_y", "energy.plastic"];
    let before = names.map(|name| slave.get(name));
    assert_eq!(before[..2], [0.0, 350.0]);
    // SAFETY: the component is alive.
    assert_eq!(unsafe { fmi2ExitInitializationMode(slave.component) }, Status::Ok, "{}", slave.log());
    for (name, value) in names.iter().zip(before) {
        let built = slave.get(name);
        // Sums of a few lengths, each rounded.
        assert!((built - value).abs() <= 1e-12 * value.abs(), "{name} was {value} and became {built}");
    }
}

/// Several values in one call are taken together or not at all.
#[test]
fn a_refused_value_changes_nothing() {
    let slave = Slave::new(false);
    let references = [reference("tool.rake_angle"), reference("numerics.courant")];
    // SAFETY: the component is alive, the arrays have two entries each.
    let status = unsafe { fmi2SetReal(slave.component, references.as_ptr(), 2, [0.1, 1.5].as_ptr()) };
    assert_eq!(status, Status::Error);
    let log = slave.log();
    assert!(log.contains("fmi2SetReal: numerics.courant = 1.5 is outside [0.01, 1.25]"), "{log}");
    // SAFETY: the component is alive.
    unsafe { fmi2EnterInitializationMode(slave.component) };
    assert_eq!((slave.get("tool.rake_angle"), slave.get("numerics.courant")), (0.0, 0.5));
}

/// A parameter is fixed once the model is built, an input is not; the deepest feed depends on the scene.
#[test]
fn inputs_change_on_the_way_and_parameters_do_not() {
    let slave = Slave::ready(&[]);
    assert_eq!(slave.set("tool.rake_angle", 0.1), Status::Error);
    assert!(slave.log().contains("tool.rake_angle cannot be set: it is a fixed parameter"));
    assert_eq!(slave.set("cutting_force", 1.0), Status::Error);
    assert_eq!(slave.set("tool_velocity", 40.0), Status::Ok);
    assert_eq!(slave.set("feed", 9e-4), Status::Error);
    assert!(
        slave.log().contains("feed = 0.0009 m is outside"),
        "the feed leaves less than two cells of 0.1 mm"
    );
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok, "{}", slave.log());
    // 3 mm and a gap of 1 µm, less 1 µs at 40 m/s; the solver is ahead by less than one substep of some ns.
    let moved = 3.001e-3 - slave.get("tool_position_x");
    assert!((moved - 40e-6).abs() < 2e-6, "the tool moved by {moved} m");
}

/// With a slope an input moves within the step and stays where it has come.
#[test]
fn a_sloped_input_holds_the_value_it_has_reached() {
    let slave = Slave::ready(&[]);
    assert_eq!(slave.set("feed", 3e-4), Status::Ok);
    assert_eq!(slave.set_slope("feed", 1, 5.0), Status::Ok);
    assert_eq!(slave.step(0.0, 2e-6), Status::Ok, "{}", slave.log());
    assert!((slave.get("feed") - 3.1e-4).abs() < 1e-18, "the feed is {}", slave.get("feed"));
    assert_eq!(slave.step(2e-6, 2e-6), Status::Ok, "{}", slave.log());
    assert!((slave.get("feed") - 3.1e-4).abs() < 1e-18, "the feed is {}", slave.get("feed"));
    // A slope that leads out of the range within the step is refused before the step.
    assert_eq!(slave.set_slope("friction", 1, -1e6), Status::Ok);
    assert_eq!(slave.step(4e-6, 2e-6), Status::Error);
    assert!(slave.log().contains("friction (value and slope at the end of the step)"));
    assert_eq!(slave.set_slope("friction", 1, 0.0), Status::Ok);
    assert_eq!(slave.step(4e-6, 2e-6), Status::Ok);
}

/// A refused step leaves the clock where it is; the instance goes on.
#[test]
fn steps_that_do_not_fit_the_clock_are_refused() {
    let slave = Slave::ready(&[]);
    let refused = [
        (0.0, 0.0, "does not go forward"),
        (0.0, -1e-6, "does not go forward"),
        (0.0, f64::NAN, "not finite"),
        (f64::INFINITY, 1e-6, "not finite"),
        (1e-6, 1e-6, "does not start at the last communication point"),
        (0.0, 5e-5, "passes the stop time"),
    ];
    for (time, step, text) in refused {
        assert_eq!(slave.step(time, step), Status::Error, "{time} {step}");
        let log = slave.log();
        assert!(log.contains(text), "{time} {step}: {log}");
    }
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok);
    assert_eq!(slave.step(0.0, 1e-6), Status::Error);
}

/// The wall time limit cuts a step short; going on from there ends where an uninterrupted run ends, bit by
/// bit.
#[test]
fn a_discarded_step_goes_on_to_the_same_state() {
    let whole = Slave::ready(&[]);
    assert_eq!(whole.step(0.0, 1e-6), Status::Ok);
    assert_eq!(whole.step(1e-6, 1e-6), Status::Ok);
    // A nanosecond is over after the first substep.
    let pieces = Slave::ready(&[("numerics.wall_time_limit", 1e-9)]);
    let (mut time, mut discarded) = (0.0, 0);
    loop {
        let status = pieces.step(time, 1e-6 - time);
        // SAFETY: the component is alive, the place is ours.
        let answer = unsafe { fmi2GetRealStatus(pieces.component, 2, &raw mut time) };
        assert_eq!(answer, Status::Ok, "{}", pieces.log());
        match status {
            Status::Ok => break,
            Status::Discard => discarded += 1,
            other => panic!("{other:?}: {}", pieces.log()),
        }
    }
    assert!(discarded > 2, "{discarded}");
    let log = pieces.log();
    assert!(log.contains("slave 2 logStatusDiscard fmi2DoStep: stopped at"), "{log}");
    assert_eq!(time.to_bits(), 1e-6_f64.to_bits());
    for name in ["energy.kinetic", "energy.plastic", "energy.tool_work", "peak_strain", "tool_position_x"] {
        let mut last = pieces.step(1e-6, 1e-6);
        while last == Status::Discard {
            let mut reached = 0.0;
            // SAFETY: the component is alive, the place is ours.
            unsafe { fmi2GetRealStatus(pieces.component, 2, &raw mut reached) };
            last = pieces.step(reached, 2e-6 - reached);
        }
        assert_eq!(pieces.get(name).to_bits(), whole.get(name).to_bits(), "{name}");
    }
}

/// Back to a state of this instance, and over bytes into another one, the run goes on bit by bit.
#[test]
fn saved_and_serialised_states_go_on_identically() {
    let slave = Slave::ready(&[("tool.rake_angle", 0.1)]);
    for index in 0..4 {
        assert_eq!(slave.step(f64::from(index) * 1e-6, 1e-6), Status::Ok);
    }
    let state = slave.state();
    let bytes = slave.serialize(state);
    assert_eq!(slave.step(4e-6, 1e-6), Status::Ok);
    let expected = slave.outputs();

    assert_eq!(slave.restore(state), Status::Ok);
    assert_eq!(slave.step(4e-6, 1e-6), Status::Ok);
    assert_eq!(slave.outputs(), expected);

    let other = Slave::new(false);
    let (status, copy) = other.deserialize(&bytes);
    assert_eq!(status, Status::Ok, "{}", other.log());
    assert_eq!(other.restore(copy), Status::Ok);
    assert_eq!(other.get("tool.rake_angle"), 0.1);
    assert_eq!(other.step(4e-6, 1e-6), Status::Ok, "{}", other.log());
    assert_eq!(other.outputs(), expected);
    assert_eq!(other.step(5e-6, 4e-5), Status::Error, "the stop time belongs to the state");
}

/// After reset the instance is as new: the same values give the same run.
#[test]
fn reset_and_rerun_is_bit_identical() {
    let slave = Slave::ready(&[("tool.rake_angle", 0.1)]);
    assert_eq!(slave.step(0.0, 2e-6), Status::Ok);
    let first = slave.outputs();
    // SAFETY: the component is alive.
    assert_eq!(unsafe { fmi2Reset(slave.component) }, Status::Ok);
    for (name, value) in COARSE.iter().chain(&[("tool.rake_angle", 0.1)]) {
        assert_eq!(slave.set(name, *value), Status::Ok);
    }
    slave.initialize();
    assert_eq!(slave.get("cutting_force"), 0.0);
    assert_eq!(slave.step(0.0, 2e-6), Status::Ok);
    assert_eq!(slave.outputs(), first);
}

/// Instances share nothing: many at once in many threads give what one gives.
#[test]
fn instances_in_many_threads_do_not_touch_each_other() {
    let run = || {
        let slave = Slave::ready(&[]);
        for index in 0..3 {
            assert_eq!(slave.step(f64::from(index) * 1e-6, 1e-6), Status::Ok);
        }
        slave.outputs()
    };
    let alone = run();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..6).map(|_| scope.spawn(run)).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), alone);
        }
    });
}

/// The solver's messages come when asked for, and do not change the run.
#[test]
fn logging_does_not_change_the_run() {
    let (quiet, loud) = (Slave::ready(&[]), Slave::ready(&[]));
    let categories = [c"solver".as_ptr()];
    // SAFETY: the component is alive, the array has one entry.
    let status = unsafe { fmi2SetDebugLogging(loud.component, 1, 1, categories.as_ptr()) };
    assert_eq!(status, Status::Ok);
    assert_eq!((quiet.step(0.0, 2e-6), loud.step(0.0, 2e-6)), (Status::Ok, Status::Ok));
    assert_eq!(quiet.outputs(), loud.outputs());
    let unknown = [c"solver".as_ptr(), c"gossip".as_ptr()];
    // SAFETY: the component is alive, the array has two entries.
    assert_eq!(unsafe { fmi2SetDebugLogging(loud.component, 0, 2, unknown.as_ptr()) }, Status::Error);
}

/// What `fmi2Instantiate` refuses gives null and, where there is a logger, a reason.
#[test]
fn wrong_instantiations_give_null_and_a_reason() {
    let messages = Messages::default();
    let callbacks = callbacks(&messages);
    let right = CString::new(guid()).unwrap();
    let bad = [0xff_u8 as c_char, 0];
    let cases: [(*const c_char, i32, *const c_char, &str); 7] = [
        (null(), 1, right.as_ptr(), "instanceName is a null pointer"),
        (c"".as_ptr(), 1, right.as_ptr(), "instanceName is empty"),
        (bad.as_ptr(), 1, right.as_ptr(), "instanceName is not UTF-8"),
        (c"a".as_ptr(), 0, right.as_ptr(), "is not co-simulation"),
        (c"a".as_ptr(), 1, null(), "fmuGUID is a null pointer"),
        (c"a".as_ptr(), 1, bad.as_ptr(), "fmuGUID is not UTF-8"),
        (c"a".as_ptr(), 1, c"{0}".as_ptr(), "GUID {0} belongs to another version"),
    ];
    for (name, kind, guid, reason) in cases {
        // SAFETY: texts are null or end with a zero; the callbacks are alive.
        let made = unsafe { fmi2Instantiate(name, kind, guid, null(), &raw const callbacks, 0, 0) };
        assert!(made.is_null(), "{reason}");
        let log = std::mem::take(&mut *messages.lock().unwrap()).join("\n");
        assert!(log.contains(reason), "{reason}: {log}");
    }
    // SAFETY: as above; without callbacks there is nobody to tell.
    let made = unsafe { fmi2Instantiate(c"a".as_ptr(), 1, right.as_ptr(), null(), null(), 0, 0) };
    assert!(made.is_null());
    // No logger is a documented leniency, and a strange resource URI only a warning.
    let silent = Callbacks { logger: None, ..callbacks };
    for (callbacks, uri) in [(silent, c"file:///tmp/a%20b"), (callbacks, c"http://nowhere")] {
        // SAFETY: as above.
        unsafe {
            let (name, guid) = (c"a".as_ptr(), right.as_ptr());
            let made = fmi2Instantiate(name, 1, guid, uri.as_ptr(), &raw const callbacks, 0, 1);
            assert!(!made.is_null());
            fmi2FreeInstance(made);
        }
    }
}

/// Instances come and go without a trace.
#[test]
fn a_thousand_instances_come_and_go() {
    for _ in 0..1000 {
        drop(Slave::new(false));
    }
    drop(Slave::ready(&[]));
}
