//! Volumetric locking control: no point's volume ratio strays far from what the grid can tell apart.
//!
//! A cell holds several points, and each follows the volume change at its own place, although the grid's
//! velocities determine little more than one value per cell. In plastic flow, which keeps its volume, the
//! rest piles up as pressures of opposite sign on neighbouring points that no node's force feels: volumetric
//! locking, and noise that never relaxes (±16 GPa in the reference cut). Here, each time the points have
//! moved by `INTERVAL`, volume ratios are averaged on the nodes, and a point that deviates from the average
//! around it by more than a threshold is brought back to the threshold:
//!
//! J_i = Σ_p w_ip V_p J_p / Σ_p w_ip V_p,  d_p = J_p − Σ_i w_ip J_i,  J_p ← J_p − sign(d_p) max(|d_p| − T, 0)
//!
//! with V the volume at the start and T the volume strain at which the pressure is (2 + π)/√3 times the
//! initial yield stress: the pressure under a flat punch, which a difference between neighbours need never
//! exceed. What lies below, such as elastic waves, shear bands and the gradients around them, stays
//! untouched. What the correction takes from the elastic energy is returned, for the ledger, and the forces
//! already deposited follow the new pressures.
//!
//! Averaging of the volumetric part on the grid: Mast et al. (2012), doi:10.1016/j.jcp.2012.04.032; the
//! threshold, and its value from Prandtl's punch, are this project's.
//!
//! Form of the effect: an optional pass between substeps. Only points that are strained by half the
//! threshold, and their neighbours, cost anything.

use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::grid::{Layout, Record, add_force};
use crate::material::ConstitutiveModel;
use crate::parallel::for_each;
use crate::partition::Partition;
use crate::partition::chunk::Chunk;
use crate::points::{BLOCK, Block, Places, PointState};
use crate::simd::Real;
use crate::transfer::NodeRun;
use crate::transfer::stencils::{Stencils, for_each_node};

/// Motion of the points between two looks at their volume ratios (cells).
///
/// Deviations grow between two looks: with five times the interval pressures at the tool's entry rise by a
/// third.
pub const INTERVAL: f64 = 0.1;

/// Pressure under a flat punch on rigid-plastic material over its yield stress, (2 + π)/√3 (Prandtl 1920).
const PUNCH: f64 = 2.968_408_5;

/// The pass and its working memory, none of which is state.
#[derive(Clone, Debug, Default)]
pub struct LockingControl {
    /// By node of the layout: its place in `wanted` and one where a candidate looks, or 0.
    places: Vec<u32>,
    /// Nodes where a candidate looks.
    wanted: Vec<usize>,
    /// Their average volume strains (-).
    averages: Vec<f64>,
    /// By chunk.
    chunks: Vec<InChunk>,
}

/// What is known of a chunk's points.
#[derive(Clone, Debug, Default)]
struct InChunk {
    /// Points strained by half the threshold: block and lane.
    candidates: Vec<(usize, usize)>,
    /// By place in `wanted`: Σ w V (J − 1) and Σ w V over its points.
    sums: Vec<[f64; 2]>,
}

impl LockingControl {
    /// Limits the deviations of volume ratios; returns the elastic energy it took (J). With `parallel` on the
    /// threads of the current pool, with the same result.
    ///
    /// The deposits in `partition.incoming` must be those of the points as they are.
    pub fn limit_deviations<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &mut Partition<R, D, M::State>,
        shape: &F,
        model: &M,
        parallel: bool,
    ) -> f64 {
        let threshold = PUNCH * model.yield_volume_strain();
        let mut chunks = std::mem::take(&mut self.chunks);
        chunks.resize_with(partition.chunks.len(), InChunk::default);
        for_each(partition.chunks.iter().zip(&mut chunks), parallel, |(chunk, known)| {
            known.find_suspects(&chunk.blocks, model, 0.5 * threshold);
        });
        let mut taken = 0.0;
        if chunks.iter().any(|known| !known.candidates.is_empty()) {
            self.mark_nodes(partition, &chunks);
            let layout = &partition.layout;
            for_each(partition.chunks.iter().zip(&mut chunks), parallel, |(chunk, known)| {
                known.sums.clear();
                known.sums.resize(self.wanted.len(), [0.0; 2]);
                for block in &chunk.blocks {
                    let ratio = &|lane: usize| model.volume_ratio(&block.state, lane);
                    known.add_block(&self.places, layout, &block.places(), shape, ratio);
                }
            });
            self.average(&chunks);
            taken = partition.sum_over_chunks(parallel, |layout, number, chunk, deposits| {
                let candidates = &chunks[number].candidates;
                self.correct(layout, chunk, deposits, candidates, (shape, model), threshold)
            });
            for &node in &self.wanted {
                self.places[node] = 0;
            }
        }
        self.chunks = chunks;
        taken
    }

    /// Marks the nodes that candidates touch.
    fn mark_nodes<R: Real, D: Dimension, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        chunks: &[InChunk],
    ) {
        let count = partition.layout.nodes();
        if self.places.len() < count {
            self.places.resize(count, 0);
        }
        self.wanted.clear();
        for (chunk, known) in partition.chunks.iter().zip(chunks) {
            for &(b, lane) in &known.candidates {
                let node = node_of(&chunk.blocks[b], lane);
                for_each_node::<D>(&partition.layout, &node, |index, _| {
                    if self.places[index] == 0 {
                        self.wanted.push(index);
                        self.places[index] = self.wanted.len() as u32;
                    }
                });
            }
        }
    }

    /// Adds up what the chunks have on the marked nodes, in their order.
    fn average(&mut self, chunks: &[InChunk]) {
        self.averages.clear();
        self.averages.extend((0..self.wanted.len()).map(|place| {
            let [strain, volume] = chunks.iter().fold([0.0; 2], |[strain, volume], known| {
                let [s, v] = known.sums[place];
                [strain + s, volume + v]
            });
            // A node on which nothing but rounding lies has no say, and next to no weight.
            if volume > 0.0 { strain / volume } else { 0.0 }
        }));
    }

    /// Brings candidates of a chunk that deviate by more than the threshold back to it.
    fn correct<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &self,
        layout: &Layout,
        chunk: &mut Chunk<R, D, M::State>,
        deposits: &mut NodeRun<R>,
        candidates: &[(usize, usize)],
        (shape, model): (&F, &M),
        threshold: f64,
    ) -> f64 {
        let mut taken = 0.0;
        let mut stencils: Option<(usize, Stencils<R>)> = None;
        for &(b, lane) in candidates {
            let block = &mut chunk.blocks[b];
            if stencils.as_ref().is_none_or(|(place, _)| *place != b) {
                stencils = Some((b, Stencils::of(&block.places(), shape)));
            }
            let Some((_, weights)) = &stencils else { continue };
            let node = node_of(block, lane);
            let own = model.volume_ratio(&block.state, lane);
            let deviation = own - 1.0 - self.around::<R, D>(layout, &node, lane, weights);
            let excess = deviation.abs() - threshold;
            if excess <= 0.0 {
                continue;
            }
            let before = mean_stress(model, block, lane);
            let fallen = model.set_volume_ratio(&mut block.state, lane, own - excess.copysign(deviation));
            let volume = block.volume[lane].to_f64();
            taken += volume * fallen;
            // Eq. 11 of Ambati et al. (2011) with the change of stress, which is the same along every axis.
            let strength = -volume * (mean_stress(model, block, lane) - before) / layout.cell;
            push::<R, D>(weights, (layout, &node), lane, strength, deposits);
        }
        taken
    }

    /// Volume strain (-) that the nodes around a candidate have on average.
    #[inline(never)]
    fn around<R: Real, D: Dimension>(
        &self,
        layout: &Layout,
        node: &D::Vector<i32>,
        lane: usize,
        weights: &Stencils<R>,
    ) -> f64 {
        let mut around = 0.0;
        for_each_node::<D>(layout, node, |index, places| {
            let average = self.averages[self.places[index] as usize - 1];
            around += weights.weight::<D>(lane, &places) * average;
        });
        around
    }
}

impl InChunk {
    /// A point off by the threshold is itself strained by half of it, or its surroundings are: then it is
    /// they that are brought back.
    fn find_suspects<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &mut self,
        blocks: &[Block<R, D, M::State>],
        model: &M,
        strain: f64,
    ) {
        self.candidates.clear();
        for (b, block) in blocks.iter().enumerate() {
            let is_strained = |lane| (model.volume_ratio(&block.state, lane) - 1.0).abs() > strain;
            let candidates = (0..BLOCK).filter(|&lane| is_strained(lane) && block.is_point(lane));
            self.candidates.extend(candidates.map(|lane| (b, lane)));
        }
    }

    /// Adds what the points of a block have on the nodes marked by `marks`; `ratio` gives volume ratios.
    fn add_block<R: Real, D: Dimension, F: ShapeFunction<R>>(
        &mut self,
        marks: &[u32],
        layout: &Layout,
        points: &Places<'_, R, D>,
        shape: &F,
        ratio: &dyn Fn(usize) -> f64,
    ) {
        let mut weights = None;
        // Sorted points share their nearest node with their neighbours.
        let mut last = (D::vector(|_| i32::MIN), false);
        for lane in points.points() {
            let node = points.node_of(lane);
            if node.as_ref() != last.0.as_ref() {
                let mut is_near = false;
                for_each_node::<D>(layout, &node, |index, _| is_near |= marks[index] != 0);
                last = (node, is_near);
            }
            if !last.1 {
                continue;
            }
            let weights = weights.get_or_insert_with(|| Stencils::of(points, shape));
            let volume = points.volume[lane].to_f64();
            let strain = ratio(lane) - 1.0;
            for_each_node::<D>(layout, &node, |index, places| {
                if let Some(place) = (marks[index] as usize).checked_sub(1) {
                    let share = volume * weights.weight::<D>(lane, &places);
                    let [strains, volumes] = &mut self.sums[place];
                    *strains += share * strain;
                    *volumes += share;
                }
            });
        }
    }
}

/// Nearest node of a point.
pub(crate) fn node_of<R: Real, D: Dimension, S>(block: &Block<R, D, S>, lane: usize) -> D::Vector<i32> {
    D::vector(|axis| block.node[axis][lane])
}

/// Mean Kirchhoff stress (Pa) of the point at `lane`.
fn mean_stress<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
    model: &M,
    block: &Block<R, D, M::State>,
    lane: usize,
) -> f64 {
    let report = model.report(&block.state, lane);
    report.jacobian * (report.stress[0] + report.stress[1] + report.stress[2]) / 3.0
}

/// Adds a force (N per unit slope, the same along every axis) of the point at `lane` to the nodes around it.
#[inline(never)]
fn push<R: Real, D: Dimension>(
    weights: &Stencils<R>,
    (layout, node): (&Layout, &D::Vector<i32>),
    lane: usize,
    strength: f64,
    run: &mut NodeRun<R>,
) {
    for_each_node::<D>(layout, node, |index, places| {
        let force = D::vector(|axis| strength * weights.slope::<D>(lane, &places, axis));
        let begin = (index - run.first) * D::QUADS;
        let record: &mut [Record<R>] = &mut run.records[begin..begin + D::QUADS];
        add_force::<R, D>(record, force);
    });
}
