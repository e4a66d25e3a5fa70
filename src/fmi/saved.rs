//! The model of an instance: all that an FMU state holds, and its form as bytes.
//!
//! Bytes: the word `SWARFFMU`, format version (u32), hash of the interface (16 bytes), length of what follows but the
//! checksum (u64), length of the header (u64), header, session, CRC-32 of everything before it. All little endian.

use super::calls::State;
use super::description::interface_hash;
use crate::scene::{Inputs, Scene};
use crate::{Error, Session};
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

const WORD: &[u8; 8] = b"SWARFFMU";
const FORMAT: u32 = 2;
/// Bytes before the header: word, format, interface, two lengths.
const FRONT: usize = 8 + 4 + 16 + 8 + 8;
const CHECKSUM: usize = 4;

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
        let session = self.session.as_ref().map(Session::save).unwrap_or_default();
        let length = 8 + header.len() + session.len();
        let mut bytes = Vec::with_capacity(FRONT + header.len() + session.len() + CHECKSUM);
        bytes.extend_from_slice(WORD);
        bytes.extend_from_slice(&FORMAT.to_le_bytes());
        bytes.extend_from_slice(&interface_hash());
        bytes.extend_from_slice(&(length as u64).to_le_bytes());
        bytes.extend_from_slice(&(header.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&header);
        bytes.extend_from_slice(&session);
        let checksum = crc32fast::hash(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        Ok(bytes)
    }

    /// A model from bytes, all of which are checked.
    ///
    /// # Errors
    /// `Error::DamagedState` naming what does not fit.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let (body, checksum) = bytes.split_last_chunk::<CHECKSUM>().ok_or_else(|| too_short(bytes))?;
        if body.len() < FRONT {
            return Err(too_short(bytes));
        }
        let (word, rest) = take::<8>(body)?;
        let (format, rest) = take::<4>(rest)?;
        let (interface, rest) = take::<16>(rest)?;
        let (length, rest) = take::<8>(rest)?;
        if &word != WORD {
            return Err(damaged("these bytes are no state of this FMU"));
        }
        if u32::from_le_bytes(format) != FORMAT {
            let found = u32::from_le_bytes(format);
            return Err(damaged(&format!("format version {found} where this FMU reads {FORMAT}")));
        }
        if interface != interface_hash() {
            return Err(damaged("it was written by a version of the FMU with another GUID"));
        }
        if u64::from_le_bytes(length) != rest.len() as u64 {
            let expected = u64::from_le_bytes(length);
            return Err(damaged(&format!("{expected} bytes were written and {} are here", rest.len())));
        }
        if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
            return Err(damaged("the checksum does not match"));
        }
        let (header_length, rest) = take::<8>(rest)?;
        let header_length = usize::try_from(u64::from_le_bytes(header_length)).unwrap_or(usize::MAX);
        let (header, session) =
            rest.split_at_checked(header_length).ok_or_else(|| damaged("its header is longer than it"))?;
        let header: Header = postcard::from_bytes(header).map_err(|e| damaged(&e.to_string()))?;
        let session = if session.is_empty() { None } else { Some(Session::restore(session)?) };
        let is_built = !matches!(header.state, State::Instantiated | State::Initialization);
        if is_built != session.is_some() {
            return Err(damaged("the run does not belong to the state of the instance"));
        }
        Ok(Model { header, session })
    }
}

fn take<const N: usize>(bytes: &[u8]) -> Result<([u8; N], &[u8]), Error> {
    bytes.split_first_chunk::<N>().map(|(first, rest)| (*first, rest)).ok_or_else(|| too_short(bytes))
}

fn too_short(bytes: &[u8]) -> Error {
    damaged(&format!("{} bytes are too few", bytes.len()))
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
