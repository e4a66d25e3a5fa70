//! Parameters of how a scene is computed.
//!
//! The Courant number ends at 1.25: beyond, no material is stable with smoothed increments and two points per
//! cell edge or more (`setup::courant_limit`), nor beyond 0.6 with plain ones. From 0.61 on the reference cut
//! feeds itself energy (a ledger off by 2 % and more, at 0.65 by 150 %) and too much plastic strain while the
//! force still looks right. The limit of the scene's material, 0.5485 for steel, is known once the scene is
//! (`setup::checks`).

use super::units::*;
use super::{Kind, NONE, Variable, choice_parameter, enumerations, integer, parameter, real};
use crate::scene::{
    Accuracy, ContactChoice, DimensionChoice, Formulation, Precision, ShapeChoice, Speed, TransferChoice,
};

/// Parameters with references 1300 to 1399.
pub(super) static PARAMETERS: &[Variable] = &[
    Variable {
        reference: 1300,
        name: "numerics.dimension",
        description: "plane strain or three dimensions",
        kind: choice_parameter!(enumerations::DIMENSION, DimensionChoice, numerics.dimension),
    },
    Variable {
        reference: 1301,
        name: "numerics.point_spacing",
        description: "distance between neighbouring material points at the start; half of it costs 8 times \
            as much in plane strain",
        kind: real(&METRE, "µm", [1e-7, 1e-3], Some(1e-5), parameter!(numerics.point_spacing)),
    },
    Variable {
        reference: 1302,
        name: "numerics.points_per_cell_edge",
        description: "material points along each edge of a grid cell at the start",
        kind: integer([1, 4], parameter!(numerics.points_per_cell_edge)),
    },
    Variable {
        reference: 1303,
        name: "numerics.courant",
        description: "time step over the time in which sound and material cross a grid cell; above a limit \
            that the material sets, for steel 0.548 and 1.12 with numerics.smoothed_increments, the scheme \
            would gain energy: refused",
        kind: real(&ONE, "", [0.01, 1.25], Some(0.5), parameter!(numerics.courant)),
    },
    Variable {
        reference: 1304,
        name: "numerics.shape_function",
        description: "shape function between material points and grid",
        kind: choice_parameter!(enumerations::SHAPE_FUNCTION, ShapeChoice, numerics.shape_function),
    },
    Variable {
        reference: 1305,
        name: "numerics.transfer",
        description: "how velocities go from the grid back to the points",
        kind: choice_parameter!(enumerations::TRANSFER, TransferChoice, numerics.transfer),
    },
    Variable {
        reference: 1306,
        name: "numerics.contact",
        description: "contact law between tool and workpiece",
        kind: choice_parameter!(enumerations::CONTACT, ContactChoice, numerics.contact),
    },
    Variable {
        reference: 1307,
        name: "numerics.precision",
        description: "floating-point format of points and grid",
        kind: choice_parameter!(enumerations::PRECISION, Precision, numerics.precision),
    },
    Variable {
        reference: 1308,
        name: "numerics.speed",
        description: "how much accuracy is traded for speed: sets precision, Courant number, active window \
            and chip, mass scaling and smoothed increments where they stand at their start values",
        kind: choice_parameter!(enumerations::SPEED, Speed, numerics.speed),
    },
    Variable {
        reference: 1309,
        name: "numerics.mass_scaling",
        description: "factor on the mass, for larger time steps at ordinary cutting speeds; 1 for none, 0 \
            for as much as numerics.inertia_error allows",
        kind: real(&ONE, "", [0.0, 1e8], Some(1.0), parameter!(numerics.mass_scaling)),
    },
    Variable {
        reference: 1310,
        name: "numerics.inertia_error",
        description: "share of the cutting force that automatic mass scaling may change, as predicted from \
            the momentum of the chip",
        kind: real(&ONE, "%", [1e-5, 0.5], Some(0.005), parameter!(numerics.inertia_error)),
    },
    Variable {
        reference: 1311,
        name: "numerics.accuracy",
        description: "sets spacing, scheme and speed together; custom lets the single parameters decide",
        kind: choice_parameter!(enumerations::ACCURACY, Accuracy, numerics.accuracy),
    },
    Variable {
        reference: 1312,
        name: "numerics.threads",
        description: "threads of this instance; 0 for all that pay",
        kind: integer([0, 1024], parameter!(numerics.threads)),
    },
    Variable {
        reference: 1313,
        name: "numerics.wall_time_limit",
        description: "wall time that one doStep may take before it is discarded at a time it can go on from; \
            0 for any",
        kind: real(&SECOND, "", [0.0, NONE], None, parameter!(numerics.wall_time_limit)),
    },
    Variable {
        reference: 1314,
        name: "numerics.active_window",
        description: "reach of the integrated material ahead of the tool in feeds, and a third of that \
            behind and below it; the rest of the workpiece stands still; 0 for no window",
        kind: real(&ONE, "", [0.0, 1000.0], Some(4.0), parameter!(numerics.active_window)),
    },
    Variable {
        reference: 1315,
        name: "numerics.smoothed_increments",
        description: "points are moved and strained by velocities whose increments are smoothed over the \
            masses that nodes share: stable up to twice the Courant number",
        kind: Kind::Boolean(parameter!(numerics.smoothed_increments)),
    },
    Variable {
        reference: 1320,
        name: "numerics.formulation",
        description: "how points act on each other and part at the edge; separated needs contact surface and shape function gimp, and is plain without; effects.volumetric_locking_control acts in plain alone",
        kind: choice_parameter!(enumerations::FORMULATION, Formulation, numerics.formulation),
    },
    Variable {
        reference: 1316,
        name: "numerics.active_chip",
        description: "height of the integrated chip above the tool's lowest point in feeds, more where it \
            touches the tool further up; what is higher moves on as a rigid body on which nothing acts; at \
            least 2, or 0 for the whole chip",
        kind: real(&ONE, "", [0.0, 1000.0], Some(3.0), parameter!(numerics.active_chip)),
    },
    Variable {
        reference: 1450,
        name: "numerics.viscosity_linear",
        description: "linear coefficient of the artificial viscosity: its pressure over density, sound \
            speed, cell length and compression rate",
        kind: real(&ONE, "", [0.0, 1.0], Some(0.06), parameter!(numerics.viscosity_linear)),
    },
    Variable {
        reference: 1451,
        name: "numerics.viscosity_quadratic",
        description: "quadratic coefficient of the artificial viscosity: square root of its pressure over \
            density, over cell length and compression rate",
        kind: real(&ONE, "", [0.0, 4.0], Some(1.2), parameter!(numerics.viscosity_quadratic)),
    },
    Variable {
        reference: 1321,
        name: "numerics.point_rate",
        description: "material points at rest that a core moves by a substep in a second: what numerics.estimated_cpu_time counts with; the log's category solver tells what this machine would take; changes nothing else",
        kind: real(&PER_SECOND, "", [1.0, 1e15], Some(1e7), parameter!(numerics.point_rate)),
    },
];
