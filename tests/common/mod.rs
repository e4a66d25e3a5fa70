//! Blocks of points and single points built without a scene, for the tests of the solver.

// Each test file uses its own part of this module.
#![allow(dead_code)]

use swarf::contact;
use swarf::dimension::Dimension;
use swarf::grid::shape_function::ShapeFunction;
use swarf::grid::{FixedNodes, Layout};
use swarf::material::effects::Temperature;
use swarf::material::j2_plasticity::State;
use swarf::material::{ConstitutiveModel, StepSums};
use swarf::partition::Partition;
use swarf::points::{BLOCK, Block};
use swarf::scene::{Constants, ContactChoice};
use swarf::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use swarf::simulation::{Options, PointView, Simulation, Solver, ToolMotion};
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

// The steel of the studies is the steel of the tests and benches.
#[allow(unused_imports)]
pub use swarf::study::body_setup::{ROOM, SteelIn, never_yielding, steel, steel_4340};

/// State of the full Johnson–Cook model with rate and adiabatic heat.
pub type StateIn<R, D> = State<R, D, Temperature<R>>;
/// A block of it.
pub type BlockIn<R, D, F> = Simulation<R, D, F, SteelIn<R>>;
/// The same in double precision.
pub type Steel = SteelIn<f64>;
pub type SteelState<D> = StateIn<f64, D>;
pub type SteelBlock<D, F> = BlockIn<f64, D, F>;

/// A tool at rest.
pub const NO_MOTION: ToolMotion = ToolMotion { velocity: [0.0; 2], friction: 0.0 };

/// Numbers that look random and are the same in every run (Steele, Lea and Flood's SplitMix64).
pub struct Random(pub u64);

impl Random {
    /// Evenly in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of several.
    pub fn one_of<T: Copy>(&mut self, items: &[T]) -> T {
        items[(self.within(0.0, items.len() as f64) as usize).min(items.len() - 1)]
    }
}

/// One constitutive update of the first `h.len()` points of a block, each with its own displacement gradient.
pub struct PointUpdate<'a, D: Dimension, M: ConstitutiveModel<f64, D>> {
    /// The model.
    pub model: &'a M,
    /// State of the points.
    pub state: &'a mut M::State,
    /// Displacement gradients; as many as fill whole vectors.
    pub h: &'a [D::Matrix<f64>],
    /// Substep (s).
    pub dt: f64,
}

impl<D: Dimension, M: ConstitutiveModel<f64, D>> Kernel<f64> for PointUpdate<'_, D, M> {
    /// Plastic work of the first point per volume (J/m3).
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd<Scalar = f64>>(self) -> f64 {
        let mut first = [0.0; BLOCK];
        first[0] = 1.0;
        let mut work = 0.0;
        for lane in (0..self.h.len()).step_by(S::Lanes::LANES) {
            let h = D::matrix(|i, j| {
                let entries: [f64; 8] =
                    std::array::from_fn(|k| self.h.get(lane + k).map_or(0.0, |h| h[i][j]));
                S::Lanes::load(&entries)
            });
            let mut totals = StepSums::zero();
            let volume = S::Lanes::load(&first[lane..]);
            self.model.update(self.state, lane, &h, self.dt, volume, &mut totals);
            work += totals.plastic_work.sum();
        }
        work
    }
}

/// Updates the first four points of `state` by the same gradient with the processor's fastest instructions;
/// returns the plastic work of the first per volume (J/m3).
pub fn update<D: Dimension>(model: &Steel, state: &mut SteelState<D>, h: D::Matrix<f64>, dt: f64) -> f64 {
    dispatch(InstructionSet::detect(), PointUpdate::<D, Steel> { model, state, h: &[h; 4], dt })
}

/// Stress, plastic strain and temperature of a point at total equivalent strains, from a start on, by Runge
/// and Kutta's fourth-order method.
///
/// * `rate`: of the total strain (1/s)
/// * `slope`: derivatives of the three with respect to time
pub fn integrate(
    mut y: [f64; 3],
    rate: f64,
    strains: &[f64],
    slope: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<[f64; 3]> {
    let add = |y: [f64; 3], k: [f64; 3], h: f64| [0, 1, 2].map(|i| y[i] + h * k[i]);
    let mut done = 0.0;
    let mut out = Vec::new();
    for &end in strains {
        while done < end {
            // Fine steps from first yield on, where ε̄ⁿ has no slope; elastic strain is exact in any.
            let size = (0.01 * y[1]).clamp(1e-8, 1e-5).min(end - done);
            let h = size / rate;
            let k1 = slope(y);
            let k2 = slope(add(y, k1, 0.5 * h));
            let k3 = slope(add(y, k2, 0.5 * h));
            let k4 = slope(add(y, k3, h));
            y = [0, 1, 2].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            done += size;
        }
        out.push(y);
    }
    out
}

/// √(3/2 s:s) of the point at `lane`, written out.
pub fn equivalent_stress<D: Dimension>(state: &SteelState<D>, lane: usize) -> f64 {
    let s: Vec<f64> = state.deviator.as_ref().iter().map(|column| column[lane]).collect();
    let zz = -s[0] - s[1];
    let normal = s[0] * s[0] + s[1] * s[1] + zz * zz;
    let shear: f64 = s[2..].iter().map(|x| x * x).sum();
    (1.5 * (normal + 2.0 * shear)).sqrt()
}

/// A rectangular block in an empty domain; its lower left corner is the origin of positions.
pub struct Lattice {
    /// Nodes of the domain along each axis (1 for a missing one).
    pub domain: [i32; 3],
    /// Node at the block's lower left corner.
    pub corner: [i32; 3],
    /// Size of the block in cells.
    pub cells: [i32; 3],
    /// Points along a cell's edge.
    pub per_edge: i32,
    /// Cell length (m).
    pub cell: f64,
    /// Fixed nodes.
    pub fixed: Vec<FixedNodes>,
    /// Courant number.
    pub courant: f64,
}

impl Lattice {
    /// The block's points as a simulation; `place` gives each, by its position (m), a velocity (m/s) and may
    /// stress it.
    pub fn build<D: Dimension, F: ShapeFunction<f64>>(
        &self,
        constants: &Constants,
        shape: F,
        tool: RigidTool,
        place: impl FnMut([f64; 3], &mut SteelState<D>, usize) -> [f64; 3],
    ) -> SteelBlock<D, F> {
        self.build_in(constants, shape, tool, place)
    }

    /// The same in any precision.
    pub fn build_in<R: Real, D: Dimension, F: ShapeFunction<R>>(
        &self,
        constants: &Constants,
        shape: F,
        tool: RigidTool,
        place: impl FnMut([f64; 3], &mut StateIn<R, D>, usize) -> [f64; 3],
    ) -> BlockIn<R, D, F> {
        self.build_of(steel::<R>(constants), shape, tool, place)
    }

    /// The same of any model.
    pub fn build_of<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
        &self,
        model: M,
        shape: F,
        tool: RigidTool,
        mut place: impl FnMut([f64; 3], &mut M::State, usize) -> [f64; 3],
    ) -> Simulation<R, D, F, M> {
        let count: [usize; 3] =
            std::array::from_fn(|k| if k < D::AXES { (self.cells[k] * self.per_edge) as usize } else { 1 });
        let total: usize = count.iter().product();
        let mut blocks = vec![Block::<R, D, M::State>::empty(); total.div_ceil(BLOCK)];
        let spacing = self.cell / f64::from(self.per_edge);
        for number in 0..total {
            let index = [number / (count[1] * count[2]), number / count[2] % count[1], number % count[2]];
            let (block, lane) = (&mut blocks[number / BLOCK], number % BLOCK);
            let from_corner: [f64; 3] = std::array::from_fn(|k| {
                if k < D::AXES { (index[k] as f64 + 0.5) / f64::from(self.per_edge) } else { 0.0 }
            });
            block.set_grid_position(lane, D::vector(|k| f64::from(self.corner[k]) + from_corner[k]));
            block.volume[lane] = R::from_f64(spacing.powi(D::AXES as i32));
            block.id[lane] = number as u32;
            ConstitutiveModel::<R, D>::place(&model, &mut block.state, lane, ROOM);
            let velocity = place(from_corner.map(|x| x * self.cell), &mut block.state, lane);
            for k in 0..D::AXES {
                block.velocity[k][lane] = R::from_f64(velocity[k]);
            }
        }
        let origin =
            std::array::from_fn(|k| if k < D::AXES { -self.cell * f64::from(self.corner[k]) } else { 0.0 });
        let layout = Layout::new(self.domain, self.cell, origin);
        let partition = Partition::new(layout, self.fixed.clone(), blocks);
        Simulation::new(
            partition,
            (shape, model),
            tool,
            contact::law(ContactChoice::Surface, false),
            // Exact solutions are compared without the locking control (tests/locking.rs).
            Options {
                courant: self.courant,
                instructions: InstructionSet::detect(),
                depth: 1.0,
                locking_control: false,
                separation: None,
                mass_scaling: None,
                window: None,
                chip_tail: None,
            },
        )
    }
}

/// A tool that never comes near.
pub fn distant_tool() -> RigidTool {
    let shape = ToolShape::new(0.0, 0.0873, 0.0, 5e-4, 1e-3).expect("a plain wedge");
    RigidTool { shape, position: [1.0, 1.0], velocity: [0.0; 2], friction: 0.0 }
}

/// All points by number.
pub fn points(solver: &dyn Solver) -> Vec<PointView> {
    let mut points = Vec::new();
    solver.visit_points(&mut |point| points.push(*point));
    points.sort_unstable_by_key(|point| point.id);
    points
}

/// Σ f over the points.
pub fn total(points: &[PointView], f: impl Fn(&PointView) -> f64) -> f64 {
    points.iter().map(f).sum()
}

/// ½ m |v|² of a point (J).
pub fn kinetic(point: &PointView) -> f64 {
    0.5 * point.mass * point.velocity.iter().map(|v| v * v).sum::<f64>()
}

/// Elastic energy of a point (J).
pub fn elastic(point: &PointView) -> f64 {
    point.volume * point.report.elastic_energy
}
