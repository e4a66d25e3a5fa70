//! Single kernels, run a given number of times, for callgrind: the difference between two numbers of times is
//! free of everything else.

use crate::blocks::{MOTION, sheared};
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::simd::InstructionSet;
use swarf::simulation::Solver;
use swarf::stabilization::volumetric_locking::LockingControl;

/// 7,500 points in the plane, and 6,912 in space.
const FLAT: [i32; 3] = [75, 25, 1];
const DEEP: [i32; 3] = [12, 9, 8];

/// Runs the kernel `name` that often; prints its points and the instruction set, for the reader of the
/// counts.
///
/// # Errors
/// A name that is not known.
pub fn run(name: &str, times: usize) -> Result<(), String> {
    let (points, set) = match name {
        "plane_strain_f64" => substeps::<PlaneStrain>(FLAT, InstructionSet::detect(), times),
        "plane_strain_f64_portable" => substeps::<PlaneStrain>(FLAT, InstructionSet::Portable, times),
        "three_dimensional_f64" => substeps::<ThreeDimensional>(DEEP, InstructionSet::detect(), times),
        "sort" => sorts(times),
        "locking_control" => controls(times),
        other => return Err(other.into()),
    };
    println!("points {points} instructions {}", set.name());
    Ok(())
}

/// Ordinary substeps: so few that no sort falls among them.
fn substeps<D: Dimension>(cells: [i32; 3], set: InstructionSet, times: usize) -> (usize, InstructionSet) {
    let mut solver = sheared::<f64, D>(cells);
    solver.options.instructions = set;
    for _ in 0..times {
        solver.step(&MOTION, false).expect("a stable block");
        assert!(solver.progress.travel > 0.0, "points were sorted: count fewer substeps");
    }
    (solver.points(), set)
}

/// Sorts of points in order, as most are.
fn sorts(times: usize) -> (usize, InstructionSet) {
    let mut solver = sheared::<f64, PlaneStrain>(FLAT);
    for _ in 0..times {
        solver.partition.sort(|_, _| {}, false);
    }
    (solver.points(), InstructionSet::detect())
}

/// Looks of the locking control at points that give it no work, as most are.
fn controls(times: usize) -> (usize, InstructionSet) {
    let mut solver = sheared::<f64, PlaneStrain>(FLAT);
    let mut control = LockingControl::default();
    for _ in 0..times {
        control.limit_deviations(&mut solver.partition, &solver.shape, &solver.model, false);
    }
    (solver.points(), InstructionSet::detect())
}
