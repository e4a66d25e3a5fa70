//! Stage 4 of a pass, with the end of stage 3: what a block's points give to the nodes around their new
//! positions.
//!
//! A kernel of its own, so that all constitutive models share one compiled copy of it.

use super::nodes::{NodeRun, first_node};
use super::scratch::times_k;
use super::scratch::{Scratch, load, store_stencils, together, transverse, way_along};
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::grid::{Layout, Record};
use crate::points::{BLOCK, Column};
use crate::simd::{Kernel, Real, Simd, Vector, each, inlined};

/// Weights, momentum and mass of one block, then stage 4.
pub(super) struct ToGrid<'a, R: Real, D: Dimension, F> {
    pub shape: &'a F,
    pub layout: &'a Layout,
    /// Density at the start (kg/m3).
    pub density: R,
    /// The block's nearest nodes, offsets, velocities and volumes.
    pub node: &'a D::Vector<Column<i32>>,
    pub offset: &'a D::Vector<Column<R>>,
    pub velocity: &'a D::Vector<Column<R>>,
    pub volume: &'a Column<R>,
    pub scratch: &'a mut Scratch<R>,
    pub deposit: &'a mut NodeRun<R>,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>> Kernel<R> for ToGrid<'_, R, D, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        self.scatter_block::<S, false>();
    }
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>> ToGrid<'_, R, D, F> {
    /// Adds what all points of a block give, once for each run of points with the same nearest node.
    ///
    /// With an affine field the scratch already holds the momentum (`moments`).
    #[inline(always)]
    pub(super) fn scatter_block<S: Simd<Scalar = R>, const AFFINE: bool>(self) {
        for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
            let offset = inlined!(D::vector, |axis| S::Lanes::load(&self.offset[axis][lane..]));
            let weights = store_stencils::<S, D, F>(self.shape, &offset, lane, self.scratch);
            let mass = S::Lanes::load(&self.volume[lane..]) * S::Lanes::splat(self.density);
            if !AFFINE {
                store_momentum::<S, D>(self.velocity, mass, lane, self.scratch);
            }
            store_masses::<S>(mass, weights, lane, self.scratch);
        }
        let ToGrid { layout, node, scratch, deposit, .. } = self;
        let first = deposit.first;
        let mut pile = Pile::<S, D>::new(inlined!(D::vector, |axis| node[axis][0]), layout, first);
        let mut lane = 0;
        while lane < BLOCK {
            let here = inlined!(D::vector, |axis| node[axis][lane]);
            match way_along::<D>(&pile.node, &here) {
                Some(0) => {}
                Some(1) => pile.slide(deposit),
                _ => {
                    pile.add_to(deposit);
                    pile = Pile::new(here, layout, first);
                }
            }
            let count = together::<S, D>(node, lane);
            pile.scatter::<AFFINE>(lane, count, scratch);
            lane += count;
        }
        pile.add_to(deposit);
    }
}

/// Momentum of points `lane..`.
#[inline(always)]
fn store_momentum<S: Simd, D: Dimension>(
    velocity: &D::Vector<Column<S::Scalar>>,
    mass: S::Lanes,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    let zero = S::Lanes::constant(0.0);
    let momentum: [S::Lanes; 4] = each!(k < 4 => {
        if k < D::AXES { mass * S::Lanes::load(&velocity[k][lane..]) } else { zero }
    });
    S::store_transposed(momentum, &mut scratch.momentum.as_flattened_mut()[4 * lane..]);
}

/// Mass of points `lane..` times their weights along the pencil.
#[inline(always)]
fn store_masses<S: Simd>(
    mass: S::Lanes,
    weights: [S::Lanes; 3],
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    let [a, b, c] = weights;
    let along = [mass * a, mass * b, mass * c, S::Lanes::constant(0.0)];
    S::store_transposed(along, &mut scratch.mass_weights.as_flattened_mut()[4 * lane..]);
}

/// What points that share their nearest node give to its stencil, before it is added to the run of nodes.
///
/// From one node to the next along the pencils it slides, and two thirds of it stay in registers:
///
/// ```text
///  pencil    │ 0   1   2   3   4        nodes
///            │[a   b   c]               pile of the points around node 1
///            │ ↓  [b   c   0]           pile of those around node 2: a is added to the run, b and c go on
/// ```
struct Pile<S: Simd, D: Dimension> {
    node: D::Vector<i32>,
    /// By pencil: place in the run of its first node.
    begin: D::Pencils<usize>,
    /// By pencil: mass of its three nodes.
    mass: D::Pencils<S::Records>,
    /// By pencil, part of the record and node: what is added there.
    records: D::Pencils<D::Quads<[S::Records; 3]>>,
}

impl<S: Simd, D: Dimension> Pile<S, D> {
    #[inline(always)]
    fn new(node: D::Vector<i32>, layout: &Layout, first: usize) -> Self {
        let zero = S::Records::constant(0.0);
        let mut begin = D::pencils(0);
        for pencil in 0..D::PENCILS {
            begin[pencil] = first_node::<D>(layout, first, &node, pencil);
        }
        Pile { node, begin, mass: D::pencils(zero), records: D::pencils(D::quads([zero; 3])) }
    }

    /// Stage 4: mass, momentum and internal force of `count` points, all around this pile's node.
    #[inline(always)]
    fn scatter<const AFFINE: bool>(&mut self, lane: usize, count: usize, scratch: &Scratch<S::Scalar>) {
        // The remainder is the lane itself; that it is below `BLOCK` spares the checks of what follows.
        let (last, lane) = (D::AXES - 1, lane % BLOCK);
        let a: [S::Records; 3] = each!(k < 3 => scratch.stencils.weight::<S>(last, k, lane));
        let mut g: [S::Records; 3] = each!(k < 3 => scratch.stencils.slope::<S>(last, k, lane));
        if AFFINE {
            for k in 0..3 {
                g[k] = S::join(times_k(a[k], k), g[k]);
            }
        }
        let momentum = load::<S>(&scratch.momentum, lane, count);
        let force = inlined!(D::vector, |axis| load::<S>(&scratch.gradients[axis], lane, count));
        let along = load::<S>(&scratch.mass_weights, lane, count);
        for pencil in 0..D::PENCILS {
            let (weight, slopes) = transverse::<S, D>(scratch, pencil, lane);
            self.mass[pencil] = weight.mul_add(along, self.mass[pencil]);
            let carried = weight * momentum;
            let mut pushed = if D::QUADS == 1 { carried } else { S::Records::constant(0.0) };
            for axis in 0..last {
                let mut slope = slopes[axis];
                if AFFINE {
                    slope = S::join(times_k(weight, pencil), slope);
                }
                pushed = slope.mul_add(force[axis], pushed);
            }
            let twisted = weight * force[last];
            let records = &mut self.records[pencil];
            for k in 0..3 {
                if D::QUADS == 2 {
                    records[0][k] = a[k].mul_add(carried, records[0][k]);
                }
                let record = &mut records[D::QUADS - 1][k];
                *record = g[k].mul_add(twisted, a[k].mul_add(pushed, *record));
            }
        }
    }

    /// Goes on to the next node along the pencils; what points around that one do not reach is added to the
    /// run of nodes.
    #[inline(always)]
    fn slide(&mut self, deposit: &mut NodeRun<S::Scalar>) {
        let zero = S::Records::constant(0.0);
        self.node[D::AXES - 1] += 1;
        for pencil in 0..D::PENCILS {
            let begin = self.begin[pencil];
            self.add_masses(pencil, deposit);
            self.mass[pencil] = zero;
            let records = &mut deposit.records[begin * D::QUADS..(begin + 1) * D::QUADS];
            for quad in 0..D::QUADS {
                let [lowest, middle, highest] = self.records[pencil][quad];
                add::<S>(lowest, &mut records[quad]);
                self.records[pencil][quad] = [middle, highest, zero];
            }
            self.begin[pencil] = begin + 1;
        }
    }

    /// Adds the pile to the run of nodes.
    #[inline(always)]
    fn add_to(&self, deposit: &mut NodeRun<S::Scalar>) {
        for pencil in 0..D::PENCILS {
            let begin = self.begin[pencil];
            self.add_masses(pencil, deposit);
            let records = &mut deposit.records[begin * D::QUADS..(begin + 3) * D::QUADS];
            for (place, record) in records.iter_mut().enumerate() {
                add::<S>(self.records[pencil][place % D::QUADS][place / D::QUADS], record);
            }
        }
    }

    #[inline(always)]
    fn add_masses(&self, pencil: usize, deposit: &mut NodeRun<S::Scalar>) {
        let begin = self.begin[pencil];
        let masses = &mut deposit.mass[begin..begin + 4];
        (S::Quad::load(masses) + S::sum_points(self.mass[pencil])).store(masses);
    }
}

/// Adds what points have piled up to a record.
#[inline(always)]
fn add<S: Simd>(pile: S::Records, Record(record): &mut Record<S::Scalar>) {
    (S::Quad::load(record) + S::sum_points(pile)).store(record);
}
