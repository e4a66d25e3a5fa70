//! Speed levels: which speed-ups `numerics.speed` takes.
//!
//! | level | precision | Courant number | active window | active chip | mass scaling |
//! |---|---|---|---|---|---|
//! | exact | double | as given | none | all | none |
//! | balanced | single | 0.54 | 3 feeds ahead | 3 feeds | none |
//! | fast | single | 0.54, or 1.1 with smoothed increments | 2.5 feeds ahead | 2 feeds | automatic, 1 % of the cutting force, or 0.5 % |
//!
//! Increments are smoothed where they can be (`Numerics::can_smooth`) and the Courant number was not set by
//! hand; that alone changes up to 1.1 % of the force, so that less is left for mass scaling.
//!
//! A level sets a parameter that stands at its start value; one that was set by hand keeps what it was set
//! to. A Courant number that was not set by hand ends at the scheme's limit for the material
//! (`setup::courant_limit`), 0.5485 for the reference cut. What each level costs in accuracy is in the book
//! (Evidence, performance).

use crate::scene::presets::PRESETS;
use crate::scene::{Numerics, Precision, Scene, Speed};

/// The scene with its level's speed-ups applied; doing it again changes nothing.
pub fn apply(scene: &mut Scene) {
    let start = Scene::default().numerics;
    let numerics = &mut scene.numerics;
    let is_smoothed = numerics.courant == start.courant && numerics.can_smooth();
    let speedups = match numerics.speed {
        Speed::Exact => return,
        Speed::Balanced => Numerics {
            precision: Precision::Single,
            courant: 0.54,
            active_window: 3.0,
            active_chip: 3.0,
            ..start.clone()
        },
        Speed::Fast => Numerics {
            precision: Precision::Single,
            smoothed_increments: is_smoothed,
            courant: if is_smoothed { 1.1 } else { 0.54 },
            // At 2.25 and 10 µm, without friction, a fragment that the flank pushes at first stayed there for
            // good (-3 % of the force).
            active_window: 2.5,
            active_chip: 2.0,
            mass_scaling: 0.0,
            inertia_error: if is_smoothed { 0.005 } else { 0.01 },
            ..start.clone()
        },
    };
    let set = |value: &mut f64, start: f64, value_set: f64| {
        if *value == start {
            *value = value_set;
        }
    };
    if numerics.precision == start.precision {
        numerics.precision = speedups.precision;
    }
    numerics.smoothed_increments |= speedups.smoothed_increments;
    set(&mut numerics.courant, start.courant, speedups.courant);
    set(&mut numerics.active_window, start.active_window, speedups.active_window);
    set(&mut numerics.active_chip, start.active_chip, speedups.active_chip);
    // A share of the force set by hand is kept; a factor set by hand needs none.
    if numerics.mass_scaling == start.mass_scaling {
        numerics.mass_scaling = speedups.mass_scaling;
        set(&mut numerics.inertia_error, start.inertia_error, speedups.inertia_error);
    }
}

/// What runs beside the plain scheme, in words; empty for nothing.
pub fn summary(scene: &Scene, mass_factor: f64) -> String {
    let numerics = &scene.numerics;
    let mut parts = Vec::new();
    if let Some(preset) = PRESETS.iter().find(|preset| preset.accuracy == numerics.accuracy) {
        parts.push(format!("preset {}: points {} m apart", preset.name, numerics.point_spacing));
    }
    if numerics.precision == Precision::Single {
        parts.push("single precision".to_owned());
    }
    if numerics.smoothed_increments {
        parts.push("smoothed increments".to_owned());
    }
    if numerics.courant != Scene::default().numerics.courant {
        parts.push(format!("Courant number {:.3}", numerics.courant));
    }
    if numerics.active_window > 0.0 {
        parts.push(format!("active window {} feeds ahead of the tool", numerics.active_window));
    }
    if numerics.active_chip > 0.0 {
        parts.push(format!("chip integrated up to {} feeds above the tool's edge", numerics.active_chip));
    }
    if numerics.mass_scaling == 0.0 {
        let (speed, share) = (scene.inputs.tool_velocity, 100.0 * numerics.inertia_error);
        parts.push(format!(
            "automatic mass scaling, a factor of {mass_factor:.3} at {speed} m/s for {share} % of the \
             cutting force"
        ));
    } else if numerics.mass_scaling != 1.0 {
        parts.push(format!("mass scaled by {}", numerics.mass_scaling));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{DimensionChoice, Formulation};

    /// A level sets what stands at its start and nothing else, and pulling twice is pulling once: states are
    /// restored by checking the scene again.
    #[test]
    fn levels_leave_what_was_set_by_hand() {
        for speed in [Speed::Exact, Speed::Balanced, Speed::Fast] {
            let mut scene = Scene::default();
            scene.numerics.speed = speed;
            (scene.numerics.active_window, scene.numerics.mass_scaling) = (7.0, 3.0);
            apply(&mut scene);
            let once = scene.clone();
            apply(&mut scene);
            assert_eq!(scene, once, "{speed:?} pulled twice");
            assert_eq!((scene.numerics.active_window, scene.numerics.mass_scaling), (7.0, 3.0), "{speed:?}");
            assert!(!scene.numerics.smoothed_increments, "{speed:?}");
            let is_single = scene.numerics.precision == Precision::Single;
            assert_eq!(is_single, speed != Speed::Exact, "{speed:?}");
        }
    }

    /// Smoothing goes with its own Courant number: one that was set by hand, and scenes that cannot smooth,
    /// have increments as they are.
    #[test]
    fn fast_smooths_where_it_can() {
        let mut plain = Scene::default();
        plain.numerics.formulation = Formulation::Plain;
        let mut by_hand = plain.clone();
        by_hand.numerics.courant = 0.4;
        let mut in_space = plain.clone();
        in_space.numerics.dimension = DimensionChoice::ThreeDimensional;
        plain.numerics.speed = Speed::Fast;
        apply(&mut plain);
        assert!(plain.numerics.smoothed_increments, "plain increments can be smoothed");
        for (mut scene, courant) in [(by_hand, 0.4), (in_space, 0.54), (Scene::default(), 0.54)] {
            scene.numerics.speed = Speed::Fast;
            apply(&mut scene);
            let Numerics { smoothed_increments, inertia_error, .. } = scene.numerics;
            assert_eq!((smoothed_increments, scene.numerics.courant, inertia_error), (false, courant, 0.01));
        }
    }
}
