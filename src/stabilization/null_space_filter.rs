//! Null-space filter: no point keeps a velocity that is foreign to all nodes around it, an outlier.
//!
//! FLIP adds the grid's increments to the points' velocities and never compares the two again. What points
//! hold and no node feels moves nothing at first; but points carry it on, to places where nodes do feel it.
//! At a tool's face a few points gathered many times the tool's speed in this way, and threw their neighbours
//! when they left. Here, each time the points have moved by `INTERVAL`, a point's velocity is brought back,
//! along each axis, to the one with which it moved, within what the velocities of the nodes around it differ
//! by and the speed that stress at yield gives a free surface:
//!
//! r_p = v_p − Σ_i w_ip v_i,  e_p = r_p − clamp(r_p, −L, L),  L = σ_y/(ρ c) + Σ_i w_ip |v_i − Σ_j w_jp v_j|
//!
//! over the nodes i of the point's stencil with their velocities v_i at the end of the substep. (Not the
//! range of the v_i: a node at a surface may have next to no mass, and any velocity.) ρ is the true density
//! where mass is scaled: with the scaled one the limit would come down to the speeds at which chips slide,
//! and what is exchanged then drags on the tool's face (book/src/evidence/performance.md). What is taken goes
//! to the nodes and from there to all points around, so that momentum is kept:
//!
//! v_p ← v_p − e_p + Σ_i w_ip (Σ_q w_iq m_q e_q)/m_i
//!
//! What this does to the kinetic energy is counted as damping in the ledger. Smooth motion, elastic waves
//! below yield and material that never yields are not touched; `numerics.stray_velocities` counts the
//! velocities that were.
//!
//! That FLIP keeps what the grid cannot see: Hammerquist and Nairn (2017), doi:10.1016/j.cma.2017.01.035, who
//! take it away from all points in each step (XPIC). The limit is this project's.
//!
//! Form of the effect: the pass over the points compares each one's velocity with the one with which it
//! moves, and more is done, after the substep, only where they are further apart than σ_y/(ρ c).

use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::grid::{self, Layout};
use crate::partition::Partition;
use crate::partition::chunk::Chunk;
use crate::partition::velocity_outliers::Outlier;
use crate::points::{BLOCK, Column, Places, PointState};
use crate::simd::Real;
use crate::transfer::NodeRun;
use crate::transfer::stencils::{PointWeights, StencilNodes, for_each_node, stencil_nodes};

/// Motion of the points between two looks at their velocities (cells).
///
/// With 0.1, a few points reached 180 m/s before they were looked at (edges of 40 and 50 µm), with 0.03 none
/// did.
pub const INTERVAL: f64 = 0.03;

/// Share of all points from which on outliers are a reason to look at the energy of the run (-): in a run
/// that blows up the limit would hide from the other guards how fast points are (test `random_scenes`, its
/// first regression).
pub const SUSPICIOUS: f64 = 0.05;

/// Nodes around outliers that are found without asking for memory.
const USUAL_SHARES: usize = 2048;

/// Working memory of the pass; none of it is state.
#[derive(Clone, Debug)]
pub struct NullSpaceFilter {
    /// By node of the layout: its place in `shares` and one, or 0.
    places: Vec<u32>,
    /// Nodes around outliers.
    shares: Vec<Share>,
    /// Lowest and highest nearest node of any outlier, along each axis: points more than two nodes beyond
    /// share none with it.
    range: [[i32; 3]; 2],
}

/// The range of no outlier at all.
const NOWHERE: [[i32; 3]; 2] = [[i32::MAX; 3], [i32::MIN; 3]];

impl Default for NullSpaceFilter {
    fn default() -> Self {
        NullSpaceFilter { places: Vec::new(), shares: Vec::with_capacity(USUAL_SHARES), range: NOWHERE }
    }
}

/// What outliers give to a node.
#[derive(Clone, Copy, Debug)]
struct Share {
    node: usize,
    /// kg
    mass: f64,
    /// kg m/s; over the mass once all is there
    momentum: [f64; 3],
}

impl NullSpaceFilter {
    /// Makes room for so many nodes in the layout.
    pub fn make_room(&mut self, nodes: usize) {
        self.places.resize(nodes.max(self.places.len()), 0);
    }

    /// Brings the outliers that chunks have found back, and passes on what they had; gives their number and
    /// the kinetic energy that this took (J). With `parallel` on the threads of the current pool, with the
    /// same result.
    ///
    /// The deposits in `partition.incoming` must be those of the points as they are, and follow.
    pub fn restore_outliers<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
        &mut self,
        partition: &mut Partition<R, D, S>,
        shape: &F,
        density: f64,
        parallel: bool,
    ) -> (u64, f64) {
        let Partition { layout, chunks, incoming, .. } = &*partition;
        let count = chunks.iter().map(|chunk| chunk.outliers.len() as u64).sum();
        if count == 0 {
            return (0, 0.0);
        }
        self.make_room(layout.nodes());
        self.range = NOWHERE;
        for chunk in chunks.iter() {
            for outlier in &chunk.outliers {
                let points = chunk.blocks[outlier.block].places();
                self.collect(layout, (&points, shape), outlier, density, incoming);
            }
        }
        for share in &mut self.shares {
            share.momentum = share.momentum.map(|momentum| momentum / share.mass);
        }
        let taken =
            partition.sum_over_chunks(parallel, |layout, _, Chunk { blocks, outliers, .. }, deposits| {
                let mut outliers = outliers.iter().peekable();
                let near = blocks.iter_mut().enumerate();
                near.filter(|(_, block)| self.reaches_block(&block.node.as_ref()[0]))
                    .map(|(b, block)| {
                        let own =
                            std::iter::from_fn(|| outliers.next_if(|outlier| outlier.block == b).copied());
                        let (node, offset, volume) = (&block.node, &block.offset, &block.volume);
                        let points = Places::<R, D> { node, offset, volume };
                        self.give(layout, (&points, &mut block.velocity), shape, own, density, deposits)
                    })
                    .sum()
            });
        for share in self.shares.drain(..) {
            self.places[share.node] = 0;
        }
        (count, taken)
    }

    /// Whether a point of a block may share nodes with a outlier: its points were sorted along the first
    /// axis, and have moved by less than a cell since.
    fn reaches_block(&self, along_first: &Column<i32>) -> bool {
        let [low, high] = &self.range;
        along_first[BLOCK - 1] + 4 >= low[0] && along_first[0] - 4 <= high[0]
    }

    /// Whether any of the nodes around points at a node is shared with a outlier; gives them if so.
    fn shares<D: Dimension>(&self, layout: &Layout, node: &D::Vector<i32>, nodes: &mut StencilNodes) -> bool {
        let [low, high] = &self.range;
        let mut axes = node.as_ref().iter().zip(low.iter().zip(high));
        if !axes.all(|(node, (low, high))| node + 2 >= *low && node - 2 <= *high) {
            return false;
        }
        stencil_nodes::<D>(layout, node, nodes);
        nodes[..3 * D::PENCILS].iter().any(|&node| self.places[node] != 0)
    }

    /// Gives the excess of a outlier to the nodes around it.
    fn collect<R: Real, D: Dimension, F: ShapeFunction<R>>(
        &mut self,
        layout: &Layout,
        (points, shape): (&Places<'_, R, D>, &F),
        outlier: &Outlier,
        density: f64,
        deposits: &[NodeRun<R>],
    ) {
        let mass = density * points.volume[outlier.lane].to_f64();
        let weights = PointWeights::of(points, outlier.lane, shape);
        for (axis, &node) in points.node_of(outlier.lane).as_ref().iter().enumerate() {
            self.range[0][axis] = self.range[0][axis].min(node);
            self.range[1][axis] = self.range[1][axis].max(node);
        }
        for_each_node::<D>(layout, &points.node_of(outlier.lane), |node, places| {
            let weight = weights.weight::<D>(&places);
            // At the rim of its stencil a node may hold nothing at all.
            if weight <= 0.0 {
                return;
            }
            if self.places[node] == 0 {
                let on_run = |run: &NodeRun<R>| {
                    let index = node.checked_sub(run.first).filter(|&index| index < run.count::<D>());
                    index.map_or(0.0, |index| run.mass[index].to_f64())
                };
                let mass = deposits.iter().map(on_run).sum();
                self.shares.push(Share { node, mass, momentum: [0.0; 3] });
                self.places[node] = self.shares.len() as u32;
            }
            let share = &mut self.shares[self.places[node] as usize - 1];
            for axis in 0..D::AXES {
                share.momentum[axis] += weight * mass * outlier.excess[axis];
            }
        });
    }

    /// Changes the velocities of a block's points by what its outliers had too much of and the nodes around
    /// give; returns the kinetic energy (J) taken.
    fn give<R: Real, D: Dimension, F: ShapeFunction<R>>(
        &self,
        layout: &Layout,
        (points, velocity): (&Places<'_, R, D>, &mut D::Vector<Column<R>>),
        shape: &F,
        outliers: impl Iterator<Item = Outlier>,
        density: f64,
        deposits: &mut NodeRun<R>,
    ) -> f64 {
        let mut outliers = outliers.peekable();
        let mut taken = 0.0;
        let mut weights = [0.0; 27];
        // Sorted points share their stencil with their neighbours.
        let (mut last, mut nodes) = ((D::vector(|_| i32::MIN), false), StencilNodes::default());
        for lane in points.points() {
            let node = points.node_of(lane);
            if node.as_ref() != last.0.as_ref() {
                last = (node, self.shares::<D>(layout, &node, &mut nodes));
            }
            if !last.1 {
                continue;
            }
            PointWeights::of(points, lane, shape).products::<D>(&mut weights);
            let around = || nodes.iter().zip(&weights).take(3 * D::PENCILS);
            let mut change = D::vector(|_| 0.0);
            if let Some(outlier) = outliers.next_if(|outlier| outlier.lane == lane) {
                (0..D::AXES).for_each(|axis| change[axis] -= outlier.excess[axis]);
            }
            for (&node, weight) in around() {
                if let Some(share) = (self.places[node] as usize).checked_sub(1) {
                    (0..D::AXES).for_each(|axis| change[axis] += weight * self.shares[share].momentum[axis]);
                }
            }
            let mass = density * points.volume[lane].to_f64();
            for axis in 0..D::AXES {
                let old = velocity[axis][lane].to_f64();
                velocity[axis][lane] = R::from_f64(old + change[axis]);
                // What rounding left of it.
                change[axis] = velocity[axis][lane].to_f64() - old;
                taken -= mass * change[axis] * (old + 0.5 * change[axis]);
            }
            for (&node, weight) in around() {
                let part = mass * weight;
                let begin = (node - deposits.first) * D::QUADS;
                let record = &mut deposits.records[begin..begin + D::QUADS];
                grid::add_momentum::<R, D>(record, D::vector(|axis| part * change[axis]));
            }
        }
        taken
    }
}
