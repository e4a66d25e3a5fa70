//! Stage 4 of a pass, with the end of stage 3: what a block's points give to the nodes around their new positions.
//!
//! A kernel of its own, so that all constitutive models share one compiled copy of it.

use super::Scratch;
use super::moments::times_k;
use super::nodes::{NodeRun, first_node};
use super::to_points::{store_stencils, transverse};
use crate::dimension::Dimension;
use crate::grid::{Layout, Record};
use crate::points::{BLOCK, Column};
use crate::shape::ShapeFunction;
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
            store_stencils::<S, D, F>(self.shape, &offset, lane, self.scratch);
            let mass = S::Lanes::load(&self.volume[lane..]) * S::Lanes::splat(self.density);
            if !AFFINE {
                store_momentum::<S, D>(self.velocity, mass, lane, self.scratch);
            }
            store_masses::<S, D>(mass, lane, self.scratch);
        }
        let ToGrid { layout, node, scratch, deposit, .. } = self;
        let mut pile = Pile::<S, D>::new(inlined!(D::vector, |axis| node[axis][0]));
        for lane in 0..BLOCK {
            let node = inlined!(D::vector, |axis| node[axis][lane]);
            if node.as_ref() != pile.node.as_ref() {
                pile.add_to(deposit, layout);
                pile = Pile::new(node);
            }
            pile.scatter::<AFFINE>(lane, scratch);
        }
        pile.add_to(deposit, layout);
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

/// Mass of points `lane..` times the weights along the pencil.
#[inline(always)]
fn store_masses<S: Simd, D: Dimension>(mass: S::Lanes, lane: usize, scratch: &mut Scratch<S::Scalar>) {
    let zero = S::Lanes::constant(0.0);
    let along: [S::Lanes; 4] = each!(k < 4 => {
        if k < 3 { mass * S::Lanes::load(&scratch.weights[D::AXES - 1][k][lane..]) } else { zero }
    });
    S::store_transposed(along, &mut scratch.mass_weights.as_flattened_mut()[4 * lane..]);
}

/// What points that share their nearest node give to its stencil, before it is added to the run of nodes.
struct Pile<S: Simd, D: Dimension> {
    node: D::Vector<i32>,
    /// By pencil: mass of its three nodes.
    mass: D::Pencils<S::Quad>,
    /// By pencil, part of the record and node: what is added there.
    records: D::Pencils<D::Quads<[S::Quad; 3]>>,
}

impl<S: Simd, D: Dimension> Pile<S, D> {
    #[inline(always)]
    fn new(node: D::Vector<i32>) -> Self {
        let zero = S::Quad::constant(0.0);
        Pile { node, mass: D::pencils(zero), records: D::pencils(D::quads([zero; 3])) }
    }

    /// Stage 4: mass, momentum and internal force of one point.
    #[inline(always)]
    fn scatter<const AFFINE: bool>(&mut self, lane: usize, scratch: &Scratch<S::Scalar>) {
        let last = D::AXES - 1;
        let a: [S::Quad; 3] = each!(k < 3 => S::Quad::splat(scratch.weights[last][k][lane]));
        let mut g: [S::Quad; 3] = each!(k < 3 => S::Quad::splat(scratch.slopes[last][k][lane]));
        if AFFINE {
            for k in 0..3 {
                g[k] = S::join(times_k(a[k], k), g[k]);
            }
        }
        let momentum = S::Quad::load(&scratch.momentum[lane]);
        let force = inlined!(D::vector, |axis| S::Quad::load(&scratch.gradients[axis][lane]));
        let along = S::Quad::load(&scratch.mass_weights[lane]);
        for pencil in 0..D::PENCILS {
            let (weight, slopes) = transverse::<_, D>(scratch, pencil, lane);
            let weight = S::Quad::splat(weight);
            self.mass[pencil] = weight.mul_add(along, self.mass[pencil]);
            let carried = weight * momentum;
            let mut pushed = if D::QUADS == 1 { carried } else { S::Quad::constant(0.0) };
            for axis in 0..last {
                let mut slope = S::Quad::splat(slopes[axis]);
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

    /// Adds the pile to the run of nodes.
    #[inline(always)]
    fn add_to(&self, deposit: &mut NodeRun<S::Scalar>, layout: &Layout) {
        for pencil in 0..D::PENCILS {
            let begin = first_node::<D>(layout, deposit.first, &self.node, pencil);
            let masses = &mut deposit.mass[begin..begin + 4];
            (S::Quad::load(masses) + self.mass[pencil]).store(masses);
            let records = &mut deposit.records[begin * D::QUADS..(begin + 3) * D::QUADS];
            for (place, Record(record)) in records.iter_mut().enumerate() {
                let add = self.records[pencil][place % D::QUADS][place / D::QUADS];
                (S::Quad::load(record) + add).store(record);
            }
        }
    }
}
