//! A simulation as the rest of the program sees it, whatever its effects, dimension and precision are.

use crate::checkpoint::StateBytes;
use crate::dimension::Dimension;
use crate::energy::ledger::Ledger;
use crate::error::Error;
use crate::grid::Layout;
use crate::heat::HeatTotals;
use crate::material::PointReport;
use crate::partition::nodes::ContactAreas;
use crate::points::{Block, PointState};
use crate::simd::Real;
use crate::speedups::active_window::WindowBounds;
use crate::speedups::rigid_chip::TailMotion;
use crate::tool::RigidTool;
use serde::{Deserialize, Serialize};

/// What the clock, the tool and the time step need to go on, and the running totals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// The solver's clock: time at the end of the last substep (s).
    pub clock: f64,
    /// Length of the last substep (s).
    pub last_step: f64,
    /// Substeps since the start.
    pub substeps: u64,
    /// Substeps since the start that were solved again at half their length (`partition::step_bounds`).
    pub retries: u64,
    /// Position of the tool's lowest point (m).
    pub tool_position: [f64; 2],
    /// Speed of the fastest point in the last substep (m/s).
    pub fastest: f64,
    /// Largest volume ratio in the last substep (-).
    pub volume_ratio: f64,
    /// Motion since the points were sorted (cells).
    pub travel: f64,
    /// Motion since stray velocities were last looked for (cells).
    pub travel_unseen: f64,
    /// Velocities since the start that were out of their range (`stabilization::null_space_filter`).
    pub null_space_velocities: u64,
    /// Motion since the locking control last looked at the points (cells).
    pub travel_uncontrolled: f64,
    /// Distance the tool has moved while it touched the workpiece (m).
    pub cut_length: f64,
    /// Furthest contact along the rake face in the last substep (m).
    pub contact_reach: f64,
    /// Areas of contact over time (m2 s); see `NodeSums::contact_areas`.
    pub contact_areas: ContactAreas,
    /// When the tool touched the workpiece.
    pub touches: Touches,
    /// Way of the tool since it last touched the workpiece (m).
    pub distance_since_contact: f64,
    /// Where the active window stands, if there is one.
    pub window: Option<WindowBounds>,
    /// How the chip's tail moves; at rest before there is one.
    pub tail: TailMotion,
    /// Factor on the mass (-).
    pub mass_factor: f64,
    /// Running totals.
    pub ledger: Ledger,
    /// Conduction's clock and totals.
    pub heat: HeatTotals,
}

/// Whether the tool touched the workpiece.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Touches {
    /// In the last substep.
    pub now: bool,
    /// In any since the start.
    pub ever: bool,
}

/// The tool's motion and friction over the next substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolMotion {
    /// Velocity of the tool (m/s).
    pub velocity: [f64; 2],
    /// Coulomb coefficient (-).
    pub friction: f64,
}

/// One point as outputs and files see it.
#[derive(Clone, Copy, Debug)]
pub struct PointView {
    /// The point's number at the start.
    pub id: u32,
    /// Position from the workpiece's lower left corner (m).
    pub position: [f64; 3],
    /// Velocity (m/s).
    pub velocity: [f64; 3],
    /// Volume at the start (m3).
    pub volume: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Whether it belongs to the chip's rigid tail, which goes where no chip would (`speedups::rigid_chip`).
    pub is_tail: bool,
    /// Its material.
    pub report: PointReport,
}

impl PointView {
    /// The point at a place in memory, where it is kept, from the grid's `origin` (m).
    pub fn new<R: Real, D: Dimension, S: PointState<R>>(
        block: &Block<R, D, S>,
        lane: usize,
        (layout, origin, density): (&Layout, &[f64; 3], f64),
        report: PointReport,
    ) -> Self {
        let (cells, volume) = (layout.cells_of(block, lane), block.volume[lane].to_f64());
        let (mut position, mut velocity) = ([0.0; 3], [0.0; 3]);
        for axis in 0..D::AXES {
            position[axis] = origin[axis] + layout.cell * cells[axis];
            velocity[axis] = block.velocity[axis][lane].to_f64();
        }
        PointView {
            id: block.id[lane],
            position,
            velocity,
            volume,
            mass: density * volume,
            is_tail: false,
            report,
        }
    }
}

/// A simulation whose effects, dimension and precision are chosen.
pub trait Solver: Send {
    /// Clock, tool and totals.
    fn progress(&self) -> &Progress;

    /// The tool.
    fn tool(&self) -> &RigidTool;

    /// One substep; `parallel` spreads it over the threads of the current pool without changing its result.
    ///
    /// # Errors
    /// `Error::Unstable` when one of the `partition::step_bounds` sees that the run has gone wrong.
    fn step(&mut self, motion: &ToolMotion, parallel: bool) -> Result<(), Error>;

    /// Does what `step` would do, without looking at a point, where it would change nothing but the clock and
    /// the tool's place; whether it did.
    fn pass(&mut self, motion: &ToolMotion) -> bool;

    /// Length of the substep that `step` would take with this drive (s).
    fn time_step(&self, motion: &ToolMotion) -> f64;

    /// Shows every point to `visit`.
    fn visit_points(&self, visit: &mut dyn FnMut(&PointView));

    /// Number of points that substeps move.
    fn points(&self) -> usize;

    /// Memory of one point's state (bytes).
    fn bytes_per_point(&self) -> usize;

    /// Lets the mass follow the tool's speed (m/s) before a substep, where the scene scales it.
    fn scale_mass(&mut self, speed: f64);

    /// The points and deposits as numbers.
    fn state_bytes(&self) -> StateBytes;

    /// Takes the state that `state_bytes` and `progress` gave.
    ///
    /// # Errors
    /// `Error::DamagedState` when it does not fit; the solver is then spoiled.
    fn restore(&mut self, bulk: &StateBytes, progress: &Progress) -> Result<(), Error>;

    /// A second, independent solver in the same state.
    fn fork(&self) -> Box<dyn Solver>;
}
