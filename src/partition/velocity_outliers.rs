//! Which points' velocities are foreign to the nodes around them; `outliers` has the equations and says what
//! for.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::points::{Column, Places};
use crate::simd::Real;
use crate::transfer::stencils::{PointWeights, for_each_node};
use crate::transfer::{Candidate, NodeRun};

/// A velocity out of bounds.
#[derive(Clone, Copy, Debug)]
pub struct Outlier {
    /// Its point's block in the chunk.
    pub block: usize,
    /// Its place in the block.
    pub lane: usize,
    /// What it has too much of (m/s).
    pub excess: [f64; 3],
}

/// The candidate as a outlier, if it is one.
///
/// * `nodes`: their velocities (m/s)
/// * `bound`: speed (m/s) that stress at yield gives a free surface
pub fn judge<R: Real, D: Dimension, F: ShapeFunction<R>>(
    (candidate, points, velocity): (&Candidate, &Places<'_, R, D>, &D::Vector<Column<R>>),
    (nodes, layout, shape): (&NodeRun<R>, &Layout, &F),
    bound: f64,
) -> Option<Outlier> {
    let &Candidate { block, lane } = candidate;
    let weights = PointWeights::of(points, lane, shape);
    let own = D::vector(|axis| velocity[axis][lane].to_f64());
    let excess = excess::<R, D>((nodes, layout, &weights), &points.node_of(lane), &own, bound)?;
    Some(Outlier { block, lane, excess })
}

/// By how much the velocity `own` (m/s) of the point with these weights passes its limit, e_p.
#[inline(never)]
fn excess<R: Real, D: Dimension>(
    (nodes, layout, weights): (&NodeRun<R>, &Layout, &PointWeights),
    node: &D::Vector<i32>,
    own: &D::Vector<f64>,
    bound: f64,
) -> Option<[f64; 3]> {
    let each = |visit: &mut dyn FnMut(f64, usize, f64)| {
        for_each_node::<D>(layout, node, |index, places| {
            let record = &nodes.records[(index - nodes.first) * D::QUADS].0;
            let weight = weights.weight::<D>(&places);
            (0..D::AXES).for_each(|axis| visit(weight, axis, record[axis].to_f64()));
        });
    };
    let (mut mean, mut spread, mut excess) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    each(&mut |weight, axis, velocity| mean[axis] += weight * velocity);
    each(&mut |weight, axis, velocity| spread[axis] += weight * (velocity - mean[axis]).abs());
    for axis in 0..D::AXES {
        let (rest, most) = (own[axis] - mean[axis], bound + spread[axis]);
        excess[axis] = rest - rest.clamp(-most, most);
    }
    excess.iter().any(|&part| part != 0.0).then_some(excess)
}
