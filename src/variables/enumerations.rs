//! The enumeration types of the variables: names from the scene's types, explanations for the reader.

use super::chip_state::ChipState;
use crate::scene::{
    Accuracy, ContactChoice, DimensionChoice, Formulation, Heat, Law, Precision, SceneKind, ShapeChoice,
    Speed, TransferChoice,
};

/// How a text ends whose item or value is named in the interface, and refused by this version.
pub const ABSENT: &str = "(not in this version)";

/// An enumeration type; items are numbered from 1 in the order given and only ever appended.
#[derive(Debug)]
pub struct Enumeration {
    /// Name of the type.
    pub name: &'static str,
    /// What is chosen.
    pub description: &'static str,
    /// Names of the items.
    pub items: fn() -> Vec<&'static str>,
    /// What each item means, in the same order.
    pub texts: &'static [&'static str],
}

impl Enumeration {
    /// The item's number, from 1.
    pub fn number_of(&self, item: &str) -> Option<i32> {
        (self.items)().iter().position(|name| *name == item).map(|index| index as i32 + 1)
    }

    /// The item's name, if there is an item of that number.
    pub fn name_of(&self, number: i32) -> Option<&'static str> {
        let index = usize::try_from(number.checked_sub(1)?).ok()?;
        (self.items)().get(index).copied()
    }

    /// All items with their numbers, as an error text lists them; what this version refuses is marked.
    pub fn list(&self) -> String {
        let items = (self.items)().into_iter().zip(self.texts).enumerate();
        let numbered = items.map(|(index, (name, text))| {
            let mark = if text.ends_with(ABSENT) { ", not in this version" } else { "" };
            format!("{name} ({}{mark})", index + 1)
        });
        numbered.collect::<Vec<_>>().join(", ")
    }
}

/// The items' names of an enumeration of `scene`.
macro_rules! items_of {
    ($choice:ident) => {
        || $choice::ALL.iter().map(|item| item.0).collect()
    };
}

/// Which process is simulated.
pub static SCENE: Enumeration = Enumeration {
    name: "Scene",
    description: "process that is simulated",
    items: items_of!(SceneKind),
    texts: &[
        "orthogonal cutting",
        "a rigid press driven into a block (not in this version)",
        "a cylinder against a rigid wall (not in this version)",
    ],
};
/// What heats and where heat goes.
pub static HEAT: Enumeration = Enumeration {
    name: "Heat",
    description: "what heats the material and where the heat goes",
    items: items_of!(Heat),
    texts: &[
        "no temperature at all",
        "plastic work heats each point, nothing flows",
        "plastic and friction work heat, and heat flows",
    ],
};
/// Flow stress law.
pub static LAW: Enumeration = Enumeration {
    name: "FlowStressLaw",
    description: "flow stress law of the workpiece",
    items: items_of!(Law),
    texts: &[
        "Johnson and Cook (1983)",
        "Johnson-Cook with strain softening, Sima and Oezel (2010)",
        "Zerilli and Armstrong (1987) for bcc metals, rate and temperature coupled",
    ],
};
/// Plane strain or three dimensions.
pub static DIMENSION: Enumeration = Enumeration {
    name: "Dimension",
    description: "plane strain or three dimensions",
    items: items_of!(DimensionChoice),
    texts: &["two dimensions, no strain across the width", "three dimensions"],
};
/// Shape function between points and grid.
pub static SHAPE_FUNCTION: Enumeration = Enumeration {
    name: "ShapeFunction",
    description: "shape function between material points and grid",
    items: items_of!(ShapeChoice),
    texts: &["linear (material point method)", "uniform GIMP (generalized interpolation)"],
};
/// How velocities go from the grid back to the points.
pub static TRANSFER: Enumeration = Enumeration {
    name: "Transfer",
    description: "how velocities go from the grid back to the points",
    items: items_of!(TransferChoice),
    texts: &["increments of the grid velocity", "grid velocity with an affine field around each point"],
};
/// How points act on each other and part at the edge.
pub static FORMULATION: Enumeration = Enumeration {
    name: "Formulation",
    description: "how points act on each other and part at the edge",
    items: items_of!(Formulation),
    texts: &[
        "the points of a cell share strain rates and stresses, and chip and work part at the edge",
        "each point by itself, on one velocity field: the scheme of Ambati et al. (2011)",
    ],
};
/// Contact law between tool and workpiece.
pub static CONTACT: Enumeration = Enumeration {
    name: "ContactLaw",
    description: "contact law between tool and workpiece",
    items: items_of!(ContactChoice),
    texts: &[
        "exact signed distance to the tool's surface",
        "distance law with a tool made of points, Ambati et al. (2011) eqs. 19 to 23",
        "velocity law, Bardenhagen et al. (2000), Ambati et al. (2011) eq. 18",
    ],
};
/// Floating-point format of points and grid.
pub static PRECISION: Enumeration = Enumeration {
    name: "Precision",
    description: "floating-point format of points and grid",
    items: items_of!(Precision),
    texts: &["64 bit", "32 bit"],
};
/// How much accuracy is traded for speed.
pub static SPEED: Enumeration = Enumeration {
    name: "Speed",
    description: "how much accuracy is traded for speed",
    items: items_of!(Speed),
    texts: &["nothing is traded", "cutting force within 0.5 %", "cutting force within 2 %"],
};
/// A point on the front of accuracy against cost.
pub static ACCURACY: Enumeration = Enumeration {
    name: "Accuracy",
    description: "a point on the front of accuracy against cost",
    items: items_of!(Accuracy),
    texts: &[
        "a first look",
        "everyday work",
        "careful work",
        "the resolution of Ambati et al. (2011)",
        "the single parameters decide",
    ],
};
/// How far the cut has come.
pub static CHIP_STATE: Enumeration = Enumeration {
    name: "ChipState",
    description: "how far the cut has come",
    items: items_of!(ChipState),
    texts: &[
        "the tool has not touched the workpiece yet",
        "the tool is in contact, the chip is still forming",
        "a chip flows along the rake face",
        "the tool has left the workpiece",
    ],
};

/// All enumeration types, in the order of the description.
pub static ALL: &[&Enumeration] = &[
    &SCENE,
    &HEAT,
    &LAW,
    &DIMENSION,
    &SHAPE_FUNCTION,
    &TRANSFER,
    &CONTACT,
    &PRECISION,
    &SPEED,
    &ACCURACY,
    &CHIP_STATE,
    &FORMULATION,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// A new item needs a text, or the description would lose it.
    #[test]
    fn every_item_has_a_text() {
        for enumeration in ALL {
            let items = (enumeration.items)();
            assert_eq!(items.len(), enumeration.texts.len(), "{}: {items:?}", enumeration.name);
        }
    }

    /// Numbers count from 1, and out-of-range numbers have no item.
    #[test]
    fn numbers_and_names_belong_together() {
        assert_eq!(HEAT.number_of("adiabatic"), Some(2));
        assert_eq!(HEAT.name_of(2), Some("adiabatic"));
        for number in [0, -1, 4, i32::MIN, i32::MAX] {
            assert_eq!(HEAT.name_of(number), None);
        }
    }
}
