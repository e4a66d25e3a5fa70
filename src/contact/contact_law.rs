//! What every contact law does, and what it is told.

use crate::checkpoint::{BulkReader, StateBytes};
use crate::contact::sticking::Strength;
use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::partition::nodes::{NodalImpulses, StepContext};
use crate::points::PointState;
use crate::simd::Real;
use crate::tool::RigidTool;

/// Where chip and work part at the edge.
#[derive(Clone, Copy, Debug)]
pub struct Parting {
    /// Out of the edge there, of length one.
    pub normal: [f64; 2],
    /// Spacing of points at the start (m).
    pub spacing: f64,
}

/// What a law is told of a substep, beside points and nodes.
pub struct ContactStep<'a, S> {
    /// What nodes and points share with it.
    pub step: &'a StepContext,
    /// The tool at the start of the substep.
    pub tool: &'a RigidTool,
    /// How deep the plane is (m); says nothing in space.
    pub depth: f64,
    /// Where chip and work part, if they do so cleanly (`chip_separation`).
    pub parting: Option<Parting>,
    /// Whether friction heat is wanted by node (`NodalImpulses::friction_heat`).
    pub wants_heat: bool,
    /// Shear strength (Pa) of the point at a lane of a state.
    pub strength: &'a Strength<'a, S>,
}

/// What contact took in the last substep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactCost {
    /// Points, or nodes under a law that acts on them, that touched the tool.
    pub touching: usize,
    /// Sweeps over them; 0 where there are none.
    pub sweeps: u32,
}

/// A contact law with its state and working memory.
pub trait ContactLaw<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>: Send + Sync {
    /// Solves the contact of a substep from what points deposited for it; `touched` then tells what it
    /// changes.
    ///
    /// The nodes of the partition's chunks are elsewhere meanwhile. A substep that is too long is solved
    /// again.
    fn solve(&mut self, partition: &Partition<R, D, S>, shape: &F, contact: &ContactStep<'_, S>);

    /// What contact changed in the last substep.
    fn touched(&self) -> &NodalImpulses;

    /// What it took.
    fn cost(&self) -> ContactCost;

    /// Points and tool have moved towards each other by up to so many cells.
    fn note_motion(&mut self, cells: f64);

    /// The points have been sorted: they and the nodes stand elsewhere in memory.
    fn note_sort(&mut self);

    /// Appends to a state what the next substep needs of this one.
    fn save(&self, bulk: &mut StateBytes);

    /// Takes what `save` gave, for points that may stand elsewhere in memory.
    ///
    /// # Errors
    /// `Error::DamagedState` when it is not there.
    fn restore(&mut self, reader: &mut BulkReader<'_>) -> Result<(), Error>;

    /// An independent copy.
    fn fork(&self) -> BoxedLaw<R, D, F, S>;
}

/// The contact law of a simulation.
pub type BoxedLaw<R, D, F, S> = Box<dyn ContactLaw<R, D, F, S>>;

impl<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>> Clone for BoxedLaw<R, D, F, S> {
    fn clone(&self) -> Self {
        self.as_ref().fork()
    }
}
