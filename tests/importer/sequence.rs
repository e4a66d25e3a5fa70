//! Any sequence of calls, drawn from bytes: the random test takes them from a generator, the fuzzer by
//! coverage.
//!
//! Whatever is called with whatever values, these must hold: the status is never fmi2Fatal, no message speaks
//! of an internal error, and a refused call leaves the instance as it was, byte by byte.
// SAFETY, once for all blocks here: components are alive and used by one thread, arrays have the lengths
// given.
#![allow(clippy::undocumented_unsafe_blocks)]

use super::{Slave, Status, reference};
use std::ffi::{c_char, c_void};
use std::ptr::null;
use swarf::fmi::abi::*;
use swarf::variables::{Kind, Variable, all};

/// Bytes as a source of decisions; at their end every decision is the first.
pub struct Draw<'a>(pub &'a [u8]);

impl Draw<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn below(&mut self, limit: usize) -> usize {
        // Two bytes reach every variable and most of a small state.
        let number = usize::from(self.byte().unwrap_or(0)) << 8 | usize::from(self.byte().unwrap_or(0));
        number % limit.max(1)
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }
}

/// Times and steps (s), most of them wrong.
const TIMES: [f64; 9] = [0.0, 1e-6, 2e-7, 1e-12, -1e-6, f64::NAN, f64::INFINITY, 1e300, 5e-324];
/// Factors on a variable's usual size, and values without it.
const FACTORS: [f64; 6] = [1.0, 0.9, 1.1, 0.5, 0.0, -1.0];
const NUMBERS: [i32; 8] = [0, 1, 2, 3, 4, -1, i32::MAX, i32::MIN];
const TEXTS: [&[u8]; 6] =
    [b"AISI 4340\0", b"custom\0", b"\0", b"no such thing\0", b"\xff\xfe\0", b"\xc3\xbc %s %n\0"];

/// An instance with the states it has given out.
struct Actor {
    slave: Slave,
    states: Vec<*mut c_void>,
    time: f64,
}

impl Actor {
    fn new() -> Self {
        let slave = Slave::new(true);
        // Coarse from the start, so that a sequence takes milliseconds.
        slave.set("numerics.point_spacing", 1e-4);
        Actor { slave, states: Vec::new(), time: 0.0 }
    }

    /// The model as bytes, where the call order allows it.
    fn snapshot(&self) -> Option<Vec<u8>> {
        let (component, mut state) = (self.slave.component, std::ptr::null_mut());
        unsafe {
            if fmi2GetFMUstate(component, &raw mut state) != Status::Ok {
                return None;
            }
            let bytes = self.slave.serialize(state);
            fmi2FreeFMUstate(component, &raw mut state);
            Some(bytes)
        }
    }
}

/// Variables that a sequence sets; others would make it slow or write files.
fn is_settable_here(variable: &Variable) -> bool {
    let costly = ["numerics.point_spacing", "numerics.accuracy", "results.directory", "workpiece.width"];
    !costly.contains(&variable.name)
}

/// Performs the calls that `draw` decides on.
///
/// # Panics
/// When a call breaks one of the promises above.
pub fn perform(mut draw: Draw) {
    let variables: Vec<&Variable> = all().filter(|variable| is_settable_here(variable)).collect();
    let mut actors = [Actor::new(), Actor::new()];
    while let Some(choice) = draw.byte() {
        let which = usize::from(choice >> 7);
        if choice & 0x7f == 0x7f {
            // Freed in the middle of anything, states and all.
            actors[which] = Actor::new();
            continue;
        }
        let actor = &mut actors[which];
        let before = actor.snapshot();
        actor.slave.log();
        let status = one_call(actor, choice & 0x7f, &variables, &mut draw);
        let log = actor.slave.log();
        let is_known = matches!(status, Status::Ok | Status::Warning | Status::Discard | Status::Error);
        assert!(is_known, "call {choice} gave {status:?}: {log}");
        assert!(!log.contains("internal error"), "call {choice}: {log}");
        if status == Status::Error {
            assert!(log.contains("logStatusError fmi2"), "call {choice} was refused without a reason: {log}");
            let is_failed_step = log.contains("the instance is in its error state");
            assert!(
                is_failed_step || actor.snapshot() == before,
                "refused call {choice} left a trace: {log}"
            );
        }
    }
}

/// One call on an instance.
fn one_call(actor: &mut Actor, choice: u8, variables: &[&Variable], draw: &mut Draw) -> Status {
    let Actor { slave, states, time } = actor;
    let component = slave.component;
    match choice % 20 {
        0 => {
            let (start, stop) = (draw.one_of(&TIMES), draw.one_of(&TIMES));
            let status = unsafe { fmi2SetupExperiment(component, 0, 0.0, start, draw.below(2) as i32, stop) };
            if status == Status::Ok {
                *time = start;
            }
            status
        }
        1 => unsafe { fmi2EnterInitializationMode(component) },
        2 => unsafe { fmi2ExitInitializationMode(component) },
        3 => unsafe { fmi2Terminate(component) },
        4 => {
            let status = unsafe { fmi2Reset(component) };
            slave.set("numerics.point_spacing", 1e-4);
            *time = 0.0;
            status
        }
        5..=7 => set(component, draw.one_of(variables), draw),
        8 => get(component, draw),
        // A step that fits, more often than one that does not.
        9..=11 => step(slave, time, draw.one_of(&[1e-7, 5e-7, 1e-9]), None),
        12 => step(slave, time, draw.one_of(&TIMES), Some(draw.one_of(&TIMES))),
        13 => {
            let mut state = std::ptr::null_mut();
            let status = unsafe { fmi2GetFMUstate(component, &raw mut state) };
            if status == Status::Ok {
                states.push(state);
            }
            status
        }
        14 => {
            let state = states.get(draw.below(states.len() + 1)).copied().unwrap_or(std::ptr::null_mut());
            let status = slave.restore(state);
            let mut reached = 0.0;
            if status == Status::Ok
                && unsafe { fmi2GetRealStatus(component, 2, &raw mut reached) } == Status::Ok
            {
                *time = reached;
            }
            status
        }
        15 => {
            let index = draw.below(states.len() + 1);
            let mut state =
                if index < states.len() { states.swap_remove(index) } else { std::ptr::null_mut() };
            unsafe { fmi2FreeFMUstate(component, &raw mut state) }
        }
        16 => deserialize(slave, states, draw),
        17 => slave.set_slope(
            draw.one_of(&["feed", "tool_velocity", "friction", "tool.rake_angle"]),
            draw.one_of(&[1, 0, 2]),
            draw.one_of(&[0.0, 1.0, -1e9, f64::NAN]),
        ),
        18 => status_call(component, draw),
        _ => {
            // All of them stay on, so that no refusal is silent.
            let names = [c"logAll".as_ptr(), draw.one_of(&TEXTS).as_ptr().cast::<c_char>()];
            unsafe { fmi2SetDebugLogging(component, 1, draw.below(3), names.as_ptr()) }
        }
    }
}

/// A step of `length`, from where the instance stands unless said otherwise.
fn step(slave: &Slave, time: &mut f64, length: f64, from: Option<f64>) -> Status {
    // Steps of the right size only: a legal one of a whole second would take an hour.
    let length = if length.is_finite() && length > 1e-6 { 1e-6 } else { length };
    let status = slave.step(from.unwrap_or(*time), length);
    unsafe { fmi2GetRealStatus(slave.component, 2, time) };
    status
}

/// Sets a variable, with its own type's function or another's, one value or the same one twice.
fn set(component: *mut c_void, variable: &Variable, draw: &mut Draw) -> Status {
    let reference = if draw.below(16) == 15 { draw.below(5000) as u32 } else { variable.reference };
    if !all().any(|known| known.reference == reference && is_settable_here(known)) {
        return unsafe { fmi2SetReal(component, &u32::MAX, 1, &0.0) };
    }
    let (references, count) = ([reference; 2], 1 + draw.below(2));
    let usual = match &variable.kind {
        Kind::Real(real) => real.access.start(&Default::default()).or(real.nominal).unwrap_or(1.0),
        _ => 1.0,
    };
    let kind = match &variable.kind {
        _ if draw.below(8) == 7 => draw.below(4),
        Kind::Real(_) => 0,
        Kind::Integer(_) | Kind::Choice(_) => 1,
        Kind::Boolean(_) => 2,
        Kind::Text(_) => 3,
    };
    let references = references.as_ptr();
    match kind {
        0 => {
            let value = usual * draw.one_of(&FACTORS);
            let values = [draw.one_of(&[value, value, value, f64::NAN, f64::INFINITY, 1e300, 5e-324]); 2];
            unsafe { fmi2SetReal(component, references, count, values.as_ptr()) }
        }
        1 => unsafe { fmi2SetInteger(component, references, count, [draw.one_of(&NUMBERS); 2].as_ptr()) },
        2 => unsafe { fmi2SetBoolean(component, references, count, [draw.one_of(&NUMBERS); 2].as_ptr()) },
        _ => {
            let text = draw.one_of(&TEXTS).as_ptr().cast::<c_char>();
            unsafe { fmi2SetString(component, references, count, [text; 2].as_ptr()) }
        }
    }
}

/// Reads any variable with any type's function.
fn get(component: *mut c_void, draw: &mut Draw) -> Status {
    let known: Vec<u32> = all().map(|variable| variable.reference).collect();
    let references = [draw.one_of(&known), draw.one_of(&known), draw.below(70_000) as u32];
    let count = draw.below(4);
    let (mut reals, mut integers, mut texts) = ([0.0; 3], [0; 3], [null::<c_char>(); 3]);
    unsafe {
        match draw.below(4) {
            0 => fmi2GetReal(component, references.as_ptr(), count, reals.as_mut_ptr()),
            1 => fmi2GetInteger(component, references.as_ptr(), count, integers.as_mut_ptr()),
            2 => fmi2GetBoolean(component, references.as_ptr(), count, integers.as_mut_ptr()),
            _ => fmi2GetString(component, references.as_ptr(), count, texts.as_mut_ptr()),
        }
    }
}

/// Serialises a state and reads it back, whole or damaged; damage must be refused.
fn deserialize(slave: &Slave, states: &mut Vec<*mut c_void>, draw: &mut Draw) -> Status {
    let Some(&state) = states.get(draw.below(states.len().max(1))) else {
        return slave.deserialize(b"no state").0;
    };
    let mut bytes = slave.serialize(state);
    let at = draw.below(bytes.len());
    let damage = draw.below(3);
    match damage {
        0 => {}
        1 => bytes[at] ^= 1 + draw.below(255) as u8,
        _ => bytes.truncate(at),
    }
    let (status, state) = slave.deserialize(&bytes);
    assert_eq!(status == Status::Ok, damage == 0, "damage {damage} at byte {at}");
    if status == Status::Ok {
        states.push(state);
    }
    status
}

/// Questions about a step, of any kind, and functions that the capability flags rule out.
fn status_call(component: *mut c_void, draw: &mut Draw) -> Status {
    let kind = draw.one_of(&NUMBERS);
    let (mut real, mut integer, mut text) = (0.0, 0, null());
    let feed = reference("feed");
    unsafe {
        match draw.below(8) {
            0 => fmi2GetStatus(component, kind, &raw mut integer),
            1 => fmi2GetRealStatus(component, kind, &raw mut real),
            2 => fmi2GetIntegerStatus(component, kind, &raw mut integer),
            3 => fmi2GetBooleanStatus(component, kind, &raw mut integer),
            4 => fmi2GetStringStatus(component, kind, &raw mut text),
            5 => fmi2GetRealOutputDerivatives(component, &100, 1, &1, &raw mut real),
            6 => fmi2GetDirectionalDerivative(component, &100, 1, &feed, 1, &1.0, &raw mut real),
            _ => fmi2CancelStep(component),
        }
    }
}

/// Bytes from a linear congruential generator (Knuth's constants), the same for the same seed.
pub fn random_bytes(seed: u64, count: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut bytes = Vec::with_capacity(count);
    for _ in 0..count {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        bytes.push((state >> 56) as u8);
    }
    bytes
}
