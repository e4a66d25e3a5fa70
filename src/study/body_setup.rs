//! Bodies of any outline and material on a grid, built without a scene.

use crate::contact::{self, BoxedLaw, NodesInside};
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::grid::{FixedNodes, Layout};
use crate::material::ConstitutiveModel;
use crate::material::j2_plasticity::J2Plasticity;
use crate::material::multiplicative::JohnsonCook;
use crate::partition::Partition;
use crate::points::{BLOCK, Block, PointState};
use crate::scene::{Constants, ContactChoice, Scene};
use crate::simd::{InstructionSet, Real};
use crate::simulation::{Options, PointView, Simulation, Solver, ToolMotion};
use crate::tool::RigidTool;
use crate::tool::profile::ToolShape;

/// The Johnson–Cook model with rate and adiabatic heat.
pub type SteelIn<R> = J2Plasticity<R, JohnsonCook<R>>;
/// The same in double precision.
pub type Steel = SteelIn<f64>;

/// Temperature at the start (K).
pub const ROOM: f64 = 298.15;

/// A tool at rest without friction.
pub const NO_MOTION: ToolMotion = ToolMotion { velocity: [0.0; 2], friction: 0.0 };

/// Constants of AISI 4340, the scene's default.
pub fn steel_4340() -> Constants {
    Scene::default().material.constants
}

/// The same elasticity without plasticity.
pub fn never_yielding(constants: Constants) -> Constants {
    Constants { yield_stress: 1e20, ..constants }
}

/// Elastic and perfectly plastic: no hardening, no rate, no heat.
pub fn perfectly_plastic(constants: Constants) -> Constants {
    Constants { hardening_modulus: 0.0, rate_coefficient: 0.0, taylor_quinney: 0.0, ..constants }
}

/// The Johnson–Cook model of some constants.
pub fn steel<R: Real>(c: &Constants) -> SteelIn<R> {
    J2Plasticity::new(c, JohnsonCook::full(c, ROOM))
}

/// A contact law of scenes, or the plain one of tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// Points, where their edge meets the tool's exact surface.
    Surface,
    /// Nodes shared with a tool made of points that is close: the paper's eqs. 19 to 23.
    Distance,
    /// Nodes shared with a tool made of points: eq. 18.
    Velocity,
    /// Nodes that lie inside the tool and move into it.
    NodesInside,
}

impl Contact {
    /// The law, for a simulation's `contact`.
    pub fn law<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(self) -> BoxedLaw<R, D, F, S> {
        match self {
            Contact::Surface => contact::law(ContactChoice::Surface, false),
            Contact::Distance => contact::law(ContactChoice::Distance, false),
            Contact::Velocity => contact::law(ContactChoice::Velocity, false),
            Contact::NodesInside => Box::new(NodesInside::default()),
        }
    }
}

/// A point to be placed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seed {
    /// Position (m).
    pub position: [f64; 3],
    /// Velocity (m/s).
    pub velocity: [f64; 3],
    /// Volume at the start (m3; m2 in the plane).
    pub volume: f64,
}

/// Centres of `count` boxes of size `spacing` (m) from `corner` (m) on; points are numbered along the last
/// axis first.
pub fn lattice(corner: [f64; 3], count: [usize; 3], spacing: f64, axes: usize) -> Vec<Seed> {
    let mut seeds = Vec::with_capacity(count.iter().product());
    for number in 0..count.iter().product() {
        let index = [number / (count[1] * count[2]), number / count[2] % count[1], number % count[2]];
        let position =
            std::array::from_fn(
                |k| {
                    if k < axes { corner[k] + (index[k] as f64 + 0.5) * spacing } else { 0.0 }
                },
            );
        seeds.push(Seed { position, velocity: [0.0; 3], volume: spacing.powi(axes as i32) });
    }
    seeds
}

/// The grid, its fixed nodes, and how time advances.
#[derive(Clone, Debug)]
pub struct BodySetup {
    /// Nodes of the domain along each axis (1 for a missing one).
    pub nodes: [i32; 3],
    /// Cell length (m).
    pub cell: f64,
    /// Position of node (0, 0, 0) (m).
    pub origin: [f64; 3],
    /// Fixed nodes.
    pub fixed: Vec<FixedNodes>,
    /// Courant number (-).
    pub courant: f64,
    /// Whether increments are smoothed.
    pub smoothed_increments: bool,
    /// Whether the points of a cell share their rate of volume change.
    pub averages_cells: bool,
    /// Whether volume ratios are evened out; exact solutions are compared without that averaging.
    pub locking_control: bool,
}

impl BodySetup {
    /// A domain from `low` to `high` (m) with six cells of rim to each side and nodes at whole multiples of
    /// `cell` from `low`.
    pub fn around(low: [f64; 2], high: [f64; 2], cell: f64) -> Self {
        const RIM: i32 = 6;
        let count = |axis: usize| ((high[axis] - low[axis]) / cell - 1e-9).ceil() as i32 + 1 + 2 * RIM;
        let origin = |axis: usize| low[axis] - f64::from(RIM) * cell;
        BodySetup {
            nodes: [count(0), count(1), 1],
            cell,
            origin: [origin(0), origin(1), 0.0],
            fixed: vec![],
            courant: 0.5,
            smoothed_increments: false,
            averages_cells: false,
            locking_control: false,
        }
    }

    /// Index of the node nearest to a coordinate (m).
    pub fn node(&self, axis: usize, x: f64) -> i32 {
        ((x - self.origin[axis]) / self.cell).round() as i32
    }

    /// The bodies' points as a simulation, numbered as the seeds; `prepare` may give each, by its number, a
    /// state.
    pub fn simulation<D: Dimension, F: ShapeFunction<f64>, M: ConstitutiveModel<f64, D>>(
        &self,
        (shape, model): (F, M),
        tool: RigidTool,
        seeds: &[Seed],
        mut prepare: impl FnMut(&mut M::State, usize, usize),
    ) -> Simulation<f64, D, F, M> {
        let mut blocks = vec![Block::<f64, D, M::State>::empty(); seeds.len().div_ceil(BLOCK)];
        for (number, seed) in seeds.iter().enumerate() {
            let (block, lane) = (&mut blocks[number / BLOCK], number % BLOCK);
            block.set_grid_position(
                lane,
                D::vector(|axis| (seed.position[axis] - self.origin[axis]) / self.cell),
            );
            block.volume[lane] = seed.volume;
            block.id[lane] = number as u32;
            model.place(&mut block.state, lane, ROOM);
            prepare(&mut block.state, lane, number);
            for axis in 0..D::AXES {
                block.velocity[axis][lane] = seed.velocity[axis];
            }
        }
        let (shares_masses, averages_cells) = (self.smoothed_increments, self.averages_cells);
        let layout =
            Layout { shares_masses, averages_cells, ..Layout::new(self.nodes, self.cell, self.origin) };
        let options = Options {
            courant: self.courant,
            instructions: InstructionSet::detect(),
            depth: 1.0,
            locking_control: self.locking_control,
            mass_scaling: None,
            separation: None,
            window: None,
            chip_tail: None,
        };
        let partition = Partition::new(layout, self.fixed.clone(), blocks);
        let contact = contact::law(ContactChoice::Surface, false);
        Simulation::new(partition, (shape, model), tool, contact, options)
    }
}

/// A tool that never comes near.
pub fn distant_tool() -> RigidTool {
    RigidTool { shape: upright_block(1.0, 1.0), position: [1e6, 1e6], velocity: [0.0; 2], friction: 0.0 }
}

/// A rectangular tool of `length` and `height` (m), its lower left corner at its origin.
///
/// # Panics
/// When a size is not above 0.
pub fn upright_block(length: f64, height: f64) -> ToolShape {
    ToolShape::new(0.0, 0.0, 0.0, length, height).expect("a right-angled wedge is a tool")
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

/// ½ m |v − u|² of a point in a frame that moves with `u` (m/s) (J).
pub fn kinetic(point: &PointView, u: [f64; 3]) -> f64 {
    0.5 * point.mass * (0..3).map(|axis| (point.velocity[axis] - u[axis]).powi(2)).sum::<f64>()
}

/// Elastic energy of a point (J).
pub fn elastic(point: &PointView) -> f64 {
    point.volume * point.report.elastic_energy
}
