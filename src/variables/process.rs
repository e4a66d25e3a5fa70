//! Parameters of what stands in the workshop: process, workpiece, tool, and the results written.
//!
//! Ranges keep the geometry meaningful (sizes above zero, rake within ±60°, clearance 0 to 45°); whether the
//! pieces fit together is the scene's own check.

use super::units::*;
use super::{Access, Kind, Variable, choice_parameter, enumerations, parameter, real};
use crate::scene::SceneKind;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4};

/// Parameters with references 1000 to 1099.
pub(super) static PARAMETERS: &[Variable] = &[
    Variable {
        reference: 1000,
        name: "scene",
        description: "process that is simulated",
        kind: choice_parameter!(enumerations::SCENE, SceneKind, kind),
    },
    Variable {
        reference: 1010,
        name: "workpiece.length",
        description: "length of the workpiece along the cut",
        kind: real(&METRE, "mm", [1e-4, 1.0], Some(1e-3), parameter!(workpiece.length)),
    },
    Variable {
        reference: 1011,
        name: "workpiece.height",
        description: "height of the workpiece",
        kind: real(&METRE, "mm", [1e-5, 1.0], Some(1e-3), parameter!(workpiece.height)),
    },
    Variable {
        reference: 1012,
        name: "workpiece.width",
        description: "width of the workpiece across the cut; in plane strain it only scales forces and \
            energies",
        kind: real(&METRE, "mm", [1e-6, 1.0], Some(1e-3), parameter!(workpiece.width)),
    },
    Variable {
        reference: 1013,
        name: "workpiece.initial_temperature",
        description: "temperature of the workpiece at the start",
        kind: real(&KELVIN, "degC", [1.0, 5000.0], Some(300.0), parameter!(workpiece.initial_temperature)),
    },
    Variable {
        reference: 1014,
        name: "workpiece.endless",
        description: "feed fresh material in front of the tool and drop what lies behind it, for a cut of any length at constant cost (not in this version)",
        kind: Kind::Boolean(parameter!(workpiece.endless)),
    },
    Variable {
        reference: 1015,
        name: "workpiece.revolution_length",
        description: "length of cut after which the tool meets the surface that it left; 0 for never, all else (not in this version)",
        kind: real(&METRE, "mm", [0.0, 100.0], None, parameter!(workpiece.revolution_length)),
    },
    Variable {
        reference: 1016,
        name: "workpiece.held_side",
        description: "hold the left side, towards which the tool cuts: the tool then stops one feed before \
            it; false leaves that side free, so that the tool can leave there",
        kind: Kind::Boolean(parameter!(workpiece.held_side)),
    },
    Variable {
        reference: 1030,
        name: "tool.rake_angle",
        description: "angle of the rake face to the normal of the machined surface, positive when the face \
            leans away from the chip",
        kind: real(&RADIAN, "deg", [-FRAC_PI_3, FRAC_PI_3], Some(0.1), parameter!(tool.rake_angle)),
    },
    Variable {
        reference: 1031,
        name: "tool.clearance_angle",
        description: "angle between the flank of the tool and the machined surface",
        kind: real(&RADIAN, "deg", [0.0, FRAC_PI_4], Some(0.1), parameter!(tool.clearance_angle)),
    },
    Variable {
        reference: 1032,
        name: "tool.edge_radius",
        description: "radius of the cutting edge; 0 for a sharp one",
        kind: real(&METRE, "µm", [0.0, 1e-3], Some(1e-5), parameter!(tool.edge_radius)),
    },
    Variable {
        reference: 1040,
        name: "tool.parting_angle",
        description: "how far the normal of a round edge leans forward from straight down where the material \
            parts, in numerics.formulation = separated: of an uncut layer edge_radius times (1 - cos) goes \
            below the edge",
        kind: real(&RADIAN, "deg", [0.0, FRAC_PI_2], Some(0.6), parameter!(tool.parting_angle)),
    },
    Variable {
        reference: 1033,
        name: "tool.length",
        description: "length of the tool along the cut",
        kind: real(&METRE, "mm", [1e-6, 1.0], Some(1e-3), parameter!(tool.length)),
    },
    Variable {
        reference: 1034,
        name: "tool.height",
        description: "height of the tool",
        kind: real(&METRE, "mm", [1e-6, 1.0], Some(1e-3), parameter!(tool.height)),
    },
    Variable {
        reference: 1035,
        name: "tool.initial_gap",
        description: "distance between the cutting edge and the right side of the workpiece at the start",
        kind: real(&METRE, "µm", [0.0, 0.1], Some(1e-6), parameter!(tool.initial_gap)),
    },
    Variable {
        reference: 1036,
        name: "tool.feed_rate_limit",
        description: "fastest vertical motion of the tool when the feed is changed in a jump",
        kind: real(&METRE_PER_SECOND, "", [0.0, 500.0], Some(10.0), parameter!(tool.feed_rate_limit)),
    },
    Variable {
        reference: 1037,
        name: "tool.conductivity",
        description: "thermal conductivity of the tool, for effects.tool_heat",
        kind: real(&WATT_PER_METRE_KELVIN, "", [1e-3, 5000.0], Some(50.0), parameter!(tool.conductivity)),
    },
    Variable {
        reference: 1038,
        name: "tool.specific_heat",
        description: "specific heat of the tool, for effects.tool_heat",
        kind: real(&JOULE_PER_KILOGRAM_KELVIN, "", [1.0, 1e5], Some(200.0), parameter!(tool.specific_heat)),
    },
    Variable {
        reference: 1039,
        name: "tool.density",
        description: "density of the tool, for effects.tool_heat",
        kind: real(&KILOGRAM_PER_CUBIC_METRE, "", [100.0, 3e4], Some(1e4), parameter!(tool.density)),
    },
    Variable {
        reference: 1420,
        name: "tool.contact_conductance",
        description: "heat that flows between tool and workpiece in contact per area and difference of \
            temperature, for effects.tool_heat",
        kind: real(
            &WATT_PER_SQUARE_METRE_KELVIN,
            "",
            [0.0, 1e12],
            Some(1e6),
            parameter!(tool.contact_conductance),
        ),
    },
    Variable {
        reference: 1050,
        name: "results.directory",
        description: "folder for ParaView files and a table of the outputs, written on the way; empty writes \
            nothing",
        kind: Kind::Text(Access::Parameter {
            get: |scene| scene.results.directory.clone(),
            set: |scene, value| scene.results.directory = value,
        }),
    },
    Variable {
        reference: 1051,
        name: "results.interval",
        description: "simulated time between two files written",
        kind: real(&SECOND, "µs", [1e-9, 1.0], Some(1e-6), parameter!(results.interval)),
    },
    Variable {
        reference: 1001,
        name: "settings",
        description: "parameters and start values of inputs as one text, for importers that drop a type or a unit: name=value; name=value; values with or without a unit, items of enumerations by name or number; taken over when initialization is left, where the variable itself stands at its start value",
        kind: Kind::Text(Access::Parameter {
            get: |scene| scene.settings.clone(),
            set: |scene, value| scene.settings = value,
        }),
    },
];
