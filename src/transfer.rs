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
//! Sorted points share their stencil with their neighbours: it is looked up, and what they give is added to it, once for
//! each run of points with the same nearest node.
//!
//! Stages 2 and 4 treat one point at a time with all components of a node in one vector [vx, vy, Δvx, Δvy], because
//! neighbouring points share nodes in no pattern that lasts. Sums over the stencil are nested: first along the
//! pencil with that axis' three weights, then over the pencils.
//!
//! Equation numbers: Ambati et al. (2011). Stress is updated after the velocity ("stress last").

use crate::contact::{Obstacle, PushSums, RigidTool};
use crate::dimension::Dimension;
use crate::grid::{Layout, Record};
use crate::material::{ConstitutiveModel, Totals};
use crate::points::{BLOCK, Block, Column};
use crate::shape::ShapeFunction;
use crate::simd::{Kernel, Mask, Real, Simd, Vector};

/// Furthest a point may move in one substep (cells); the grid's window relies on it.
pub const TRAVEL_LIMIT: f64 = 0.4;

/// What a pass over points adds up, with extremes over the points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassSums {
    /// Plastic work (J).
    pub plastic_work: f64,
    /// ½ Σ m |Δv|² of the points (J).
    pub increment_energy: f64,
    /// ½ Σ V₀ Δτ : h (J): by how much stress power with the mean stress of the substep exceeds that with the stress
    /// at its start, which the grid's forces are made of.
    pub stress_lag: f64,
    /// What pushing points out of the tool exchanged.
    pub pushed: PushSums,
    /// Largest motion along an axis (cells); beyond `TRAVEL_LIMIT` the point was held and the run must stop.
    pub travel: f64,
    /// Largest volume ratio det F (-).
    pub volume_ratio: f64,
}

/// Nodes of a chunk: a run of the grid's nodes, from index `first` on.
#[derive(Clone, Debug, Default)]
pub struct NodeRun<R> {
    /// Index of the first node in the layout.
    pub first: usize,
    /// `QUADS` records per node, and `SLACK` more.
    pub records: Vec<Record<R>>,
    /// Mass per node (kg), and `SLACK` more.
    pub mass: Vec<R>,
}

/// Entries behind the last node, so that whole vectors and stencils can be read and written there.
const SLACK: usize = 6;

impl<R: Real> NodeRun<R> {
    /// Number of nodes.
    pub fn count<D: Dimension>(&self) -> usize {
        self.records.len().saturating_sub(SLACK) / D::QUADS
    }

    /// Sets the run to `count` zero nodes from `first` on.
    pub fn reset<D: Dimension>(&mut self, first: usize, count: usize) {
        self.first = first;
        self.records.clear();
        self.records.resize(count * D::QUADS + SLACK, Record([R::ZERO; 4]));
        self.mass.clear();
        self.mass.resize(count + SLACK, R::ZERO);
    }

    /// Sets all nodes to zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.records.fill(Record([R::ZERO; 4]));
        self.mass.fill(R::ZERO);
    }
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
    /// The tool at the end of the substep; points inside it are pushed out. `None` only deposits.
    pub tool: Option<&'a RigidTool>,
    /// Substep (s).
    pub dt: f64,
}

/// What passes between the stages for one block.
struct Scratch<R> {
    /// Weights and slopes by axis and node of the stencil.
    weights: [[Column<R>; 3]; 3],
    slopes: [[Column<R>; 3]; 3],
    /// Per point: velocity and increment (up to two records).
    values: [[[R; 4]; BLOCK]; 2],
    /// Per point and axis: derivative of the first record; later momentum and force records.
    gradients: [[[R; 4]; BLOCK]; 3],
    /// Per point: momentum record.
    momentum: [[R; 4]; BLOCK],
    /// Per point: mass times the weights along the pencil.
    mass_weights: [[R; 4]; BLOCK],
}

impl<R: Real> Scratch<R> {
    fn new() -> Self {
        Scratch {
            weights: [[[R::ZERO; BLOCK]; 3]; 3],
            slopes: [[[R::ZERO; BLOCK]; 3]; 3],
            values: [[[R::ZERO; 4]; BLOCK]; 2],
            gradients: [[[R::ZERO; 4]; BLOCK]; 3],
            momentum: [[R::ZERO; 4]; BLOCK],
            mass_weights: [[R::ZERO; 4]; BLOCK],
        }
    }
}

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
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>> Kernel<R>
    for PointsPass<'_, R, D, F, M>
{
    type Output = PassSums;

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> PassSums {
        let PointsPass { blocks, nodes, deposit, layout, shape, model, tool, dt } = self;
        let rates = Rates {
            dt: R::from_f64(dt),
            per_cell: R::from_f64(dt / layout.cell),
            inverse_cell: R::from_f64(1.0 / layout.cell),
            density: R::from_f64(model.density()),
        };
        let obstacle = tool.map(|tool| Obstacle::new(tool, layout, model.density()));
        let mut pushed = PushSums::default();
        let mut scratch = Scratch::<R>::new();
        let mut sums = LaneSums::<S::Lanes>::zero();
        deposit.clear();
        let Some(first) = blocks.first() else { return PassSums::default() };
        let first = D::vector(|axis| first.node[axis][0]);
        let mut stencil = Stencil::<R, D>::around(nodes, layout, first);
        let mut pile = Pile::<S, D>::new(first);
        for block in blocks {
            for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
                let offset = D::vector(|axis| S::Lanes::load(&block.offset[axis][lane..]));
                store_stencils::<S, D, F>(shape, &offset, lane, &mut scratch);
            }
            for lane in 0..BLOCK {
                let node = D::vector(|axis| block.node[axis][lane]);
                if node.as_ref() != stencil.node.as_ref() {
                    stencil = Stencil::around(nodes, layout, node);
                }
                gather::<S, D>(&stencil, lane, &mut scratch);
            }
            for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
                update::<S, D, M>(model, &rates, block, lane, &mut scratch, &mut sums);
            }
            if let Some(obstacle) = &obstacle {
                obstacle.push_out(block, layout, &mut pushed);
            }
            for lane in (0..BLOCK).step_by(S::Lanes::LANES) {
                prepare::<S, D, F, _>(shape, rates.density, block, lane, &mut scratch);
            }
            for lane in 0..BLOCK {
                let node = D::vector(|axis| block.node[axis][lane]);
                if node.as_ref() != pile.node.as_ref() {
                    pile.add_to(deposit, layout);
                    pile = Pile::new(node);
                }
                pile.scatter(lane, &scratch);
            }
        }
        pile.add_to(deposit, layout);
        PassSums {
            plastic_work: sums.model.plastic_work.sum().to_f64(),
            increment_energy: 0.5 * sums.increment_energy.sum().to_f64(),
            stress_lag: 0.5 * sums.stress_lag.sum().to_f64(),
            pushed,
            travel: sums.travel.max_lane().to_f64(),
            volume_ratio: sums.model.volume_ratio.max_lane().to_f64(),
        }
    }
}

/// `PassSums` while they are still side by side.
struct LaneSums<V> {
    model: Totals<V>,
    increment_energy: V,
    stress_lag: V,
    travel: V,
}

impl<V: Vector> LaneSums<V> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = V::constant(0.0);
        LaneSums { model: Totals::zero(), increment_energy: zero, stress_lag: zero, travel: zero }
    }
}

/// Stage 1, and the end of stage 3: weights and slopes of points `lane..` at their offsets.
#[inline(always)]
fn store_stencils<S: Simd, D: Dimension, F: ShapeFunction<S::Scalar>>(
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
fn transverse<R: Real, D: Dimension>(scratch: &Scratch<R>, pencil: usize, lane: usize) -> (R, [R; 2]) {
    if D::AXES == 2 {
        (scratch.weights[0][pencil][lane], [scratch.slopes[0][pencil][lane], R::ZERO])
    } else {
        let (i, j) = (pencil / 3, pencil % 3);
        let (x, y) = (scratch.weights[0][i][lane], scratch.weights[1][j][lane]);
        (x * y, [scratch.slopes[0][i][lane] * y, x * scratch.slopes[1][j][lane]])
    }
}

/// Index, within a run of nodes, of the first of the three nodes that a point touches on one of its pencils.
#[inline(always)]
pub fn first_node<D: Dimension>(
    layout: &Layout,
    first: usize,
    node: &D::Vector<i32>,
    pencil: usize,
) -> usize {
    let touched = if D::AXES == 2 {
        node[0] + pencil as i32 - 1
    } else {
        (node[0] + (pencil / 3) as i32 - 1) * layout.counts[1] + node[1] + (pencil % 3) as i32 - 1
    };
    (layout.offset[touched as usize] + node[D::AXES - 1] - 1 - first as i32) as usize
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
fn gather<S: Simd, D: Dimension>(
    stencil: &Stencil<'_, S::Scalar, D>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    let last = D::AXES - 1;
    let zero = S::Quad::constant(0.0);
    let a: [S::Quad; 3] = std::array::from_fn(|k| S::Quad::splat(scratch.weights[last][k][lane]));
    let g: [S::Quad; 3] = std::array::from_fn(|k| S::Quad::splat(scratch.slopes[last][k][lane]));
    let mut values = [zero; 2];
    let mut gradients = D::vector(|_| zero);
    for pencil in 0..D::PENCILS {
        let records = stencil.pencils[pencil];
        let (weight, slopes) = transverse::<_, D>(scratch, pencil, lane);
        let weight = S::Quad::splat(weight);
        for quad in 0..D::QUADS {
            let n: [S::Quad; 3] = std::array::from_fn(|k| S::Quad::load(&records[k * D::QUADS + quad].0));
            let along = a[2].mul_add(n[2], a[1].mul_add(n[1], a[0] * n[0]));
            values[quad] = weight.mul_add(along, values[quad]);
            if quad == 0 {
                let slope_along = g[2].mul_add(n[2], g[1].mul_add(n[1], g[0] * n[0]));
                for axis in 0..last {
                    gradients[axis] = S::Quad::splat(slopes[axis]).mul_add(along, gradients[axis]);
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

/// Stage 3: FLIP, motion and stress of points `lane..`, and what they give to the grid.
#[inline(always)]
fn update<S: Simd, D: Dimension, M: ConstitutiveModel<S::Scalar, D>>(
    model: &M,
    rates: &Rates<S::Scalar>,
    block: &mut Block<S::Scalar, D, M::State>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
    sums: &mut LaneSums<S::Lanes>,
) {
    let zero = S::Lanes::constant(0.0);
    let first = S::load_transposed(&scratch.values[0].as_flattened()[4 * lane..]);
    let second = if D::QUADS == 1 {
        [first[2], first[3], zero, zero]
    } else {
        S::load_transposed(&scratch.values[1].as_flattened()[4 * lane..])
    };
    let volume = S::Lanes::load(&block.volume[lane..]);
    let mass = volume * S::Lanes::constant(model.density());

    // Eq. 17, and the energy of the increments for the ledger.
    let velocity = D::vector(|axis| S::Lanes::load(&block.velocity[axis][lane..]) + second[axis]);
    let mut square = zero;
    for axis in 0..D::AXES {
        velocity[axis].store(&mut block.velocity[axis][lane..]);
        square = second[axis].mul_add(second[axis], square);
    }
    sums.increment_energy = mass.mul_add(square, sums.increment_energy);

    // Eq. 16. A point that would leave the window of its nodes stays where it is, and the run stops with an error.
    let limit = S::Lanes::constant(TRAVEL_LIMIT);
    let per_cell = S::Lanes::splat(rates.per_cell);
    for axis in 0..D::AXES {
        let travel = per_cell * first[axis];
        sums.travel = sums.travel.max(travel.abs());
        let travel = S::Lanes::select(travel.abs().le(limit), travel, zero);
        let moved = S::Lanes::load(&block.offset[axis][lane..]) + travel;
        let shift = moved.round();
        if (shift.abs().gt(zero)).any() {
            move_node(&mut block.node[axis], lane, shift);
        }
        (moved - shift).store(&mut block.offset[axis][lane..]);
    }

    let mut h = D::matrix(|_, _| zero);
    for column in 0..D::AXES {
        let slope = S::load_transposed(&scratch.gradients[column].as_flattened()[4 * lane..]);
        for row in 0..D::AXES {
            h[row][column] = slope[row] * per_cell;
        }
    }
    let before = model.stress::<S::Lanes>(&block.state, lane);
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

    let strength = -(volume * S::Lanes::splat(rates.inverse_cell));
    for column in 0..D::AXES {
        // In the plane force follows momentum in the same record.
        let shift = if D::QUADS == 1 { 2 } else { 0 };
        let force: [S::Lanes; 4] = std::array::from_fn(|k| {
            if k >= shift && k - shift < D::AXES {
                strength * D::component(&stress, k - shift, column)
            } else {
                zero
            }
        });
        S::store_transposed(force, &mut scratch.gradients[column].as_flattened_mut()[4 * lane..]);
    }
}

/// End of stage 3: weights at the new positions, and the momentum and mass of points `lane..`.
#[inline(always)]
fn prepare<S: Simd, D: Dimension, F: ShapeFunction<S::Scalar>, T>(
    shape: &F,
    density: S::Scalar,
    block: &Block<S::Scalar, D, T>,
    lane: usize,
    scratch: &mut Scratch<S::Scalar>,
) {
    let zero = S::Lanes::constant(0.0);
    let offset = D::vector(|axis| S::Lanes::load(&block.offset[axis][lane..]));
    store_stencils::<S, D, F>(shape, &offset, lane, scratch);
    let mass = S::Lanes::load(&block.volume[lane..]) * S::Lanes::splat(density);
    let momentum: [S::Lanes; 4] = std::array::from_fn(|k| {
        if k < D::AXES { mass * S::Lanes::load(&block.velocity[k][lane..]) } else { zero }
    });
    S::store_transposed(momentum, &mut scratch.momentum.as_flattened_mut()[4 * lane..]);
    let along: [S::Lanes; 4] = std::array::from_fn(|k| {
        if k < 3 { mass * S::Lanes::load(&scratch.weights[D::AXES - 1][k][lane..]) } else { zero }
    });
    S::store_transposed(along, &mut scratch.mass_weights.as_flattened_mut()[4 * lane..]);
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
    fn scatter(&mut self, lane: usize, scratch: &Scratch<S::Scalar>) {
        let last = D::AXES - 1;
        let a: [S::Quad; 3] = std::array::from_fn(|k| S::Quad::splat(scratch.weights[last][k][lane]));
        let g: [S::Quad; 3] = std::array::from_fn(|k| S::Quad::splat(scratch.slopes[last][k][lane]));
        let momentum = S::Quad::load(&scratch.momentum[lane]);
        let force = D::vector(|axis| S::Quad::load(&scratch.gradients[axis][lane]));
        let along = S::Quad::load(&scratch.mass_weights[lane]);
        for pencil in 0..D::PENCILS {
            let (weight, slopes) = transverse::<_, D>(scratch, pencil, lane);
            let weight = S::Quad::splat(weight);
            self.mass[pencil] = weight.mul_add(along, self.mass[pencil]);
            let carried = weight * momentum;
            let mut pushed = if D::QUADS == 1 { carried } else { S::Quad::constant(0.0) };
            for axis in 0..last {
                pushed = S::Quad::splat(slopes[axis]).mul_add(force[axis], pushed);
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
