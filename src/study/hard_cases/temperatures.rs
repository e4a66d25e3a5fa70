//! Temperatures near, at and above melting and below the reference, and the rate 0.
//!
//! Molten material has no strength: only pressure. The flow stress is never negative, whatever temperature
//! and rate.

use super::monitor::{Watched, cut, soundness};
use super::{Setting, Sheet};
use crate::dimension::PlaneStrain;
use crate::material::{ConstitutiveModel, StepSums};
use crate::points::PointState;
use crate::scene::Scene;
use crate::simd::{InstructionSet, Kernel, Simd, Vector, dispatch};
use crate::study::body_setup::{Steel, steel, steel_4340};
use rayon::prelude::*;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    points(sheet);
    let melting = steel_4340().melting_temperature;
    let temperatures = [1.0, 200.0, melting - 1.0, melting, melting + 500.0];
    let scenes: Vec<Scene> = temperatures
        .iter()
        .map(|&temperature| {
            let mut scene = cut(setting.pick(4e-5, 2e-5));
            scene.workpiece.initial_temperature = temperature;
            scene
        })
        .collect();
    let runs: Vec<Watched> = scenes
        .par_iter()
        .with_max_len(1)
        .map(|scene| {
            let mut run = Watched::new(scene);
            run.run(setting.pick(12e-6, 20e-6), 20);
            run
        })
        .collect();
    for (temperature, run) in temperatures.into_iter().zip(&runs) {
        let name = format!("cut at {temperature} K");
        let retries = run.outputs().retries;
        let ledger = run.figure(100.0 * run.worst.ledger);
        sheet.at_most(format!("{name}: ledger"), ledger, "%", 1.0).retried(retries).remarked(run.remark());
        let wrong = run.figure(run.worst.not_finite as f64);
        sheet.at_most(format!("{name}: numbers that are none"), wrong, "", 0.0);
        let gain = run.figure((-run.worst.plastic_gain).max(0.0));
        sheet.at_most(format!("{name}: plastic work given back"), gain, "J", 0.0);
        if temperature >= melting {
            // What rounding leaves of a stress that is scaled to nothing.
            let strength = run.figure(run.worst.stress / steel_4340().yield_stress);
            sheet.at_most(format!("{name}: equivalent stress over A"), strength, "", 1e-9);
        } else {
            sheet.show(format!("{name}: smallest volume ratio"), run.figure(run.worst.ratio), "");
        }
    }
    let mut at_rest = cut(setting.pick(4e-5, 2e-5));
    at_rest.inputs.tool_velocity = 0.0;
    let mut run = Watched::new(&at_rest);
    run.run(5e-6, 5);
    // From rest the first substeps load the metal at rates below any reference.
    run.steer(crate::scene::Inputs { tool_velocity: 1e-3, ..at_rest.inputs }, super::monitor::NO_SLOPE)
        .run(5e-6, 5);
    run.steer(crate::scene::Inputs { tool_velocity: 50.0, ..at_rest.inputs }, super::monitor::NO_SLOPE)
        .run(5e-6, 5);
    soundness(sheet, "rate 0, then 1 mm/s, then 50 m/s", &run);
}

/// One point in a path of shear, over temperatures and rates.
fn points(sheet: &mut Sheet) {
    let constants = steel_4340();
    let melting = constants.melting_temperature;
    let (mut lowest, mut wrong, mut backwards) = (f64::MAX, 0, 0.0_f64);
    for temperature in [1.0, 200.0, constants.reference_temperature, melting - 1e-9, melting, 2.0 * melting] {
        for rate in [0.0, 1e-300, 1e-12, 1.0, 1e9] {
            let model = steel(&constants);
            let mut state =
                <<Steel as ConstitutiveModel<f64, PlaneStrain>>::State as PointState<f64>>::zeroed();
            for lane in 0..8 {
                ConstitutiveModel::<f64, PlaneStrain>::place(&model, &mut state, lane, temperature);
            }
            let mut strain = 0.0;
            for _ in 0..200 {
                // Of the strain, 1e-3 a step; what rate it is at is the substep's length. At rate 0 nothing
                // moves.
                let (h, dt) = if rate == 0.0 { (0.0, 1e-9) } else { (1e-3, 1e-3 / rate) };
                let work =
                    dispatch(InstructionSet::detect(), OnePoint { model: &model, state: &mut state, h, dt });
                let report = ConstitutiveModel::<f64, PlaneStrain>::report(&model, &state, 0);
                lowest = lowest.min(state.yield_stress[0]);
                let all = [state.yield_stress[0], report.plastic_strain, report.temperature, work];
                wrong += all.iter().chain(&report.stress).filter(|value| !value.is_finite()).count();
                backwards = backwards.max(strain - report.plastic_strain).max(-work);
                strain = report.plastic_strain;
            }
        }
    }
    let name = "point in shear, six temperatures, rates 0 to 1e9/s";
    sheet.at_least(format!("{name}: lowest flow stress"), lowest, "Pa", 0.0);
    sheet.at_most(format!("{name}: numbers that are none"), f64::from(wrong as u32), "", 0.0);
    sheet.at_most(format!("{name}: plastic strain or work given back"), backwards, "", 0.0);
}

/// A step of simple shear of the first point of a block.
struct OnePoint<'a> {
    model: &'a Steel,
    state: &'a mut <Steel as ConstitutiveModel<f64, PlaneStrain>>::State,
    h: f64,
    dt: f64,
}

impl Kernel<f64> for OnePoint<'_> {
    /// Plastic work per volume (J/m3).
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd<Scalar = f64>>(self) -> f64 {
        let OnePoint { model, state, h, dt } = self;
        let mut volume = [0.0; 8];
        volume[0] = 1.0;
        let zero = S::Lanes::splat(0.0);
        let gradient = [[zero, S::Lanes::splat(h)], [zero, zero]];
        let mut totals = StepSums::zero();
        let volume = S::Lanes::load(&volume);
        ConstitutiveModel::<f64, PlaneStrain>::update(model, state, 0, &gradient, dt, volume, &mut totals);
        totals.plastic_work.sum()
    }
}
