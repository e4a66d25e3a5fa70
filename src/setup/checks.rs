//! What a scene may not ask for: values that do not belong together, and what this version does not have.

use crate::dimension::{PlaneStrain, ThreeDimensional};
use crate::error::{Error, ZERO_CELSIUS};
use crate::grid::shape_function::Gimp;
use crate::material::library;
use crate::scene::presets;
use crate::scene::speed_levels;
use crate::scene::{DimensionChoice, Formulation, Scene, ShapeChoice};
use crate::setup::{combinations, courant_limit, process_of};
use crate::speedups::rigid_chip::LEAST_REACH;
use crate::variables::{length_text, settings, time_text};

/// Takes the settings over, checks what belongs together and refuses what this version does not have; fills
/// in a library material's constants.
///
/// # Errors
/// `Error::NotAvailable`, `Error::Inconsistent` or `Error::OutOfRange`, naming the variable.
pub fn check(scene: &Scene) -> Result<Scene, Error> {
    let scene = &settings::take_over(scene)?.0;
    let process = process_of(scene.kind)?;
    process.check(scene)?;
    let asked_courant = scene.numerics.courant;
    let mut resolved = scene.clone();
    presets::take_preset(&mut resolved);
    if !resolved.numerics.separates() {
        resolved.numerics.formulation = Formulation::Plain;
    }
    speed_levels::apply(&mut resolved);
    resolved.material.constants = library::resolve(&scene.material)?;
    resolved.material.name = library::known_name(&scene.material.name).into();
    // From here on what is in use counts, not what was asked for.
    let scene = &resolved;
    let workpiece = &scene.workpiece;
    let cell = scene.numerics.cell();
    let shortest = if scene.numerics.dimension == DimensionChoice::ThreeDimensional {
        workpiece.length.min(workpiece.height).min(workpiece.width)
    } else {
        workpiece.length.min(workpiece.height)
    };
    if shortest < 4.0 * cell {
        return Err(Error::Inconsistent(format!(
            "numerics.point_spacing = {} m is too coarse: the workpiece is {shortest} m in its shortest \
             direction and needs at least four cells of {} points each",
            scene.numerics.point_spacing, scene.numerics.points_per_cell_edge
        )));
    }
    let spacing = scene.numerics.point_spacing;
    let width = if scene.numerics.dimension == DimensionChoice::ThreeDimensional {
        workpiece.width / spacing
    } else {
        1.0
    };
    let points = workpiece.length / spacing * workpiece.height / spacing * width;
    if points > MOST_POINTS {
        return Err(Error::Inconsistent(format!(
            "numerics.point_spacing = {spacing} m gives {points:.3e} points; at most {MOST_POINTS:.0e} are \
             allowed"
        )));
    }
    let constants = &resolved.material.constants;
    if scene.effects.thermal_softening && constants.melting_temperature <= constants.reference_temperature {
        return Err(Error::Inconsistent(format!(
            "material.melting_temperature = {} K must lie above material.reference_temperature = {} K",
            constants.melting_temperature, constants.reference_temperature
        )));
    }
    combinations::check(&resolved)?;
    limit_courant(&mut resolved, asked_courant)?;
    check_chip(&resolved)?;
    process.check_inputs(&resolved, &resolved.inputs)?;
    Ok(resolved)
}

/// Coldest workpiece (K) that is taken for meant: below, somebody has probably written degrees Celsius.
const COLD: f64 = 200.0;

/// What is allowed in a scene that `check` has returned, and yet is probably not what was meant.
pub fn warnings(scene: &Scene) -> Vec<String> {
    let temperature = scene.workpiece.initial_temperature;
    let cold = (temperature < COLD).then(|| {
        format!(
            "workpiece.initial_temperature = {temperature} K is below {COLD} K; SI: kelvin; {temperature} \
             degC is {:.2} K",
            temperature + ZERO_CELSIUS
        )
    });
    let spacing = scene.numerics.point_spacing;
    let feed = scene.inputs.feed;
    let lengths = [("feed", feed), ("tool.edge_radius", scene.tool.edge_radius)];
    let coarse =
        lengths.into_iter().filter(|(_, length)| *length > 0.0 && *length < presets::resolved(scene));
    let coarse = coarse.map(|(name, length)| {
        format!(
            "{name} = {} holds {:.1} point spacings of {} and needs {} at least for the force to mean anything; \
             numerics.point_spacing = {} or less would do",
            length_text(length),
            length / spacing,
            length_text(spacing),
            presets::LEAST_SPACINGS,
            length_text(length / presets::LEAST_SPACINGS)
        )
    });
    let limit = scene.numerics.wall_time_limit;
    let limited = (limit > 0.0).then(|| {
        format!(
            "numerics.wall_time_limit = {}: a step that takes longer is cut short and returns fmi2Discard, from which \
             only a master that asks for fmi2LastSuccessfulTime can go on; FMPy and libcosim end there, OMSimulator \
             records a part of the step as the whole; 0 sets no limit",
            time_text(limit)
        )
    });
    cold.into_iter().chain(coarse).chain(limited).collect()
}

/// Keeps the Courant number within the scheme's limit; one set by hand that is above it is refused.
fn limit_courant(scene: &mut Scene, asked: f64) -> Result<(), Error> {
    let limit = courant_limit(scene);
    if asked > limit && asked != Scene::default().numerics.courant {
        return Err(Error::Inconsistent(format!(
            "numerics.courant = {asked} is above the stability limit of the scheme, {limit:.4} with \
             material.poissons_ratio = {} and numerics.points_per_cell_edge = {}",
            scene.material.constants.poissons_ratio, scene.numerics.points_per_cell_edge
        )));
    }
    scene.numerics.courant = scene.numerics.courant.min(limit);
    Ok(())
}

/// The largest Courant number (-) at which a workpiece of the scene's material is stable
/// (`setup::courant_limit`).
fn courant_limit(scene: &Scene) -> f64 {
    // Cells along each edge of a block whose corners know little of one another.
    const PLANE: [usize; 3] = [6, 6, 1];
    const SPACE: [usize; 3] = [4, 4, 4];
    let (per_edge, ratio) = (scene.numerics.points_per_cell_edge, scene.material.constants.poissons_ratio);
    let shape = Gimp::new(per_edge);
    match (scene.numerics.shape_function, scene.numerics.dimension) {
        // Its slopes jump where a point crosses a face, and no step is short enough; what no material has
        // with GIMP and plain increments has to do.
        (ShapeChoice::Linear, _) => 0.6,
        (ShapeChoice::Gimp, DimensionChoice::PlaneStrain) => {
            let smoothed = scene.numerics.smoothed_increments;
            courant_limit::largest_courant::<PlaneStrain, _>(&shape, per_edge, PLANE, ratio, smoothed)
        }
        (ShapeChoice::Gimp, DimensionChoice::ThreeDimensional) => {
            courant_limit::largest_courant::<ThreeDimensional, _>(&shape, per_edge, SPACE, ratio, false)
        }
    }
}

/// Refuses to integrate so little of the chip that the workpiece before the tool would be taken for it.
fn check_chip(scene: &Scene) -> Result<(), Error> {
    let above = scene.numerics.active_chip;
    if above == 0.0 || above >= LEAST_REACH {
        return Ok(());
    }
    Err(Error::Inconsistent(format!(
        "numerics.active_chip = {above} is below {LEAST_REACH} feeds, so near the bulge of the workpiece \
         before the tool that this may be taken for chip; 0 integrates the whole chip"
    )))
}

/// Most points of a scene: 3 GB; more would fill an engineer's machine before it says so.
const MOST_POINTS: f64 = 2e7;

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 is allowed, and is seldom meant to be kelvin.
    #[test]
    fn a_workpiece_that_is_colder_than_any_workshop_is_told() {
        let mut scene = Scene::default();
        assert_eq!(warnings(&scene), Vec::<String>::new());
        scene.workpiece.initial_temperature = 20.0;
        let text = warnings(&check(&scene).unwrap()).join("\n");
        assert!(text.starts_with("workpiece.initial_temperature = 20 K is below 200 K"), "{text}");
        assert!(text.ends_with("SI: kelvin; 20 degC is 293.15 K"), "{text}");
    }

    /// A master that ignores fmi2Discard records nonsense in silence, so the limit is told before it acts.
    #[test]
    fn a_wall_time_limit_is_told() {
        let mut scene = Scene::default();
        scene.numerics.wall_time_limit = 0.5;
        let texts = warnings(&check(&scene).unwrap());
        assert_eq!(texts.len(), 1, "{texts:?}");
        assert!(
            texts[0].starts_with("numerics.wall_time_limit = 500 ms: a step that takes longer"),
            "{texts:?}"
        );
    }

    /// Three points through the feed or the edge are no shape; who asks for them learns what would do.
    #[test]
    fn what_the_points_do_not_resolve_is_told() {
        let mut scene = Scene::default();
        (scene.inputs.feed, scene.tool.edge_radius) = (1e-4, 2e-5);
        scene.numerics.point_spacing = 4e-5;
        let texts = warnings(&check(&scene).unwrap());
        let expected = [
            "feed = 100 µm holds 2.5 point spacings of 40 µm and needs 4",
            "tool.edge_radius = 20 µm holds 0.5 point spacings of 40 µm and needs 4",
        ];
        assert_eq!(texts.len(), 2, "{texts:?}");
        for (text, expected) in texts.iter().zip(expected) {
            assert!(text.starts_with(expected), "{text}");
        }
        assert!(texts[1].ends_with("numerics.point_spacing = 5 µm or less would do"), "{}", texts[1]);
        // At four it is quiet, and so it is for a sharp edge and a lifted tool.
        (scene.inputs.feed, scene.tool.edge_radius) = (1.6e-4, 0.0);
        assert_eq!(warnings(&check(&scene).unwrap()), Vec::<String>::new());
        scene.inputs.feed = -1e-5;
        assert_eq!(warnings(&check(&scene).unwrap()), Vec::<String>::new());
    }
}
