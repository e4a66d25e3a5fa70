//! What a run hands out: the outputs at a communication point and the points' fields.
//!
//! Plain data, below the solver, so that files and pictures are made without it.

/// All outputs at a communication point. Units and meanings stand in the variable table.
#[allow(missing_docs)] // Each field is documented by its entry in the variable table.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outputs {
    pub cutting_force: f64,
    pub thrust_force: f64,
    pub cutting_force_min: f64,
    pub cutting_force_max: f64,
    pub chip_temperature: f64,
    pub chip_temperature_peak: f64,
    pub peak_strain: f64,
    pub peak_strain_p999: f64,
    pub chip_thickness: f64,
    pub contact_length: f64,
    pub shear_angle: f64,
    pub cut_length: f64,
    pub cutting_power: f64,
    pub specific_cutting_energy: f64,
    pub tool_work: f64,
    pub kinetic_energy: f64,
    pub elastic_energy: f64,
    pub plastic_work: f64,
    /// Work of separation by damage (J).
    pub damage_work: f64,
    /// Work of artificial viscosity (J).
    pub viscous_work: f64,
    pub friction_work: f64,
    pub damping: f64,
    /// Dissipated by inelastic contact with the tool and the fixed nodes (J).
    pub contact_loss: f64,
    /// Kinetic and elastic energy carried away by retired points (J).
    pub retired_energy: f64,
    pub thermal_energy: f64,
    pub balance_error: f64,
    pub substeps: i32,
    pub time_step: f64,
    pub active_points: i32,
    pub retired_points: i32,
    pub min_jacobian: f64,
    pub tool_position_x: f64,
    pub tool_position_y: f64,
    /// 1 approaching, 2 entering, 3 cutting, 4 left.
    pub chip_state: i32,
    pub mass_factor: f64,
    /// Part of the kinetic energy that is due to scaled mass (J).
    pub surplus_kinetic_energy: f64,
    /// Kinetic energy brought in by changes of the mass factor (J).
    pub mass_scaling_energy: f64,
    /// Substeps since the start that were solved again at half their length.
    pub retries: i32,
    /// Velocities since the start that the grid could not see and that were brought back.
    pub stray_velocities: i32,
    pub force_error_band: f64,
    /// A time of this machine (s): no part of a saved state, where it is 0.
    #[serde(skip)]
    pub estimated_cpu_time: f64,
    /// Elastic energy that heat took by expanding the material (J).
    pub thermoelastic: f64,
    /// Heat that went into the tool (J).
    pub tool_heat: f64,
    pub tool_temperature_peak: f64,
    /// Mean over the last communication step, for `effects.sticking`.
    pub sticking_share: f64,
}

/// The points' fields at the solver's clock, for pictures and files; one entry per point, in the order of `id`.
#[derive(Clone, Debug, Default)]
pub struct PointFields {
    /// Solver clock (s).
    pub time: f64,
    /// Number of the point at the start.
    pub id: Vec<u32>,
    /// Mass (kg).
    pub mass: Vec<f64>,
    /// Position from the workpiece's lower left corner (m); z is 0 in plane strain.
    pub position: Vec<[f64; 3]>,
    /// Velocity (m/s).
    pub velocity: Vec<[f64; 3]>,
    /// Cauchy stress xx, yy, zz, yz, xz, xy (Pa).
    pub stress: Vec<[f64; 6]>,
    /// Equivalent plastic strain (-).
    pub plastic_strain: Vec<f64>,
    /// Temperature (K).
    pub temperature: Vec<f64>,
    /// Volume ratio det F (-).
    pub jacobian: Vec<f64>,
    /// The tool's outline, a closed polygon in the x-y plane (m).
    pub tool_outline: Vec<[f64; 2]>,
    /// The tool's velocity (m/s); not part of the files.
    pub tool_velocity: [f64; 2],
}

/// One output as a column of a table: the name and SI unit as in the FMU, and its value.
pub struct Column {
    /// Name of the FMU's variable.
    pub name: &'static str,
    /// SI unit; "1" for none.
    pub unit: &'static str,
    /// The value.
    pub value: fn(&Outputs) -> f64,
}

/// The outputs as columns, in the order of `Outputs`.
///
/// The names repeat the variable table, which stands above this module; a test of the master holds the two together.
pub const COLUMNS: &[Column] = &[
    Column { name: "cutting_force", unit: "N", value: |o| o.cutting_force },
    Column { name: "thrust_force", unit: "N", value: |o| o.thrust_force },
    Column { name: "cutting_force_min", unit: "N", value: |o| o.cutting_force_min },
    Column { name: "cutting_force_max", unit: "N", value: |o| o.cutting_force_max },
    Column { name: "chip_temperature", unit: "K", value: |o| o.chip_temperature },
    Column { name: "chip_temperature_peak", unit: "K", value: |o| o.chip_temperature_peak },
    Column { name: "peak_strain", unit: "1", value: |o| o.peak_strain },
    Column { name: "peak_strain_p999", unit: "1", value: |o| o.peak_strain_p999 },
    Column { name: "chip_thickness", unit: "m", value: |o| o.chip_thickness },
    Column { name: "contact_length", unit: "m", value: |o| o.contact_length },
    Column { name: "shear_angle", unit: "rad", value: |o| o.shear_angle },
    Column { name: "cut_length", unit: "m", value: |o| o.cut_length },
    Column { name: "cutting_power", unit: "W", value: |o| o.cutting_power },
    Column { name: "specific_cutting_energy", unit: "J/m3", value: |o| o.specific_cutting_energy },
    Column { name: "energy.tool_work", unit: "J", value: |o| o.tool_work },
    Column { name: "energy.kinetic", unit: "J", value: |o| o.kinetic_energy },
    Column { name: "energy.elastic", unit: "J", value: |o| o.elastic_energy },
    Column { name: "energy.plastic", unit: "J", value: |o| o.plastic_work },
    Column { name: "energy.friction", unit: "J", value: |o| o.friction_work },
    Column { name: "energy.damping", unit: "J", value: |o| o.damping },
    Column { name: "energy.contact", unit: "J", value: |o| o.contact_loss },
    Column { name: "energy.retired", unit: "J", value: |o| o.retired_energy },
    Column { name: "energy.thermal", unit: "J", value: |o| o.thermal_energy },
    Column { name: "energy.balance_error", unit: "1", value: |o| o.balance_error },
    Column { name: "numerics.substeps", unit: "1", value: |o| f64::from(o.substeps) },
    Column { name: "numerics.time_step", unit: "s", value: |o| o.time_step },
    Column { name: "numerics.active_points", unit: "1", value: |o| f64::from(o.active_points) },
    Column { name: "numerics.retired_points", unit: "1", value: |o| f64::from(o.retired_points) },
    Column { name: "numerics.min_jacobian", unit: "1", value: |o| o.min_jacobian },
    Column { name: "tool_position_x", unit: "m", value: |o| o.tool_position_x },
    Column { name: "tool_position_y", unit: "m", value: |o| o.tool_position_y },
    Column { name: "chip.state", unit: "1", value: |o| f64::from(o.chip_state) },
    Column { name: "numerics.mass_factor", unit: "1", value: |o| o.mass_factor },
    Column { name: "energy.surplus_kinetic", unit: "J", value: |o| o.surplus_kinetic_energy },
    Column { name: "energy.mass_scaling", unit: "J", value: |o| o.mass_scaling_energy },
    Column { name: "numerics.retries", unit: "1", value: |o| f64::from(o.retries) },
    Column { name: "numerics.stray_velocities", unit: "1", value: |o| f64::from(o.stray_velocities) },
    Column { name: "numerics.force_error_band", unit: "1", value: |o| o.force_error_band },
    Column { name: "numerics.estimated_cpu_time", unit: "s", value: |o| o.estimated_cpu_time },
    Column { name: "energy.thermoelastic", unit: "J", value: |o| o.thermoelastic },
    Column { name: "energy.tool_heat", unit: "J", value: |o| o.tool_heat },
    Column { name: "tool_temperature_peak", unit: "K", value: |o| o.tool_temperature_peak },
    Column { name: "energy.damage", unit: "J", value: |o| o.damage_work },
    Column { name: "energy.viscous", unit: "J", value: |o| o.viscous_work },
    Column { name: "sticking_share", unit: "1", value: |o| o.sticking_share },
];
