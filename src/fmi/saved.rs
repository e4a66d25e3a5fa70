//! The model of an instance: all that an FMU state holds, and its form as bytes.
//!
//! Bytes: length of the header (u64, little endian), header, session, in one `checkpoint::Envelope` whose
//! origin is the hash of the interface.

use super::description::interface_hash;
use super::state::State;
use crate::checkpoint::Envelope;
use crate::scene::{Inputs, Scene};
use crate::{Error, Session, variables};
use serde::{Deserialize, Serialize};

/// Everything that decides how an instance goes on.
#[derive(Clone)]
pub struct Model {
    /// Where in the call order it stands, times and values.
    pub header: Header,
    /// The run, once initialization mode is left.
    pub session: Option<Session>,
}

/// The part of a model besides the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Where in the call order the instance stands.
    pub state: State,
    /// Parameters as set by the importer, and the present inputs.
    pub scene: Scene,
    /// Slopes of the inputs for the next or the interrupted step (per second).
    pub slopes: Inputs,
    /// Start of the experiment (s).
    pub start: f64,
    /// End of the experiment, if the importer has fixed one (s).
    pub stop: Option<f64>,
    /// Last communication point, or where an interrupted step ended (s).
    pub time: f64,
}

/// Slopes of inputs that keep their values.
pub const NO_SLOPES: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// A saved model; the bytes are kept between asking for their number and asking for them.
pub(super) struct Saved {
    pub(super) model: Model,
    pub(super) bytes: Option<Vec<u8>>,
}

impl Default for Model {
    fn default() -> Self {
        let header = Header {
            state: State::Instantiated,
            scene: Scene::default(),
            slopes: NO_SLOPES,
            start: 0.0,
            stop: None,
            time: 0.0,
        };
        Model { header, session: None }
    }
}

impl Model {
    /// The model as bytes.
    ///
    /// # Errors
    /// None known; a header that cannot be written would be `Error::DamagedState`.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let header = postcard::to_stdvec(&self.header).map_err(|e| damaged(&e.to_string()))?;
        let session = self.session.as_ref().map(Session::to_bytes).unwrap_or_default();
        let length = (header.len() as u64).to_le_bytes();
        Ok(envelope(&interface_hash()).seal(&[&length, &header, &session]))
    }

    /// A model from bytes, all of which are checked.
    ///
    /// # Errors
    /// `Error::DamagedState` naming what does not fit.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let hash = interface_hash();
        let content = envelope(&hash).open(bytes)?;
        let too_long = || damaged("its header is longer than it");
        let (length, content) = content.split_first_chunk().ok_or_else(too_long)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
        let (header, session) = content.split_at_checked(length).ok_or_else(too_long)?;
        let (header, rest): (Header, _) =
            postcard::take_from_bytes(header).map_err(|e| damaged(&e.to_string()))?;
        if !rest.is_empty() {
            return Err(damaged("there is more in its header than a header"));
        }
        header.check()?;
        let session = if session.is_empty() { None } else { Some(Session::from_bytes(session)?) };
        let is_built = !matches!(header.state, State::Instantiated | State::Initialization);
        if is_built != session.is_some() {
            return Err(damaged("the run does not belong to the state of the instance"));
        }
        if let Some(session) = &session {
            // A run that failed may hold anything; nothing goes on from it.
            if header.state != State::Failed {
                session.check_run()?;
            }
            session.check_inputs(&header.scene.inputs).map_err(|error| damaged(&error.to_string()))?;
        }
        Ok(Model { header, session })
    }
}

impl Header {
    /// Checks every value.
    fn check(&self) -> Result<(), Error> {
        let refused = |error: Error| damaged(&error.to_string());
        variables::check_ranges(&self.scene).map_err(refused)?;
        variables::check_slopes(&self.slopes).map_err(refused)?;
        let (start, time) = (self.start, self.time);
        if !(start.is_finite() && time.is_finite() && time >= start) {
            return Err(damaged(&format!("its time {time} s does not lie after its start {start} s")));
        }
        match self.stop {
            Some(stop) if !(stop.is_finite() && stop > start) => {
                Err(damaged(&format!("its stop time {stop} s does not lie after its start {start} s")))
            }
            _ => Ok(()),
        }
    }
}

/// What stands around a model's bytes: format 4.
fn envelope(hash: &[u8]) -> Envelope<'_> {
    Envelope { word: *b"SWARFFMU", format: 4, origin: hash, of: "this FMU" }
}

fn damaged(text: &str) -> Error {
    Error::DamagedState(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed() -> Model {
        let mut model = Model::default();
        model.header.scene.tool.rake_angle = 0.1;
        model.header.stop = Some(4e-5);
        model
    }

    /// What is saved is what comes back.
    #[test]
    fn a_model_survives_its_bytes() {
        let model = changed();
        let back = Model::from_bytes(&model.to_bytes().unwrap()).unwrap();
        assert_eq!(back.header, model.header);
    }

    /// CRC-32 finds every burst of up to 32 bits; shortened and lengthened bytes contradict their length.
    #[test]
    fn every_single_damaged_byte_and_every_other_length_is_refused() {
        let bytes = changed().to_bytes().unwrap();
        for index in 0..bytes.len() {
            for flip in [1, 0x80, 0xff] {
                let mut copy = bytes.clone();
                copy[index] ^= flip;
                assert!(Model::from_bytes(&copy).is_err(), "byte {index} flipped by {flip:#x} was taken");
            }
            assert!(Model::from_bytes(&bytes[..index]).is_err(), "the first {index} bytes were taken");
        }
        let mut longer = bytes;
        longer.push(0);
        assert!(Model::from_bytes(&longer).is_err());
    }
}
