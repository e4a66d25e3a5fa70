//! Inputs and outputs.

use super::units::*;
use super::{Access, Choice, Kind, NONE, Variable, enumerations, integer, real};
use crate::scene::Scene;
use crate::session::Outputs;

macro_rules! input {
    ($place:ident) => {
        Access::Input { get: |inputs| inputs.$place, set: |inputs, value| inputs.$place = value }
    };
}

macro_rules! output {
    ($place:ident) => {
        Access::Output { get: |outputs| outputs.$place }
    };
}

/// Inputs: references 1 to 99.
pub(super) static INPUTS: &[Variable] = &[
    Variable {
        reference: 1,
        name: "tool_velocity",
        description: "cutting speed; positive drives the tool into the workpiece, towards -x",
        kind: real(&METRE_PER_SECOND, "", [-500.0, 500.0], Some(50.0), input!(tool_velocity)),
    },
    Variable {
        reference: 2,
        name: "feed",
        description: "uncut chip thickness: depth of the tool's lowest point below the workpiece's top surface, at most the workpiece height less two cells; a jump is followed at tool.feed_rate_limit, an input derivative exactly",
        kind: real(&METRE, "mm", [0.0, NONE], Some(1e-4), input!(feed)),
    },
    Variable {
        reference: 3,
        name: "friction",
        description: "Coulomb coefficient of friction between tool and workpiece, on rake face and flank",
        kind: real(&ONE, "", [0.0, 10.0], Some(0.2), input!(friction)),
    },
];

/// Outputs: references 100 to 999.
pub(super) static OUTPUTS: &[Variable] = &[
    Variable {
        reference: 100,
        name: "cutting_force",
        description: "force of the workpiece on the tool against the cutting direction, mean over the last communication step",
        kind: real(&NEWTON, "", [-NONE, NONE], Some(500.0), output!(cutting_force)),
    },
    Variable {
        reference: 101,
        name: "thrust_force",
        description: "force of the workpiece on the tool normal to the machined surface, positive away from the workpiece, mean over the last communication step",
        kind: real(&NEWTON, "", [-NONE, NONE], Some(100.0), output!(thrust_force)),
    },
    Variable {
        reference: 102,
        name: "cutting_force_min",
        description: "smallest cutting force within the last communication step, smoothed over 0.05 µs",
        kind: real(&NEWTON, "", [-NONE, NONE], Some(500.0), output!(cutting_force_min)),
    },
    Variable {
        reference: 103,
        name: "cutting_force_max",
        description: "largest cutting force within the last communication step, smoothed over 0.05 µs",
        kind: real(&NEWTON, "", [-NONE, NONE], Some(500.0), output!(cutting_force_max)),
    },
    Variable {
        reference: 104,
        name: "chip_temperature",
        description: "mass-weighted mean temperature of the chip (material above the machined surface with plastic strain above 0.05); the initial temperature before there is one",
        kind: real(&KELVIN, "degC", [0.0, NONE], Some(500.0), output!(chip_temperature)),
    },
    Variable {
        reference: 105,
        name: "chip_temperature_peak",
        description: "highest temperature of any material point of chip and workpiece",
        kind: real(&KELVIN, "degC", [0.0, NONE], Some(1000.0), output!(chip_temperature_peak)),
    },
    Variable {
        reference: 106,
        name: "peak_strain",
        description: "highest equivalent plastic strain of any material point; a few crushed points at the edge rule it",
        kind: real(&ONE, "", [0.0, NONE], Some(5.0), output!(peak_strain)),
    },
    Variable {
        reference: 107,
        name: "peak_strain_p999",
        description: "99.9th percentile of the equivalent plastic strain over points that have yielded",
        kind: real(&ONE, "", [0.0, NONE], Some(5.0), output!(peak_strain_p999)),
    },
    Variable {
        reference: 108,
        name: "chip_thickness",
        description: "mean chip thickness normal to the rake face; 0 before there is a chip",
        kind: real(&METRE, "mm", [0.0, NONE], Some(1e-4), output!(chip_thickness)),
    },
    Variable {
        reference: 109,
        name: "contact_length",
        description: "length of the rake face in contact with the chip",
        kind: real(&METRE, "mm", [0.0, NONE], Some(1e-4), output!(contact_length)),
    },
    Variable {
        reference: 110,
        name: "shear_angle",
        description: "angle of the shear plane to the cutting direction, from chip thickness ratio and rake angle",
        kind: real(&RADIAN, "deg", [-NONE, NONE], Some(0.5), output!(shear_angle)),
    },
    Variable {
        reference: 111,
        name: "cut_length",
        description: "distance the tool has travelled inside material",
        kind: real(&METRE, "mm", [0.0, NONE], Some(1e-3), output!(cut_length)),
    },
    Variable {
        reference: 112,
        name: "cutting_power",
        description: "work rate of the tool on the workpiece, mean over the last communication step",
        kind: real(&WATT, "kW", [-NONE, NONE], Some(1e4), output!(cutting_power)),
    },
    Variable {
        reference: 113,
        name: "specific_cutting_energy",
        description: "cutting power over removed volume rate; 0 before there is a chip",
        kind: real(
            &JOULE_PER_CUBIC_METRE,
            "J/mm3",
            [-NONE, NONE],
            Some(1e9),
            output!(specific_cutting_energy),
        ),
    },
    Variable {
        reference: 114,
        name: "energy.tool_work",
        description: "work of the tool on the workpiece since the start",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(tool_work)),
    },
    Variable {
        reference: 115,
        name: "energy.kinetic",
        description: "kinetic energy of chip and workpiece",
        kind: real(&JOULE, "mJ", [0.0, NONE], Some(0.1), output!(kinetic_energy)),
    },
    Variable {
        reference: 116,
        name: "energy.elastic",
        description: "elastic strain energy of chip and workpiece",
        kind: real(&JOULE, "mJ", [0.0, NONE], Some(0.1), output!(elastic_energy)),
    },
    Variable {
        reference: 117,
        name: "energy.plastic",
        description: "plastic work in chip and workpiece since the start",
        kind: real(&JOULE, "mJ", [0.0, NONE], Some(0.1), output!(plastic_work)),
    },
    Variable {
        reference: 118,
        name: "energy.friction",
        description: "work of friction between tool and workpiece since the start",
        kind: real(&JOULE, "mJ", [0.0, NONE], Some(0.1), output!(friction_work)),
    },
    Variable {
        reference: 119,
        name: "energy.damping",
        description: "energy that the numerical scheme itself dissipates since the start: transfer between points and grid, explicit time steps, volumetric locking control",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(damping)),
    },
    Variable {
        reference: 120,
        name: "energy.contact",
        description: "energy lost to inelastic contact with tool and fixed nodes since the start",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(contact_loss)),
    },
    Variable {
        reference: 121,
        name: "energy.retired",
        description: "kinetic and elastic energy carried away by points that left the domain",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(retired_energy)),
    },
    Variable {
        reference: 122,
        name: "energy.thermal",
        description: "heat stored in chip and workpiece since the start",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(thermal_energy)),
    },
    Variable {
        reference: 123,
        name: "energy.balance_error",
        description: "unaccounted energy over the tool work, or over the elastic energy of a feed x feed x width block at yield if that is more",
        kind: real(&ONE, "%", [-NONE, NONE], Some(0.01), output!(balance_error)),
    },
    Variable {
        reference: 124,
        name: "numerics.substeps",
        description: "time steps that the solver made in the last communication step",
        kind: integer([0, i32::MAX], output!(substeps)),
    },
    Variable {
        reference: 125,
        name: "numerics.time_step",
        description: "length of the solver's last time step",
        kind: real(&SECOND, "ns", [0.0, NONE], Some(1e-9), output!(time_step)),
    },
    Variable {
        reference: 126,
        name: "numerics.active_points",
        description: "material points that the solver moves",
        kind: integer([0, i32::MAX], output!(active_points)),
    },
    Variable {
        reference: 127,
        name: "numerics.retired_points",
        description: "material points that left the domain; their mass and energy stay in the ledger",
        kind: integer([0, i32::MAX], output!(retired_points)),
    },
    Variable {
        reference: 128,
        name: "numerics.min_jacobian",
        description: "smallest volume ratio det F over all material points",
        kind: real(&ONE, "", [-NONE, NONE], Some(1.0), output!(min_jacobian)),
    },
    Variable {
        reference: 129,
        name: "tool_position_x",
        description: "position along the cut of the tool's lowest point, from the workpiece's lower left corner",
        kind: real(&METRE, "mm", [-NONE, NONE], Some(1e-3), output!(tool_position_x)),
    },
    Variable {
        reference: 130,
        name: "tool_position_y",
        description: "height of the tool's lowest point, from the workpiece's lower left corner",
        kind: real(&METRE, "mm", [-NONE, NONE], Some(1e-3), output!(tool_position_y)),
    },
    Variable {
        reference: 131,
        name: "chip.state",
        description: "how far the cut has come",
        kind: Kind::Choice(Choice { of: &enumerations::CHIP_STATE, access: output!(chip_state) }),
    },
    Variable {
        reference: 132,
        name: "numerics.mass_factor",
        description: "factor on the mass in use, see numerics.mass_scaling",
        kind: real(&ONE, "", [0.0, NONE], Some(1.0), output!(mass_factor)),
    },
    Variable {
        reference: 133,
        name: "energy.surplus_kinetic",
        description: "part of the kinetic energy that is due to scaled mass",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(surplus_kinetic_energy)),
    },
    Variable {
        reference: 134,
        name: "energy.mass_scaling",
        description: "kinetic energy brought in by changes of the mass factor since the start",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(mass_scaling_energy)),
    },
    Variable {
        reference: 190,
        name: "numerics.retries",
        description: "time steps since the start that were solved again at half their length, because a point would have moved too far or changed its volume too much",
        kind: integer([0, i32::MAX], output!(retries)),
    },
    Variable {
        reference: 191,
        name: "numerics.stray_velocities",
        description: "velocities of points since the start that were brought back because they were foreign to all nodes around: what the transfer stores and the grid cannot see",
        kind: integer([0, i32::MAX], output!(stray_velocities)),
    },
    Variable {
        reference: 200,
        name: "numerics.force_error_band",
        description: "share of the cutting force that it may be off by at this spacing and speed level, from the price list measured on the reference cut; 1 where that knows nothing, as for numerics.contact other than surface; 0 before the model is built",
        kind: real(&ONE, "%", [0.0, NONE], Some(0.05), output!(force_error_band)),
    },
    Variable {
        reference: 201,
        name: "numerics.estimated_cpu_time",
        description: "processor time of all threads from start to stop time (without a stop time: over the default experiment's 40 µs), estimated when initialization is left; 0 before, and in a state restored from bytes",
        kind: real(&SECOND, "", [0.0, NONE], Some(10.0), output!(estimated_cpu_time)),
    },
    Variable {
        reference: 171,
        name: "energy.thermoelastic",
        description: "elastic energy that heat took since the start by expanding the material, negative where it gave it",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(thermoelastic)),
    },
    Variable {
        reference: 172,
        name: "energy.tool_heat",
        description: "heat that went into the tool since the start, for effects.heat = conduction: its share of the friction work and, with effects.tool_heat, what flows through the contact",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(tool_heat)),
    },
    Variable {
        reference: 170,
        name: "tool_temperature_peak",
        description: "highest temperature of the tool, for effects.tool_heat; the initial temperature of the workpiece without",
        kind: real(&KELVIN, "degC", [0.0, NONE], Some(500.0), output!(tool_temperature_peak)),
    },
    Variable {
        reference: 180,
        name: "energy.damage",
        description: "work of separation since the start: plastic work of material past the initiation of damage, and the elastic energy that damage releases",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(damage_work)),
    },
    Variable {
        reference: 181,
        name: "energy.viscous",
        description: "work of the artificial viscosity since the start",
        kind: real(&JOULE, "mJ", [-NONE, NONE], Some(0.1), output!(viscous_work)),
    },
    Variable {
        reference: 182,
        name: "sticking_share",
        description: "share of the area of contact where the material sticks to the tool, mean over the last communication step: friction there is below Coulomb's, capped by the shear strength or at rest on the tool; 0 without effects.sticking",
        kind: real(&ONE, "%", [0.0, NONE], Some(0.5), output!(sticking_share)),
    },
];

/// Outputs before the model is built, as initialization mode shows them.
pub fn outputs_at_start(scene: &Scene) -> Outputs {
    Outputs {
        chip_temperature: scene.workpiece.initial_temperature,
        chip_temperature_peak: scene.workpiece.initial_temperature,
        tool_temperature_peak: scene.workpiece.initial_temperature,
        min_jacobian: 1.0,
        mass_factor: 1.0,
        tool_position_x: scene.workpiece.length + scene.tool.initial_gap,
        tool_position_y: scene.workpiece.height - scene.inputs.feed,
        chip_state: 1,
        ..Outputs::default()
    }
}

/// The parameters and inputs that an output's value before the first step depends on; none for a constant.
pub fn start_dependencies(output: &str) -> &'static [&'static str] {
    match output {
        "chip_temperature" | "chip_temperature_peak" | "tool_temperature_peak" => {
            &["workpiece.initial_temperature"]
        }
        "tool_position_x" => &["workpiece.length", "tool.initial_gap"],
        "tool_position_y" => &["feed", "workpiece.height"],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Inputs;
    use crate::variables::all;

    /// The dependencies written to the description are those of the function beside them: found by changing each value.
    #[test]
    fn start_dependencies_are_those_of_the_start_outputs() {
        let inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };
        let scene = Scene::default();
        for output in OUTPUTS {
            let Kind::Real(value) = &output.kind else { continue };
            let at = |scene: &Scene| value.access.read(scene, &inputs, &outputs_at_start(scene));
            let mut found = Vec::new();
            for cause in all() {
                let Kind::Real(real) = &cause.kind else { continue };
                let Some(start) = real.access.start(&scene) else { continue };
                let mut other = scene.clone();
                real.access.set_start(&mut other, start + 1.0);
                if at(&other) != at(&scene) {
                    found.push(cause.name);
                }
            }
            assert_eq!(found, start_dependencies(output.name), "{}", output.name);
        }
    }
}
