//! What a process of metal working is to the rest of the program: bodies, walls, a tool and its motion, and
//! what it asks of a scene.
//!
//! One type per scene, all of it plain data: the kernels are chosen elsewhere and know none of them. To add a
//! scene, write such a type in a file of its own and name it in `setup::process_of`.

use crate::error::Error;
use crate::grid::FixedNodes;
use crate::output::results::CutBlock;
use crate::scene::lattice::StartLattice;
use crate::scene::{Inputs, Scene};
use crate::simulation::ToolMotion;
use crate::tool::RigidTool;

/// Uncut feeds before a held side at which a run warns: what the fixture does is felt from about there on
/// (-).
pub const FEEDS_TO_WARN: f64 = 2.0;
/// Uncut feeds before a held side at which the tool stops: nearer, it would press the rest against the
/// fixture (-).
pub const FEEDS_TO_STOP: f64 = 1.0;

/// The bodies of a process, on the grid that they move through.
#[derive(Clone, Debug)]
pub struct Bodies {
    /// Nodes of the grid along each axis.
    pub counts: [i32; 3],
    /// Position of its first node (m).
    pub origin: [f64; 3],
    /// Nodes that do not move.
    pub fixed: Vec<FixedNodes>,
    /// The bodies' points.
    pub lattices: Vec<PlacedLattice>,
}

/// Points that fill a block whose first corner is a node.
#[derive(Clone, Copy, Debug)]
pub struct PlacedLattice {
    /// The points.
    pub lattice: StartLattice,
    /// The node at the block's lowest corner.
    pub first: [i32; 3],
}

/// Inputs at the start of a substep, and how fast the feed changes there.
#[derive(Clone, Copy, Debug)]
pub struct InputsNow {
    /// The inputs with their slopes taken in.
    pub inputs: Inputs,
    /// Slope of the feed (m/s).
    pub feed_slope: f64,
}

/// What a substep integrates, for the estimate of a run's cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegratedArea {
    /// All of it (m2).
    pub all: f64,
    /// The part that has yielded and does so again (m2).
    pub yielding: f64,
}

/// A process of metal working.
pub trait Process: Sync {
    /// Refuses what the process cannot do with a scene.
    ///
    /// # Errors
    /// Names the variable and what is allowed.
    fn check(&self, scene: &Scene) -> Result<(), Error>;

    /// Refuses inputs that the scene has no room for.
    ///
    /// # Errors
    /// `Error::OutOfRange`.
    fn check_inputs(&self, scene: &Scene, inputs: &Inputs) -> Result<(), Error>;

    /// Bodies and walls; `axes` is 2 in plane strain, 3.
    fn bodies(&self, scene: &Scene, axes: usize) -> Bodies;

    /// The tool where it starts.
    ///
    /// # Errors
    /// `Error::Inconsistent` when its shape is impossible.
    fn tool(&self, scene: &Scene) -> Result<RigidTool, Error>;

    /// The tool's motion in a substep that starts with these inputs; `time_step` tells the substep's length
    /// (s) for a motion.
    fn tool_motion(
        &self,
        scene: &Scene,
        now: &InputsNow,
        tool: &RigidTool,
        time_step: &dyn Fn(&ToolMotion) -> f64,
    ) -> ToolMotion;

    /// Uncut material between the tool's foremost point and a side that it must not reach, over the tool's
    /// depth (-); infinite where there is no such side, or no depth.
    fn feeds_left(&self, scene: &Scene, tool: &RigidTool) -> f64;

    /// The block whose machined surface, chip and shear bands results files profile, if there is one.
    fn cut_block(&self, scene: &Scene) -> Option<CutBlock>;

    /// Area (m2) that substeps integrate once the tool has gone `distance` (m).
    fn integrated_area(&self, scene: &Scene, inputs: &Inputs, distance: f64) -> IntegratedArea;
}
