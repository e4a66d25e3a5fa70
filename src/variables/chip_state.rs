//! How far a cut has come: the values of `chip.state`.

use crate::scene::choice;
use serde::{Deserialize, Serialize};

choice! {
    /// How far the cut has come.
    #[derive(Default)]
    ChipState {
        /// The tool has not touched the workpiece yet.
        #[default]
        Approaching = "approaching",
        /// The tool is in contact, the chip is still forming.
        Entering = "entering",
        /// A chip flows along the rake face.
        Cutting = "cutting",
        /// The tool has left the workpiece.
        Left = "left",
    }
}

impl From<ChipState> for f64 {
    fn from(state: ChipState) -> f64 {
        f64::from(state.number())
    }
}
