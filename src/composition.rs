//! From a scene to a solver: checks, the lattice of points, and the kernels for the effects the scene names.
//!
//! Each choice of the scene fixes one type parameter; what is not named becomes a type that does nothing:
//!
//! ```text
//!   precision × dimension × shape function × contact law × (rate × thermal) of the flow law  →  one Simulation
//! ```

use crate::contact::{RigidTool, SurfaceContact};
use crate::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use crate::error::Error;
use crate::grid::{FixedNodes, Layout, MARGIN};
use crate::inertia::MassScaling;
use crate::levels;
use crate::material::ConstitutiveModel;
use crate::material::effects::{
    Adiabatic, Isothermal, RateDependent, RateEffect, RateIndependent, Softening, ThermalEffect,
};
use crate::material::johnson_cook::JohnsonCook;
use crate::material::library;
use crate::partition::Partition;
use crate::points::{BLOCK, Block};
use crate::scene::{
    Accuracy, ContactChoice, DimensionChoice, Heat, Law, Precision, Scene, SceneKind, ShapeChoice,
};
use crate::shape::{Gimp, Linear, ShapeFunction};
use crate::simd::{InstructionSet, Real};
use crate::simulation::{Options, Simulation, Solver};
use crate::tool_shape::ToolShape;
use crate::window::ActiveWindow;

/// Checks what belongs together and refuses what this version does not have; fills in a library material's constants.
///
/// # Errors
/// `Error::NotAvailable`, `Error::Inconsistent` or `Error::OutOfRange`, naming the variable.
pub fn check(scene: &Scene) -> Result<Scene, Error> {
    refuse_missing(scene)?;
    let mut resolved = scene.clone();
    levels::pull(&mut resolved);
    resolved.material.constants = library::resolve(&scene.material)?;
    let workpiece = &scene.workpiece;
    let cell = cell(scene);
    let shortest = if scene.numerics.dimension == DimensionChoice::ThreeDimensional {
        workpiece.length.min(workpiece.height).min(workpiece.width)
    } else {
        workpiece.length.min(workpiece.height)
    };
    if shortest < 4.0 * cell {
        return Err(Error::Inconsistent(format!(
            "numerics.point_spacing = {} m is too coarse: the workpiece is {shortest} m in its shortest direction and \
             needs at least four cells of {} points each",
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
            "numerics.point_spacing = {spacing} m gives {points:.3e} points; at most {MOST_POINTS:.0e} are allowed"
        )));
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
            "numerics.shape_function = linear goes with numerics.precision = double and numerics.speed = exact only".into(),
        ));
    }
    check_feed(scene, scene.inputs.feed)?;
    Ok(resolved)
}

/// Most points of a scene: 3 GB; more would fill an engineer's machine before it says so.
const MOST_POINTS: f64 = 2e7;

/// Checks a feed (m) against the workpiece.
///
/// # Errors
/// `Error::OutOfRange` when less than two cells would be left below the tool.
pub fn check_feed(scene: &Scene, feed: f64) -> Result<(), Error> {
    let max = scene.workpiece.height - 2.0 * cell(scene);
    if (0.0..=max).contains(&feed) {
        Ok(())
    } else {
        Err(Error::OutOfRange { name: "feed".into(), asked: feed, min: 0.0, max, unit: "m" })
    }
}

/// Cell length (m).
fn cell(scene: &Scene) -> f64 {
    scene.numerics.point_spacing * f64::from(scene.numerics.points_per_cell_edge)
}

/// Refuses every value whose effect this version does not have.
fn refuse_missing(scene: &Scene) -> Result<(), Error> {
    let Scene { workpiece, effects, numerics, .. } = scene;
    let missing: [(bool, &str, &str, &str); 12] = [
        (scene.kind != SceneKind::Cut, "scene", "press or taylor", "cut"),
        (workpiece.endless, "workpiece.endless", "true", "false"),
        (workpiece.revolution_length > 0.0, "workpiece.revolution_length", "above 0", "0"),
        (scene.material.law != Law::JohnsonCook, "material.law", "johnson_cook_tanh", "johnson_cook"),
        (effects.heat == Heat::Conduction, "effects.heat", "conduction", "none, adiabatic"),
        (effects.tool_heat, "effects.tool_heat", "true", "false"),
        (effects.thermal_expansion, "effects.thermal_expansion", "true", "false"),
        (effects.damage, "effects.damage", "true", "false"),
        (effects.sticking, "effects.sticking", "true", "false"),
        (effects.artificial_viscosity, "effects.artificial_viscosity", "true", "false"),
        (numerics.contact != ContactChoice::Surface, "numerics.contact", "distance or velocity", "surface"),
        (numerics.accuracy != Accuracy::Custom, "numerics.accuracy", "a preset", "custom"),
    ];
    match missing.into_iter().find(|entry| entry.0) {
        Some((_, name, asked, allowed)) => {
            Err(Error::NotAvailable { name: name.into(), asked: asked.into(), allowed: allowed.into() })
        }
        None => Ok(()),
    }
}

/// One line on which effects run and why.
pub fn effects_summary(scene: &Scene) -> String {
    let constants = &scene.material.constants;
    let rate = if !scene.effects.rate {
        "rate off (effects.rate)"
    } else if constants.rate_coefficient == 0.0 {
        "rate off (its coefficient is 0)"
    } else {
        "rate on"
    };
    let heat = match (scene.effects.heat, scene.effects.thermal_softening) {
        (Heat::None, false) => "no temperature".into(),
        (Heat::None, true) => {
            format!("constant temperature {} K with its softening", scene.workpiece.initial_temperature)
        }
        (_, false) => "adiabatic heat without softening".to_string(),
        (_, true) => "adiabatic heat with softening".to_string(),
    };
    let locking = if scene.effects.volumetric_locking_control { ", volumetric locking control" } else { "" };
    let friction = if scene.inputs.friction == 0.0 { "friction 0 at the start" } else { "friction" };
    let mass_factor = MassScaling::of(scene).map_or(1.0, |s| s.wanted(scene.inputs.tool_velocity.abs()));
    let levers = levels::summary(scene, mass_factor);
    format!(
        "effects: plasticity ({}), {rate}, {heat}, {friction}{locking}; contact at the exact tool surface{}{levers}",
        scene.material.name,
        if levers.is_empty() { "" } else { "; " }
    )
}

/// Builds the solver of a scene that `check` has returned.
///
/// # Errors
/// `Error::Inconsistent` when the tool's shape is impossible.
pub fn build(scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    match scene.numerics.dimension {
        DimensionChoice::PlaneStrain => with_shape::<PlaneStrain>(scene),
        DimensionChoice::ThreeDimensional => with_shape::<ThreeDimensional>(scene),
    }
}

fn with_shape<D: Dimension>(scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    let edge = scene.numerics.points_per_cell_edge;
    match (scene.numerics.shape_function, scene.numerics.precision) {
        (ShapeChoice::Gimp, Precision::Double) => with_rate::<f64, D, _>(scene, Gimp::new(edge)),
        (ShapeChoice::Gimp, Precision::Single) => with_rate::<f32, D, _>(scene, Gimp::new(edge)),
        // `check` has refused single precision here: each combination is a kernel more to compile, and nobody needs this one.
        (ShapeChoice::Linear, _) => with_rate::<f64, D, _>(scene, Linear),
    }
}

fn with_rate<R: Real, D: Dimension, F: ShapeFunction<R>>(
    scene: &Scene,
    shape: F,
) -> Result<Box<dyn Solver>, Error> {
    let constants = &scene.material.constants;
    if scene.effects.rate && constants.rate_coefficient != 0.0 {
        let rate = RateDependent {
            coefficient: R::from_f64(constants.rate_coefficient),
            reference: R::from_f64(constants.reference_rate),
        };
        with_heat::<R, D, _, _>(scene, shape, rate)
    } else {
        with_heat::<R, D, _, _>(scene, shape, RateIndependent)
    }
}

fn with_heat<R: Real, D: Dimension, F: ShapeFunction<R>, Q: RateEffect<R>>(
    scene: &Scene,
    shape: F,
    rate: Q,
) -> Result<Box<dyn Solver>, Error> {
    let constants = &scene.material.constants;
    let softening = Softening {
        exponent: constants.thermal_exponent,
        reference: constants.reference_temperature,
        melting: constants.melting_temperature,
    };
    let initial = scene.workpiece.initial_temperature;
    let capacity = constants.density * constants.specific_heat;
    match (scene.effects.heat, scene.effects.thermal_softening) {
        (Heat::None, softens) => {
            let thermal = Isothermal { temperature: initial, softening: softens.then_some(softening) };
            finish::<R, D, _, _, _>(scene, shape, rate, thermal)
        }
        (_, true) => {
            let thermal = Adiabatic::<R, true>::new(constants.taylor_quinney, capacity, initial, softening);
            finish::<R, D, _, _, _>(scene, shape, rate, thermal)
        }
        (_, false) => {
            let thermal = Adiabatic::<R, false>::new(constants.taylor_quinney, capacity, initial, softening);
            finish::<R, D, _, _, _>(scene, shape, rate, thermal)
        }
    }
}

fn finish<R: Real, D: Dimension, F: ShapeFunction<R>, Q: RateEffect<R>, T: ThermalEffect<R>>(
    scene: &Scene,
    shape: F,
    rate: Q,
    thermal: T,
) -> Result<Box<dyn Solver>, Error> {
    let model = JohnsonCook::new(&scene.material.constants, rate, thermal);
    let partition = cutting_block::<R, D, _>(scene, &model);
    let tool = tool_before_workpiece(scene)?;
    let options = Options {
        courant: scene.numerics.courant,
        instructions: InstructionSet::detect(),
        locking_control: scene.effects.volumetric_locking_control,
        mass_scaling: MassScaling::of(scene),
        window: (scene.numerics.active_window > 0.0).then(|| ActiveWindow {
            ahead: scene.numerics.active_window,
            height: scene.workpiece.height,
            walls: partition.fixed.clone(),
        }),
    };
    let parts = (shape, model, SurfaceContact);
    Ok(Box::new(Simulation::new(partition, parts, tool, options)))
}

/// The workpiece as a lattice of points, its left and bottom nodes fixed.
///
/// A wall is only as long as the workpiece: a chip flies past it. It goes on behind its surface as far as points reach:
/// free nodes there would take the stress off points that press on it (test `the_period_converges`).
fn cutting_block<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
    scene: &Scene,
    model: &M,
) -> Partition<R, D, M::State> {
    let cell = cell(scene);
    let workpiece = &scene.workpiece;
    let size = [workpiece.length, workpiece.height, workpiece.width];
    // Room for the chip: a workpiece length to each side, three heights above; memory is used only where points are.
    let before = [workpiece.length, 0.25 * workpiece.height + 8.0 * cell, workpiece.width];
    let behind = [workpiece.length, 3.0 * workpiece.height, workpiece.width];
    let mut counts = [1; 3];
    let mut first = [0; 3];
    let mut origin = [0.0; 3];
    for axis in 0..D::AXES {
        first[axis] = (before[axis] / cell).ceil() as i32 + 4;
        origin[axis] = -cell * f64::from(first[axis]);
        counts[axis] = first[axis] + ((size[axis] + behind[axis]) / cell).ceil() as i32 + 4;
    }
    let last = |axis: usize| {
        if axis < D::AXES { first[axis] + (size[axis] / cell + 1e-9).floor() as i32 } else { 0 }
    };
    let everything = i32::MAX / 2;
    let depth = (-everything, everything);
    let left = FixedNodes {
        low: [first[0] - MARGIN, first[1] - MARGIN, depth.0],
        high: [first[0], last(1), depth.1],
        axes: [true; 3],
    };
    let bottom = FixedNodes {
        low: [first[0] - MARGIN, first[1] - MARGIN, depth.0],
        high: [last(0), first[1], depth.1],
        axes: [true; 3],
    };
    let blocks = lattice::<R, D, M>(scene, model, size, first, cell);
    Partition::new(Layout::new(counts, cell, origin), vec![left, bottom], blocks)
}

/// Points at the centres of equal boxes that fill the block exactly.
fn lattice<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
    scene: &Scene,
    model: &M,
    size: [f64; 3],
    first: [i32; 3],
    cell: f64,
) -> Vec<Block<R, D, M::State>> {
    let spacing = scene.numerics.point_spacing;
    let count: [usize; 3] =
        std::array::from_fn(|axis| if axis < D::AXES { (size[axis] / spacing).round() as usize } else { 1 });
    let step: [f64; 3] = std::array::from_fn(|axis| size[axis] / count[axis] as f64);
    let volume = step.iter().product::<f64>();
    let total = count.iter().product::<usize>();
    let mut blocks = vec![Block::empty(); total.div_ceil(BLOCK)];
    for number in 0..total {
        let index = [number / (count[1] * count[2]), number / count[2] % count[1], number % count[2]];
        let (block, lane) = (&mut blocks[number / BLOCK], number % BLOCK);
        let position =
            D::vector(|axis| f64::from(first[axis]) + (index[axis] as f64 + 0.5) * step[axis] / cell);
        block.set_grid_position(lane, position);
        block.volume[lane] = R::from_f64(volume);
        block.id[lane] = number as u32;
        model.place(&mut block.state, lane, scene.workpiece.initial_temperature);
    }
    blocks
}

/// The tool at its feed, its foremost part within the feed `tool.initial_gap` ahead of the workpiece's right side.
fn tool_before_workpiece(scene: &Scene) -> Result<RigidTool, Error> {
    let tool = &scene.tool;
    let shape =
        ToolShape::new(tool.rake_angle, tool.clearance_angle, tool.edge_radius, tool.length, tool.height)?;
    let feed = scene.inputs.feed;
    let (start, direction) = (shape.rake_start(), shape.rake_direction());
    // A face that leans forward is foremost at the workpiece's top, otherwise the edge is.
    let on_rake = start[0] + direction[0] / direction[1] * (feed.min(tool.height) - start[1]).max(0.0);
    let edge = shape.outline(64).into_iter().filter(|point| point[1] <= feed);
    let foremost = edge.map(|point| point[0]).fold(on_rake, f64::min);
    let position = [scene.workpiece.length + tool.initial_gap - foremost, scene.workpiece.height - feed];
    Ok(RigidTool { shape, position, velocity: [0.0; 2], friction: scene.inputs.friction })
}
