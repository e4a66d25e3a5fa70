//! The fast kernels against the plain loop (`common/reference_loop.rs`), in every instruction set of this
//! processor.

mod common;
#[path = "common/reference_loop.rs"]
mod plain;

use common::{Lattice, Random, SteelBlock, points, steel_4340};
use plain::ReferenceLoop;
use swarf::contact::NodesInside;
use swarf::dimension::PlaneStrain;
use swarf::grid::FixedNodes;
use swarf::grid::shape_function::Gimp;
use swarf::simd::InstructionSet;
use swarf::simulation::{Solver, ToolMotion};
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

const CELL: f64 = 4e-5;
/// Cells along the block's edges: 960 points.
const CELLS: [i32; 3] = [20, 12, 1];
/// Fast, so that the chip forms within the test: five cells of travel.
const MOTION: ToolMotion = ToolMotion { velocity: [-150.0, 0.0], friction: 0.2 };
const SUBSTEPS: usize = 400;

/// A small block on two walls, and a tool of 10 degrees rake and a rounded edge before it, four cells deep.
fn scene() -> (Lattice, RigidTool) {
    let wall = |low, high| FixedNodes { low, high, axes: [true; 3] };
    let (x, y) = (30, 14);
    let lattice = Lattice {
        domain: [x + CELLS[0] + 24, y + CELLS[1] + 30, 1],
        corner: [x, y, 0],
        cells: CELLS,
        per_edge: 2,
        cell: CELL,
        fixed: vec![
            wall([x - 2, y - 2, 0], [x, y + CELLS[1], 0]),
            wall([x - 2, y - 2, 0], [x + CELLS[0], y, 0]),
        ],
        courant: 0.5,
    };
    let shape = ToolShape::new(10_f64.to_radians(), 0.0873, 3e-5, 5e-4, 1e-3).expect("a rounded wedge");
    let position = [f64::from(CELLS[0]) * CELL + 3.2e-5, f64::from(CELLS[1] - 4) * CELL];
    (lattice, RigidTool { shape, position, velocity: [0.0; 2], friction: 0.0 })
}

/// What is compared of a run, as numbers of order one: each point's position in cells, velocity over the
/// tool's, volume ratio, Cauchy stress over the yield stress, plastic strain and temperature over the initial
/// one; the tool's impulse over that of a block of the uncut chip's size.
type Numbers = Vec<f64>;

fn scaled_impulse(impulse: [f64; 2]) -> [f64; 2] {
    let whole = steel_4340().density * 16.0 * CELL * CELL * 150.0;
    impulse.map(|component| component / whole)
}

fn fast(set: InstructionSet) -> Numbers {
    let (lattice, tool) = scene();
    let mut solver: SteelBlock<PlaneStrain, Gimp<f64>> =
        lattice.build(&steel_4340(), Gimp::new(2), tool, |_, _, _| [0.0; 3]);
    solver.options.instructions = set;
    // The plain loop has no contact but this one, on nodes.
    solver.contact = Box::new(NodesInside::default());
    let (mut sorts, mut travel) = (0, 0.0);
    // The plain loop has no limit on stray velocities, which is tried in tests/strays.rs: never look for
    // them.
    solver.progress.travel_unseen = f64::NEG_INFINITY;
    for _ in 0..SUBSTEPS {
        solver.step(&MOTION, false).expect("a stable cut");
        sorts += usize::from(solver.progress().travel < travel);
        travel = solver.progress().travel;
    }
    assert!(sorts >= 3, "points were sorted {sorts} times only");
    let yield_stress = steel_4340().yield_stress;
    let mut numbers = Numbers::new();
    for point in points(&solver) {
        let r = &point.report;
        numbers.extend([point.position[0] / CELL, point.position[1] / CELL]);
        numbers.extend([point.velocity[0] / 150.0, point.velocity[1] / 150.0, r.jacobian]);
        numbers.extend([r.stress[0], r.stress[1], r.stress[5]].map(|stress| stress / yield_stress));
        numbers.extend([r.plastic_strain, r.temperature / common::ROOM]);
    }
    numbers.extend(scaled_impulse(solver.progress().ledger.tool_impulse));
    numbers
}

/// The plain loop; its points start up to `shift` (cells) away from where they belong.
fn plain(shift: f64) -> Numbers {
    let (lattice, tool) = scene();
    let constants = steel_4340();
    let mut plain = ReferenceLoop::new(&lattice, &constants, tool);
    let mut random = Random(1);
    for coordinate in plain.points.x.iter_mut().chain(&mut plain.points.y) {
        *coordinate += CELL * shift * random.within(-1.0, 1.0);
    }
    let mut yielded = 0;
    for _ in 0..SUBSTEPS {
        plain.step(&MOTION);
        yielded += plain.yielding;
    }
    assert!(
        yielded > 10_000,
        "only {yielded} returns in {SUBSTEPS} substeps: the test would miss the flow law"
    );
    let bulk = constants.youngs_modulus / (3.0 * (1.0 - 2.0 * constants.poissons_ratio));
    let q = &plain.points;
    let mut numbers = Numbers::new();
    for p in 0..q.count() {
        let j = q.jacobian[p];
        let mean = 0.5 * bulk * (j * j - 1.0);
        numbers.extend([q.x[p] / CELL, q.y[p] / CELL, q.vx[p] / 150.0, q.vy[p] / 150.0, j]);
        let stress = [q.sxx[p] + mean, q.syy[p] + mean, q.sxy[p]];
        numbers.extend(stress.map(|stress| stress / j / constants.yield_stress));
        numbers.extend([q.plastic_strain[p], q.temperature[p] / common::ROOM]);
    }
    numbers.extend(scaled_impulse(plain.tool_impulse));
    numbers
}

fn largest_difference(a: &Numbers, b: &Numbers) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// How far apart two right programs may be after the cut.
///
/// Each substep rounds every number a few times, and a cut amplifies what it is given. The plain loop
/// measures by how much: its points start off by the rounding of a position in the domain (30 cells times
/// machine epsilon). The roundings of different substeps are independent, so together they count as the root
/// of their number times that.
fn tolerance(undisturbed: &Numbers) -> f64 {
    let response = largest_difference(undisturbed, &plain(30.0 * f64::EPSILON));
    let tolerance = response * (SUBSTEPS as f64).sqrt();
    println!("response to rounding at the start {response:.2e}, tolerance {tolerance:.2e}");
    // A wrong term changes stresses of order one by far more.
    assert!(tolerance < 1e-7, "the cut amplifies rounding to {response}: it can tell nothing");
    tolerance
}

/// The kernels compute what the equations say: see `tolerance` for the bound.
#[test]
fn the_kernels_agree_with_the_plain_loop_in_every_instruction_set() {
    let expected = plain(0.0);
    let tolerance = tolerance(&expected);
    for set in InstructionSet::ALL.into_iter().filter(|set| set.is_available()) {
        let difference = largest_difference(&fast(set), &expected);
        println!("{}: largest difference {difference:.2e}", set.name());
        assert!(difference <= tolerance, "{}: {difference:.3e} > {tolerance:.3e}", set.name());
    }
}

/// The instruction sets differ by fused roundings alone: see `tolerance` for the bound.
#[test]
fn instruction_sets_agree_within_rounding() {
    if !InstructionSet::Avx2.is_available() {
        println!("this processor has no AVX2: nothing to compare");
        return;
    }
    let tolerance = tolerance(&plain(0.0));
    let difference = largest_difference(&fast(InstructionSet::Portable), &fast(InstructionSet::Avx2));
    println!("portable against avx2: largest difference {difference:.2e}");
    assert!(difference <= tolerance, "{difference:.3e} > {tolerance:.3e}");
    assert!(difference > 0.0, "both runs used the same instructions");
}
