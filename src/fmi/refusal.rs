//! Why a call is refused, in words that name what was asked, what is allowed and what holds now.

use super::state::State;
use crate::Error;
use std::fmt;

/// A refused or failed call.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The call is not allowed now.
    WrongState {
        /// State of the instance.
        now: State,
        /// Where the call is allowed.
        allowed: Vec<State>,
    },
    /// No variable has this value reference.
    UnknownReference(u32),
    /// The variable is of another type.
    WrongType {
        /// The variable.
        name: &'static str,
        /// Its type.
        is: &'static str,
        /// The type of the function called.
        asked: &'static str,
    },
    /// The variable cannot be set now, or not at all.
    NotSettable {
        /// The variable.
        name: &'static str,
        /// Why.
        reason: &'static str,
    },
    /// A pointer argument that is null or cannot be one.
    BadPointer {
        /// The argument.
        argument: &'static str,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A text argument that is not UTF-8.
    NotUtf8 {
        /// The argument.
        argument: &'static str,
    },
    /// An argument that is wrong by itself or does not fit the instance.
    BadArgument(String),
    /// A function that the capability flags rule out.
    NotCapable(&'static str),
    /// The scene or the solver refused.
    Model(Error),
    /// The solver could not go on.
    StepFailed(Error),
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Refusal::Model(error)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::WrongState { now, allowed } if allowed.is_empty() => {
                write!(f, "never allowed, as this FMU takes no step in the background; now: {now}")
            }
            Refusal::WrongState { now, allowed } => {
                let names: Vec<String> = allowed.iter().map(ToString::to_string).collect();
                write!(f, "not allowed now ({now}), only when: {}", names.join("; "))
            }
            Refusal::UnknownReference(reference) => {
                write!(f, "no variable has value reference {reference}; nothing was read or changed")
            }
            Refusal::WrongType { name, is, asked } => {
                write!(f, "{name} is of type {is}, not {asked}; nothing was read or changed")
            }
            Refusal::NotSettable { name, reason } => {
                write!(f, "{name} cannot be set: {reason}; the old value is kept")
            }
            Refusal::BadPointer { argument, fault } => write!(f, "argument {argument} {fault}"),
            Refusal::NotUtf8 { argument } => write!(f, "argument {argument} is not UTF-8 text"),
            Refusal::BadArgument(text) => f.write_str(text),
            Refusal::NotCapable(text) => f.write_str(text),
            Refusal::Model(error) => error.fmt(f),
            Refusal::StepFailed(error) => {
                write!(
                    f,
                    "{error}; the instance is in its error state until it is reset or a state is restored"
                )
            }
        }
    }
}

impl std::error::Error for Refusal {}
