//! Stages 1 and 2 of a pass: weights of a block's points, and velocity, increment and gradient from the
//! nodes.
//!
//! A kernel of its own, so that all constitutive models share one compiled copy of it.

use super::nodes::{NodeRun, first_node};
use super::scratch::times_k;
use super::scratch::{Scratch, store_stencils, together, transverse, way_along};
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::grid::{Layout, Record};
use crate::points::{BLOCK, Column};
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
        let mut lane = 0;
        while lane < BLOCK {
            let here = inlined!(D::vector, |axis| node[axis][lane]);
            match way_along::<D>(&stencil.node, &here) {
                Some(0) => {}
                Some(1) => stencil.slide(nodes),
                _ => stencil = Stencil::around(nodes, layout, here),
            }
            gather::<S, D, AFFINE>(&stencil, lane, scratch);
            lane += together::<S, D>(node, lane);
        }
    }
}

/// The records of a point's stencil: three nodes on each of its pencils.
///
/// Sorted points share it with their neighbours, or have the next one along the pencils.
struct Stencil<'a, R: Real, D: Dimension> {
    node: D::Vector<i32>,
    /// By pencil: place in the run of its first node.
    begin: D::Pencils<usize>,
    /// Of each array the first `3 QUADS` records belong to the stencil.
    pencils: D::Pencils<&'a [Record<R>; 6]>,
}

impl<'a, R: Real, D: Dimension> Stencil<'a, R, D> {
    #[inline(always)]
    fn around(nodes: &'a NodeRun<R>, layout: &Layout, node: D::Vector<i32>) -> Self {
        let mut begin = D::pencils(0);
        for pencil in 0..D::PENCILS {
            begin[pencil] = first_node::<D>(layout, nodes.first, &node, pencil);
        }
        let mut stencil = Stencil { node, begin, pencils: D::pencils(records_from(nodes, 0)) };
        stencil.look_up(nodes);
        stencil
    }

    /// Goes on to the next node along the pencils.
    #[inline(always)]
    fn slide(&mut self, nodes: &'a NodeRun<R>) {
        self.node[D::AXES - 1] += 1;
        for pencil in 0..D::PENCILS {
            self.begin[pencil] += 1;
        }
        self.look_up(nodes);
    }

    #[inline(always)]
    fn look_up(&mut self, nodes: &'a NodeRun<R>) {
        for pencil in 0..D::PENCILS {
            self.pencils[pencil] = records_from(nodes, self.begin[pencil] * D::QUADS);
        }
    }
}

/// Six records: a run is longer than its nodes by `SLACK`, so they follow each of them.
#[inline(always)]
fn records_from<R: Real>(nodes: &NodeRun<R>, begin: usize) -> &[Record<R>; 6] {
    nodes.records[begin..begin + 6].first_chunk().expect("six records")
}

/// Stage 2: velocity, increment and velocity gradient at the points from `lane` on that a register holds.
/// What one gets that is not around this stencil is overwritten when its turn comes.
#[inline(always)]
fn gather<S: Simd, D: Dimension, const AFFINE: bool>(
    stencil: &Stencil<'_, S::Scalar, D>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    // The remainder is the lane itself; that it is below `BLOCK` spares the checks of what follows.
    let (last, lane) = (D::AXES - 1, lane % BLOCK);
    let zero = S::Records::constant(0.0);
    let a: [S::Records; 3] = each!(k < 3 => scratch.stencils.weight::<S>(last, k, lane));
    let mut g: [S::Records; 3] = each!(k < 3 => scratch.stencils.slope::<S>(last, k, lane));
    if AFFINE {
        for k in 0..3 {
            g[k] = S::join(g[k], times_k(a[k], k));
        }
    }
    let mut values = [zero; 2];
    let mut gradients = D::vector(|_| zero);
    for pencil in 0..D::PENCILS {
        let records = stencil.pencils[pencil];
        let (weight, slopes) = transverse::<S, D>(scratch, pencil, lane);
        for quad in 0..D::QUADS {
            let mut n: [S::Records; 3] = each!(k < 3 => S::load_for_all(&records[k * D::QUADS + quad].0));
            if AFFINE {
                n = each!(k < 3 => S::first_twice(n[k]));
            }
            let along = a[2].mul_add(n[2], a[1].mul_add(n[1], a[0] * n[0]));
            values[quad] = weight.mul_add(along, values[quad]);
            if quad == 0 {
                let slope_along = g[2].mul_add(n[2], g[1].mul_add(n[1], g[0] * n[0]));
                for axis in 0..last {
                    let mut slope = slopes[axis];
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
        values[quad].store(&mut scratch.values[quad].as_flattened_mut()[4 * lane..]);
    }
    for axis in 0..D::AXES {
        gradients[axis].store(&mut scratch.gradients[axis].as_flattened_mut()[4 * lane..]);
    }
}
