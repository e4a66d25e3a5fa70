//! Grid to points, constitutive update and points to grid, in one pass over the points.
//!
//! A block of 64 points goes through four stages; what passes between them fits into the first-level cache:
//!
//! | stage | side by side | does |
//! |---|---|---|
//! | 1 weights | points | shape functions and slopes at the old positions |
//! | 2 gather | node components | velocity, its increment and its gradient from the nodes (eqs. 16, 17) |
//! | 3 update | points | FLIP velocity, position, stress from the model, weights at the new positions |
//! | 4 scatter | node components | mass, momentum and internal force for the next substep (eqs. 6, 7, 11) |
//!
//! Sorted points share their stencil with their neighbours: it is looked up, and what they give is added to
//! it, once for each run of a block's points with the same nearest node.
//!
//! Stage 3 treats two registers of points as one (`simd::pair`): a return to the yield surface waits for its
//! own results, and another goes beside it in that time.
//!
//! Stages 2 and 4 treat one point at a time with all components of a node in one vector [vx, vy, Δvx, Δvy],
//! because neighbouring points share nodes in no pattern that lasts; two neighbours that do share them, where
//! a register holds two such vectors (single precision with AVX2). Sums over the stencil are nested: first
//! along the pencil with that axis' three weights, then over the pencils.
//!
//! Stages 1 and 2 (`to_points`) and stage 4 (`to_grid`) know nothing of the material: each is a kernel of its
//! own, called once for each block, and compiled once for all models.
//!
//! In substeps that look for outlier velocities (`outliers`), each block's are compared with those that its
//! points have moved with, before stage 4 (`look`).
//!
//! Where increments are smoothed (`partition::smoothing`), the masses that nodes share follow stage 4
//! (`to_shared`).
//!
//! Where points carry an affine velocity field (`transfer::apic`), gradients and forces share their records
//! with first moments (`moments`).
//!
//! Equation numbers: Ambati et al. (2011). Stress is updated after the velocity ("stress last").
//!
//! What may be touched: another transfer is another pair of stages 2 and 4 beside `moments`; what a pass adds
//! up goes into `PassSums` and from there into the ledger. Instruction counts of this room are held by `cargo
//! xtask bench --instructions`.

pub mod apic;
pub(crate) mod stencils;

mod look;
mod cell_average;
mod moments;
mod nodes;
mod scratch;
mod to_grid;
mod to_points;
mod to_shared;

pub use look::{Candidate, OutlierScan};
pub use nodes::{NodeRun, NodesPass, first_node};

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::material::{ConstitutiveModel, StepSums};
use crate::points::{BLOCK, Block, Column, PointState};
use crate::simd::pair::{Pair, load_transposed, store_transposed};
use crate::simd::{Kernel, Mask, Real, Simd, Vector, each, inlined};
use cell_average::{ShareRate, ShareStress};
use look::Differences;
use moments::Affine;
use scratch::Scratch;
use std::marker::PhantomData;
use to_grid::ToGrid;
use to_points::ToPoints;
use to_shared::ToShared;

/// Furthest a point may move in one substep (cells); the grid's window relies on it.
pub const TRAVEL_LIMIT: f64 = 0.4;

/// What a pass over points adds up, with extremes over the points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassSums {
    /// Plastic work (J).
    pub plastic_work: f64,
    /// Elastic energy that rising temperatures took (J).
    pub thermoelastic: f64,
    /// Work of separation (J).
    pub damage_work: f64,
    /// Work of artificial viscosity (J).
    pub viscous_work: f64,
    /// ½ Σ m |Δv|² of the points (J); with an affine velocity field the gain of ½ Σ m |v|².
    pub increment_energy: f64,
    /// ½ Σ V₀ Δτ : h (J): by how much stress power with the mean stress of the substep exceeds that with the
    /// stress at its start, which the grid's forces are made of.
    pub stress_lag: f64,
    /// Largest motion along an axis (cells); beyond `TRAVEL_LIMIT` the point was held and the run must stop.
    pub travel: f64,
    /// Largest volume ratio det F (-).
    pub volume_ratio: f64,
}

/// One pass over a chunk's points.
pub struct PointsPass<'a, R: Real, D: Dimension, F, M: ConstitutiveModel<R, D>> {
    /// The points.
    pub blocks: &'a mut [Block<R, D, M::State>],
    /// Velocities and increments of the nodes around them.
    pub nodes: &'a NodeRun<R>,
    /// Where mass, momentum and force for the next substep go.
    pub deposit: &'a mut NodeRun<R>,
    /// Arrangement of the nodes.
    pub layout: &'a Layout,
    /// Shape function.
    pub shape: &'a F,
    /// Constitutive model.
    pub model: &'a M,
    /// Substep (s).
    pub dt: f64,
    /// Motion of the grid in it (cells).
    pub drift: [f64; 3],
    /// OutlierScan at the points' velocities, if one is due.
    pub look: Option<OutlierScan<'a>>,
}

/// The points that stage 3 updates at once.
type Pairs<S> = Pair<<S as Simd>::Lanes>;

/// The substep in the forms the stages need.
struct Rates<R> {
    /// Δt (s).
    dt: R,
    /// Δt over the cell length (s/m).
    per_cell: R,
    /// One over the cell length (1/m).
    inverse_cell: R,
    /// Density at the start (kg/m3).
    density: R,
    /// Motion of the grid (cells).
    drift: [R; 3],
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Kernel<R>
    for PointsPass<'_, R, D, F, M>
{
    type Output = PassSums;
    // One copy for each model: by far most of what there is to compile.
    const UNIT: usize = if R::IS_SINGLE { 1 } else { 0 } + if D::AXES == 3 { 2 } else { 0 };

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> PassSums {
        let PointsPass { blocks, nodes, deposit, layout, shape, model, dt, drift, mut look } = self;
        let rates = Rates {
            dt: R::from_f64(dt),
            per_cell: R::from_f64(dt / layout.cell),
            inverse_cell: R::from_f64(1.0 / layout.cell),
            density: R::from_f64(model.density()),
            drift: drift.map(R::from_f64),
        };
        let mut scratch = Scratch::<R>::new();
        let mut sums = LaneSums::<Pairs<S>>::zero();
        deposit.clear();
        for b in 0..blocks.len() {
            let (block, ahead) = blocks[b..].split_first_mut().expect("b is below their number");
            let parts = BLOCK / Pairs::<S>::LANES;
            let (node, offset) = (&block.node, &block.offset);
            let scratch = &mut scratch;
            let to_points = ToPoints::<R, D, F> { shape, nodes, layout, node, offset, scratch };
            if M::State::IS_AFFINE {
                S::outlined(Affine(to_points))
            } else {
                S::outlined(to_points)
            }
            if layout.averages_cells {
                let (volume, group) = (&block.volume, &block.group);
                S::outlined(ShareRate::<R, D> { volume, group, scratch, dimension: PhantomData });
            }
            for part in 0..parts {
                let lane = part * Pairs::<S>::LANES;
                update::<S, D, F, M>((shape, model), &rates, block, lane, scratch, &mut sums);
                // A block's columns are too short for the processor to guess that they go on.
                if let Some(next) = ahead.first() {
                    S::prefetch(next, part, parts);
                }
            }
            let Block { node, offset, velocity, volume, group, .. } = &*block;
            if layout.averages_cells {
                S::outlined(ShareStress::<R, D> { group, scratch, dimension: PhantomData });
            }
            if let Some(look) = &mut look {
                let (bound, values) = (R::from_f64(look.bound), &scratch.values[0]);
                if let Some(difference) = S::outlined(Differences::<R, D> { values, velocity, bound }) {
                    look.note(b, &difference, volume);
                }
            }
            let density = rates.density;
            let to_grid = ToGrid::<R, D, F> {
                shape,
                layout,
                density,
                node,
                offset,
                velocity,
                volume,
                scratch,
                deposit,
            };
            if M::State::IS_AFFINE {
                S::outlined(Affine(to_grid))
            } else {
                S::outlined(to_grid)
            }
            if D::AXES == 2 && layout.shares_masses {
                S::outlined(ToShared::<R, D, F> {
                    shape,
                    layout,
                    density,
                    node,
                    offset,
                    volume,
                    scratch,
                    deposit,
                });
            }
        }
        PassSums {
            plastic_work: sums.model.plastic_work.sum().to_f64(),
            thermoelastic: sums.model.thermoelastic.sum().to_f64(),
            damage_work: sums.model.damage_work.sum().to_f64(),
            viscous_work: sums.model.viscous_work.sum().to_f64(),
            increment_energy: 0.5 * sums.increment_energy.sum().to_f64(),
            stress_lag: 0.5 * sums.stress_lag.sum().to_f64(),
            travel: sums.travel.max_lane().to_f64(),
            volume_ratio: sums.model.volume_ratio.max_lane().to_f64(),
        }
    }
}

/// `PassSums` while they are still side by side.
struct LaneSums<V> {
    model: StepSums<V>,
    increment_energy: V,
    stress_lag: V,
    travel: V,
}

impl<V: Vector> LaneSums<V> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = V::constant(0.0);
        LaneSums { model: StepSums::zero(), increment_energy: zero, stress_lag: zero, travel: zero }
    }
}

/// Stage 3: FLIP, motion and stress of points `lane..`, and what they give to the grid.
#[inline(always)]
fn update<S: Simd, D: Dimension, F: ShapeFunction<S::Scalar>, M: ConstitutiveModel<S::Scalar, D>>(
    (shape, model): (&F, &M),
    rates: &Rates<S::Scalar>,
    block: &mut Block<S::Scalar, D, M::State>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
    sums: &mut LaneSums<Pairs<S>>,
) {
    let zero = Pairs::<S>::constant(0.0);
    let first = load_transposed::<S>(&scratch.values[0].as_flattened()[4 * lane..]);
    let second = if D::QUADS == 1 {
        [first[2], first[3], zero, zero]
    } else {
        load_transposed::<S>(&scratch.values[1].as_flattened()[4 * lane..])
    };
    let volume = Pairs::<S>::load(&block.volume[lane..]);
    let mass = volume * Pairs::<S>::constant(model.density());

    // Eq. 17, and the energy of the increments for the ledger. With an affine field the grid's velocity is
    // the point's, and the ledger takes what that gains; without time nothing changes.
    let mut square = zero;
    for axis in 0..D::AXES {
        let old = Pairs::<S>::load(&block.velocity[axis][lane..]);
        if M::State::IS_AFFINE && rates.dt > S::Scalar::ZERO {
            first[axis].store(&mut block.velocity[axis][lane..]);
            square += (first[axis] - old) * (first[axis] + old);
        } else {
            (old + second[axis]).store(&mut block.velocity[axis][lane..]);
            square = second[axis].mul_add(second[axis], square);
        }
    }
    sums.increment_energy = mass.mul_add(square, sums.increment_energy);

    // Eq. 16. A point that would leave the window of its nodes stays where it is, and the run stops with an
    // error.
    let limit = Pairs::<S>::constant(TRAVEL_LIMIT);
    let per_cell = Pairs::<S>::splat(rates.per_cell);
    let from_node = inlined!(D::vector, |axis| Pairs::<S>::load(&block.offset[axis][lane..]));
    for axis in 0..D::AXES {
        // The grid moves as well.
        let travel = per_cell.mul_add(first[axis], -Pairs::<S>::splat(rates.drift[axis]));
        sums.travel = sums.travel.max(travel.abs());
        let travel = Pairs::<S>::select(travel.abs().le(limit), travel, zero);
        let moved = from_node[axis] + travel;
        let shift = moved.round();
        if (shift.abs().gt(zero)).any() {
            move_node(&mut block.node[axis], lane, shift);
        }
        (moved - shift).store(&mut block.offset[axis][lane..]);
    }

    let mut h = D::matrix(|_, _| zero);
    for column in 0..D::AXES {
        let slope = load_transposed::<S>(&scratch.gradients[column].as_flattened()[4 * lane..]);
        for row in 0..D::AXES {
            h[row][column] = slope[row] * per_cell;
        }
        if M::State::IS_AFFINE && rates.dt > S::Scalar::ZERO {
            let [.., x, y] = slope;
            moments::keep::<_, D, _>(block, lane, column, from_node[column], first, [x, y]);
        }
    }
    let before = model.stress::<Pairs<S>>(&block.state, lane);
    // Without time nothing yields, not even stress that the rate effect holds above the flow stress at rest.
    let stress = if rates.dt > S::Scalar::ZERO {
        model.update(&mut block.state, lane, &h, rates.dt, volume, &mut sums.model)
    } else {
        before
    };
    let mut lag = zero;
    for row in 0..D::AXES {
        for column in 0..D::AXES {
            let change = D::component(&stress, row, column) - D::component(&before, row, column);
            lag = change.mul_add(h[row][column], lag);
        }
    }
    sums.stress_lag = volume.mul_add(lag, sums.stress_lag);

    let strength = -(volume * Pairs::<S>::splat(rates.inverse_cell));
    let rates_of_momentum = if M::State::IS_AFFINE {
        let (rates, momentum) = moments::give::<_, D, F, _>(shape, block, lane, mass);
        store_transposed::<S>(momentum, &mut scratch.momentum.as_flattened_mut()[4 * lane..]);
        rates
    } else {
        [[zero; 2]; 2]
    };
    for column in 0..D::AXES {
        // In the plane force follows momentum in the same record.
        let shift = if D::QUADS == 1 { 2 } else { 0 };
        let force: [Pairs<S>; 4] = each!(k < 4 => {
            if k >= shift && k - shift < D::AXES {
                strength * D::component(&stress, k - shift, column)
            } else if M::State::IS_AFFINE && k < 2 {
                rates_of_momentum[column][k]
            } else {
                zero
            }
        });
        store_transposed::<S>(force, &mut scratch.gradients[column].as_flattened_mut()[4 * lane..]);
    }
}

/// Moves the nearest node of points `lane..` by whole cells.
#[inline(always)]
fn move_node<V: Vector>(node: &mut Column<i32>, lane: usize, shift: V) {
    let mut cells = [0_i32; 16];
    shift.store_i32(&mut cells);
    for (index, cells) in node[lane..lane + V::LANES].iter_mut().zip(cells) {
        *index += cells;
    }
}
