//! Uniform stretching until points part.
//!
//! A bar whose points fly apart, v = ε̇ (X - L/2), held against motion across: uniaxial strain at the stretch
//! λ = 1 + ε̇ t. While its ends have not been heard of, no force acts in its middle, where the stress is that
//! of the law at J = λ,
//!
//! σ = (4/3 μ ln λ + κ/2 (λ² - 1))/λ, or with 2/3 Y in the place of the first term once that is reached.
//!
//! Points keep their square (`grid::shape_function`), so from some stretch on the grid does not see a closed
//! body any more. Up to `KNOWN` no gap opens, a gap being a distance of neighbours of more than 1.02 of what
//! the stretch makes it.

use super::{Setting, Sheet};
use crate::dimension::PlaneStrain;
use crate::grid::FixedNodes;
use crate::grid::shape_function::Gimp;
use crate::scene::Constants;
use crate::simulation::Solver;
use crate::study::body_setup::{
    BodySetup, NO_MOTION, distant_tool, lattice, never_yielding, perfectly_plastic, points, steel, steel_4340,
};

/// The stretch up to which points are known to carry the body's stress (-); book/src/evidence/hard-cases.md.
pub const KNOWN: f64 = 1.1;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let cells = setting.pick(64, 128);
    stretch(sheet, "elastic", &never_yielding(steel_4340()), cells);
    stretch(sheet, "perfectly plastic", &perfectly_plastic(steel_4340()), cells);
}

/// The law's stress along the bar (Pa).
fn exact(c: &Constants, stretch: f64) -> f64 {
    let bulk = c.youngs_modulus / (3.0 * (1.0 - 2.0 * c.poissons_ratio));
    let shear = c.youngs_modulus / (2.0 * (1.0 + c.poissons_ratio));
    let deviator = (4.0 / 3.0 * shear * stretch.ln()).min(2.0 / 3.0 * c.yield_stress);
    (deviator + 0.5 * bulk * (stretch * stretch - 1.0)) / stretch
}

/// Stretches a bar of `cells` by two cells to twice its length.
fn stretch(sheet: &mut Sheet, name: &str, c: &Constants, cells: usize) {
    const CELL: f64 = 2e-5;
    const END: f64 = 2.0;
    let length = cells as f64 * CELL;
    let model = steel(c);
    let sound = crate::material::ConstitutiveModel::<f64, PlaneStrain>::sound_speed(&model, 1.0);
    // Waves from the ends reach the middle quarter at a stretch of 1 + 0.75 v/c; they run faster in stretched
    // elastic material.
    let end_speed = 2.5 * sound;
    let rate = 2.0 * end_speed / length;
    let half = 0.5 * length * (END - 1.0);
    let mut setup = BodySetup::around([-half, 0.0], [length + half, 2.0 * CELL], CELL);
    let everything = i32::MAX / 2;
    setup.fixed.push(FixedNodes {
        low: [-everything, -everything, 0],
        high: [everything, everything, 0],
        axes: [false, true, false],
    });
    let mut seeds = lattice([0.0; 3], [2 * cells, 4, 1], CELL / 2.0, 2);
    for seed in &mut seeds {
        seed.velocity[0] = rate * (seed.position[0] - 0.5 * length);
    }
    let mut bar =
        setup.simulation::<PlaneStrain, _, _>((Gimp::new(2), model), distant_tool(), &seeds, |_, _, _| {});
    let middle = 2 * cells * 3 / 8..2 * cells * 5 / 8;
    let (mut error, mut closed, mut exact_to) = (String::new(), f64::NAN, f64::NAN);
    let (mut stress_at_known, mut gap_at_known) = (0.0_f64, 0.0_f64);
    loop {
        if let Err(e) = bar.step(&NO_MOTION, false) {
            error = e.to_string();
            break;
        }
        let stretch = 1.0 + rate * bar.progress().clock;
        if stretch > END {
            break;
        }
        let now = points(&bar);
        let wanted = exact(c, stretch);
        let (mut off, mut gap) = (0.0_f64, 0.0_f64);
        for column in middle.clone() {
            let point = &now[4 * column + 1];
            off = off.max((point.report.stress[0] / wanted - 1.0).abs());
            let next = now[4 * (column + 1) + 1].position[0] - point.position[0];
            gap = gap.max(next / (0.5 * CELL * stretch) - 1.0);
        }
        if stretch <= KNOWN {
            // At first yield strains are small, and so is what 2 % of the stress are.
            if stretch > 1.01 {
                stress_at_known = stress_at_known.max(off);
            }
            gap_at_known = gap_at_known.max(gap);
        }
        if gap > 0.02 && closed.is_nan() {
            closed = stretch;
        }
        if off > 0.02 && stretch > 1.01 && exact_to.is_nan() {
            exact_to = stretch;
        }
    }
    let none_if_ended = |value: f64| if error.is_empty() { value } else { f64::NAN };
    let retries = i32::try_from(bar.progress().retries).unwrap_or(i32::MAX);
    let figure = sheet.at_most(
        format!("{name}: largest error of the stress up to a stretch of {KNOWN}"),
        none_if_ended(100.0 * stress_at_known),
        "%",
        2.0,
    );
    figure.retried(retries).remarked(error.clone());
    let gap = none_if_ended(100.0 * gap_at_known);
    sheet.at_most(format!("{name}: widest gap up to a stretch of {KNOWN}"), gap, "%", 2.0).retried(retries);
    let or_end = |value: f64| if value.is_nan() { END } else { value };
    sheet.show(format!("{name}: stretch at which the stress is off by 2 %"), or_end(exact_to), "");
    sheet.show(format!("{name}: stretch at which a gap of 2 % opens"), or_end(closed), "");
}
