//! Thermal expansion: a block heated slowly without walls, in space and in plane strain, and one that walls
//! confine.
//!
//! Exact for the constitutive law, with λ the stretch, μ and κ the moduli and g = 1 + α ΔT the free stretch:
//!
//! * free in space: λ = g, without stress;
//! * free in plane strain: τ_xx = ⅔ μ ln λ + κ/2 ((λ²/g³)² − 1) = 0 and τ_zz = −2 μ ln λ;
//! * confined: τ = κ/2 (g⁻⁶ − 1).
//!
//! For small α ΔT these are αΔT, (1 + ν) αΔT, −E α ΔT and −3 κ α ΔT.

use super::Report;
use crate::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use crate::grid::FixedNodes;
use crate::grid::shape_function::Gimp;
use crate::material::ConstitutiveModel;
use crate::material::effects::Adiabatic;
use crate::material::hardening::PowerLaw;
use crate::material::j2_plasticity::J2Plasticity;
use crate::material::multiplicative::Multiplicative;
use crate::material::rate::RateIndependent;
use crate::points::BLOCK;
use crate::simulation::Solver;
use crate::study::body_setup::{
    BodySetup, NO_MOTION, ROOM, distant_tool, lattice, never_yielding, steel_4340,
};

/// Rise of temperature (K).
pub const RISE: f64 = 100.0;
/// Edge of the block (cells).
const EDGE: i32 = 6;
/// Substeps of heating, some fifty periods of the slowest vibration, and of watching.
const HEATING: i32 = 2000;
/// See `HEATING`.
const WATCHING: i32 = 400;

/// What the heated block shows, as means over points and over the substeps of watching.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Volume ratio det F (-).
    pub volume_ratio: f64,
    /// Cauchy stress xx and zz (Pa).
    pub stress: [f64; 2],
}

/// The free stretch at a rise of temperature (K).
pub fn free_stretch(rise: f64) -> f64 {
    1.0 + steel_4340().thermal_expansion * rise
}

/// κ and μ (Pa).
fn moduli() -> (f64, f64) {
    let c = steel_4340();
    let (e, nu) = (c.youngs_modulus, c.poissons_ratio);
    (e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
}

/// Exact stretch in the plane (-) and Cauchy stress across it (Pa) of the block that is free in plane strain.
pub fn free_in_plane_strain(rise: f64) -> (f64, f64) {
    let (kappa, mu) = moduli();
    let g = free_stretch(rise);
    let residual = |log: f64| 2.0 / 3.0 * mu * log + 0.5 * kappa * ((4.0 * log).exp() / g.powi(6) - 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if residual(middle) > 0.0 { high = middle } else { low = middle }
    }
    (low.exp(), -2.0 * mu * low / (2.0 * low).exp())
}

/// Exact mean Cauchy stress (Pa) of the confined block.
pub fn confined(rise: f64) -> f64 {
    0.5 * moduli().0 * (free_stretch(rise).powi(-6) - 1.0)
}

/// Heats a block by `rise` (K).
///
/// # Panics
/// When the run becomes unstable.
pub fn run<D: Dimension>(is_confined: bool, rise: f64) -> Outcome {
    let cell = 1e-5;
    let edge = f64::from(EDGE) * cell;
    let mut setup = BodySetup::around([0.0; 2], [edge; 2], cell);
    setup.courant = 0.4;
    if D::AXES == 3 {
        setup.nodes[2] = setup.nodes[1];
        setup.origin[2] = setup.origin[1];
    }
    if is_confined {
        let everything = i32::MAX / 2;
        for axis in 0..D::AXES {
            let (low, high) = (setup.node(axis, 0.0), setup.node(axis, edge));
            for (from, to) in [(-everything, low), (high, everything)] {
                let mut wall = FixedNodes { low: [-everything; 3], high: [everything; 3], axes: [true; 3] };
                (wall.low[axis], wall.high[axis]) = (from, to);
                setup.fixed.push(wall);
            }
        }
    }
    let c = never_yielding(steel_4340());
    let thermal = Adiabatic::<f64, true>::of(&c, ROOM).with_expansion(c.thermal_expansion);
    let law: Multiplicative<PowerLaw<f64>, _, _> = Multiplicative::new(&c, RateIndependent, thermal);
    let model = J2Plasticity::new(&c, law);
    let points = 2 * EDGE as usize;
    let count = [points, points, if D::AXES == 3 { points } else { 1 }];
    let seeds = lattice([0.0; 3], count, cell / 2.0, D::AXES);
    let mut solver = setup.simulation::<D, _, _>((Gimp::new(2), model), distant_tool(), &seeds, |_, _, _| {});
    // The heat given here is in no ledger: the watch on the energy leaves bodies with a body force, if only
    // of zero, alone.
    solver.body_force = Some(std::sync::Arc::new(|_: [f64; 3], _: f64| [0.0; 3]));
    let mut sum = Outcome { volume_ratio: 0.0, stress: [0.0; 2] };
    for step in 1..=HEATING + WATCHING {
        if step <= HEATING {
            let phase = std::f64::consts::PI * f64::from(step) / f64::from(HEATING);
            let temperature = ROOM + 0.5 * rise * (1.0 - phase.cos());
            for block in solver.partition.chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
                for lane in 0..BLOCK {
                    ConstitutiveModel::<f64, D>::set_temperature(&model, &mut block.state, lane, temperature);
                }
            }
        }
        solver.step(&NO_MOTION, false).expect("a stable step");
        if step > HEATING {
            let share = 1.0 / (seeds.len() as f64 * f64::from(WATCHING));
            solver.visit_points(&mut |point| {
                sum.volume_ratio += share * point.report.jacobian;
                sum.stress[0] += share * point.report.stress[0];
                sum.stress[1] += share * point.report.stress[2];
            });
        }
    }
    sum
}

/// The three blocks.
pub fn verify(report: &mut Report) {
    let free = run::<ThreeDimensional>(false, RISE);
    let strain = free.volume_ratio.cbrt() - free_stretch(RISE);
    report.at_most("free block in space: strain less the exact one", strain, "", 1e-6, "");
    let plane = run::<PlaneStrain>(false, RISE);
    let (stretch, across) = free_in_plane_strain(RISE);
    let strain = plane.volume_ratio.sqrt() - stretch;
    report.at_most("free block in plane strain: strain less the exact one", strain, "", 1e-6, "");
    let error = plane.stress[1] / across - 1.0;
    report.at_most("free block in plane strain: stress across the plane", 100.0 * error, "%", 0.1, "");
    let held = run::<PlaneStrain>(true, RISE);
    let error = held.stress[0] / confined(RISE) - 1.0;
    report.at_most("confined block: stress", error, "", 1e-6, "");
}
