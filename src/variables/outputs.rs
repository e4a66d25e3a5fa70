//! Inputs and outputs: each stands here once.
//!
//! An entry of `outputs!` holds all that is known of an output: its place in `Outputs`, reference, name,
//! type, unit, range, meaning, and where its value comes from. The struct, the variables of the FMU and the
//! columns of tables are made from the entries here; the functions that fill the struct are made from the
//! same entries in `session::outputs`, where what the sources read is known. So this module needs no solver,
//! and a new output is one entry.

use super::chip_state::ChipState;
use super::settings;
use super::units::*;
use super::{Access, Choice, Kind, NONE, Variable, enumerations, integer, real};
use crate::scene::Scene;
use enumerations::Enumeration;
use serde::{Deserialize, Serialize};

macro_rules! input {
    ($place:ident) => {
        Access::Input { get: |inputs| inputs.$place, set: |inputs, value| inputs.$place = value }
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
        description: "uncut chip thickness: depth of the tool's lowest point below the workpiece's top \
                      surface, at most the workpiece height less two cells; negative lifts the tool clear, \
                      by at most the workpiece height; a jump is followed at tool.feed_rate_limit, an input \
                      derivative exactly",
        // No workpiece is higher than 1 m.
        kind: real(&METRE, "mm", [-1.0, NONE], Some(1e-4), input!(feed)),
    },
    Variable {
        reference: 3,
        name: "friction",
        description: "Coulomb coefficient of friction between tool and workpiece, on rake face and flank",
        kind: real(&ONE, "", [0.0, 10.0], Some(0.2), input!(friction)),
    },
];

/// The table of outputs, handed to the macro `$made`; references 100 to 999.
///
/// Sources of a value:
///
/// * `state |r| …`: read from the present state, `session::outputs::Readings`;
/// * `step |s| …`: read from a communication step, `session::outputs::StepReadings`;
/// * `estimate`: put in by `Session::estimate`.
// rustfmt would move the continued lines at every call.
#[rustfmt::skip]
macro_rules! outputs {
    ($made:ident) => {
        $made! {
            cutting_force {
                variable: 100 "cutting_force" real(&NEWTON, "", [-NONE, NONE], Some(500.0)),
                meaning: "force of the workpiece on the tool against the cutting direction, mean over \
                    the last communication step",
                source: step |s| s.force[0],
            }
            thrust_force {
                variable: 101 "thrust_force" real(&NEWTON, "", [-NONE, NONE], Some(100.0)),
                meaning: "force of the workpiece on the tool normal to the machined surface, positive \
                    away from the workpiece, mean over the last communication step",
                source: step |s| s.force[1],
            }
            cutting_force_min {
                variable: 102 "cutting_force_min" real(&NEWTON, "", [-NONE, NONE], Some(500.0)),
                meaning: "smallest cutting force within the last communication step, smoothed over 0.05 \
                    µs",
                source: step |s| s.force_range[0],
            }
            cutting_force_max {
                variable: 103 "cutting_force_max" real(&NEWTON, "", [-NONE, NONE], Some(500.0)),
                meaning: "largest cutting force within the last communication step, smoothed over 0.05 \
                    µs",
                source: step |s| s.force_range[1],
            }
            chip_temperature {
                variable: 104 "chip_temperature" real(&KELVIN, "degC", [0.0, NONE], Some(500.0)),
                meaning: "mass-weighted mean temperature of the chip (material above the machined \
                    surface with plastic strain above 0.05); the initial temperature before there is one",
                source: state |r| r.chip_temperature(),
            }
            chip_temperature_peak {
                variable: 105 "chip_temperature_peak" real(&KELVIN, "degC", [0.0, NONE], Some(1000.0)),
                meaning: "highest temperature of any material point of chip and workpiece",
                source: state |r| r.survey.peak_temperature,
            }
            peak_strain {
                variable: 106 "peak_strain" real(&ONE, "", [0.0, NONE], Some(5.0)),
                meaning: "highest equivalent plastic strain of any material point; a few crushed points \
                    at the edge rule it",
                source: state |r| r.survey.peak_strain,
            }
            peak_strain_p999 {
                variable: 107 "peak_strain_p999" real(&ONE, "", [0.0, NONE], Some(5.0)),
                meaning: "99.9th percentile of the equivalent plastic strain over points that have \
                    yielded",
                source: state |r| r.survey.strain_p999(),
            }
            chip_thickness {
                variable: 108 "chip_thickness" real(&METRE, "mm", [0.0, NONE], Some(1e-4)),
                meaning: "mean chip thickness normal to the rake face; 0 before there is a chip",
                source: state |r| r.chip_thickness(),
            }
            contact_length {
                variable: 109 "contact_length" real(&METRE, "mm", [0.0, NONE], Some(1e-4)),
                meaning: "length of the rake face in contact with the chip",
                source: state |r| r.progress.contact_reach,
            }
            shear_angle {
                variable: 110 "shear_angle" real(&RADIAN, "deg", [-NONE, NONE], Some(0.5)),
                meaning: "angle of the shear plane to the cutting direction, from chip thickness ratio \
                    and rake angle",
                source: state |r| shear_angle(r.feed, r.chip_thickness(), r.scene.tool.rake_angle),
            }
            cut_length {
                variable: 111 "cut_length" real(&METRE, "mm", [0.0, NONE], Some(1e-3)),
                meaning: "distance the tool has travelled inside material",
                source: state |r| r.progress.cut_length,
            }
            cutting_power {
                variable: 112 "cutting_power" real(&WATT, "kW", [-NONE, NONE], Some(1e4)),
                meaning: "work rate of the tool on the workpiece, mean over the last communication \
                    step",
                source: step |s| s.power,
            }
            specific_cutting_energy {
                variable: 113 "specific_cutting_energy"
                    real(&JOULE_PER_CUBIC_METRE, "J/mm3", [-NONE, NONE], Some(1e9)),
                meaning: "cutting power over removed volume rate; 0 before there is a chip",
                source: step |s| s.specific_energy(),
            }
            tool_work {
                variable: 114 "energy.tool_work" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "work of the tool on the workpiece since the start",
                source: state |r| r.ledger.tool_work,
            }
            kinetic_energy {
                variable: 115 "energy.kinetic" real(&JOULE, "mJ", [0.0, NONE], Some(0.1)),
                meaning: "kinetic energy of chip and workpiece",
                source: state |r| r.survey.kinetic,
            }
            elastic_energy {
                variable: 116 "energy.elastic" real(&JOULE, "mJ", [0.0, NONE], Some(0.1)),
                meaning: "elastic strain energy of chip and workpiece",
                source: state |r| r.survey.elastic,
            }
            plastic_work {
                variable: 117 "energy.plastic" real(&JOULE, "mJ", [0.0, NONE], Some(0.1)),
                meaning: "plastic work in chip and workpiece since the start",
                source: state |r| r.ledger.plastic_work,
            }
            friction_work {
                variable: 118 "energy.friction" real(&JOULE, "mJ", [0.0, NONE], Some(0.1)),
                meaning: "work of friction between tool and workpiece since the start",
                source: state |r| r.ledger.friction_work,
            }
            damping {
                variable: 119 "energy.damping" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "energy that the numerical scheme itself dissipates since the start: transfer \
                    between points and grid, explicit time steps, volumetric locking control",
                source: state |r| r.ledger.damping,
            }
            contact_loss {
                variable: 120 "energy.contact" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "energy lost to inelastic contact with tool and fixed nodes since the start",
                source: state |r| r.ledger.contact_loss,
            }
            retired_energy {
                variable: 121 "energy.retired" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "kinetic and elastic energy carried away by points that left the domain",
                source: state |r| r.ledger.retired_energy,
            }
            thermal_energy {
                variable: 122 "energy.thermal" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "heat stored in chip and workpiece since the start",
                source: state |r| r.survey.heat + r.ledger.retired_heat + r.heat.carry + r.heat.waits(),
            }
            balance_error {
                variable: 123 "energy.balance_error" real(&ONE, "%", [-NONE, NONE], Some(0.01)),
                meaning: "unaccounted energy over the tool work, or over the elastic energy of a feed x \
                    feed x width block at yield if that is more",
                source: state |r| r.balance_error(),
            }
            substeps {
                variable: 124 "numerics.substeps" integer([0, i32::MAX]),
                meaning: "time steps that the solver made in the last communication step",
                source: step |s| count(s.substeps),
            }
            time_step {
                variable: 125 "numerics.time_step" real(&SECOND, "ns", [0.0, NONE], Some(1e-9)),
                meaning: "length of the solver's last time step",
                source: state |r| r.progress.last_step,
            }
            active_points {
                variable: 126 "numerics.active_points" integer([0, i32::MAX]),
                meaning: "material points that the solver moves",
                source: state |r| count(r.points as u64),
            }
            retired_points {
                variable: 127 "numerics.retired_points" integer([0, i32::MAX]),
                meaning: "material points that left the domain; their mass and energy stay in the \
                    ledger",
                source: state |r| count(r.ledger.retired_points),
            }
            min_jacobian {
                variable: 128 "numerics.min_jacobian" real(&ONE, "", [-NONE, NONE], Some(1.0)),
                meaning: "smallest volume ratio det F over all material points",
                source: state |r| r.survey.min_jacobian,
            }
            tool_position_x {
                variable: 129 "tool_position_x" real(&METRE, "mm", [-NONE, NONE], Some(1e-3)),
                meaning: "position along the cut of the tool's lowest point, from the workpiece's lower \
                    left corner",
                source: state |r| r.tool.position[0],
            }
            tool_position_y {
                variable: 130 "tool_position_y" real(&METRE, "mm", [-NONE, NONE], Some(1e-3)),
                meaning: "height of the tool's lowest point, from the workpiece's lower left corner",
                source: state |r| r.tool.position[1],
            }
            chip_state {
                variable: 131 "chip.state" choice(&enumerations::CHIP_STATE),
                meaning: "how far the cut has come",
                source: state |r| r.chip_state(),
            }
            mass_factor {
                variable: 132 "numerics.mass_factor" real(&ONE, "", [0.0, NONE], Some(1.0)),
                meaning: "factor on the mass in use, see numerics.mass_scaling",
                source: state |r| r.progress.mass_factor,
            }
            surplus_kinetic_energy {
                variable: 133 "energy.surplus_kinetic" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "part of the kinetic energy that is due to scaled mass",
                source: state |r| r.survey.kinetic * (1.0 - 1.0 / r.progress.mass_factor),
            }
            mass_scaling_energy {
                variable: 134 "energy.mass_scaling" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "kinetic energy brought in by changes of the mass factor since the start",
                source: state |r| r.ledger.mass_scaling,
            }
            tool_lag {
                variable: 140 "tool_lag" real(&METRE, "µm", [-NONE, NONE], Some(1e-5)),
                meaning: "feed asked for less the feed that the tool has reached, as it follows a jump at \
                    tool.feed_rate_limit",
                source: state |r| r.tool_lag,
            }
            retries {
                variable: 190 "numerics.retries" integer([0, i32::MAX]),
                meaning: "time steps since the start that were solved again at half their length, \
                    because a point would have moved too far or changed its volume too much",
                source: state |r| count(r.progress.retries),
            }
            stray_velocities {
                variable: 191 "numerics.stray_velocities" integer([0, i32::MAX]),
                meaning: "velocities of points since the start that were brought back because they were \
                    foreign to all nodes around: what the transfer stores and the grid cannot see",
                source: state |r| count(r.progress.null_space_velocities),
            }
            force_error_band {
                variable: 200 "numerics.force_error_band" real(&ONE, "%", [0.0, NONE], Some(0.05)),
                meaning: "share of the cutting force that it may be off by at this spacing and speed \
                    level, from the price list measured on the reference cut; 1 where that knows nothing: \
                    numerics.contact other than surface, numerics.points_per_cell_edge other than 2, an edge \
                    radius below four point spacings, a molten rake face; 0 before the model is built",
                source: state |r| r.force_error_band(),
            }
            estimated_cpu_time {
                variable: 201 "numerics.estimated_cpu_time" real(&SECOND, "", [0.0, NONE], Some(10.0)),
                meaning: "processor time of all threads from start to stop time (without a stop time: \
                    over the default experiment's 40 µs) of a machine that has numerics.point_rate, \
                    estimated when initialization is left; 0 before",
                source: estimate,
            }
            thermoelastic {
                variable: 171 "energy.thermoelastic" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "elastic energy that heat took since the start by expanding the material, \
                    negative where it gave it",
                source: state |r| r.ledger.thermoelastic,
            }
            tool_heat {
                variable: 172 "energy.tool_heat" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "heat that went into the tool since the start, for effects.heat = conduction: \
                    its share of the friction work and, with effects.tool_heat, what flows through the \
                    contact",
                source: state |r| r.heat.friction_in_tool + r.heat.contact,
            }
            tool_temperature_peak {
                variable: 170 "tool_temperature_peak" real(&KELVIN, "degC", [0.0, NONE], Some(500.0)),
                meaning: "highest temperature of the tool, for effects.tool_heat; the initial \
                    temperature of the workpiece without",
                source: state |r| r.scene.workpiece.initial_temperature + r.hottest_of_tool(),
            }
            damage_work {
                variable: 180 "energy.damage" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "work of separation since the start: plastic work of material past the \
                    initiation of damage, and the elastic energy that damage releases",
                source: state |r| r.ledger.damage_work,
            }
            viscous_work {
                variable: 181 "energy.viscous" real(&JOULE, "mJ", [-NONE, NONE], Some(0.1)),
                meaning: "work of the artificial viscosity since the start",
                source: state |r| r.ledger.viscous_work,
            }
            sticking_share {
                variable: 182 "sticking_share" real(&ONE, "%", [0.0, NONE], Some(0.5)),
                meaning: "share of the area of contact where the material sticks to the tool, mean over \
                    the last communication step: friction there is below Coulomb's, capped by the shear \
                    strength or at rest on the tool; 0 without effects.sticking",
                source: step |s| s.sticking_share,
            }
        }
    };
}
pub(crate) use outputs;

/// Rust's type of an output.
macro_rules! value_type {
    (real) => {
        f64
    };
    (integer) => {
        i32
    };
    (choice) => {
        ChipState
    };
}

/// Reads an output for the FMU, which knows an item of an enumeration by its number.
macro_rules! output {
    (choice $place:ident) => {
        Access::Output { get: |outputs| outputs.$place.number() }
    };
    ($kind:ident $place:ident) => {
        Access::Output { get: |outputs| outputs.$place }
    };
}

/// Name of an output's SI unit.
macro_rules! unit_name {
    (real($unit:expr, $($rest:expr),*)) => {
        $unit.name
    };
    ($kind:ident($($rest:expr),*)) => {
        "1"
    };
}

/// What is made of the table here: the struct, the FMU's variables, the columns.
macro_rules! struct_variables_and_columns {
    ($($place:ident {
        variable: $reference:literal $name:literal $kind:ident($($argument:expr),*),
        meaning: $meaning:literal,
        source: $source:ident $(|$from:ident| $value:expr)?,
    })+) => {
        /// All outputs at a communication point.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct Outputs {
            $(#[doc = $meaning] pub $place: value_type!($kind),)+
        }

        /// Outputs: references 100 to 999.
        pub(super) static OUTPUTS: &[Variable] = &[$(
            Variable {
                reference: $reference,
                name: $name,
                description: $meaning,
                kind: $kind($($argument,)* output!($kind $place)),
            }
        ),+];

        /// The outputs as columns of a table, in the order of the variables.
        pub static COLUMNS: &[Column] = &[$(
            Column {
                name: $name,
                unit: unit_name!($kind($($argument),*)),
                value: |outputs| f64::from(outputs.$place),
            }
        ),+];
    };
}
outputs!(struct_variables_and_columns);

/// One output as a column of a table.
pub struct Column {
    /// Name of the FMU's variable.
    pub name: &'static str,
    /// SI unit; "1" for none.
    pub unit: &'static str,
    /// The value.
    pub value: fn(&Outputs) -> f64,
}

/// The type of an enumeration's output.
const fn choice(of: &'static Enumeration, access: Access<i32>) -> Kind {
    Kind::Choice(Choice { of, access })
}

/// Outputs before the model is built, as initialization mode shows them.
pub fn outputs_at_start(scene: &Scene) -> Outputs {
    // Settings that cannot be read are refused when initialization is left; until then they count for
    // nothing.
    let scene = &settings::take_over(scene).map_or_else(|_| scene.clone(), |taken| taken.0);
    Outputs {
        chip_temperature: scene.workpiece.initial_temperature,
        chip_temperature_peak: scene.workpiece.initial_temperature,
        tool_temperature_peak: scene.workpiece.initial_temperature,
        min_jacobian: 1.0,
        mass_factor: 1.0,
        tool_position_x: scene.workpiece.length + scene.tool.initial_gap,
        tool_position_y: scene.workpiece.height - scene.inputs.feed,
        chip_state: ChipState::Approaching,
        ..Outputs::default()
    }
}

/// The parameters and inputs that an output's value before the first step depends on; none for a constant.
pub fn start_dependencies(output: &str) -> &'static [&'static str] {
    match output {
        "chip_temperature" | "chip_temperature_peak" | "tool_temperature_peak" => {
            &["workpiece.initial_temperature", "settings"]
        }
        "tool_position_x" => &["workpiece.length", "tool.initial_gap", "settings"],
        "tool_position_y" => &["feed", "workpiece.height", "settings"],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Inputs;
    use crate::variables::all;

    /// The dependencies written to the description are those of the function beside them: found by changing
    /// each value.
    #[test]
    fn start_dependencies_are_those_of_the_start_outputs() {
        let inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };
        let scene = Scene::default();
        for output in OUTPUTS {
            let Kind::Real(value) = &output.kind else { continue };
            let at = |scene: &Scene| value.access.read(scene, &inputs, &outputs_at_start(scene));
            let mut found = Vec::new();
            for cause in all() {
                let mut other = scene.clone();
                match &cause.kind {
                    Kind::Real(real) => {
                        let Some(start) = real.access.start(&scene) else { continue };
                        real.access.set_start(&mut other, start + 1.0);
                    }
                    Kind::Text(access) if cause.name == settings::NAME => {
                        let text = "workpiece.initial_temperature=400; workpiece.length=4e-3; feed=1e-4";
                        access.set_start(&mut other, text.into());
                    }
                    _ => continue,
                }
                if at(&other) != at(&scene) {
                    found.push(cause.name);
                }
            }
            assert_eq!(found, start_dependencies(output.name), "{}", output.name);
        }
    }
}
