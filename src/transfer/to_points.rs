//! Stages 1 and 2 of a pass: weights of a block's points, and velocity, increment and gradient from the nodes.
//!
//! A kernel of its own, so that all constitutive models share one compiled copy of it.

use super::Scratch;
use super::moments::times_k;
use super::nodes::{NodeRun, first_node};
use crate::dimension::Dimension;
use crate::grid::{Layout, Record};
use crate::points::{BLOCK, Column};
use crate::shape::ShapeFunction;
use crate::simd::{Kernel, Real, Simd, Vector, each, inlined};

/// Stages 1 and 2 for one block.
pub(super) struct ToPoints<'a, R: Real, D: Dimension, F> {
    pub shape: &'a F,
    pub nodes: &'a NodeRun<R>,
    pub layout: &'a Layout,
    /// The block's nearest nodes and offsets.
    pub node: &'a D::Vector<Column<i32>>,
    pub offset: &'a D::Vector<Column<R>>,
    pub scratch: &'a mut Scratch<R>,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>> Kernel<R> for ToPoints<'_, R, D, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        self.gather_block::<S, false>();
    }
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>> ToPoints<'_, R, D, F> {
    /// Both stages; with moments of the velocity where points have an affine field (`moments`).
    #[inline(always)]
    pub(super) fn gather_block<S: Simd<Scalar = R>, const AFFINE: bool>(self) {
        let ToPoints { shape, nodes, layout, node, offset, scratch } = self;
        for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
            let offset = inlined!(D::vector, |axis| S::Lanes::load(&offset[axis][lane..]));
            store_stencils::<S, D, F>(shape, &offset, lane, scratch);
        }
        let first = inlined!(D::vector, |axis| node[axis][0]);
        let mut stencil = Stencil::<R, D>::around(nodes, layout, first);
        for lane in 0..BLOCK {
            let node = inlined!(D::vector, |axis| node[axis][lane]);
            if node.as_ref() != stencil.node.as_ref() {
                stencil = Stencil::around(nodes, layout, node);
            }
            gather::<S, D, AFFINE>(&stencil, lane, scratch);
        }
    }
}

/// Stage 1, and the end of stage 3: weights and slopes of points `lane..` at their offsets.
#[inline(always)]
pub(super) fn store_stencils<S: Simd, D: Dimension, F: ShapeFunction<S::Scalar>>(
    shape: &F,
    offset: &D::Vector<S::Lanes>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    for axis in 0..D::AXES {
        let stencil = shape.stencil(offset[axis]);
        for k in 0..3 {
            stencil.weights[k].store(&mut scratch.weights[axis][k][lane..]);
            stencil.slopes[k].store(&mut scratch.slopes[axis][k][lane..]);
        }
    }
}

/// Product of the weights across the pencils, and its derivatives along each axis but the last.
#[inline(always)]
pub(super) fn transverse<R: Real, D: Dimension>(
    scratch: &Scratch<R>,
    pencil: usize,
    lane: usize,
) -> (R, [R; 2]) {
    if D::AXES == 2 {
        (scratch.weights[0][pencil][lane], [scratch.slopes[0][pencil][lane], R::ZERO])
    } else {
        let (i, j) = (pencil / 3, pencil % 3);
        let (x, y) = (scratch.weights[0][i][lane], scratch.weights[1][j][lane]);
        (x * y, [scratch.slopes[0][i][lane] * y, x * scratch.slopes[1][j][lane]])
    }
}

/// The records of a point's stencil: three nodes on each of its pencils.
///
/// Sorted points share it with their neighbours, so it is looked up only when the nearest node changes.
struct Stencil<'a, R: Real, D: Dimension> {
    node: D::Vector<i32>,
    /// Of each array the first `3 QUADS` records belong to the stencil.
    pencils: D::Pencils<&'a [Record<R>; 6]>,
}

impl<'a, R: Real, D: Dimension> Stencil<'a, R, D> {
    #[inline(always)]
    fn around(nodes: &'a NodeRun<R>, layout: &Layout, node: D::Vector<i32>) -> Self {
        // A run is longer than its nodes by `SLACK`, so six records follow each of them.
        let from = |begin: usize| nodes.records[begin..begin + 6].first_chunk().expect("six records");
        let mut pencils = D::pencils(from(0));
        for pencil in 0..D::PENCILS {
            pencils[pencil] = from(first_node::<D>(layout, nodes.first, &node, pencil) * D::QUADS);
        }
        Stencil { node, pencils }
    }
}

/// Stage 2: velocity, increment and velocity gradient at one point.
#[inline(always)]
fn gather<S: Simd, D: Dimension, const AFFINE: bool>(
    stencil: &Stencil<'_, S::Scalar, D>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    let last = D::AXES - 1;
    let zero = S::Quad::constant(0.0);
    let a: [S::Quad; 3] = each!(k < 3 => S::Quad::splat(scratch.weights[last][k][lane]));
    let mut g: [S::Quad; 3] = each!(k < 3 => S::Quad::splat(scratch.slopes[last][k][lane]));
    if AFFINE {
        for k in 0..3 {
            g[k] = S::join(g[k], times_k(a[k], k));
        }
    }
    let mut values = [zero; 2];
    let mut gradients = D::vector(|_| zero);
    for pencil in 0..D::PENCILS {
        let records = stencil.pencils[pencil];
        let (weight, slopes) = transverse::<_, D>(scratch, pencil, lane);
        let weight = S::Quad::splat(weight);
        for quad in 0..D::QUADS {
            let mut n: [S::Quad; 3] = each!(k < 3 => S::Quad::load(&records[k * D::QUADS + quad].0));
            if AFFINE {
                n = each!(k < 3 => S::first_twice(n[k]));
            }
            let along = a[2].mul_add(n[2], a[1].mul_add(n[1], a[0] * n[0]));
            values[quad] = weight.mul_add(along, values[quad]);
            if quad == 0 {
                let slope_along = g[2].mul_add(n[2], g[1].mul_add(n[1], g[0] * n[0]));
                for axis in 0..last {
                    let mut slope = S::Quad::splat(slopes[axis]);
                    if AFFINE {
                        slope = S::join(slope, times_k(weight, pencil));
                    }
                    gradients[axis] = slope.mul_add(along, gradients[axis]);
                }
                gradients[last] = weight.mul_add(slope_along, gradients[last]);
            }
        }
    }
    for quad in 0..D::QUADS {
        values[quad].store(&mut scratch.values[quad][lane]);
    }
    for axis in 0..D::AXES {
        gradients[axis].store(&mut scratch.gradients[axis][lane]);
    }
}
