//! A run of sorted points with its own copy of the nodes around them: the unit of parallel work.
//!
//! ```text
//!   points, sorted:   │ chunk 0 │ chunk 1 │ chunk 2 │
//!   its nodes:       ├───────────┤
//!                            ├───────────┤            a few pencils of overlap
//!                                      ├───────────┤
//! ```
//!
//! A chunk adds up, on its own nodes (`chunk_nodes`), what all chunks deposited there in the last substep, always in the order of
//! the chunks; solves the momentum equation; and moves its points, which deposit into a buffer of its own. It reads
//! only the deposits of the last substep and writes only its own, so a substep needs no lock, and its result does not depend on
//! how many threads there are. On the overlap neighbours do the same work twice and get the same bits; sums over nodes count
//! those that a chunk owns.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::material::ConstitutiveModel;
use crate::partition::nodes::ChunkNodes;
use crate::partition::velocity_outliers::{self, Stray};
use crate::points::{Block, PointState};
use crate::simd::{InstructionSet, Real, dispatch};
use crate::transfer::{Look, NodeRun, PassSums, PointsPass, Suspect};
use std::time::{Duration, Instant};

/// Strays, and points suspected of being some, of a chunk that are found without asking for memory.
const USUAL_STRAYS: usize = 256;
const USUAL_SUSPECTS: usize = 1024;

/// A run of sorted points.
#[derive(Clone)]
pub struct Chunk<R: Real, D: Dimension, S> {
    /// Its points; only the last block of the last chunk may have empty places.
    pub blocks: Vec<Block<R, D, S>>,
    /// Sums over its points in the last substep.
    pub sums: PassSums,
    /// What the last pass over its points took, so that the longest can come first; not part of the state.
    pub effort: Duration,
    /// Points whose velocities the last pass had to look at.
    suspects: Vec<Suspect>,
    /// Those found out of bounds.
    pub strays: Vec<Stray>,
}

impl<R: Real, D: Dimension, S> Default for Chunk<R, D, S> {
    fn default() -> Self {
        Chunk {
            blocks: Vec::new(),
            sums: PassSums::default(),
            effort: Duration::ZERO,
            suspects: Vec::with_capacity(USUAL_SUSPECTS),
            strays: Vec::with_capacity(USUAL_STRAYS),
        }
    }
}

/// What all chunks share in one substep.
pub struct Substep<'a, F, M> {
    /// Arrangement of the nodes.
    pub layout: &'a Layout,
    /// Shape function.
    pub shape: &'a F,
    /// Constitutive model.
    pub model: &'a M,
    /// Substep (s).
    pub dt: f64,
    /// Instruction set of the kernels.
    pub instructions: InstructionSet,
}

impl<R: Real, D: Dimension, S: PointState<R>> Chunk<R, D, S> {
    /// Moves the points by what a substep has made of their `nodes`; they deposit into `outgoing`. With a bound (m/s), notes in
    /// `strays` those whose velocity differs by more from the ones that all nodes around them had in the substep.
    pub fn move_points<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        nodes: &mut ChunkNodes<R>,
        outgoing: &mut NodeRun<R>,
        common: &Substep<'_, F, M>,
        stray_bound: Option<f64>,
    ) {
        let begin = Instant::now();
        self.sums = self.pass_points(&nodes.run, outgoing, common, stray_bound);
        self.effort = begin.elapsed();
        self.strays.clear();
        let Some(bound) = stray_bound else { return };
        // A point's velocity is judged by those that its increment belongs to.
        nodes.take_smoothing_back(common.layout);
        for suspect in self.suspects.drain(..) {
            let block = &self.blocks[suspect.block];
            let around = (&nodes.run, common.layout, common.shape);
            let point = (&suspect, &block.places(), &block.velocity);
            self.strays.extend(velocity_outliers::judge::<R, D, F>(point, around, bound));
        }
    }

    /// Deposits mass, momentum and force of points that have just been sorted, without moving them.
    pub fn deposit<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        nodes: &mut ChunkNodes<R>,
        outgoing: &mut NodeRun<R>,
        common: &Substep<'_, F, M>,
    ) {
        nodes.run.clear();
        let _ = self.pass_points(&nodes.run, outgoing, &Substep { dt: 0.0, ..*common }, None);
    }

    /// Moves the points by the nodes' present velocities; with nodes at rest it only deposits.
    fn pass_points<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        nodes: &NodeRun<R>,
        outgoing: &mut NodeRun<R>,
        common: &Substep<'_, F, M>,
        stray_bound: Option<f64>,
    ) -> PassSums {
        self.suspects.clear();
        let look = stray_bound.map(|bound| Look { bound, suspects: &mut self.suspects });
        dispatch(
            common.instructions,
            PointsPass {
                blocks: &mut self.blocks,
                nodes,
                deposit: outgoing,
                layout: common.layout,
                shape: common.shape,
                model: common.model,
                dt: common.dt,
                look,
            },
        )
    }
}
