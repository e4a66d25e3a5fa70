//! Wrong calls: the call order of the standard's table, bad pointers, bad values, damaged states.

// Apple on ARM passes variable arguments on the stack, where the tests' logger does not look for them.
#![cfg(not(all(target_vendor = "apple", target_arch = "aarch64")))]
// SAFETY, once for all blocks here: the component is alive and used by one thread, arrays have the lengths
// given, and whatever is null, odd or stale is what the test tries and must be refused before it is followed.
#![allow(clippy::undocumented_unsafe_blocks)]

mod importer;

use importer::{Slave, Status, reference};
use std::ffi::{CString, c_char, c_void};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicU32, Ordering};
use swarf::fmi::abi::*;

/// A function with arguments that are right as far as they can be.
type Attempt = fn(&Slave) -> Status;

/// The six states an importer can bring about, as columns of the table below. (What an internal error leaves
/// behind is tried in `src/fmi/abi/tests.rs`, as nothing outside can bring one about.)
const STATES: [&str; 6] =
    ["instantiated", "initialization", "stepComplete", "stepFailed", "terminated", "error"];

/// FMI 2.0.4, section 4.2.4, copied by hand: `x` where the standard allows the call in the state of `STATES`,
/// `+` where we allow it beyond the standard: a discarded step may go on.
const TABLE: &[(&str, &str, Attempt)] = &[
    ("fmi2SetDebugLogging", "xxxxxx", |s| unsafe { fmi2SetDebugLogging(s.component, 0, 0, null()) }),
    ("fmi2SetupExperiment", "x.....", |s| unsafe { fmi2SetupExperiment(s.component, 0, 0.0, 0.0, 0, 0.0) }),
    ("fmi2EnterInitializationMode", "x.....", |s| unsafe { fmi2EnterInitializationMode(s.component) }),
    ("fmi2ExitInitializationMode", ".x....", |s| unsafe { fmi2ExitInitializationMode(s.component) }),
    ("fmi2Terminate", "..xx..", |s| unsafe { fmi2Terminate(s.component) }),
    ("fmi2Reset", "xxxxxx", |s| unsafe { fmi2Reset(s.component) }),
    ("fmi2GetReal", ".xxxxx", |s| unsafe { fmi2GetReal(s.component, &100, 1, &mut 0.0) }),
    ("fmi2GetInteger", ".xxxxx", |s| unsafe { fmi2GetInteger(s.component, &131, 1, &mut 0) }),
    ("fmi2GetBoolean", ".xxxxx", |s| unsafe { fmi2GetBoolean(s.component, &1201, 1, &mut 0) }),
    ("fmi2GetString", ".xxxxx", |s| unsafe { fmi2GetString(s.component, &1100, 1, &mut null()) }),
    ("fmi2SetReal", "xxx...", |s| unsafe { fmi2SetReal(s.component, &1, 1, &50.0) }),
    ("fmi2SetInteger", "xxx...", |s| unsafe { fmi2SetInteger(s.component, null(), 0, null()) }),
    ("fmi2SetBoolean", "xxx...", |s| unsafe { fmi2SetBoolean(s.component, null(), 0, null()) }),
    ("fmi2SetString", "xxx...", |s| unsafe { fmi2SetString(s.component, null(), 0, null()) }),
    ("fmi2GetFMUstate", "xxxxxx", |s| unsafe { fmi2GetFMUstate(s.component, &mut null_mut()) }),
    ("fmi2SetFMUstate", "xxxxxx", |s| s.restore(s.state())),
    ("fmi2FreeFMUstate", "xxxxxx", |s| unsafe { fmi2FreeFMUstate(s.component, &mut s.state()) }),
    ("fmi2SerializedFMUstateSize", "xxxxxx", |s| unsafe {
        fmi2SerializedFMUstateSize(s.component, s.state(), &mut 0)
    }),
    ("fmi2SerializeFMUstate", "xxxxxx", |s| {
        s.serialize(s.state());
        Status::Ok
    }),
    ("fmi2DeSerializeFMUstate", "xxxxxx", |s| s.deserialize(&s.serialize(s.state())).0),
    ("fmi2SetRealInputDerivatives", "xxx...", |s| s.set_slope("feed", 1, 0.0)),
    ("fmi2DoStep", "..x+..", |s| {
        let mut time = 0.0;
        unsafe { fmi2GetRealStatus(s.component, 2, &raw mut time) };
        s.step(time, 1e-12)
    }),
    ("fmi2CancelStep", "......", |s| unsafe { fmi2CancelStep(s.component) }),
    ("fmi2GetRealStatus", "..xxx.", |s| unsafe { fmi2GetRealStatus(s.component, 2, &mut 0.0) }),
    ("fmi2GetBooleanStatus", "..xxx.", |s| unsafe { fmi2GetBooleanStatus(s.component, 3, &mut 0) }),
];

/// Allowed where `TABLE`'s third column would say so, yet never with success, as the capability flags
/// announce.
const INCAPABLE: &[(&str, &str, Status, Attempt)] = &[
    ("fmi2GetRealOutputDerivatives", "..xxxx", Status::Error, |s| unsafe {
        fmi2GetRealOutputDerivatives(s.component, &100, 1, &1, &mut 0.0)
    }),
    ("fmi2GetDirectionalDerivative", ".xxxxx", Status::Error, |s| unsafe {
        fmi2GetDirectionalDerivative(s.component, &100, 1, &1, 1, &1.0, &mut 0.0)
    }),
    ("fmi2GetStatus", "..xxx.", Status::Discard, |s| unsafe { fmi2GetStatus(s.component, 0, &mut 0) }),
    ("fmi2GetIntegerStatus", "..xxx.", Status::Discard, |s| unsafe {
        fmi2GetIntegerStatus(s.component, 0, &mut 0)
    }),
    ("fmi2GetStringStatus", "..xxx.", Status::Discard, |s| unsafe {
        fmi2GetStringStatus(s.component, 1, &mut null())
    }),
];

/// An instance brought into a state.
fn in_state(state: &str) -> Slave {
    let slave = match state {
        "error" => return after_a_failed_step(),
        "stepFailed" => Slave::ready(&[("numerics.wall_time_limit", 1e-9)]),
        "stepComplete" | "terminated" => Slave::ready(&[]),
        _ => Slave::new(false),
    };
    match state {
        "stepFailed" => assert_eq!(slave.step(0.0, 1e-6), Status::Discard, "{}", slave.log()),
        // SAFETY: the component is alive.
        "terminated" => assert_eq!(unsafe { fmi2Terminate(slave.component) }, Status::Ok),
        "initialization" => {
            slave.set("numerics.point_spacing", 5e-5);
            // SAFETY: the component is alive.
            assert_eq!(unsafe { fmi2EnterInitializationMode(slave.component) }, Status::Ok);
        }
        _ => {}
    }
    slave.log();
    slave
}

/// An instance whose step has failed: the folder it writes its results to is gone.
fn after_a_failed_step() -> Slave {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("swarf-failing-{}-{number}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let slave = Slave::new(false);
    let text = CString::new(folder.to_str().unwrap()).unwrap();
    // SAFETY: the component is alive, the arrays have one entry each.
    let status =
        unsafe { fmi2SetString(slave.component, &reference("results.directory"), 1, &text.as_ptr()) };
    assert_eq!(status, Status::Ok, "{}", slave.log());
    for (name, value) in [("numerics.point_spacing", 5e-5), ("results.interval", 1e-7)] {
        assert_eq!(slave.set(name, value), Status::Ok, "{}", slave.log());
    }
    slave.initialize();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(slave.step(0.0, 1e-6), Status::Error);
    let log = slave.log();
    assert!(log.contains("the instance is in its error state"), "{log}");
    slave
}

/// Every function in every state answers as the standard's table says. (`fmi2FreeInstance` ends each case, so
/// it is tried in every state as well.)
#[test]
fn the_call_order_is_that_of_the_standard() {
    let mut names: Vec<&str> =
        TABLE.iter().map(|row| row.0).chain(INCAPABLE.iter().map(|row| row.0)).collect();
    names.push("fmi2FreeInstance");
    let mut known: Vec<&str> = swarf::fmi::calls::ALL.iter().map(|call| call.name).collect();
    names.sort_unstable();
    known.sort_unstable();
    assert_eq!(names, known, "the tables hold every function that needs an instance");
    let all = TABLE.iter().map(|(name, allowed, attempt)| (*name, *allowed, Status::Ok, *attempt));
    for (name, allowed, expected, attempt) in all.chain(INCAPABLE.iter().copied()) {
        for (state, mark) in STATES.iter().zip(allowed.chars()) {
            let slave = in_state(state);
            let status = attempt(&slave);
            let log = slave.log();
            let refused = log.contains("allowed");
            if mark == '.' {
                assert_eq!((status, refused), (Status::Error, true), "{name} when {state}: {log}");
                assert!(log.contains(&format!("slave 3 logStatusError {name}: ")), "{name}: {log}");
            } else {
                // A step in state stepFailed may be cut short again.
                let is_fine = status == expected || (name == "fmi2DoStep" && status == Status::Discard);
                assert!(is_fine && !refused, "{name} when {state}: {status:?} {log}");
            }
        }
    }
}

/// A step that failed is no end: results can be read, and a reset or a restored state makes the instance
/// sound again.
#[test]
fn a_failed_step_can_be_left_by_reset_and_by_an_earlier_state() {
    let sound = Slave::ready(&[]);
    let bytes = sound.serialize(sound.state());
    let slave = after_a_failed_step();
    assert!(slave.get("tool_position_x").is_finite());
    let (status, state) = slave.deserialize(&bytes);
    assert_eq!((status, slave.restore(state)), (Status::Ok, Status::Ok), "{}", slave.log());
    assert_eq!((slave.step(0.0, 1e-6), sound.step(0.0, 1e-6)), (Status::Ok, Status::Ok), "{}", slave.log());
    assert_eq!(slave.outputs(), sound.outputs());
    let other = after_a_failed_step();
    assert_eq!(unsafe { fmi2Reset(other.component) }, Status::Ok);
    other.set("numerics.point_spacing", 5e-5);
    other.initialize();
    assert_eq!(other.step(0.0, 1e-6), Status::Ok, "{}", other.log());
}

/// A null pointer is refused wherever a value is needed, and the instance goes on.
#[test]
fn null_pointers_are_refused_for_every_argument() {
    let slave = Slave::ready(&[]);
    let c = slave.component;
    let state = slave.state();
    let (feed, text, truth, number) = (
        reference("feed"),
        reference("material.name"),
        reference("effects.rate"),
        reference("numerics.threads"),
    );
    let texts = [null::<c_char>()];
    // SAFETY: the component is alive; null pointers are what is tried, and they are not followed.
    let refused: Vec<Status> = unsafe {
        vec![
            fmi2GetReal(c, null(), 1, &mut 0.0),
            fmi2GetReal(c, &feed, 1, null_mut()),
            fmi2GetInteger(c, null(), 1, &mut 0),
            fmi2GetInteger(c, &number, 1, null_mut()),
            fmi2GetBoolean(c, null(), 1, &mut 0),
            fmi2GetBoolean(c, &truth, 1, null_mut()),
            fmi2GetString(c, null(), 1, &mut null()),
            fmi2GetString(c, &text, 1, null_mut()),
            fmi2SetReal(c, null(), 1, &0.0),
            fmi2SetReal(c, &feed, 1, null()),
            fmi2SetInteger(c, null(), 1, &0),
            fmi2SetInteger(c, &number, 1, null()),
            fmi2SetBoolean(c, null(), 1, &0),
            fmi2SetBoolean(c, &truth, 1, null()),
            fmi2SetString(c, null(), 1, texts.as_ptr()),
            fmi2SetString(c, &text, 1, null()),
            fmi2SetString(c, &text, 1, texts.as_ptr()),
            fmi2SetRealInputDerivatives(c, null(), 1, &1, &0.0),
            fmi2SetRealInputDerivatives(c, &feed, 1, null(), &0.0),
            fmi2SetRealInputDerivatives(c, &feed, 1, &1, null()),
            fmi2SetDebugLogging(c, 1, 1, null()),
            fmi2SetDebugLogging(c, 1, 1, texts.as_ptr()),
            fmi2GetFMUstate(c, null_mut()),
            fmi2SetFMUstate(c, null_mut()),
            fmi2SerializedFMUstateSize(c, null_mut(), &mut 0),
            fmi2SerializedFMUstateSize(c, state, null_mut()),
            fmi2SerializeFMUstate(c, null_mut(), &mut 0, 1),
            fmi2SerializeFMUstate(c, state, null_mut(), 1),
            fmi2DeSerializeFMUstate(c, null(), 1, &mut null_mut()),
            fmi2DeSerializeFMUstate(c, (&raw const feed).cast(), 0, &mut null_mut()),
            fmi2DeSerializeFMUstate(c, (&raw const feed).cast(), 4, null_mut()),
            fmi2GetStatus(c, 0, null_mut()),
            fmi2GetRealStatus(c, 2, null_mut()),
            fmi2GetIntegerStatus(c, 0, null_mut()),
            fmi2GetBooleanStatus(c, 3, null_mut()),
            fmi2GetStringStatus(c, 1, null_mut()),
            fmi2GetReal(null_mut(), &feed, 1, &mut 0.0),
            fmi2DoStep(null_mut(), 0.0, 1e-6, 1),
            fmi2Reset(null_mut()),
        ]
    };
    for (index, status) in refused.iter().enumerate() {
        assert_eq!(*status, Status::Error, "case {index}");
    }
    // One message each, but for the three without an instance.
    assert_eq!(slave.log().lines().count(), refused.len() - 3);
    // SAFETY: freeing nothing is allowed.
    unsafe {
        assert_eq!(fmi2FreeFMUstate(c, null_mut()), Status::Ok);
        assert_eq!(fmi2FreeFMUstate(c, &mut null_mut()), Status::Ok);
        fmi2FreeInstance(null_mut());
    }
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok, "{}", slave.log());
}

/// Zero-length arrays are nothing to do, whatever their pointers.
#[test]
fn empty_arrays_may_be_null() {
    let slave = Slave::ready(&[]);
    let c = slave.component;
    // SAFETY: the component is alive; arrays of length zero are not followed.
    unsafe {
        assert_eq!(fmi2GetReal(c, null(), 0, null_mut()), Status::Ok);
        assert_eq!(fmi2GetInteger(c, null(), 0, null_mut()), Status::Ok);
        assert_eq!(fmi2GetBoolean(c, null(), 0, null_mut()), Status::Ok);
        assert_eq!(fmi2GetString(c, null(), 0, null_mut()), Status::Ok);
        assert_eq!(fmi2SetReal(c, null(), 0, null()), Status::Ok);
        assert_eq!(fmi2SetRealInputDerivatives(c, null(), 0, null(), null()), Status::Ok);
        assert_eq!(fmi2SetDebugLogging(c, 0, 0, null()), Status::Ok);
    }
}

/// Lengths and addresses that no array has are refused before anything is read.
#[test]
fn impossible_arrays_are_refused() {
    let slave = Slave::ready(&[]);
    let odd = std::ptr::without_provenance::<u32>(0x1001);
    // SAFETY: the component is alive; misaligned and overlong arrays are refused unread.
    unsafe {
        assert_eq!(fmi2GetReal(slave.component, odd, 1, &mut 0.0), Status::Error);
        assert_eq!(fmi2GetReal(slave.component, &1, usize::MAX, &mut 0.0), Status::Error);
        assert_eq!(fmi2Reset(std::ptr::without_provenance_mut(0x1001)), Status::Error);
    }
}

/// Wrong references, types and values each have their message.
#[test]
fn wrong_values_name_the_variable_and_the_rule() {
    let slave = Slave::new(false);
    let c = slave.component;
    let bad = [0xff_u8 as c_char, 0];
    // SAFETY: the component is alive, the arrays have one entry each.
    let cases = unsafe {
        [
            (fmi2SetReal(c, &4711, 1, &0.0), "no variable has value reference 4711"),
            (fmi2SetReal(c, &1100, 1, &0.0), "material.name is of type String, not Real"),
            (fmi2SetReal(c, &1, 1, &f64::NAN), "tool_velocity = NaN is not a finite number"),
            (fmi2SetReal(c, &1, 1, &501.0), "tool_velocity = 501 m/s is outside [-500, 500] m/s"),
            (fmi2SetInteger(c, &1200, 1, &4), "none (1), adiabatic (2), conduction (3)"),
            (fmi2SetInteger(c, &1312, 1, &-1), "numerics.threads = -1 is outside [0, 1024]"),
            (fmi2SetInteger(c, &131, 1, &1), "chip.state cannot be set: it is an output"),
            (fmi2SetBoolean(c, &1201, 1, &2), "Boolean 2 is neither 0 nor 1"),
            (fmi2SetString(c, &1100, 1, &bad.as_ptr()), "argument value is not UTF-8 text"),
            (fmi2SetRealInputDerivatives(c, &2, 1, &2, &0.0), "only order 1"),
            (fmi2SetRealInputDerivatives(c, &2, 1, &0, &0.0), "only order 1"),
            (fmi2SetRealInputDerivatives(c, &2, 1, &1, &f64::NAN), "slope NaN of feed"),
            (fmi2SetRealInputDerivatives(c, &1010, 1, &1, &0.0), "only a Real input has a slope"),
            (fmi2SetupExperiment(c, 0, 0.0, f64::NAN, 0, 0.0), "start time NaN s"),
            (fmi2SetupExperiment(c, 0, 0.0, 1.0, 1, 1.0), "stop time 1 s does not lie after"),
            (fmi2SetupExperiment(c, 1, -1.0, 0.0, 0, 0.0), "tolerance -1"),
        ]
    };
    let log = slave.log();
    assert_eq!(log.lines().count(), cases.len(), "{log}");
    for (line, (status, text)) in log.lines().zip(cases) {
        assert_eq!(status, Status::Error, "{text}");
        assert!(line.contains(text), "{text}: {line}");
    }
}

/// What this version does not have is refused when the model is built; the value can be corrected then.
#[test]
fn a_scene_that_cannot_be_built_can_be_corrected() {
    let slave = Slave::new(false);
    let c = slave.component;
    // SAFETY: the component is alive, the arrays have one entry each.
    unsafe {
        slave.set("numerics.point_spacing", 5e-5);
        assert_eq!(fmi2SetBoolean(c, &reference("workpiece.endless"), 1, &1), Status::Ok);
        assert_eq!(fmi2EnterInitializationMode(c), Status::Ok);
        assert_eq!(fmi2ExitInitializationMode(c), Status::Error);
        let log = slave.log();
        assert!(
            log.contains("fmi2ExitInitializationMode: workpiece.endless = true is not available"),
            "{log}"
        );
        assert_eq!(fmi2SetBoolean(c, &reference("workpiece.endless"), 1, &0), Status::Ok);
        assert_eq!(fmi2ExitInitializationMode(c), Status::Ok, "{}", slave.log());
    }
}

/// States belong to their instance, and only while they are not freed.
#[test]
fn stale_and_foreign_states_are_refused() {
    let (slave, other) = (Slave::ready(&[]), Slave::ready(&[]));
    let mut state = slave.state();
    let kept = state;
    assert_eq!(other.restore(state), Status::Error);
    // SAFETY: the component is alive; states are not followed as pointers.
    unsafe {
        assert_eq!(fmi2FreeFMUstate(slave.component, &raw mut state), Status::Ok);
        assert!(state.is_null());
        let mut stale: *mut c_void = kept;
        assert_eq!(fmi2FreeFMUstate(slave.component, &raw mut stale), Status::Error);
        assert_eq!(fmi2GetFMUstate(slave.component, &raw mut stale), Status::Error);
    }
    assert_eq!(slave.restore(kept), Status::Error);
    // A state that is given again is overwritten, not doubled.
    let again = slave.state();
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok);
    let mut same = again;
    // SAFETY: as above.
    assert_eq!(unsafe { fmi2GetFMUstate(slave.component, &raw mut same) }, Status::Ok);
    assert_eq!(same, again);
    assert_eq!(slave.restore(again), Status::Ok);
    assert_eq!(slave.step(1e-6, 1e-6), Status::Ok, "{}", slave.log());
}

/// No damaged state is taken: not shortened, not lengthened, with no byte changed anywhere.
#[test]
fn damaged_states_are_refused() {
    let slave = Slave::ready(&[]);
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok);
    let bytes = slave.serialize(slave.state());
    // Places spread by a linear congruential generator (Knuth's constants), the same in every run.
    let mut random = 1_u64;
    let mut next = |below: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % below
    };
    for case in 0..10_000 {
        let mut copy = bytes.clone();
        match case % 4 {
            0 => copy.truncate(next(bytes.len())),
            1 => copy.extend(std::iter::repeat_n(0, 1 + next(64))),
            _ => copy[next(bytes.len())] ^= 1 + next(255) as u8,
        }
        let (status, state) = slave.deserialize(&copy);
        assert!(status == Status::Error && state.is_null(), "damage {case} was taken");
    }
    let log = slave.log();
    assert!(log.lines().all(|line| line.contains("serialised state refused")), "{log}");
    assert_eq!(slave.deserialize(&bytes).0, Status::Ok, "{}", slave.log());
    assert_eq!(slave.step(1e-6, 1e-6), Status::Ok, "{}", slave.log());
}

/// Values in millimetres, degrees or Celsius are refused with the value that was probably meant, or warned of
/// where they are allowed.
#[test]
fn slips_of_units_are_told() {
    let slave = Slave::new(false);
    for (name, value, hint) in [
        ("numerics.point_spacing", 0.01, "SI: metres; 0.01 mm is 1e-5"),
        ("workpiece.length", 3.0, "SI: metres; 3 mm is 3e-3"),
        ("tool.edge_radius", 0.02, "SI: metres; 0.02 mm is 2e-5"),
        ("tool.rake_angle", 10.0, "SI: radians; 10 deg is 0.1745"),
        ("workpiece.initial_temperature", -20.0, "SI: kelvin; -20 degC is 253.15"),
    ] {
        assert_eq!(slave.set(name, value), Status::Error, "{name}");
        let log = slave.log();
        assert!(log.ends_with(hint), "{log}");
    }
    assert_eq!(slave.set("numerics.point_spacing", 5e-5), Status::Ok);
    assert_eq!(slave.set("workpiece.initial_temperature", 20.0), Status::Ok);
    assert_eq!(slave.set("feed", 0.3), Status::Ok, "what is too deep is known when the model is built");
    // SAFETY: the component is alive.
    unsafe {
        assert_eq!(fmi2EnterInitializationMode(slave.component), Status::Ok);
        assert_eq!(fmi2ExitInitializationMode(slave.component), Status::Error);
        let log = slave.log();
        assert!(
            log.contains("feed = 0.3 m is outside [-0.001, ") && log.ends_with("0.3 mm is 3e-4"),
            "{log}"
        );
        assert_eq!(slave.set("feed", 3e-4), Status::Ok);
        assert_eq!(fmi2ExitInitializationMode(slave.component), Status::Ok);
    }
    let log = slave.log();
    assert!(log.starts_with("slave 1 logStatusWarning fmi2ExitInitializationMode: "), "{log}");
    assert!(log.ends_with("SI: kelvin; 20 degC is 293.15 K"), "{log}");
}

/// Every step towards a held side succeeds, as masters lose what they have over one that does not; two
/// warnings say what comes and what came, and the time and the outputs go on.
#[test]
fn a_run_into_the_held_side_keeps_its_results() {
    let slave = Slave::ready(&[("workpiece.length", 1e-3)]);
    let mut log = String::new();
    for k in 0..30 {
        assert_eq!(slave.step(f64::from(k) * 1e-6, 1e-6), Status::Ok, "{}", slave.log());
        log += &slave.log();
        log += "\n";
    }
    let told: Vec<&str> = log.lines().filter(|line| !line.is_empty()).collect();
    assert_eq!(told.len(), 2, "{log}");
    assert!(told.iter().all(|line| line.starts_with("slave 1 logStatusWarning fmi2DoStep: at ")), "{log}");
    assert!(told[0].contains("less than 2 feeds are left"), "{log}");
    assert!(told[1].contains("the tool stopped 1 feed before the workpiece's left side"), "{log}");
    let x = slave.get("tool_position_x");
    // It stops within one substep, of some 10 ns at this spacing.
    assert!(x <= 3e-4 && x > 3e-4 - 1e-6, "the tool stopped at {x} m");
    assert_eq!((slave.get_integer("chip.state"), slave.get("cutting_power")), (3, 0.0));
}

/// The output and one line of the log tell that the tool lags behind a jump of the feed.
#[test]
fn a_tool_that_lags_is_told_once() {
    let slave = Slave::ready(&[]);
    assert_eq!(slave.set("feed", -1e-4), Status::Ok);
    assert_eq!(slave.step(0.0, 1e-6), Status::Ok);
    let log = slave.log();
    assert_eq!(log.lines().count(), 1, "{log}");
    assert!(
        log.starts_with("slave 1 logStatusWarning fmi2DoStep: at ") && log.contains("the tool lags"),
        "{log}"
    );
    // 0.4 mm asked for, 10 µm gone in 1 µs at 10 m/s, and up to a substep more.
    let lag = slave.get("tool_lag");
    assert!((lag + 3.9e-4).abs() < 1e-6, "lag {lag} m");
    assert_eq!(slave.step(1e-6, 1e-6), Status::Ok);
    assert_eq!(slave.log(), "", "said once");
}
