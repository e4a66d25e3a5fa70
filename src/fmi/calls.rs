//! Which function may be called when: the table of FMI 2.0.4, section 4.2.4, for co-simulation.
//!
//! Two things differ. After a step cut short by the wall time limit (the standard's stepFailed) `fmi2DoStep`
//! may go on from the last successful time. And a state that the standard lacks, `Spoiled`, follows a panic:
//! only what makes the instance sound again, or frees it, is allowed then.

use super::refusal::Refusal;
use super::state::State;

/// A function of the interface and the states that allow it.
#[derive(Debug)]
pub struct Call {
    /// Name in the standard.
    pub name: &'static str,
    /// Bits of the states.
    pub states: u8,
}

impl Call {
    /// Refuses the call in a state that does not allow it.
    ///
    /// # Errors
    /// `Refusal::WrongState`.
    pub fn check(&self, now: State) -> Result<(), Refusal> {
        if self.states & now as u8 != 0 {
            return Ok(());
        }
        let allowed = State::ALL.into_iter().filter(|state| self.states & *state as u8 != 0).collect();
        Err(Refusal::WrongState { now, allowed })
    }
}

const INSTANTIATED: u8 = State::Instantiated as u8;
const INITIALIZATION: u8 = State::Initialization as u8;
const STEP_COMPLETE: u8 = State::StepComplete as u8;
const STEP_DISCARDED: u8 = State::StepDiscarded as u8;
const TERMINATED: u8 = State::Terminated as u8;
const FAILED: u8 = State::Failed as u8;
const SPOILED: u8 = State::Spoiled as u8;

const EVERY: u8 = SOUND | SPOILED;
const SOUND: u8 = INSTANTIATED | INITIALIZATION | STEP_COMPLETE | STEP_DISCARDED | TERMINATED | FAILED;
const AFTER_START: u8 = STEP_COMPLETE | STEP_DISCARDED | TERMINATED | FAILED;
const SETTING: u8 = INSTANTIATED | INITIALIZATION | STEP_COMPLETE;
const STATUS: u8 = STEP_COMPLETE | STEP_DISCARDED | TERMINATED;

/// One constant per function, and the list of all.
macro_rules! table {
    ($($constant:ident $name:literal $states:expr;)+) => {
        $(
            #[doc = concat!("`", $name, "`.")]
            pub static $constant: Call = Call { name: $name, states: $states };
        )+
        /// All functions that need an instance.
        pub static ALL: &[&Call] = &[$(&$constant),+];
    };
}

table! {
    SET_DEBUG_LOGGING "fmi2SetDebugLogging" EVERY;
    FREE_INSTANCE "fmi2FreeInstance" EVERY;
    SETUP_EXPERIMENT "fmi2SetupExperiment" INSTANTIATED;
    ENTER_INITIALIZATION_MODE "fmi2EnterInitializationMode" INSTANTIATED;
    EXIT_INITIALIZATION_MODE "fmi2ExitInitializationMode" INITIALIZATION;
    TERMINATE "fmi2Terminate" STEP_COMPLETE | STEP_DISCARDED;
    RESET "fmi2Reset" EVERY;
    GET_REAL "fmi2GetReal" INITIALIZATION | AFTER_START;
    GET_INTEGER "fmi2GetInteger" INITIALIZATION | AFTER_START;
    GET_BOOLEAN "fmi2GetBoolean" INITIALIZATION | AFTER_START;
    GET_STRING "fmi2GetString" INITIALIZATION | AFTER_START;
    SET_REAL "fmi2SetReal" SETTING;
    SET_INTEGER "fmi2SetInteger" SETTING;
    SET_BOOLEAN "fmi2SetBoolean" SETTING;
    SET_STRING "fmi2SetString" SETTING;
    GET_FMU_STATE "fmi2GetFMUstate" SOUND;
    SET_FMU_STATE "fmi2SetFMUstate" EVERY;
    FREE_FMU_STATE "fmi2FreeFMUstate" EVERY;
    SERIALIZED_FMU_STATE_SIZE "fmi2SerializedFMUstateSize" EVERY;
    SERIALIZE_FMU_STATE "fmi2SerializeFMUstate" EVERY;
    DESERIALIZE_FMU_STATE "fmi2DeSerializeFMUstate" EVERY;
    GET_DIRECTIONAL_DERIVATIVE "fmi2GetDirectionalDerivative" INITIALIZATION | AFTER_START;
    SET_REAL_INPUT_DERIVATIVES "fmi2SetRealInputDerivatives" SETTING;
    GET_REAL_OUTPUT_DERIVATIVES "fmi2GetRealOutputDerivatives" AFTER_START;
    DO_STEP "fmi2DoStep" STEP_COMPLETE | STEP_DISCARDED;
    CANCEL_STEP "fmi2CancelStep" 0;
    GET_STATUS "fmi2GetStatus" STATUS;
    GET_REAL_STATUS "fmi2GetRealStatus" STATUS;
    GET_INTEGER_STATUS "fmi2GetIntegerStatus" STATUS;
    GET_BOOLEAN_STATUS "fmi2GetBooleanStatus" STATUS;
    GET_STRING_STATUS "fmi2GetStringStatus" STATUS;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 34 functions less the three that need no instance.
    #[test]
    fn every_function_of_an_instance_stands_once() {
        let names: std::collections::HashSet<_> = ALL.iter().map(|call| call.name).collect();
        assert_eq!((ALL.len(), names.len()), (31, 31));
    }

    /// A spoiled instance holds nothing that can be trusted, so nothing may be read from it.
    #[test]
    fn a_spoiled_instance_gives_no_values() {
        for call in ALL.iter().filter(|call| call.name.starts_with("fmi2Get") || call.name == "fmi2DoStep") {
            assert!(call.check(State::Spoiled).is_err(), "{} is allowed", call.name);
        }
    }
}
