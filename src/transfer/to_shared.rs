//! The masses that neighbouring nodes share, for smoothed increments (`partition::smoothing`), in the plane.
//!
//! m_ij = Σ_p m_p w_ip w_jp of nodes i and j a cell apart along x, along y or along both. A point's weights
//! are products, w = a_k b_l with node k along x and l along y, and so are its shares in these masses:
//!
//! ```text
//!   y │  o───o
//!     │  │╲ ╱│           with the next along x         a_k a_k+1   m [ b_0 b_0   b_1 b_1   b_2 b_2 ]
//!     │  │ ╳ │           with the next along y         a_k a_k     m [ b_0 b_1   b_1 b_2      ·    ]
//!     │  │╱ ╲│           along either diagonal         a_k a_k+1   m [ b_0 b_1   b_1 b_2      ·    ]
//!     │ k,l──o  x
//! ```
//!
//! in which nodes along the pencils stand side by side in a register, as they do for the mass itself
//! (`to_grid`).
//!
//! A kernel of its own that follows stage 4: what is added up stays in registers, and scenes without pay
//! nothing.

use super::nodes::{NodeRun, first_node};
use super::scratch::{Scratch, load, together, way_along};
use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::points::{BLOCK, Column};
use crate::simd::{Kernel, Real, Simd, Vector, each, inlined};

/// Shared masses of one block's points, whose weights stage 4 has left in the scratch.
pub(super) struct ToShared<'a, R: Real, D: Dimension, F> {
    pub shape: &'a F,
    pub layout: &'a Layout,
    /// Density at the start (kg/m3).
    pub density: R,
    /// The block's nearest nodes, offsets and volumes.
    pub node: &'a D::Vector<Column<i32>>,
    pub offset: &'a D::Vector<Column<R>>,
    pub volume: &'a Column<R>,
    pub scratch: &'a mut Scratch<R>,
    pub deposit: &'a mut NodeRun<R>,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>> Kernel<R> for ToShared<'_, R, D, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        let ToShared { shape, layout, density, node, offset, volume, scratch, deposit } = self;
        for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
            let mass = S::Lanes::load(&volume[lane..]) * S::Lanes::splat(density);
            let weights = shape.stencil(S::Lanes::load(&offset[1][lane..])).weights;
            store_products::<S>(mass, weights, lane, scratch);
        }
        let mut last = inlined!(D::vector, |axis| node[axis][0]);
        let mut pile = Pile::<S>::new(around::<D>(layout, deposit.first, &last));
        let mut lane = 0;
        while lane < BLOCK {
            let here = inlined!(D::vector, |axis| node[axis][lane]);
            let way = way_along::<D>(&last, &here);
            if way != Some(0) {
                pile.add_to(deposit);
                let begin = if way == Some(1) {
                    pile.begin.map(|begin| begin + 1)
                } else {
                    around::<D>(layout, deposit.first, &here)
                };
                (pile, last) = (Pile::new(begin), here);
            }
            let count = together::<S, D>(node, lane);
            pile.scatter(lane, count, scratch);
            lane += count;
        }
        pile.add_to(deposit);
    }
}

/// By pencil: place, in a run of nodes from `first` on, of the first node around a point.
#[inline(always)]
fn around<D: Dimension>(layout: &Layout, first: usize, node: &D::Vector<i32>) -> [usize; 3] {
    each!(pencil < 3 => first_node::<D>(layout, first, node, pencil))
}

/// Squares of the weights along y, and products of neighbouring ones, of points `lane..` times their mass;
/// they take the place of force records, which have been given.
#[inline(always)]
fn store_products<S: Simd>(
    mass: S::Lanes,
    [b, c, d]: [S::Lanes; 3],
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    let zero = S::Lanes::constant(0.0);
    let (mb, md) = (mass * b, mass * d);
    let squares = [mb * b, mass * c * c, md * d, zero];
    let products = [mb * c, md * c, zero, zero];
    S::store_transposed(squares, &mut scratch.gradients[0].as_flattened_mut()[4 * lane..]);
    S::store_transposed(products, &mut scratch.gradients[1].as_flattened_mut()[4 * lane..]);
}

/// What points with the same nearest node have added up.
struct Pile<S: Simd> {
    /// By pencil: place in the run of its first node.
    begin: [usize; 3],
    /// Along x, along y and along diagonals, by pencil.
    shared: [[S::Records; 3]; 3],
}

impl<S: Simd> Pile<S> {
    #[inline(always)]
    fn new(begin: [usize; 3]) -> Self {
        Pile { begin, shared: [[S::Records::constant(0.0); 3]; 3] }
    }

    #[inline(always)]
    fn scatter(&mut self, lane: usize, count: usize, scratch: &Scratch<S::Scalar>) {
        // The remainder is the lane itself; that it is below `BLOCK` spares the checks of what follows.
        let lane = lane % BLOCK;
        let a: [S::Records; 3] = each!(k < 3 => scratch.stencils.weight::<S>(0, k, lane));
        let [squares, products] = each!(k < 2 => load::<S>(&scratch.gradients[k], lane, count));
        let [along_x, along_y, diagonal] = &mut self.shared;
        for pencil in 0..3 {
            along_y[pencil] = (a[pencil] * a[pencil]).mul_add(products, along_y[pencil]);
            // The last of three has no next one in the points' reach.
            if pencil < 2 {
                let both = a[pencil] * a[pencil + 1];
                along_x[pencil] = both.mul_add(squares, along_x[pencil]);
                diagonal[pencil] = both.mul_add(products, diagonal[pencil]);
            }
        }
    }

    #[inline(always)]
    fn add_to(&self, deposit: &mut NodeRun<S::Scalar>) {
        let [along_x, along_y, diagonal] = &mut deposit.shared;
        for pencil in 0..3 {
            let begin = self.begin[pencil];
            add::<S>(self.shared[1][pencil], along_y, begin);
            if pencil < 2 {
                add::<S>(self.shared[0][pencil], along_x, begin);
                add::<S>(self.shared[2][pencil], diagonal, begin);
            }
        }
    }
}

/// Adds what points have piled up to the nodes from `begin` on.
#[inline(always)]
fn add<S: Simd>(pile: S::Records, nodes: &mut [S::Scalar], begin: usize) {
    let nodes = &mut nodes[begin..begin + 4];
    (S::Quad::load(nodes) + S::sum_points(pile)).store(nodes);
}
