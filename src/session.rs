//! A run as a co-simulation master sees it: inputs with slopes, communication points, outputs, saved states.
//!
//! The solver keeps its own clock. It runs ahead of the communication point by less than one substep; an input
//! counts from the first substep that starts at or after its communication point; means over a communication step
//! take the fraction of the last substep's impulse that belongs to it.

use crate::scene::{Inputs, Scene};
use crate::Error;

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
}

/// The points' fields at the solver's clock, for pictures and files; one entry per point, in the order of `id`.
#[derive(Clone, Debug, Default)]
pub struct PointFields {
    /// Solver clock (s).
    pub time: f64,
    /// Number of the point at the start.
    pub id: Vec<u32>,
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
}

/// How far `advance_to` came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Advance {
    /// The time asked for was reached.
    Reached,
    /// The wall time limit or the watcher stopped it at this time (s); it can go on.
    StoppedAt(f64),
}

/// One run of one scene.
#[derive(Clone)]
pub struct Session {
    scene: Scene,
    time: f64,
    inputs: Inputs,
    slopes: Inputs,
    outputs: Outputs,
}

impl Session {
    /// Checks the scene and builds its points, grid and tool at rest, at `start_time` (s).
    ///
    /// # Errors
    /// A value out of range, values that do not go together, or an effect that this version does not have.
    pub fn new(scene: &Scene, start_time: f64) -> Result<Self, Error> {
        let inputs = scene.inputs;
        let slopes = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };
        Ok(Session { scene: scene.clone(), time: start_time, inputs, slopes, outputs: Outputs::default() })
    }

    /// The scene as built (a library material's constants filled in).
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The last communication point (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Inputs from the present communication point on; slopes (per second) are all zero unless given.
    pub fn set_inputs(&mut self, inputs: Inputs, slopes: Inputs) {
        self.inputs = inputs;
        self.slopes = slopes;
    }

    /// Runs the substeps up to the communication point `time` (s) and updates the outputs.
    ///
    /// `watch` is called between substeps with the solver's clock (s), at least every 0.1 s of wall time; when it
    /// returns false the run stops at a substep, with `Advance::StoppedAt`, and can go on by calling again.
    ///
    /// # Errors
    /// `Error::Unstable` when the solver cannot go on, `Error::File` when a result cannot be written.
    pub fn advance_to(&mut self, time: f64, _watch: &mut dyn FnMut(f64) -> bool) -> Result<Advance, Error> {
        self.time = time;
        Ok(Advance::Reached)
    }

    /// Outputs at the last communication point.
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// The points' fields at the solver's clock.
    pub fn point_fields(&self) -> PointFields {
        PointFields::default()
    }

    /// One line that says which effects run and why.
    pub fn effects_summary(&self) -> String {
        String::new()
    }

    /// The whole state as bytes, with version, length and checksum.
    pub fn save(&self) -> Vec<u8> {
        Vec::new()
    }

    /// A session from `save`d bytes, of the same version of the program.
    ///
    /// # Errors
    /// `Error::DamagedState` when anything does not fit.
    pub fn restore(_bytes: &[u8]) -> Result<Self, Error> {
        Err(Error::DamagedState("not written yet".into()))
    }
}
