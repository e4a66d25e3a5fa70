//! Parameters of the workpiece material and of the effects that run.
//!
//! Ranges hold every metal with room to spare; they keep the laws defined (Poisson's ratio below ½, exponents
//! and stiffness positive), not the engineer from being creative.

use super::units::*;
use super::{Access, Kind, Variable, choice_parameter, enumerations, parameter, real};
use crate::scene::{Heat, Law};

/// Parameters with references 1100 to 1299, and 1440 to 1445, and 1460 to 1465.
pub(super) static PARAMETERS: &[Variable] = &[
    Variable {
        reference: 1100,
        name: "material.name",
        description: "name in the material library, without regard to case, spaces, underscores and hyphens (AISI 4340, AISI 1045, Ti-6Al-4V, Al 2024-T351, OFHC copper), or custom to use the constants given here",
        kind: Kind::Text(Access::Parameter {
            get: |scene| scene.material.name.clone(),
            set: |scene, value| scene.material.name = value,
        }),
    },
    Variable {
        reference: 1101,
        name: "material.law",
        description: "flow stress law of the workpiece",
        kind: choice_parameter!(enumerations::LAW, Law, material.law),
    },
    Variable {
        reference: 1102,
        name: "material.density",
        description: "mass density of the workpiece",
        kind: real(
            &KILOGRAM_PER_CUBIC_METRE,
            "",
            [100.0, 3e4],
            Some(8e3),
            parameter!(material.constants.density),
        ),
    },
    Variable {
        reference: 1103,
        name: "material.youngs_modulus",
        description: "Young's modulus of the workpiece",
        kind: real(&PASCAL, "GPa", [1e6, 2e12], Some(2e11), parameter!(material.constants.youngs_modulus)),
    },
    Variable {
        reference: 1104,
        name: "material.poissons_ratio",
        description: "Poisson's ratio of the workpiece",
        kind: real(&ONE, "", [0.0, 0.495], Some(0.3), parameter!(material.constants.poissons_ratio)),
    },
    Variable {
        reference: 1105,
        name: "material.yield_stress",
        description: "Johnson-Cook constant A: yield stress at the reference rate and temperature",
        kind: real(&PASCAL, "MPa", [1e4, 1e11], Some(1e9), parameter!(material.constants.yield_stress)),
    },
    Variable {
        reference: 1106,
        name: "material.hardening_modulus",
        description: "Johnson-Cook constant B: hardening modulus",
        kind: real(&PASCAL, "MPa", [0.0, 1e11], Some(1e9), parameter!(material.constants.hardening_modulus)),
    },
    Variable {
        reference: 1107,
        name: "material.hardening_exponent",
        description: "Johnson-Cook constant n: hardening exponent",
        kind: real(&ONE, "", [0.0, 2.0], Some(0.3), parameter!(material.constants.hardening_exponent)),
    },
    Variable {
        reference: 1108,
        name: "material.rate_coefficient",
        description: "Johnson-Cook constant C: growth of the flow stress with the logarithm of the strain \
            rate",
        kind: real(&ONE, "", [0.0, 1.0], Some(0.01), parameter!(material.constants.rate_coefficient)),
    },
    Variable {
        reference: 1109,
        name: "material.reference_rate",
        description: "Johnson-Cook reference strain rate",
        kind: real(&PER_SECOND, "", [1e-8, 1e8], Some(1.0), parameter!(material.constants.reference_rate)),
    },
    Variable {
        reference: 1110,
        name: "material.thermal_exponent",
        description: "Johnson-Cook constant m: exponent of the thermal softening",
        kind: real(&ONE, "", [0.05, 10.0], Some(1.0), parameter!(material.constants.thermal_exponent)),
    },
    Variable {
        reference: 1111,
        name: "material.melting_temperature",
        description: "melting temperature: at and above it the flow stress is zero",
        kind: real(
            &KELVIN,
            "degC",
            [200.0, 6000.0],
            Some(1500.0),
            parameter!(material.constants.melting_temperature),
        ),
    },
    Variable {
        reference: 1112,
        name: "material.reference_temperature",
        description: "Johnson-Cook reference temperature: below it nothing softens",
        kind: real(
            &KELVIN,
            "degC",
            [1.0, 5000.0],
            Some(300.0),
            parameter!(material.constants.reference_temperature),
        ),
    },
    Variable {
        reference: 1113,
        name: "material.specific_heat",
        description: "specific heat capacity of the workpiece",
        kind: real(
            &JOULE_PER_KILOGRAM_KELVIN,
            "",
            [1.0, 1e5],
            Some(500.0),
            parameter!(material.constants.specific_heat),
        ),
    },
    Variable {
        reference: 1114,
        name: "material.conductivity",
        description: "thermal conductivity of the workpiece",
        kind: real(
            &WATT_PER_METRE_KELVIN,
            "",
            [0.0, 5000.0],
            Some(50.0),
            parameter!(material.constants.conductivity),
        ),
    },
    Variable {
        reference: 1115,
        name: "material.thermal_expansion",
        description: "coefficient of linear thermal expansion of the workpiece",
        kind: real(
            &PER_KELVIN,
            "",
            [0.0, 1e-3],
            Some(1e-5),
            parameter!(material.constants.thermal_expansion),
        ),
    },
    Variable {
        reference: 1116,
        name: "material.taylor_quinney",
        description: "Taylor-Quinney coefficient: share of the plastic work that becomes heat",
        kind: real(&ONE, "", [0.0, 1.0], Some(0.9), parameter!(material.constants.taylor_quinney)),
    },
    Variable {
        reference: 1117,
        name: "material.d1",
        description: "Johnson-Cook damage constant d1: strain at failure without triaxiality",
        kind: real(&ONE, "", [-100.0, 100.0], None, parameter!(material.constants.damage[0])),
    },
    Variable {
        reference: 1118,
        name: "material.d2",
        description: "Johnson-Cook damage constant d2: factor of the triaxiality term",
        kind: real(&ONE, "", [-100.0, 100.0], None, parameter!(material.constants.damage[1])),
    },
    Variable {
        reference: 1119,
        name: "material.d3",
        description: "Johnson-Cook damage constant d3: exponent of the triaxiality term",
        kind: real(&ONE, "", [-100.0, 100.0], None, parameter!(material.constants.damage[2])),
    },
    Variable {
        reference: 1120,
        name: "material.d4",
        description: "Johnson-Cook damage constant d4: factor of the rate term",
        kind: real(&ONE, "", [-100.0, 100.0], None, parameter!(material.constants.damage[3])),
    },
    Variable {
        reference: 1121,
        name: "material.d5",
        description: "Johnson-Cook damage constant d5: factor of the temperature term",
        kind: real(&ONE, "", [-100.0, 100.0], None, parameter!(material.constants.damage[4])),
    },
    Variable {
        reference: 1440,
        name: "material.tanh_a",
        description: "Sima-Ozel constant a: exponent of the strain at which hardening decays; for \
            material.law = johnson_cook_tanh",
        kind: real(&ONE, "", [0.0, 20.0], Some(2.0), parameter!(material.constants.tanh[0])),
    },
    Variable {
        reference: 1441,
        name: "material.tanh_b",
        description: "Sima-Ozel constant b: exponent of the temperature that moves the strain softening",
        kind: real(&ONE, "", [0.01, 20.0], Some(5.0), parameter!(material.constants.tanh[1])),
    },
    Variable {
        reference: 1442,
        name: "material.tanh_c",
        description: "Sima-Ozel constant c: exponent of the strain in the hyperbolic tangent",
        kind: real(&ONE, "", [0.01, 20.0], Some(2.0), parameter!(material.constants.tanh[2])),
    },
    Variable {
        reference: 1443,
        name: "material.tanh_d",
        description: "Sima-Ozel constant d: exponent of the temperature in the share that softens",
        kind: real(&ONE, "", [0.01, 20.0], Some(1.0), parameter!(material.constants.tanh[3])),
    },
    Variable {
        reference: 1444,
        name: "material.tanh_s",
        description: "Sima-Ozel constant s: exponent of the hyperbolic tangent",
        kind: real(&ONE, "", [0.0, 20.0], Some(0.05), parameter!(material.constants.tanh[4])),
    },
    Variable {
        reference: 1445,
        name: "material.fracture_energy",
        description: "energy per area that material dissipates between the initiation of damage and \
            separation",
        kind: real(
            &JOULE_PER_SQUARE_METRE,
            "",
            [1.0, 1e9],
            Some(1e4),
            parameter!(material.constants.fracture_energy),
        ),
    },
    Variable {
        reference: 1460,
        name: "material.zerilli_armstrong_c0",
        description: "Zerilli-Armstrong constant C0: stress that neither rate nor temperature change; for \
            material.law = zerilli_armstrong",
        kind: real(
            &PASCAL,
            "MPa",
            [0.0, 1e11],
            Some(1e8),
            parameter!(material.constants.zerilli_armstrong.c0),
        ),
    },
    Variable {
        reference: 1461,
        name: "material.zerilli_armstrong_c1",
        description: "Zerilli-Armstrong constant C1: stress at 0 K that heat takes away",
        kind: real(
            &PASCAL,
            "MPa",
            [0.0, 1e11],
            Some(1e9),
            parameter!(material.constants.zerilli_armstrong.c1),
        ),
    },
    Variable {
        reference: 1462,
        name: "material.zerilli_armstrong_c3",
        description: "Zerilli-Armstrong constant C3: how fast the temperature takes that stress away",
        kind: real(
            &PER_KELVIN,
            "",
            [0.0, 0.1],
            Some(5e-3),
            parameter!(material.constants.zerilli_armstrong.c3),
        ),
    },
    Variable {
        reference: 1463,
        name: "material.zerilli_armstrong_c4",
        description: "Zerilli-Armstrong constant C4: how much of it the logarithm of the strain rate over \
            1/s holds",
        kind: real(
            &PER_KELVIN,
            "",
            [0.0, 0.01],
            Some(2e-4),
            parameter!(material.constants.zerilli_armstrong.c4),
        ),
    },
    Variable {
        reference: 1464,
        name: "material.zerilli_armstrong_c5",
        description: "Zerilli-Armstrong constant C5: hardening modulus",
        kind: real(
            &PASCAL,
            "MPa",
            [0.0, 1e11],
            Some(1e9),
            parameter!(material.constants.zerilli_armstrong.c5),
        ),
    },
    Variable {
        reference: 1465,
        name: "material.zerilli_armstrong_n",
        description: "Zerilli-Armstrong constant n: hardening exponent",
        kind: real(&ONE, "", [0.0, 2.0], Some(0.2), parameter!(material.constants.zerilli_armstrong.n)),
    },
    Variable {
        reference: 1200,
        name: "effects.heat",
        description: "what heats the material and where the heat goes",
        kind: choice_parameter!(enumerations::HEAT, Heat, effects.heat),
    },
    Variable {
        reference: 1201,
        name: "effects.rate",
        description: "flow stress depends on the strain rate",
        kind: Kind::Boolean(parameter!(effects.rate)),
    },
    Variable {
        reference: 1202,
        name: "effects.thermal_softening",
        description: "flow stress depends on the temperature",
        kind: Kind::Boolean(parameter!(effects.thermal_softening)),
    },
    Variable {
        reference: 1203,
        name: "effects.tool_heat",
        description: "tool takes up and conducts heat",
        kind: Kind::Boolean(parameter!(effects.tool_heat)),
    },
    Variable {
        reference: 1204,
        name: "effects.thermal_expansion",
        description: "heat makes the material expand",
        kind: Kind::Boolean(parameter!(effects.thermal_expansion)),
    },
    Variable {
        reference: 1205,
        name: "effects.damage",
        description: "material takes damage and separates",
        kind: Kind::Boolean(parameter!(effects.damage)),
    },
    Variable {
        reference: 1206,
        name: "effects.sticking",
        description: "friction traction is capped by the material's shear strength, flow stress over the \
            root of 3; goes with numerics.contact = surface",
        kind: Kind::Boolean(parameter!(effects.sticking)),
    },
    Variable {
        reference: 1207,
        name: "effects.artificial_viscosity",
        description: "shocks are damped by artificial viscosity",
        kind: Kind::Boolean(parameter!(effects.artificial_viscosity)),
    },
    Variable {
        reference: 1208,
        name: "effects.volumetric_locking_control",
        description: "volumetric locking of the plastic flow is controlled",
        kind: Kind::Boolean(parameter!(effects.volumetric_locking_control)),
    },
];
