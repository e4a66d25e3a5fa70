//! What a scene may not ask for: values that do not belong together, and what this version does not have.

use crate::dimension::{PlaneStrain, ThreeDimensional};
use crate::error::{Error, ZERO_CELSIUS};
use crate::grid::shape_function::Gimp;
use crate::material::library;
use crate::scene::presets;
use crate::scene::speed_levels;
use crate::scene::{
    ContactChoice, DimensionChoice, Heat, Law, Precision, Scene, ShapeChoice, TransferChoice,
};
use crate::setup::{courant_limit, process_of};
use crate::speedups::rigid_chip::LEAST_REACH;
use crate::variables::settings;

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
    if scene.effects.tool_heat && scene.effects.heat != Heat::Conduction {
        return Err(Error::Inconsistent(
            "effects.tool_heat = true needs heat that flows: effects.heat = conduction".into(),
        ));
    }
    if scene.effects.thermal_expansion && scene.effects.heat == Heat::None {
        return Err(Error::Inconsistent(
            "effects.thermal_expansion = true needs a temperature that changes: effects.heat = adiabatic or \
             conduction"
                .into(),
        ));
    }
    let constants = &resolved.material.constants;
    if scene.effects.thermal_softening && constants.melting_temperature <= constants.reference_temperature {
        return Err(Error::Inconsistent(format!(
            "material.melting_temperature = {} K must lie above material.reference_temperature = {} K",
            constants.melting_temperature, constants.reference_temperature
        )));
    }
    if resolved.numerics.shape_function == ShapeChoice::Linear
        && resolved.numerics.precision == Precision::Single
    {
        return Err(Error::Inconsistent(
            "numerics.shape_function = linear goes with numerics.precision = double and numerics.speed = \
             exact only"
                .into(),
        ));
    }
    limit_courant(&mut resolved, asked_courant)?;
    check_contact(&resolved)?;
    check_affine(&resolved)?;
    check_smoothing(&resolved)?;
    check_chip(&resolved)?;
    refuse_rare(&resolved)?;
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
    cold.into_iter().collect()
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

/// Refuses what the paper's own contact laws do not go with.
fn check_contact(scene: &Scene) -> Result<(), Error> {
    let name = match scene.numerics.contact {
        ContactChoice::Surface => return Ok(()),
        ContactChoice::Distance => "distance",
        ContactChoice::Velocity => "velocity",
    };
    let refuse = |text: &str| Err(Error::Inconsistent(format!("numerics.contact = {name} {text}")));
    if scene.numerics.points_per_cell_edge != 2 {
        return refuse(
            "goes with numerics.points_per_cell_edge = 2 only: its tool is made of points half a cell apart, \
             and bodies touch where their points are that close",
        );
    }
    if scene.effects.sticking {
        return refuse(
            "goes with effects.sticking = false only: the shear strength is that of touching points, of \
             which nodes know nothing",
        );
    }
    if scene.effects.tool_heat {
        return refuse(
            "goes with effects.tool_heat = false only: heat flows where points touch the tool, and this law \
             acts on nodes",
        );
    }
    Ok(())
}

/// Refuses all but one combination with the affine transfer: each is a kernel more to compile.
fn check_affine(scene: &Scene) -> Result<(), Error> {
    let Scene { effects, numerics, .. } = scene;
    let fits = numerics.dimension == DimensionChoice::PlaneStrain
        && numerics.shape_function == ShapeChoice::Gimp
        && numerics.precision == Precision::Double
        && effects.rate
        && effects.heat == Heat::Adiabatic
        && effects.thermal_softening
        && scene.material.law == Law::JohnsonCook
        && !effects.damage
        && !effects.artificial_viscosity;
    if numerics.transfer == TransferChoice::Flip || fits {
        return Ok(());
    }
    Err(Error::Inconsistent(
        "numerics.transfer = apic goes with numerics.dimension = plane_strain, numerics.shape_function = \
         gimp, numerics.precision = double (numerics.speed = exact), effects.rate = true, effects.heat = \
         adiabatic, effects.thermal_softening = true, material.law = johnson_cook and neither effects.damage \
         nor effects.artificial_viscosity only"
            .into(),
    ))
}

/// Refuses smoothed increments where nodes do not keep the masses that they share.
fn check_smoothing(scene: &Scene) -> Result<(), Error> {
    if scene.numerics.can_smooth() || !scene.numerics.smoothed_increments {
        return Ok(());
    }
    Err(Error::Inconsistent(
        "numerics.smoothed_increments = true goes with numerics.dimension = plane_strain, numerics.shape_function = gimp, \
         numerics.transfer = flip and numerics.formulation = plain only"
            .into(),
    ))
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

/// Refuses combinations of effects that no kernel is compiled for.
fn refuse_rare(scene: &Scene) -> Result<(), Error> {
    let Scene { effects, numerics, .. } = scene;
    let law = scene.material.law;
    let is_plain = law == Law::JohnsonCook;
    let name = if !is_plain {
        format!("material.law = {}", law.name())
    } else if effects.damage {
        "effects.damage = true".into()
    } else if effects.artificial_viscosity {
        "effects.artificial_viscosity = true".into()
    } else {
        return Ok(());
    };
    let refuse = |text: String| Err(Error::Inconsistent(text));
    if numerics.shape_function == ShapeChoice::Linear {
        return refuse(format!("{name} goes with numerics.shape_function = gimp only"));
    }
    if !is_plain && !effects.thermal_softening {
        return refuse(format!("{name} softens with temperature and needs effects.thermal_softening = true"));
    }
    if law == Law::ZerilliArmstrong && effects.damage {
        return refuse(format!("{name} goes with effects.damage = false only"));
    }
    if effects.damage && effects.thermal_expansion {
        return refuse("effects.damage = true goes with effects.thermal_expansion = false only".into());
    }
    if effects.artificial_viscosity && (!is_plain || effects.damage) {
        return refuse(
            "effects.artificial_viscosity = true goes with material.law = johnson_cook and effects.damage = \
             false only"
                .into(),
        );
    }
    Ok(())
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
}
