//! Volumetric locking control: volume ratios kept as smooth as the grid can tell.
//!
//! A cell holds several points, and each follows the volume change at its own place, although the grid's velocities
//! determine little more than one value per cell. In plastic flow, which keeps its volume, the rest piles up as
//! pressures of opposite sign on neighbouring points that no node's force feels: volumetric locking, and noise that
//! never relaxes. Here, each time the points are sorted, volume ratios are averaged on the nodes and the points
//! brought closer to the average around them:
//!
//! J_i = Σ_p w_ip V_p J_p / Σ_p w_ip V_p,  J_p ← J_p + s (Σ_i w_ip J_i − J_p)
//!
//! with V the volume at the start and s = `SHARE`. What the averaging takes from the elastic energy is returned, for the
//! ledger. Deviations below `THRESHOLD`, such as elastic waves have, stay untouched.
//!
//! `SHARE` was chosen so that pressures in the reference cut stay below 10 GPa. At this strength the averaging also
//! smooths the chip's shear bands away (README, known limits).
//!
//! Related: averaging of the volumetric part on the grid, Mast et al. (2012), doi:10.1016/j.jcp.2012.04.032.
//!
//! Form of the effect: an optional pass, a loop of its own between substeps; without it nothing is kept or done.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::{BLOCK, Block, Column, PointState};
use crate::shape::ShapeFunction;
use crate::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use crate::transfer::first_node;

/// Part of the deviation from the surroundings that one pass takes away (-).
const SHARE: f64 = 0.8;
/// Smallest deviation of J that is acted upon (-): a mean stress of 0.1 % of a steel's bulk modulus.
const THRESHOLD: f64 = 1e-3;

/// Averages volume ratios; returns the elastic energy it took (J).
pub fn even_out_volume<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
    partition: &mut Partition<R, D, M::State>,
    shape: &F,
    model: &M,
) -> f64 {
    let layout = &partition.layout;
    // Per node: Σ w V J and Σ w V.
    let mut nodes = vec![[0.0; 2]; layout.nodes()];
    for block in partition.chunks.iter().flat_map(|chunk| &chunk.blocks) {
        for_each_weight::<R, D, F, _>(block, layout, shape, |lane, node, weight| {
            let volume = weight * block.volume[lane].to_f64();
            nodes[node][0] += volume * model.volume_ratio(&block.state, lane);
            nodes[node][1] += volume;
        });
    }
    let mut taken = 0.0;
    for block in partition.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
        let mut around = [0.0; BLOCK];
        for_each_weight::<R, D, F, _>(block, layout, shape, |lane, node, weight| {
            let [sum, volume] = nodes[node];
            // A node on which nothing but rounding lies has no say, and next to no weight.
            around[lane] += if volume > 0.0 { weight * sum / volume } else { weight };
        });
        for (lane, around) in around.into_iter().enumerate() {
            let own = model.volume_ratio(&block.state, lane);
            if block.is_point(lane) && (around - own).abs() > THRESHOLD {
                let fallen = model.set_volume_ratio(&mut block.state, lane, own + SHARE * (around - own));
                taken += block.volume[lane].to_f64() * fallen;
            }
        }
    }
    taken
}

/// Calls `visit` with lane, index of the node in the layout, and weight, for every point of a block and every node it
/// touches.
fn for_each_weight<R: Real, D: Dimension, F: ShapeFunction<R>, T: PointState<R>>(
    block: &Block<R, D, T>,
    layout: &Layout,
    shape: &F,
    mut visit: impl FnMut(usize, usize, f64),
) {
    // Once in some sixty substeps: the portable instruction set is fast enough.
    let weights = dispatch(InstructionSet::Portable, BlockWeights { offset: block.offset.as_ref(), shape });
    for lane in (0..BLOCK).filter(|&lane| block.is_point(lane)) {
        let node = D::vector(|axis| block.node[axis][lane]);
        for pencil in 0..D::PENCILS {
            let first = first_node::<D>(layout, 0, &node, pencil);
            let across = if D::AXES == 2 {
                weights[0][pencil][lane]
            } else {
                weights[0][pencil / 3][lane] * weights[1][pencil % 3][lane]
            };
            for k in 0..3 {
                visit(lane, first + k, (across * weights[D::AXES - 1][k][lane]).to_f64());
            }
        }
    }
}

/// Weights of a block's points by axis and node of the stencil.
struct BlockWeights<'a, R, F> {
    offset: &'a [Column<R>],
    shape: &'a F,
}

impl<R: Real, F: ShapeFunction<R>> Kernel<R> for BlockWeights<'_, R, F> {
    type Output = [[Column<R>; 3]; 3];

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> Self::Output {
        let mut weights = [[[R::ZERO; BLOCK]; 3]; 3];
        for (offset, weights) in self.offset.iter().zip(&mut weights) {
            for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
                let stencil = self.shape.stencil(S::Lanes::load(&offset[lane..]));
                for (column, values) in weights.iter_mut().zip(stencil.weights) {
                    values.store(&mut column[lane..]);
                }
            }
        }
        weights
    }
}
