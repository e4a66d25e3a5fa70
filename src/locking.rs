//! Volumetric locking control: no point's volume ratio strays far from what the grid can tell apart.
//!
//! A cell holds several points, and each follows the volume change at its own place, although the grid's velocities
//! determine little more than one value per cell. In plastic flow, which keeps its volume, the rest piles up as
//! pressures of opposite sign on neighbouring points that no node's force feels: volumetric locking, and noise that
//! never relaxes (±16 GPa in the reference cut). Here, each time the points have moved by `INTERVAL`, volume ratios
//! are averaged on the nodes, and a point that deviates from the average around it by more than a threshold is brought
//! back to the threshold:
//!
//! J_i = Σ_p w_ip V_p J_p / Σ_p w_ip V_p,  d_p = J_p − Σ_i w_ip J_i,  J_p ← J_p − sign(d_p) max(|d_p| − T, 0)
//!
//! with V the volume at the start and T the volume strain at which the pressure is (2 + π)/√3 times the initial yield
//! stress: the pressure under a flat punch, which a difference between neighbours need never exceed. What lies below,
//! such as elastic waves, shear bands and the gradients around them, stays untouched. What the correction takes from
//! the elastic energy is returned, for the ledger, and the forces already deposited follow the new pressures.
//!
//! Averaging of the volumetric part on the grid: Mast et al. (2012), doi:10.1016/j.jcp.2012.04.032; the threshold, and
//! its value from Prandtl's punch, are this project's.
//!
//! Form of the effect: an optional pass between substeps. Only points that are strained by half the threshold, and their
//! neighbours, cost anything.

use crate::dimension::Dimension;
use crate::grid::{Layout, Record, add_force};
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::{BLOCK, Block, Places, PointState};
use crate::shape::ShapeFunction;
use crate::simd::Real;
use crate::stencils::{Stencils, for_each_node};
use crate::transfer::NodeRun;

/// Motion of the points between two looks at their volume ratios (cells).
///
/// Deviations grow between two looks: with five times the interval pressures at the tool's entry rise by a third.
pub const INTERVAL: f64 = 0.1;

/// Pressure under a flat punch on rigid-plastic material over its yield stress, (2 + π)/√3 (Prandtl 1920).
const PUNCH: f64 = 2.968_408_5;

/// The pass and its working memory, none of which is state.
#[derive(Clone, Debug, Default)]
pub struct LockingControl {
    /// Per node: Σ w V (J − 1) and Σ w V where a suspect looks, and whether one does.
    nodes: Vec<Average>,
    /// Nodes where a suspect looks.
    wanted: Vec<usize>,
    /// Points strained by half the threshold: chunk, block, lane.
    suspects: Vec<(usize, usize, usize)>,
}

/// What is known of the volume around a node.
#[derive(Clone, Copy, Debug, Default)]
struct Average {
    strain: f64,
    volume: f64,
    is_wanted: bool,
}

impl LockingControl {
    /// Limits the deviations of volume ratios; returns the elastic energy it took (J).
    ///
    /// The deposits in `partition.incoming` must be those of the points as they are.
    pub fn limit_deviations<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &mut Partition<R, D, M::State>,
        shape: &F,
        model: &M,
    ) -> f64 {
        let threshold = PUNCH * model.yield_volume_strain();
        self.find_suspects(partition, model, 0.5 * threshold);
        if self.suspects.is_empty() {
            return 0.0;
        }
        self.mark_nodes(partition);
        self.average(partition, shape, model);
        let taken = self.correct(partition, shape, model, threshold);
        for &node in &self.wanted {
            self.nodes[node] = Average::default();
        }
        taken
    }

    /// A point off by the threshold is itself strained by half of it, or its surroundings are: then it is they that
    /// are brought back.
    fn find_suspects<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &Partition<R, D, M::State>,
        model: &M,
        strain: f64,
    ) {
        self.suspects.clear();
        for (c, chunk) in partition.chunks.iter().enumerate() {
            for (b, block) in chunk.blocks.iter().enumerate() {
                let is_strained = |lane| (model.volume_ratio(&block.state, lane) - 1.0).abs() > strain;
                let suspects = (0..BLOCK).filter(|&lane| is_strained(lane) && block.is_point(lane));
                self.suspects.extend(suspects.map(|lane| (c, b, lane)));
            }
        }
    }

    /// Marks the nodes that suspects touch.
    fn mark_nodes<R: Real, D: Dimension, S: PointState<R>>(&mut self, partition: &Partition<R, D, S>) {
        let count = partition.layout.nodes();
        if self.nodes.len() < count {
            self.nodes.resize(count, Average::default());
        }
        self.wanted.clear();
        for &(c, b, lane) in &self.suspects {
            let node = node_of(&partition.chunks[c].blocks[b], lane);
            for_each_node::<D>(&partition.layout, &node, |index, _| {
                if !std::mem::replace(&mut self.nodes[index].is_wanted, true) {
                    self.wanted.push(index);
                }
            });
        }
    }

    /// Averages volume strains on the marked nodes.
    fn average<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &Partition<R, D, M::State>,
        shape: &F,
        model: &M,
    ) {
        for block in partition.chunks.iter().flat_map(|chunk| &chunk.blocks) {
            let ratio = &|lane: usize| model.volume_ratio(&block.state, lane);
            self.average_block(&partition.layout, &block.places(), shape, ratio);
        }
    }

    /// Adds to the marked nodes what the points of a block near them have; `ratio` gives volume ratios.
    fn average_block<R: Real, D: Dimension, F: ShapeFunction<R>>(
        &mut self,
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
                for_each_node::<D>(layout, &node, |index, _| is_near |= self.nodes[index].is_wanted);
                last = (node, is_near);
            }
            if !last.1 {
                continue;
            }
            let weights = weights.get_or_insert_with(|| Stencils::of(points, shape));
            let volume = points.volume[lane].to_f64();
            let strain = ratio(lane) - 1.0;
            for_each_node::<D>(layout, &node, |index, places| {
                let average = &mut self.nodes[index];
                if average.is_wanted {
                    let share = volume * weights.weight::<D>(lane, &places);
                    average.strain += share * strain;
                    average.volume += share;
                }
            });
        }
    }

    /// Brings suspects that deviate by more than the threshold back to it.
    fn correct<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &self,
        partition: &mut Partition<R, D, M::State>,
        shape: &F,
        model: &M,
        threshold: f64,
    ) -> f64 {
        let Partition { layout, chunks, incoming, .. } = partition;
        let mut taken = 0.0;
        let mut stencils: Option<((usize, usize), Stencils<R>)> = None;
        for &(c, b, lane) in &self.suspects {
            let block = &mut chunks[c].blocks[b];
            if stencils.as_ref().is_none_or(|(place, _)| *place != (c, b)) {
                stencils = Some(((c, b), Stencils::of(&block.places(), shape)));
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
            push::<R, D>(weights, (layout, &node), lane, strength, &mut incoming[c]);
        }
        taken
    }

    /// Volume strain (-) that the nodes around a point have on average.
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
            let Average { strain, volume, .. } = self.nodes[index];
            // A node on which nothing but rounding lies has no say, and next to no weight.
            if volume > 0.0 {
                around += weights.weight::<D>(lane, &places) * strain / volume;
            }
        });
        around
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
