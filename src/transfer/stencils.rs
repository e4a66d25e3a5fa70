//! Weights and slopes of points for the passes between substeps, and the nodes they belong to.
//!
//! The substep's own kernels (`transfer`) keep theirs in scratch memory. Passes that look at few points now
//! and then ask here: for a whole block (`Stencils`, in double precision `ExactStencils`) or for one point
//! (`PointWeights`). All give nodes in the order of `for_each_node`: pencil by pencil, along each from the
//! lowest on.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::points::{BLOCK, Column, Places};
use crate::simd::{Array, InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use crate::transfer::first_node;

/// Calls `visit` with the index in the layout of each node that a point at `node` touches, and the node's
/// place in the stencil along each axis.
pub(crate) fn for_each_node<D: Dimension>(
    layout: &Layout,
    node: &D::Vector<i32>,
    mut visit: impl FnMut(usize, [usize; 3]),
) {
    for pencil in 0..D::PENCILS {
        let first = first_node::<D>(layout, 0, node, pencil);
        (0..3).for_each(|k| visit(first + k, places::<D>(pencil, k)));
    }
}

/// Places in the stencil along each axis of node `k` of its pencil `pencil`.
#[inline(always)]
pub(crate) fn places<D: Dimension>(pencil: usize, k: usize) -> [usize; 3] {
    if D::AXES == 2 { [pencil, k, 0] } else { [pencil / 3, pencil % 3, k] }
}

/// Indices of the nodes around a point, of which a dimension has 9 or 27.
pub(crate) type StencilNodes = [usize; 27];

/// The nodes around points whose nearest node is `node`, in the order of `for_each_node`.
#[inline(always)]
pub(crate) fn stencil_nodes<D: Dimension>(layout: &Layout, node: &D::Vector<i32>, nodes: &mut StencilNodes) {
    for (pencil, along) in nodes.chunks_mut(3).enumerate().take(D::PENCILS) {
        let first = first_node::<D>(layout, 0, node, pencil);
        (0..3).for_each(|k| along[k] = first + k);
    }
}

/// Weights and slopes of a block's points, by axis and place in the stencil.
pub(crate) struct Stencils<R> {
    pub(crate) weights: [[Column<R>; 3]; 3],
    pub(crate) slopes: [[Column<R>; 3]; 3],
}

impl<R: Real> Stencils<R> {
    /// Those of a block.
    pub(crate) fn of<D: Dimension, F: ShapeFunction<R>>(points: &Places<'_, R, D>, shape: &F) -> Self {
        // A few blocks every some ten substeps: the portable instruction set is fast enough.
        dispatch(InstructionSet::Portable, BlockStencils { offset: points.offset.as_ref(), shape })
    }

    /// Weight of a node for a point (-).
    pub(crate) fn weight<D: Dimension>(&self, lane: usize, places: &[usize; 3]) -> f64 {
        (0..D::AXES).map(|axis| self.weights[axis][places[axis]][lane].to_f64()).product()
    }

    /// Slope of that weight along an axis (1/cell).
    pub(crate) fn slope<D: Dimension>(&self, lane: usize, places: &[usize; 3], along: usize) -> f64 {
        let factor = |axis: usize| {
            let columns = if axis == along { &self.slopes } else { &self.weights };
            columns[axis][places[axis]][lane].to_f64()
        };
        (0..D::AXES).map(factor).product()
    }
}

/// Fills `Stencils`.
struct BlockStencils<'a, R, F> {
    offset: &'a [Column<R>],
    shape: &'a F,
}

impl<R: Real, F: ShapeFunction<R>> Kernel<R> for BlockStencils<'_, R, F> {
    type Output = Stencils<R>;

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> Self::Output {
        let zero = [[[R::ZERO; BLOCK]; 3]; 3];
        let mut out = Stencils { weights: zero, slopes: zero };
        for (axis, offset) in self.offset.iter().enumerate() {
            for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
                let stencil = self.shape.stencil(S::Lanes::load(&offset[lane..]));
                for k in 0..3 {
                    stencil.weights[k].store(&mut out.weights[axis][k][lane..]);
                    stencil.slopes[k].store(&mut out.slopes[axis][k][lane..]);
                }
            }
        }
        out
    }
}

/// Weights and slopes of a block's points in double precision, by axis and place in the stencil.
///
/// The middle weight is what the others leave, so that weights sum to one and slopes to zero in single
/// precision too: on these sums conservation rests.
pub(crate) struct ExactStencils {
    weights: [[Column<f64>; 3]; 3],
    slopes: [[Column<f64>; 3]; 3],
}

impl ExactStencils {
    /// Those of a block.
    #[inline(never)]
    pub(crate) fn of<R: Real, D: Dimension, F: ShapeFunction<R>>(
        points: &Places<'_, R, D>,
        shape: &F,
    ) -> Self {
        let exact = |columns: &[[Column<R>; 3]; 3], sum: f64| {
            columns.each_ref().map(|of_axis| {
                let mut wide = of_axis.each_ref().map(|column| column.map(Real::to_f64));
                for lane in 0..BLOCK {
                    wide[1][lane] = sum - wide[0][lane] - wide[2][lane];
                }
                wide
            })
        };
        let own = Stencils::of(points, shape);
        ExactStencils { weights: exact(&own.weights, 1.0), slopes: exact(&own.slopes, 0.0) }
    }

    /// Weight of a node for a point (-).
    pub(crate) fn weight<D: Dimension>(&self, lane: usize, places: &[usize; 3]) -> f64 {
        (0..D::AXES).map(|axis| self.weights[axis][places[axis]][lane]).product()
    }

    /// Slope of that weight along an axis (1/cell).
    pub(crate) fn slope<D: Dimension>(&self, lane: usize, places: &[usize; 3], along: usize) -> f64 {
        let factor = |axis: usize| {
            let columns = if axis == along { &self.slopes } else { &self.weights };
            columns[axis][places[axis]][lane]
        };
        (0..D::AXES).map(factor).product()
    }
}

/// The weights of one point alone, the same numbers as in `ExactStencils`: where few points of a block are
/// asked for.
pub(crate) struct PointWeights([[f64; 3]; 3]);

impl PointWeights {
    /// Those of the point at `lane`.
    #[inline(always)]
    pub(crate) fn of<R: Real, D: Dimension, F: ShapeFunction<R>>(
        points: &Places<'_, R, D>,
        lane: usize,
        shape: &F,
    ) -> Self {
        let mut weights = [[0.0; 3]; 3];
        for (of_axis, offset) in weights.iter_mut().zip(points.offset.as_ref()) {
            let stencil = shape.stencil(Array::<R, 1>::splat(offset[lane]));
            let [low, _, high] = stencil.weights.map(|weight| weight.sum().to_f64());
            *of_axis = [low, 1.0 - low - high, high];
        }
        PointWeights(weights)
    }

    /// Weight of a node (-).
    #[inline(always)]
    pub(crate) fn weight<D: Dimension>(&self, places: &[usize; 3]) -> f64 {
        (0..D::AXES).map(|axis| self.0[axis][places[axis]]).product()
    }

    /// Weights of all nodes, in the order of `stencil_nodes`.
    #[inline(always)]
    pub(crate) fn products<D: Dimension>(&self, products: &mut [f64; 27]) {
        for (k, product) in products.iter_mut().enumerate().take(3 * D::PENCILS) {
            *product = self.weight::<D>(&places::<D>(k / 3, k % 3));
        }
    }
}
