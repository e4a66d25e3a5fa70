//! From a scene to a solver: the lattice of points, and the kernels for the effects the scene names.
//!
//! Each choice of the scene fixes one type parameter; what is not named becomes a type that does nothing:
//!
//! ```text
//!   precision × dimension × shape function × flow law × damage  →  one Simulation
//! ```
//!
//! Each combination is a kernel to compile for every instruction set, so rate and heat are chosen for Johnson
//! and Cook's law in the plane with GIMP only. Everything else - other laws, damage, artificial viscosity,
//! three dimensions, linear shape functions - runs in the one kernel with rate and adiabatic heat, and what
//! the scene lacks of these is taken out by constants (`constants_in_use`).
//!
//! * this file: the choice of kernel; `cut` and `process`: what a scene builds; `checks`: what it may not
//!   ask for; `combinations`: what goes only with what;
//! * `courant_limit`: the stable substep; `effects_summary`: the log's line on effects.
//!
//! What may be touched: a scene is a type that implements `Process`; a flow law is an arm of `with_law`;
//! every combination that is not compiled is a rule of `combinations`, which refuses it by name.

pub mod checks;
mod combinations;
pub mod courant_limit;
mod cut;
mod effects_summary;
pub(crate) mod process;

pub use effects_summary::effects_summary;

use crate::chip_separation::ChipSeparation;
use crate::contact;
use crate::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use crate::error::Error;
use crate::grid::Layout;
use crate::grid::shape_function::{Gimp, Linear, ShapeFunction};
use crate::heat::HeatConduction;
use crate::heat::tool::{ToolBody, ToolMaterial};
use crate::material::ConstitutiveModel;
use crate::material::damage::JohnsonCookDamage;
use crate::material::effects::{Adiabatic, Isothermal, Softening, ThermalEffect};
use crate::material::flow_law::FlowLaw;
use crate::material::hardening::{Hardening, PowerLaw, TanhLaw};
use crate::material::j2_plasticity::J2Plasticity;
use crate::material::multiplicative::{Multiplicative, WithRateAndHeat};
use crate::material::rate::{RateDependent, RateEffect, RateIndependent};
use crate::material::viscosity::Viscous;
use crate::material::zerilli_armstrong::ZerilliArmstrong;
use crate::partition::Partition;
use crate::points::{BLOCK, Block};
use crate::scene::{
    Constants, DimensionChoice, Heat, Law, Precision, Scene, SceneKind, ShapeChoice, TransferChoice,
};
use crate::simd::{InstructionSet, Real};
use crate::simulation::{Options, Simulation, Solver};
use crate::speedups::active_window::ActiveWindow;
use crate::speedups::mass_scaling::MassScaling;
use crate::speedups::rigid_chip::ChipTail;
use crate::transfer::apic::Affine;
use cut::Cut;
use process::{Bodies, Process};

/// The process of a kind.
///
/// # Errors
/// `Error::NotAvailable` for one that this version does not have.
pub fn process_of(kind: SceneKind) -> Result<&'static dyn Process, Error> {
    match kind {
        SceneKind::Cut => Ok(&Cut),
        SceneKind::Press | SceneKind::Taylor => Err(Error::NotAvailable {
            name: "scene".into(),
            asked: "press or taylor".into(),
            allowed: "cut".into(),
        }),
    }
}

/// Builds the solver of a scene that `check` has returned.
///
/// # Errors
/// `Error::Inconsistent` when the tool's shape is impossible.
pub fn build(scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    if cfg!(all(feature = "reference-kernel", not(feature = "kernels"), not(test))) {
        return reference(scene);
    }
    if scene.numerics.transfer == TransferChoice::Apic {
        return affine(scene);
    }
    match (scene.numerics.dimension, scene.numerics.precision) {
        (DimensionChoice::PlaneStrain, Precision::Double) => {
            with_shape::<f64, PlaneStrain>(scene, with_rate::<f64>)
        }
        (DimensionChoice::PlaneStrain, Precision::Single) => {
            with_shape::<f32, PlaneStrain>(scene, with_rate::<f32>)
        }
        (DimensionChoice::ThreeDimensional, Precision::Double) => {
            with_shape::<f64, ThreeDimensional>(scene, without_choice::<_, ThreeDimensional, _>)
        }
        (DimensionChoice::ThreeDimensional, Precision::Single) => {
            with_shape::<f32, ThreeDimensional>(scene, without_choice::<_, ThreeDimensional, _>)
        }
    }
}

/// Builds a solver with GIMP.
type Build<R> = fn(&Scene, Gimp<R>) -> Result<Box<dyn Solver>, Error>;

/// `plain` builds what runs Johnson and Cook's law alone.
fn with_shape<R: Real, D: Dimension>(scene: &Scene, plain: Build<R>) -> Result<Box<dyn Solver>, Error> {
    match scene.numerics.shape_function {
        ShapeChoice::Gimp => with_law::<R, D>(scene, Gimp::new(scene.numerics.points_per_cell_edge), plain),
        // `check` has refused single precision here.
        ShapeChoice::Linear => without_choice::<f64, D, _>(scene, Linear),
    }
}

/// Johnson and Cook's law in the one kernel with rate and adiabatic heat.
fn without_choice<R: Real, D: Dimension, F: ShapeFunction<R>>(
    scene: &Scene,
    shape: F,
) -> Result<Box<dyn Solver>, Error> {
    let model = undamaged(scene, product::<R, PowerLaw<R>>(scene));
    assemble::<R, D, _, _>(scene, shape, model)
}

/// The one kernel with the affine transfer that `check_affine` lets pass.
fn affine(scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    let model = Affine(undamaged(scene, product::<f64, PowerLaw<f64>>(scene)));
    assemble::<f64, PlaneStrain, _, _>(scene, Gimp::new(scene.numerics.points_per_cell_edge), model)
}

/// The flow law a scene names, in the one kernel with rate and adiabatic heat that each has.
fn with_law<R: Real, D: Dimension>(
    scene: &Scene,
    shape: Gimp<R>,
    plain: Build<R>,
) -> Result<Box<dyn Solver>, Error> {
    let effects = &scene.effects;
    match (scene.material.law, effects.damage) {
        (Law::JohnsonCook, true) => damaged::<R, D, _>(scene, shape, product::<R, PowerLaw<R>>(scene)),
        (Law::JohnsonCookTanh, true) => damaged::<R, D, _>(scene, shape, product::<R, TanhLaw<R>>(scene)),
        (Law::JohnsonCookTanh, false) => {
            let model = undamaged(scene, product::<R, TanhLaw<R>>(scene));
            assemble::<R, D, _, _>(scene, shape, model)
        }
        // `check` has refused damage here.
        (Law::ZerilliArmstrong, _) => {
            let constants = constants_in_use(scene);
            let law = ZerilliArmstrong::new(&constants, adiabatic(scene, &constants));
            assemble::<R, D, _, _>(scene, shape, undamaged(scene, law))
        }
        (Law::JohnsonCook, false) if effects.artificial_viscosity => {
            let (linear, quadratic) = (scene.numerics.viscosity_linear, scene.numerics.viscosity_quadratic);
            let model = undamaged(scene, product::<R, PowerLaw<R>>(scene));
            assemble::<R, D, _, _>(
                scene,
                shape,
                Viscous::new(model, linear, quadratic, scene.numerics.cell()),
            )
        }
        (Law::JohnsonCook, false) => plain(scene, shape),
    }
}

/// A flow law with the scene's damage.
fn damaged<R: Real, D: Dimension, L: FlowLaw<R>>(
    scene: &Scene,
    shape: Gimp<R>,
    law: L,
) -> Result<Box<dyn Solver>, Error> {
    let (constants, effects) = (&scene.material.constants, &scene.effects);
    let damage = JohnsonCookDamage::<R>::new(
        constants,
        scene.numerics.cell(),
        effects.rate,
        effects.thermal_softening,
    );
    assemble::<R, D, _, _>(scene, shape, J2Plasticity::with(constants, law, damage))
}

/// A flow law without damage.
fn undamaged<R: Real, L: FlowLaw<R>>(scene: &Scene, law: L) -> J2Plasticity<R, L> {
    J2Plasticity::new(&scene.material.constants, law)
}

/// A hardening with rate and adiabatic heat.
fn product<R: Real, H: Hardening<R>>(scene: &Scene) -> WithRateAndHeat<R, H> {
    let constants = constants_in_use(scene);
    Multiplicative::new(&constants, RateDependent::of(&constants), adiabatic(scene, &constants))
}

/// Heat that stays where it arises, with the constants in use.
fn adiabatic<R: Real, const SOFTENS: bool>(scene: &Scene, constants: &Constants) -> Adiabatic<R, SOFTENS> {
    Adiabatic::of(constants, scene.workpiece.initial_temperature).with_expansion(constants.thermal_expansion)
}

/// The material's constants with those taken out whose effect the scene lacks: no rate is a rate coefficient
/// of 0, no heat a Taylor-Quinney coefficient of 0, no softening a melting temperature out of reach.
fn constants_in_use(scene: &Scene) -> Constants {
    let effects = &scene.effects;
    let mut constants = scene.material.constants.clone();
    if !effects.rate {
        constants.rate_coefficient = 0.0;
        constants.zerilli_armstrong.c4 = 0.0;
    }
    if effects.heat == Heat::None {
        constants.taylor_quinney = 0.0;
    }
    if !effects.thermal_softening {
        (constants.thermal_exponent, constants.melting_temperature) = (1.0, OUT_OF_REACH);
    }
    if !effects.thermal_expansion {
        constants.thermal_expansion = 0.0;
    }
    constants
}

/// A melting temperature (K) that lets nothing soften: 1 − T* = 1 in any precision.
const OUT_OF_REACH: f64 = 1e30;

/// In the plane, with GIMP: a kernel for each choice of rate and heat.
fn with_rate<R: Real>(scene: &Scene, shape: Gimp<R>) -> Result<Box<dyn Solver>, Error> {
    let constants = constants_in_use(scene);
    if constants.rate_coefficient != 0.0 {
        with_heat::<R, _>(scene, shape, RateDependent::of(&constants))
    } else {
        with_heat::<R, _>(scene, shape, RateIndependent)
    }
}

fn with_heat<R: Real, Q: RateEffect<R>>(
    scene: &Scene,
    shape: Gimp<R>,
    rate: Q,
) -> Result<Box<dyn Solver>, Error> {
    let constants = &constants_in_use(scene);
    match (scene.effects.heat, scene.effects.thermal_softening) {
        (Heat::None, softens) => {
            let softening = softens.then(|| Softening::of(constants));
            let thermal = Isothermal { temperature: scene.workpiece.initial_temperature, softening };
            plain(scene, shape, rate, thermal)
        }
        (_, true) => plain(scene, shape, rate, adiabatic::<R, true>(scene, constants)),
        (_, false) => plain(scene, shape, rate, adiabatic::<R, false>(scene, constants)),
    }
}

/// Johnson and Cook's law in the plane with the effects a scene names.
fn plain<R: Real, Q: RateEffect<R>, T: ThermalEffect<R>>(
    scene: &Scene,
    shape: Gimp<R>,
    rate: Q,
    thermal: T,
) -> Result<Box<dyn Solver>, Error> {
    let law: Multiplicative<PowerLaw<R>, Q, T> =
        Multiplicative::new(&scene.material.constants, rate, thermal);
    assemble::<R, PlaneStrain, _, _>(scene, shape, undamaged(scene, law))
}

/// The kernel of the reference cut, alone in a build that takes a minute instead of many: plane strain, GIMP,
/// FLIP, double precision, Johnson and Cook's law with rate, adiabatic heat and softening.
fn reference(scene: &Scene) -> Result<Box<dyn Solver>, Error> {
    let Scene { effects, numerics, material, .. } = scene;
    let is_reference = numerics.dimension == DimensionChoice::PlaneStrain
        && numerics.precision == Precision::Double
        && numerics.shape_function == ShapeChoice::Gimp
        && numerics.transfer == TransferChoice::Flip
        && material.law == Law::JohnsonCook
        && !effects.damage
        && !effects.artificial_viscosity;
    if !is_reference {
        return Err(Error::Inconsistent("this build has the reference cut's kernel alone".into()));
    }
    let shape = Gimp::new(numerics.points_per_cell_edge);
    simulation::<f64, PlaneStrain, _, _>(scene, shape, undamaged(scene, product::<f64, PowerLaw<f64>>(scene)))
}

fn assemble<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
    scene: &Scene,
    shape: F,
    model: M,
) -> Result<Box<dyn Solver>, Error> {
    // No unit test runs a scene (those in `tests` do), and without the kernels unit tests are built in a
    // third of the time. Nor does the master, which has the FMU for that.
    if cfg!(test) || !cfg!(feature = "kernels") {
        return Err(Error::Inconsistent(
            "this build has no kernels (feature `kernels`, not in unit tests)".into(),
        ));
    }
    simulation::<R, D, F, M>(scene, shape, model)
}

fn simulation<R: Real, D: Dimension, F: ShapeFunction<R>, M: ConstitutiveModel<R, D>>(
    scene: &Scene,
    shape: F,
    model: M,
) -> Result<Box<dyn Solver>, Error> {
    let process = process_of(scene.kind)?;
    let partition = fill::<R, D, M>(scene, &process.bodies(scene, D::AXES), &model);
    let tool = process.tool(scene)?;
    let options = Options {
        courant: scene.numerics.courant,
        instructions: InstructionSet::detect(),
        depth: scene.workpiece.width,
        locking_control: scene.effects.volumetric_locking_control && !scene.numerics.separates(),
        mass_scaling: MassScaling::of(scene),
        separation: scene.numerics.separates().then_some(ChipSeparation {
            spacing: scene.numerics.point_spacing,
            parting_angle: scene.tool.parting_angle,
            depth: scene.workpiece.width,
        }),
        window: (scene.numerics.active_window > 0.0)
            .then_some(ActiveWindow { ahead: scene.numerics.active_window, height: scene.workpiece.height }),
        chip_tail: (scene.numerics.active_chip > 0.0)
            .then_some(ChipTail { above: scene.numerics.active_chip, height: scene.workpiece.height }),
    };
    let contact = contact::law(scene.numerics.contact, scene.effects.sticking);
    let mut simulation = Simulation::new(partition, (shape, model), tool, contact, options);
    if scene.effects.heat == Heat::Conduction {
        let constants = &scene.material.constants;
        let capacity = constants.density * constants.specific_heat;
        let initial = scene.workpiece.initial_temperature;
        let tool = &scene.tool;
        let mut conduction = HeatConduction::new(constants.conductivity, capacity, initial)
            .with_tool(tool.conductivity, tool.specific_heat * tool.density);
        conduction.starts_even = true;
        conduction.plastic_work_heats = constants.taylor_quinney > 0.0;
        simulation.set_conduction(conduction);
        if scene.effects.tool_heat {
            let material = ToolMaterial {
                conductivity: tool.conductivity,
                capacity: tool.specific_heat * tool.density,
                conductance: tool.contact_conductance,
            };
            let (cell, width) = (scene.numerics.cell(), scene.workpiece.width);
            let body = ToolBody::new(&simulation.tool.shape, cell, width, material);
            simulation.set_tool_body(body);
        }
    }
    Ok(Box::new(simulation))
}

/// The bodies of a process as points on a grid.
fn fill<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
    scene: &Scene,
    bodies: &Bodies,
    model: &M,
) -> Partition<R, D, M::State> {
    let cell = scene.numerics.cell();
    let total = bodies.lattices.iter().map(|body| body.lattice.points()).sum::<usize>();
    let mut blocks = vec![Block::empty(); total.div_ceil(BLOCK)];
    let mut id = 0;
    for body in &bodies.lattices {
        let step = body.lattice.step;
        let volume = step.iter().product::<f64>();
        for number in 0..body.lattice.points() {
            let index = body.lattice.index(number);
            let (block, lane) = (&mut blocks[id / BLOCK], id % BLOCK);
            let position = D::vector(|axis| {
                f64::from(body.first[axis]) + (index[axis] as f64 + 0.5) * step[axis] / cell
            });
            block.set_grid_position(lane, position);
            block.volume[lane] = R::from_f64(volume);
            block.id[lane] = id as u32;
            model.place(&mut block.state, lane, scene.workpiece.initial_temperature);
            id += 1;
        }
    }
    let shares_masses = scene.numerics.smoothed_increments;
    let averages_cells = scene.numerics.separates();
    let layout = Layout { shares_masses, averages_cells, ..Layout::new(bodies.counts, cell, bodies.origin) };
    Partition::new(layout, bodies.fixed.clone(), blocks)
}
