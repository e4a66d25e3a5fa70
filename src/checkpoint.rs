//! The byte form of a solver's state: what is saved and restored without a word on what it means.

use crate::error::Error;
use crate::simd::Real;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The bulk of a solver's state: numbers in a fixed order, little endian, without marks between them.
///
/// Raw bytes, as a self-describing form costs several times as much as the copy itself and masters with rollback save
/// at every step.
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

    /// The next count of things that take at least `bytes` each: one that cannot be there is damage, not a reason to ask
    /// for memory.
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
