//! What passes between the stages of a pass for one block; it stays in the first-level cache.
//!
//! Stages 2 and 4 take as many points at a time as a register holds records of (`Simd::ABREAST`), from any
//! lane on, and what the last one's companion would be lies behind the last lane: read and written there,
//! used nowhere.

use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::points::{BLOCK, Column};
use crate::simd::{Real, Simd, Vector, each};

/// Places behind the last lane: at least `Simd::ABREAST` - 1.
const BEHIND: usize = 2;

/// Four numbers for each point.
pub(super) type Rows<R> = [[R; 4]; BLOCK + BEHIND];

/// Of points `lane..`, the first `count` (1 or `Simd::ABREAST`); zeros for the others.
#[inline(always)]
pub(super) fn load<S: Simd>(rows: &Rows<S::Scalar>, lane: usize, count: usize) -> S::Records {
    let from = &rows.as_flattened()[4 * lane..];
    if count == S::ABREAST { S::Records::load(from) } else { S::load_first(from) }
}

/// What passes between the stages for one block.
pub(super) struct Scratch<R> {
    /// The points' weights and their slopes.
    pub stencils: Stencils<R>,
    /// Per point: velocity and increment (up to two records).
    pub values: [Rows<R>; 2],
    /// Per point and axis: derivative of the first record; later force records, then factors of the shared
    /// masses (`to_shared`).
    pub gradients: [Rows<R>; 3],
    /// Per point: momentum record.
    pub momentum: Rows<R>,
    /// Per point: mass times the weights along the pencil.
    pub mass_weights: Rows<R>,
    /// Per point: its part of its cell's volume, where cells are averaged.
    pub part: Column<R>,
    /// By cell of the block and axis: sums over its points.
    pub cells: [Rows<R>; 3],
}

impl<R: Real> Scratch<R> {
    pub fn new() -> Self {
        let rows = [[R::ZERO; 4]; BLOCK + BEHIND];
        Scratch {
            stencils: Stencils::zero(),
            values: [rows; 2],
            gradients: [rows; 3],
            momentum: rows,
            mass_weights: rows,
            part: [R::ZERO; BLOCK],
            cells: [rows; 3],
        }
    }
}

/// Weights of each point's stencil and their slopes.
///
/// Stages 2 and 4 need each of them in all places of a point's record. One point's is spread while it is
/// loaded, from a column of all points; those of several, within a register, from rows of four:
///
/// ```text
///  number n of point p:  column n, place p          row n / 4, record p, entry n % 4
/// ```
pub(super) struct Stencils<R>([R; (4 * ROWS) * BLOCK + 4 * BEHIND]);

/// What a stencil has along an axis: three weights, then three slopes.
const ALONG_AXIS: usize = 6;
/// Rows of four that hold what it has along three axes.
const ROWS: usize = (3 * ALONG_AXIS).div_ceil(4);

impl<R: Real> Stencils<R> {
    fn zero() -> Self {
        Stencils([R::ZERO; (4 * ROWS) * BLOCK + 4 * BEHIND])
    }

    /// The weights of node `node` of three along an axis, for points from `lane` (below `BLOCK`) on.
    #[inline(always)]
    pub fn weight<S: Simd<Scalar = R>>(&self, axis: usize, node: usize, lane: usize) -> S::Records {
        self.each::<S>(ALONG_AXIS * axis + node, lane)
    }

    /// Their slopes.
    #[inline(always)]
    pub fn slope<S: Simd<Scalar = R>>(&self, axis: usize, node: usize, lane: usize) -> S::Records {
        self.each::<S>(ALONG_AXIS * axis + 3 + node, lane)
    }

    #[inline(always)]
    fn each<S: Simd<Scalar = R>>(&self, number: usize, lane: usize) -> S::Records {
        if S::ABREAST == 1 {
            S::Records::splat(self.0[number * BLOCK + lane])
        } else {
            S::spread(S::Records::load(&self.0[4 * (number / 4 * BLOCK + lane)..]), number % 4)
        }
    }
}

/// Stage 1, and the end of stage 3: weights and slopes of points `lane..` at their offsets; gives the weights
/// along the last axis.
#[inline(always)]
pub(super) fn store_stencils<S: Simd, D: Dimension, F: ShapeFunction<S::Scalar>>(
    shape: &F,
    offset: &D::Vector<S::Lanes>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) -> [S::Lanes; 3] {
    let mut numbers = [S::Lanes::constant(0.0); 4 * ROWS];
    for axis in 0..D::AXES {
        let stencil = shape.stencil(offset[axis]);
        for k in 0..3 {
            numbers[ALONG_AXIS * axis + k] = stencil.weights[k];
            numbers[ALONG_AXIS * axis + 3 + k] = stencil.slopes[k];
        }
    }
    let stencils = &mut scratch.stencils.0;
    if S::ABREAST == 1 {
        for k in 0..ALONG_AXIS * D::AXES {
            numbers[k].store(&mut stencils[k * BLOCK + lane..]);
        }
    } else {
        for row in 0..(ALONG_AXIS * D::AXES).div_ceil(4) {
            let row_of_each = each!(k < 4 => numbers[4 * row + k]);
            S::store_transposed(row_of_each, &mut stencils[4 * (row * BLOCK + lane)..]);
        }
    }
    let last = ALONG_AXIS * (D::AXES - 1);
    [numbers[last], numbers[last + 1], numbers[last + 2]]
}

/// Of points `lane..`: product of the weights across the pencils, and its derivatives along each axis but the
/// last.
#[inline(always)]
pub(super) fn transverse<S: Simd, D: Dimension>(
    scratch: &Scratch<S::Scalar>,
    pencil: usize,
    lane: usize,
) -> (S::Records, [S::Records; 2]) {
    let stencils = &scratch.stencils;
    if D::AXES == 2 {
        let slope = stencils.slope::<S>(0, pencil, lane);
        (stencils.weight::<S>(0, pencil, lane), [slope, S::Records::constant(0.0)])
    } else {
        let (i, j) = (pencil / 3, pencil % 3);
        let (x, y) = (stencils.weight::<S>(0, i, lane), stencils.weight::<S>(1, j, lane));
        (x * y, [stencils.slope::<S>(0, i, lane) * y, x * stencils.slope::<S>(1, j, lane)])
    }
}

/// How many points stages 2 and 4 take together from `lane` (below `BLOCK`) on: as many as `Simd::ABREAST` of
/// the same nearest node.
#[inline(always)]
pub(super) fn together<S: Simd, D: Dimension>(node: &D::Vector<Column<i32>>, lane: usize) -> usize {
    let is_pair = S::ABREAST == 2 && lane + 1 < BLOCK && {
        let mut differ = 0;
        for axis in 0..D::AXES {
            differ |= node[axis][lane] ^ node[axis][lane + 1];
        }
        differ == 0
    };
    1 + usize::from(is_pair)
}

/// How many nodes further along the pencils a node is than another; `None` where other pencils pass through
/// it.
#[inline(always)]
pub(super) fn way_along<D: Dimension>(from: &D::Vector<i32>, to: &D::Vector<i32>) -> Option<i32> {
    let last = D::AXES - 1;
    let differ = (0..last).fold(0, |differ, axis| differ | (from[axis] ^ to[axis]));
    (differ == 0).then_some(to[last] - from[last])
}

/// k times the weight of the node `place` of three.
#[inline(always)]
pub(super) fn times_k<V: Vector>(weight: V, place: usize) -> V {
    match place {
        0 => -weight,
        1 => V::constant(0.0),
        _ => weight,
    }
}
