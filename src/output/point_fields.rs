//! The points' fields at one time.
//!
//! Plain data, below the solver, so that files and pictures are made without it.

/// The points' fields at the solver's clock, for pictures and files; one entry per point, in the order of
/// `id`.
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
    /// Damage (-), 1 for a point that has failed.
    pub damage: Vec<f64>,
    /// Whether a point belongs to the chip's rigid tail, which goes where no chip would; empty where none
    /// does.
    pub tail: Vec<bool>,
    /// Length of a grid cell (m).
    pub cell: f64,
    /// The tool's outline, a closed polygon in the x-y plane (m).
    pub tool_outline: Vec<[f64; 2]>,
    /// The tool's velocity (m/s); not part of the files.
    pub tool_velocity: [f64; 2],
}

impl PointFields {
    /// Whether the point of an index belongs to the chip's rigid tail.
    pub fn is_tail(&self, index: usize) -> bool {
        self.tail.get(index).copied().unwrap_or(false)
    }
}
