//! A run of sorted points with its own copy of the nodes around them: the unit of parallel work.
//!
//! ```text
//!   points, sorted:   │ chunk 0 │ chunk 1 │ chunk 2 │
//!   its nodes:       ├───────────┤
//!                            ├───────────┤            a few pencils of overlap
//!                                      ├───────────┤
//! ```
//!
//! A chunk adds up, on its own nodes (`partition::nodes`), what all chunks deposited there in the last
//! substep, always in the order of the chunks; solves the momentum equation; and moves its points, which
//! deposit into a buffer of its own. It reads only the deposits of the last substep and writes only its own,
//! so a substep needs no lock, and its result does not depend on how many threads there are. On the overlap
//! neighbours do the same work twice and get the same bits; sums over nodes count those that a chunk owns.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::material::ConstitutiveModel;
use crate::partition::nodes::{ChunkNodes, StepContext};
use crate::partition::velocity_outliers::{self, Outlier};
use crate::points::{Block, PointState};
use crate::simd::{Real, dispatch};
use crate::transfer::{Candidate, NodeRun, OutlierScan, PassSums, PointsPass};
use std::time::{Duration, Instant};

/// Strays, and points suspected of being some, of a chunk that are found without asking for memory.
const USUAL_OUTLIERS: usize = 256;
const USUAL_CANDIDATES: usize = 1024;

/// A run of sorted points.
#[derive(Clone)]
pub struct Chunk<R: Real, D: Dimension, S> {
    /// Its points; only the last block of the last chunk may have empty places.
    pub blocks: Vec<Block<R, D, S>>,
    /// Sums over its points in the last substep.
    pub sums: PassSums,
    /// What the last pass over its points took, so that the longest can come first; not part of the state.
    pub cost: Duration,
    /// Points whose velocities the last pass had to look at.
    candidates: Vec<Candidate>,
    /// Those found out of bounds.
    pub outliers: Vec<Outlier>,
}

impl<R: Real, D: Dimension, S> Default for Chunk<R, D, S> {
    fn default() -> Self {
        Chunk {
            blocks: Vec::new(),
            sums: PassSums::default(),
            cost: Duration::ZERO,
            candidates: Vec::with_capacity(USUAL_CANDIDATES),
            outliers: Vec::with_capacity(USUAL_OUTLIERS),
        }
    }
}

/// What all chunks' points share in one substep.
pub struct PointsStep<'a, F, M> {
    /// Arrangement of the nodes.
    pub layout: &'a Layout,
    /// Shape function.
    pub shape: &'a F,
    /// Constitutive model.
    pub model: &'a M,
    /// What nodes and contact share with them.
    pub step: &'a StepContext,
}

impl<R: Real, D: Dimension, S: PointState<R>> Chunk<R, D, S> {
    /// Moves the points by what a substep has made of their `nodes`; they deposit into `outgoing`. With a
    /// bound (m/s), notes in `outliers` those whose velocity differs by more from the ones that all nodes
    /// around them had in the substep.
    pub fn update_particles<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        nodes: &mut ChunkNodes<R>,
        outgoing: &mut NodeRun<R>,
        common: &PointsStep<'_, F, M>,
        outlier_bound: Option<f64>,
    ) {
        let begin = Instant::now();
        self.sums = self.pass_points(&nodes.run, outgoing, common, outlier_bound);
        self.cost = begin.elapsed();
        self.outliers.clear();
        let Some(bound) = outlier_bound else { return };
        // A point's velocity is judged by those that its increment belongs to.
        nodes.take_smoothing_back(common.layout);
        for candidate in self.candidates.drain(..) {
            let block = &self.blocks[candidate.block];
            let around = (&nodes.run, common.layout, common.shape);
            let point = (&candidate, &block.places(), &block.velocity);
            self.outliers.extend(velocity_outliers::judge::<R, D, F>(point, around, bound));
        }
    }

    /// Deposits mass, momentum and force of points that have just been sorted, without moving them: in a
    /// substep of 0 s.
    pub fn deposit<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        nodes: &mut ChunkNodes<R>,
        outgoing: &mut NodeRun<R>,
        common: &PointsStep<'_, F, M>,
    ) {
        debug_assert!(common.step.dt == 0.0, "a deposit over {} s would move the points", common.step.dt);
        nodes.run.clear();
        let _ = self.pass_points(&nodes.run, outgoing, common, None);
    }

    /// Moves the points by the nodes' present velocities; with nodes at rest it only deposits.
    fn pass_points<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        nodes: &NodeRun<R>,
        outgoing: &mut NodeRun<R>,
        common: &PointsStep<'_, F, M>,
        outlier_bound: Option<f64>,
    ) -> PassSums {
        self.candidates.clear();
        let look = outlier_bound.map(|bound| OutlierScan { bound, candidates: &mut self.candidates });
        dispatch(
            common.step.instructions,
            PointsPass {
                blocks: &mut self.blocks,
                nodes,
                deposit: outgoing,
                layout: common.layout,
                shape: common.shape,
                model: common.model,
                dt: common.step.dt,
                drift: common.step.drift,
                look,
            },
        )
    }
}
