//! Where in the call order an instance stands.

use serde::{Deserialize, Serialize};
use std::fmt;

/// State of an instance, one bit each.
#[repr(u8)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum State {
    /// Parameters may be set.
    Instantiated = 1,
    /// Between entering and leaving initialization mode.
    Initialization = 2,
    /// The model is built, the last step was done.
    StepComplete = 4,
    /// The last step was cut short; the standard's stepFailed.
    StepDiscarded = 8,
    /// Over; results can be read.
    Terminated = 16,
    /// A step failed.
    Failed = 32,
    /// A panic was caught.
    Spoiled = 64,
}

impl State {
    /// All states.
    pub const ALL: [State; 7] = [
        State::Instantiated,
        State::Initialization,
        State::StepComplete,
        State::StepDiscarded,
        State::Terminated,
        State::Failed,
        State::Spoiled,
    ];
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            State::Instantiated => "instantiated",
            State::Initialization => "in initialization mode",
            State::StepComplete => "ready for a step",
            State::StepDiscarded => "after a step that was cut short",
            State::Terminated => "terminated",
            State::Failed => "after a step that failed",
            State::Spoiled => "spoiled by an internal error; reset it, restore a state or free it",
        })
    }
}
