//! The byte form of a state: numbers in a fixed order, and the envelope that tells damaged bytes from whole
//! ones.
//!
//! Nothing here knows what the bytes mean: `session` and `fmi::saved` say what they put in. Bytes are sealed
//! once, on the outside.

use crate::error::Error;
use crate::simd::Real;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// What stands around saved bytes, so that damaged and foreign ones are refused before anything is read from
/// them.
///
/// Word (8 bytes), format (u32), origin, length of the content (u64), content, CRC-32 of everything before
/// it; all little endian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Envelope<'a> {
    /// What the bytes are.
    pub word: [u8; 8],
    /// Version of the content's form.
    pub format: u32,
    /// What wrote them, where other writers have other content under the same format.
    pub origin: &'a [u8],
    /// The same in words: "this FMU".
    pub of: &'a str,
}

const CHECKSUM: usize = 4;

impl Envelope<'_> {
    /// The parts of a content, one after the other, with the envelope around them.
    pub fn seal(&self, parts: &[&[u8]]) -> Vec<u8> {
        let length: usize = parts.iter().map(|part| part.len()).sum();
        let mut bytes = Vec::with_capacity(self.front() + length + CHECKSUM);
        bytes.extend_from_slice(&self.word);
        bytes.extend_from_slice(&self.format.to_le_bytes());
        bytes.extend_from_slice(self.origin);
        bytes.extend_from_slice(&(length as u64).to_le_bytes());
        parts.iter().for_each(|part| bytes.extend_from_slice(part));
        let checksum = crc32fast::hash(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// The content of sealed bytes.
    ///
    /// # Errors
    /// `Error::DamagedState` naming what does not fit.
    pub fn open<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], Error> {
        let too_short = || damaged(&format!("{} bytes are too few", bytes.len()));
        let (body, checksum) = bytes.split_last_chunk::<CHECKSUM>().ok_or_else(too_short)?;
        let (front, content) = body.split_at_checked(self.front()).ok_or_else(too_short)?;
        let mut front = BulkReader(front);
        let (word, format) = (front.take::<8>()?, u32::from_le_bytes(front.take()?));
        let (origin, length) = front.0.split_at(self.origin.len());
        let length = BulkReader(length).take().map(u64::from_le_bytes)?;
        let Envelope { of, .. } = self;
        if word != self.word {
            return Err(damaged(&format!("these bytes are no state of {of}")));
        }
        if format != self.format {
            return Err(damaged(&format!("format version {format} where {of} reads {}", self.format)));
        }
        if origin != self.origin {
            return Err(damaged(&format!("it was written by a version of {of} with another GUID")));
        }
        if length != content.len() as u64 {
            return Err(damaged(&format!("{length} bytes were written and {} are here", content.len())));
        }
        if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
            return Err(damaged("the checksum does not match"));
        }
        Ok(content)
    }

    /// Bytes before the content.
    fn front(&self) -> usize {
        8 + 4 + self.origin.len() + 8
    }
}

fn damaged(text: &str) -> Error {
    Error::DamagedState(text.to_owned())
}

/// The bulk of a solver's state: numbers in a fixed order, little endian, without marks between them.
///
/// Raw bytes, as a self-describing form costs several times as much as the copy itself and masters with
/// rollback save at every step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateBytes(Vec<u8>);

impl StateBytes {
    /// None yet, with room for so many bytes.
    pub fn with_capacity(bytes: usize) -> Self {
        StateBytes(Vec::with_capacity(bytes))
    }

    /// Reads the numbers from the first on.
    pub fn reader(&self) -> BulkReader<'_> {
        BulkReader(&self.0)
    }

    /// Appends numbers, each as its bytes.
    pub fn put<const N: usize>(&mut self, numbers: impl Iterator<Item = [u8; N]>) {
        numbers.for_each(|number| self.0.extend_from_slice(&number));
    }

    /// Appends floating-point numbers; single precision is kept exactly by double.
    pub fn put_reals<'a, R: Real>(&mut self, values: impl IntoIterator<Item = &'a R>) {
        self.put(values.into_iter().map(|value| value.to_f64().to_le_bytes()));
    }

    /// Appends counts.
    pub fn put_counts(&mut self, counts: impl IntoIterator<Item = usize>) {
        self.put(counts.into_iter().map(|count| (count as u64).to_le_bytes()));
    }
}

impl Serialize for StateBytes {
    fn serialize<W: Serializer>(&self, writer: W) -> Result<W::Ok, W::Error> {
        writer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for StateBytes {
    fn deserialize<W: Deserializer<'de>>(reader: W) -> Result<Self, W::Error> {
        // Borrowed first: as a sequence every byte would be read by itself.
        <&[u8]>::deserialize(reader).map(|bytes| StateBytes(bytes.to_vec()))
    }
}

/// Reads what `StateBytes` holds, from its front.
pub struct BulkReader<'a>(&'a [u8]);

impl BulkReader<'_> {
    /// The error of a state that does not fit.
    pub fn damaged() -> Error {
        Error::DamagedState("its points do not fit this scene".into())
    }

    /// The next number's bytes.
    ///
    /// # Errors
    /// `Error::DamagedState` when there are none left, as for the other functions.
    pub fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let (number, rest) = self.0.split_first_chunk().ok_or_else(Self::damaged)?;
        self.0 = rest;
        Ok(*number)
    }

    /// The next floating-point number.
    ///
    /// # Errors
    /// As `take`.
    pub fn real<R: Real>(&mut self) -> Result<R, Error> {
        self.take().map(f64::from_le_bytes).map(R::from_f64)
    }

    /// The next count.
    ///
    /// # Errors
    /// As `take`.
    pub fn count(&mut self) -> Result<usize, Error> {
        usize::try_from(u64::from_le_bytes(self.take()?)).map_err(|_| Self::damaged())
    }

    /// Bytes that are left.
    pub fn left(&self) -> usize {
        self.0.len()
    }

    /// The next count of things that take at least `bytes` each: one that cannot be there is damage, not a
    /// reason to ask for memory.
    ///
    /// # Errors
    /// As `take`.
    pub fn count_of(&mut self, bytes: usize) -> Result<usize, Error> {
        self.count()
            .and_then(|count| if count <= self.0.len() / bytes { Ok(count) } else { Err(Self::damaged()) })
    }

    /// Makes sure that nothing is left.
    ///
    /// # Errors
    /// `Error::DamagedState` when something is.
    pub fn finish(self) -> Result<(), Error> {
        if self.0.is_empty() { Ok(()) } else { Err(Self::damaged()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENVELOPE: Envelope = Envelope { word: *b"A CAKE  ", format: 3, origin: &[1, 2], of: "the baker" };

    /// CRC-32 finds every burst of up to 32 bits; shortened and lengthened bytes contradict their length.
    #[test]
    fn every_single_damaged_byte_and_every_other_length_is_refused() {
        let bytes = ENVELOPE.seal(&[b"flour", b"", b"milk"]);
        assert_eq!(ENVELOPE.open(&bytes), Ok(b"flourmilk".as_slice()));
        for index in 0..bytes.len() {
            for flip in [1, 0x80, 0xff] {
                let mut copy = bytes.clone();
                copy[index] ^= flip;
                assert!(ENVELOPE.open(&copy).is_err(), "byte {index} flipped by {flip:#x} was taken");
            }
            assert!(ENVELOPE.open(&bytes[..index]).is_err(), "the first {index} bytes were taken");
        }
        let longer = [bytes.as_slice(), &[0]].concat();
        assert!(ENVELOPE.open(&longer).is_err());
    }

    /// A state of another program, format or version is sound, and not ours; the text says which it is.
    #[test]
    fn foreign_bytes_are_refused_by_name() {
        let others = [
            (Envelope { word: *b"A PIE   ", ..ENVELOPE }, "no state of the baker"),
            (Envelope { format: 2, ..ENVELOPE }, "format version 2 where the baker reads 3"),
            (Envelope { origin: &[1, 3], ..ENVELOPE }, "another GUID"),
        ];
        for (other, expected) in others {
            let text = ENVELOPE.open(&other.seal(&[b"flour"])).unwrap_err().to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
