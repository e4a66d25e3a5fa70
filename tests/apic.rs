//! The affine transfer (`transfer::apic`) keeps what its paper promises: momentum, angular momentum, linear
//! velocity fields.

mod common;

use common::{Lattice, NO_MOTION, Random, SteelIn, distant_tool, elastic, points, steel, steel_4340, total};
use swarf::dimension::PlaneStrain;
use swarf::grid::shape_function::Gimp;
use swarf::points::{BLOCK, PointState};
use swarf::simulation::{Simulation, Solver};
use swarf::transfer::apic::Affine;

type Block = Simulation<f64, PlaneStrain, Gimp<f64>, Affine<SteelIn<f64>>>;

/// Cell length (m).
const CELL: f64 = 2e-5;

/// A free block of steel with a velocity (m/s) and moments (m/s times cells) at each place (m).
fn block(mut velocity: impl FnMut([f64; 3]) -> ([f64; 2], [f64; 4])) -> Block {
    let lattice = Lattice {
        domain: [60, 50, 1],
        corner: [10, 10, 0],
        cells: [18, 14, 1],
        per_edge: 2,
        cell: CELL,
        fixed: vec![],
        courant: 0.5,
    };
    let model = Affine(steel(&steel_4340()));
    lattice.build_of::<f64, PlaneStrain, _, _>(model, Gimp::new(2), distant_tool(), |x, state, lane| {
        let ([x, y], moments) = velocity(x);
        for k in 0..4 {
            state.moments_mut()[k][lane] = moments[k];
        }
        [x, y, 0.0]
    })
}

/// A block that flies, turns and is shaken at random.
fn shaken(seed: u64) -> Block {
    let mut random = Random(seed);
    block(|x| {
        let noise: [f64; 6] = std::array::from_fn(|_| random.within(-5.0, 5.0));
        let moments = [noise[2], noise[3] - 0.4, noise[4] + 0.4, noise[5]].map(|moment| 0.2 * moment);
        ([30.0 - 1e5 * x[1] + noise[0], 17.0 + 1e5 * x[0] + noise[1]], moments)
    })
}

/// Momentum (kg m/s), and angular momentum about the grid's origin with the points' own (kg m2/s); with Σ m
/// |v| and Σ m |x| |v|.
fn momenta(block: &Block) -> ([f64; 3], [f64; 2]) {
    let (mut momenta, mut scales) = ([0.0; 3], [0.0; 2]);
    let density = 7830.0;
    for (block, lane) in block.partition.points() {
        let mass = density * block.volume[lane];
        let [x, y] = block.grid_position(lane).map(|cells| cells * CELL);
        let [u, v] = [block.velocity[0][lane], block.velocity[1][lane]];
        let moments = block.state.moments();
        let own = CELL * (moments[2][lane] - moments[1][lane]);
        momenta[0] += mass * u;
        momenta[1] += mass * v;
        momenta[2] += mass * (x * v - y * u + own);
        scales[0] += mass * u.hypot(v);
        scales[1] += mass * x.hypot(y) * u.hypot(v);
    }
    (momenta, scales)
}

/// Sections 5.3 and 5.4 of the paper: both transfers conserve momentum, and angular momentum with its affine
/// share; internal forces of a symmetric stress add neither. The bound is FLIP's for momentum
/// (tests/conservation.rs).
#[test]
fn momentum_and_angular_momentum_are_conserved() {
    for seed in 0..3 {
        let mut block = shaken(seed);
        let (start, scales) = momenta(&block);
        let mut worst = [0.0_f64; 3];
        for _ in 0..400 {
            block.step(&NO_MOTION, false).expect("a stable step");
            let (now, _) = momenta(&block);
            for k in 0..3 {
                worst[k] = worst[k].max((now[k] - start[k]).abs() / scales[k / 2]);
            }
        }
        println!("seed {seed}: drift of momentum and angular momentum {worst:?}");
        assert!(worst.iter().all(|&drift| drift < 1e-12), "drifts {worst:?} of what moves");
    }
}

/// A field v = a + A x of points comes back from the grid as it was, at the surface too: m_i v_i = Σ w m (a +
/// A x_i), and moments A D. A filter (PIC) would change it there, and everywhere in the moments.
#[test]
fn affine_velocity_fields_are_reproduced() {
    // 1/s; and D of points a quarter of a cell from their node: 1/8 + 1/16.
    let gradient = [[3e4, -8e4], [5e4, -1e4]];
    let second = 3.0 / 16.0;
    let field =
        |x: [f64; 3]| [0, 1].map(|row: usize| 20.0 + gradient[row][0] * x[0] + gradient[row][1] * x[1]);
    let moments = [0, 1, 2, 3].map(|k: usize| gradient[k / 2][k % 2] * CELL * second);
    let mut block = block(|x| (field(x), moments));
    let before = points(&block);
    block.step(&NO_MOTION, false).expect("a stable step");
    for (before, after) in before.iter().zip(points(&block)) {
        for axis in 0..2 {
            let error = after.velocity[axis] - before.velocity[axis];
            // Some dozen roundings of velocities up to 50 m/s.
            assert!(error.abs() < 64.0 * f64::EPSILON * 50.0, "velocity changed by {error:e} m/s");
        }
    }
    for (block, lane) in block.partition.points() {
        for k in 0..4 {
            let error = block.state.moments()[k][lane] - moments[k];
            assert!(error.abs() < 64.0 * f64::EPSILON * 50.0, "moment {k} changed by {error:e}");
        }
    }
}

/// Kinetic and elastic energy after some substeps over that at the start, with moments (APIC) or without
/// (PIC).
fn energy_left(keeps_moments: bool) -> f64 {
    // The block turns and bends: half a wave of transverse velocity along it, some 30 µs long.
    let length = 18.0 * CELL;
    let mut block = self::block(|x| {
        let bend = 20.0 * (std::f64::consts::PI * x[0] / length).cos();
        ([-1e5 * (x[1] - 7.0 * CELL), 1e5 * (x[0] - 9.0 * CELL) + bend], [0.0; 4])
    });
    let energy = |block: &Block| total(&points(block), |p| common::kinetic(p) + elastic(p));
    let start = energy(&block);
    for _ in 0..200 {
        block.step(&NO_MOTION, false).expect("a stable step");
        if !keeps_moments {
            for block in block.partition.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
                *block.state.moments_mut() = [[0.0; BLOCK]; 4];
            }
            // A new simulation deposits what the points have now.
            let Simulation { partition, shape, model, tool, contact, options, .. } = block;
            block = Simulation::new(partition, (shape, model), tool, contact, options);
        }
    }
    energy(&block) / start
}

/// Without its moments the transfer is PIC, which filters every substep; with them it keeps most of what PIC
/// loses.
#[test]
fn dissipation_is_far_below_that_of_pic() {
    let (apic, pic) = (energy_left(true), energy_left(false));
    println!("energy left after 200 substeps: APIC {apic:.4}, PIC {pic:.4}");
    assert!(1.0 - apic < 0.5 * (1.0 - pic), "APIC keeps {apic} of the energy, PIC {pic}");
}

/// Start = kinetic + elastic + plastic + damping, each from what it names: the damping of APIC is the work of
/// all forces less what the points' kinetic energy gains.
#[test]
fn the_ledger_closes() {
    let mut block = shaken(7);
    for _ in 0..300 {
        block.step(&NO_MOTION, false).expect("a stable step");
    }
    let now = points(&block);
    let ledger = &block.progress().ledger;
    let energy = total(&now, |p| common::kinetic(p) + elastic(p)) + ledger.plastic_work + ledger.damping;
    let error = (energy - ledger.initial_energy) / ledger.initial_energy;
    println!(
        "ledger's error {error:.1e} of the start; damping {:.3} of it",
        ledger.damping / ledger.initial_energy
    );
    assert!(error.abs() < 1e-3, "the ledger is open by {error:e} of the energy at the start");
}
