//! FMU states: copies of the model that the importer can go back to, and their form as bytes.
//!
//! A state belongs to the instance that made it: the handle given out is a key into the instance's own table
//! and is never followed as a pointer, so a stale or foreign one is refused. Bytes carry a state to another
//! instance or process.

use super::calls;
use super::instance::{Instance, Reply};
use super::logging::Status;
use super::refusal::Refusal;
use super::saved::{Model, Saved};

impl Instance {
    /// Copies the model into a state and gives its handle; `previous` is overwritten if given.
    ///
    /// # Errors
    /// A wrong call order, an unknown previous handle.
    pub fn get_fmu_state(&mut self, previous: Option<usize>) -> Result<usize, Refusal> {
        self.require(&calls::GET_FMU_STATE)?;
        let model = self.model.clone();
        if let Some(handle) = previous {
            *self.saved_mut(handle)? = Saved { model, bytes: None };
            return Ok(handle);
        }
        Ok(self.keep(model))
    }

    /// Goes back to a state.
    ///
    /// # Errors
    /// An unknown handle.
    pub fn set_fmu_state(&mut self, handle: usize) -> Reply {
        self.require(&calls::SET_FMU_STATE)?;
        self.model = self.saved_mut(handle)?.model.clone();
        Ok(Status::Ok)
    }

    /// Forgets a state.
    ///
    /// # Errors
    /// An unknown handle.
    pub fn free_fmu_state(&mut self, handle: usize) -> Reply {
        self.require(&calls::FREE_FMU_STATE)?;
        self.saved.remove(&handle).map(|_| Status::Ok).ok_or_else(unknown_state)
    }

    /// Number of bytes of a state.
    ///
    /// # Errors
    /// An unknown handle.
    pub fn serialized_fmu_state_size(&mut self, handle: usize) -> Result<usize, Refusal> {
        self.require(&calls::SERIALIZED_FMU_STATE_SIZE)?;
        let saved = self.saved_mut(handle)?;
        let bytes = saved.model.to_bytes()?;
        let size = bytes.len();
        saved.bytes = Some(bytes);
        Ok(size)
    }

    /// A state as bytes.
    ///
    /// # Errors
    /// An unknown handle, or a size that is not the state's.
    pub fn serialize_fmu_state(&mut self, handle: usize, size: usize) -> Result<Vec<u8>, Refusal> {
        self.require(&calls::SERIALIZE_FMU_STATE)?;
        let saved = self.saved_mut(handle)?;
        let bytes = match saved.bytes.take() {
            Some(bytes) => bytes,
            None => saved.model.to_bytes()?,
        };
        if bytes.len() != size {
            let text = format!(
                "the state has {} bytes, room was given for {size}; nothing was written",
                bytes.len()
            );
            saved.bytes = Some(bytes);
            return Err(Refusal::BadArgument(text));
        }
        Ok(bytes)
    }

    /// Makes a state from bytes and gives its handle; the model changes only when the state is set.
    ///
    /// # Errors
    /// Bytes that are damaged or of another version.
    pub fn deserialize_fmu_state(&mut self, bytes: &[u8]) -> Result<usize, Refusal> {
        self.require(&calls::DESERIALIZE_FMU_STATE)?;
        let model = Model::from_bytes(bytes)?;
        Ok(self.keep(model))
    }

    fn keep(&mut self, model: Model) -> usize {
        let saved = Box::new(Saved { model, bytes: None });
        // The address is never zero, and no two states alive in one process share it.
        let handle = (&raw const *saved).addr();
        self.saved.insert(handle, saved);
        handle
    }

    fn saved_mut(&mut self, handle: usize) -> Result<&mut Saved, Refusal> {
        self.saved.get_mut(&handle).map(Box::as_mut).ok_or_else(unknown_state)
    }
}

fn unknown_state() -> Refusal {
    Refusal::BadArgument("this FMU state was not made by this instance, or has been freed".into())
}
