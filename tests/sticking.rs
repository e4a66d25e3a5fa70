//! Friction capped by the shear strength (`contact::sticking`): a block pressed on a moving wall, and a cut.

mod common;

use common::{Lattice, ROOM, SteelState, steel, steel_4340, update};
use std::sync::Arc;
use swarf::contact;
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::grid::shape_function::Gimp;
use swarf::material::{ConstitutiveModel, PointReport, StepSums};
use swarf::points::PointState;
use swarf::scene::{Constants, ContactChoice, Formulation, Scene};
use swarf::session::Session;
use swarf::simd::Vector;
use swarf::simulation::{Solver, ToolMotion};
use swarf::study::body_setup::{BodySetup, Steel, lattice, never_yielding};
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

/// An elastic body whose surface shears at a strength of its own, so that only the contact can limit the
/// traction.
#[derive(Clone)]
struct WeakSurface {
    body: Steel,
    flow_stress: f64,
}

impl<D: Dimension> ConstitutiveModel<f64, D> for WeakSurface {
    type State = SteelState<D>;

    fn density(&self) -> f64 {
        ConstitutiveModel::<f64, D>::density(&self.body)
    }

    fn set_density(&mut self, density: f64) {
        ConstitutiveModel::<f64, D>::set_density(&mut self.body, density);
    }

    fn sound_speed(&self, volume_ratio: f64) -> f64 {
        ConstitutiveModel::<f64, D>::sound_speed(&self.body, volume_ratio)
    }

    fn flow_stress(&self, _state: &Self::State, _lane: usize) -> f64 {
        self.flow_stress
    }

    fn place(&self, state: &mut Self::State, lane: usize, temperature: f64) {
        ConstitutiveModel::<f64, D>::place(&self.body, state, lane, temperature);
    }

    #[inline(always)]
    fn stress<V: Vector<Scalar = f64>>(&self, state: &Self::State, lane: usize) -> D::Symmetric<V> {
        ConstitutiveModel::<f64, D>::stress(&self.body, state, lane)
    }

    #[inline(always)]
    fn update<V: Vector<Scalar = f64>>(
        &self,
        state: &mut Self::State,
        lane: usize,
        h: &D::Matrix<V>,
        dt: f64,
        volume: V,
        totals: &mut StepSums<V>,
    ) -> D::Symmetric<V> {
        ConstitutiveModel::<f64, D>::update(&self.body, state, lane, h, dt, volume, totals)
    }

    fn volume_ratio(&self, state: &Self::State, lane: usize) -> f64 {
        ConstitutiveModel::<f64, D>::volume_ratio(&self.body, state, lane)
    }

    fn set_volume_ratio(&self, state: &mut Self::State, lane: usize, volume_ratio: f64) -> f64 {
        ConstitutiveModel::<f64, D>::set_volume_ratio(&self.body, state, lane, volume_ratio)
    }

    fn report(&self, state: &Self::State, lane: usize) -> PointReport {
        ConstitutiveModel::<f64, D>::report(&self.body, state, lane)
    }
}

/// Pressure of the block on the wall (Pa): 1000 kg/m3, 0.2 m thick, at 20 m/s2.
const PRESSURE: f64 = 4000.0;
/// Coulomb coefficient.
const FRICTION: f64 = 0.1;
/// Length of the block along the wall and its thickness (m).
const LENGTH: f64 = 0.8;
const THICKNESS: f64 = 0.2;

/// What the wall feels of the block.
#[derive(Debug)]
struct Tractions {
    /// Mean pressure and shear traction over the block's length (Pa).
    pressure: f64,
    shear: f64,
    /// Share of the contact that sticks (-).
    sticking: f64,
    /// Length of the contact by the points' footprints (m).
    length: f64,
}

/// Presses a block on a wall at `degrees` to the grid, that moves along itself, and measures while it slides.
///
/// The load grows over 0.1 s, fifteen periods of the block's vibration; the means are taken over 0.1 s after
/// that. A pull that would hold the block against the traction expected, and whose resultant lies in the
/// wall, keeps it from rocking.
fn drag(strength: f64, degrees: f64, cell: f64) -> Tractions {
    const RAMP: f64 = 0.1;
    const SPEED: f64 = 2.0;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (along, out) = ([-sin, -cos], [-cos, sin]);
    let spacing = 0.5 * cell;
    let count = [LENGTH, THICKNESS].map(|length: f64| (length / spacing).round() as usize);
    let mut seeds = lattice([0.0; 3], [count[0], count[1], 1], spacing, 2);
    for seed in &mut seeds {
        let [a, o, _] = seed.position;
        seed.position = [a * along[0] + o * out[0], a * along[1] + o * out[1], 0.0];
    }
    let shape = ToolShape::new(degrees.to_radians(), 0.0, 0.0, 6.0, 4.0).expect("a wedge");
    let position = [2.5 * along[0], 2.5 * along[1]];
    let wall = RigidTool { shape, position, velocity: [0.0; 2], friction: FRICTION };
    let constants = never_yielding(Constants {
        density: 1000.0,
        youngs_modulus: 1e7,
        poissons_ratio: 0.3,
        ..steel_4340()
    });
    let model = WeakSurface { body: steel(&constants), flow_stress: 3_f64.sqrt() * strength };
    let setup = BodySetup::around([-2.0 - 0.37 * cell, -2.0 - 0.21 * cell], [2.0, 2.0], cell);
    let mut solver = setup.simulation::<PlaneStrain, _, _>((Gimp::new(2), model), wall, &seeds, |_, _, _| {});
    solver.contact = contact::law(ContactChoice::Surface, true);
    solver.body_force = Some(Arc::new(move |x: [f64; 3], time: f64| {
        let s = (time / RAMP).min(1.0);
        let load = PRESSURE * s * s * (3.0 - 2.0 * s);
        let hold =
            (FRICTION * load).min(strength) * (4.0 - 6.0 * (x[0] * out[0] + x[1] * out[1]) / THICKNESS);
        let force = [0, 1].map(|axis| (-load * out[axis] - hold * along[axis]) / (1000.0 * THICKNESS));
        [force[0], force[1], 0.0]
    }));
    let motion = ToolMotion { velocity: along.map(|a| SPEED * a), friction: FRICTION };
    let mut until = |end: f64| {
        while solver.progress().clock < end {
            solver.step(&motion, false).expect("a stable step");
        }
        let progress = solver.progress();
        (progress.clock, progress.ledger.tool_impulse, progress.contact_areas)
    };
    let (before, after) = (until(RAMP), until(RAMP + 0.1));
    let impulse = [0, 1].map(|axis| after.1[axis] - before.1[axis]);
    let area = after.2.all - before.2.all;
    let time = after.0 - before.0;
    Tractions {
        pressure: (impulse[0] * out[0] + impulse[1] * out[1]) / (time * LENGTH),
        shear: (impulse[0] * along[0] + impulse[1] * along[1]) / (time * LENGTH),
        sticking: (after.2.sticking - before.2.sticking) / area,
        length: area / time,
    }
}

/// With low pressure the traction is Coulomb's, with high pressure the shear strength, and the contact is as
/// long as the block: within 1e-3, for a vibration that has not quite died down and a block that the pressure
/// makes longer by ν (1 + ν) p/E, 1.6e-4. Everything slides under Coulomb's law or everything is capped.
#[test]
fn friction_is_the_smaller_of_coulombs_and_the_strength() {
    for degrees in [0.0, 17.0] {
        for (strength, expected, share) in [
            (2.0 * FRICTION * PRESSURE, FRICTION * PRESSURE, 0.0),
            (0.4 * FRICTION * PRESSURE, 0.4 * FRICTION * PRESSURE, 1.0),
        ] {
            let found = drag(strength, degrees, 0.05);
            println!("wall at {degrees}°, strength {strength} Pa: {found:?}, expected {expected} Pa");
            assert!((found.pressure / PRESSURE - 1.0).abs() < 1e-3, "{found:?}");
            assert!((found.length / LENGTH - 1.0).abs() < 1e-3, "{found:?}");
            assert!((found.shear / expected - 1.0).abs() < 1e-3, "{expected} Pa expected, {found:?}");
            assert!((found.sticking - share).abs() < 1e-3, "share {share} expected, {found:?}");
        }
    }
}

/// A block of 8 by 10 (by 4) cells hits an upright wall obliquely: its weak surface drags with strength times
/// its face when it is pressed all over, and never with more. In space strips across z add up to the face.
/// Within 2 %: the face grows by 0.3 %, and sweeps that end at 1e-5 of the fastest speed leave up to 1 % of
/// this drag, a tenth of the pressure.
fn hits_a_wall<D: Dimension>(name: &str) {
    const CELL: f64 = 2e-5;
    const STRENGTH: f64 = 1e8;
    let deep = D::AXES == 3;
    let lattice = Lattice {
        domain: [50, 50, if deep { 30 } else { 1 }],
        corner: [12, 14, if deep { 12 } else { 0 }],
        cells: [8, 10, 4],
        per_edge: 2,
        cell: CELL,
        fixed: vec![],
        courant: 0.5,
    };
    let shape = ToolShape::new(0.0, 0.0, 0.0, 3e-4, 8e-4).expect("a right-angled wedge");
    let tool = RigidTool { shape, position: [8.0 * CELL, -2e-4], velocity: [0.0; 2], friction: 1.0 };
    let body = steel(&common::never_yielding(steel_4340()));
    let model = WeakSurface { body, flow_stress: 3_f64.sqrt() * STRENGTH };
    let mut block =
        lattice.build_of(model, Gimp::new(2), tool, |_, _: &mut SteelState<D>, _| [25.0, 10.0, 0.0]);
    block.contact = contact::law(ContactChoice::Surface, true);
    let motion = ToolMotion { velocity: [0.0; 2], friction: 1.0 };
    let face = 10.0 * CELL * if deep { 4.0 * CELL } else { 1.0 };
    let (mut most, mut clock, mut impulse) = (0.0_f64, 0.0, 0.0);
    for _ in 0..100 {
        block.step(&motion, false).expect("a stable step");
        let progress = block.progress();
        let drag = (impulse - progress.ledger.tool_impulse[1]) / (progress.clock - clock);
        (clock, impulse) = (progress.clock, progress.ledger.tool_impulse[1]);
        most = most.max(drag);
    }
    let share = most / (STRENGTH * face);
    println!("{name}: the wall drags with {share:.4} of strength times face at most");
    assert!((0.98..1.02).contains(&share), "{name}: {share} of strength times face");
}

/// See `hits_a_wall`.
#[test]
fn the_drag_is_strength_times_face_in_the_plane_and_in_space() {
    hits_a_wall::<PlaneStrain>("plane strain");
    hits_a_wall::<ThreeDimensional>("three dimensions");
}

/// The flow stress that caps friction is A at the start, and the stress at which a point yields when it does,
/// rate and heat included; per present area, as tractions are.
#[test]
fn the_flow_stress_is_that_of_the_yielding_point() {
    let constants = steel_4340();
    let model = steel::<f64>(&constants);
    let mut state = SteelState::<PlaneStrain>::zeroed();
    for lane in 0..4 {
        ConstitutiveModel::<f64, PlaneStrain>::place(&model, &mut state, lane, ROOM);
    }
    let at = |state: &SteelState<PlaneStrain>| {
        ConstitutiveModel::<f64, PlaneStrain>::flow_stress(&model, state, 0)
    };
    assert!((at(&state) / constants.yield_stress - 1.0).abs() < 1e-12, "{} Pa at the start", at(&state));
    // Shear with some compression at 1e6 per second.
    for _ in 0..200 {
        update::<PlaneStrain>(&model, &mut state, [[-1e-4, 1e-3], [0.0, 0.0]], 1e-9);
    }
    let equivalent = common::equivalent_stress(&state, 0) / state.jacobian[0];
    assert!(equivalent > 1.2 * constants.yield_stress, "it does not yield: {equivalent} Pa");
    // The return map ends within its own tolerance of the flow stress; here the two are the same number.
    assert!((at(&state) / equivalent - 1.0).abs() < 1e-12, "{} Pa, yields at {equivalent} Pa", at(&state));
}

/// A small cut, spacing 40 µm.
fn cut(friction: f64, change: impl Fn(&mut Scene)) -> Session {
    let mut scene = Scene::default();
    (scene.workpiece.length, scene.workpiece.height) = (2e-3, 8e-4);
    scene.numerics.point_spacing = 4e-5;
    scene.inputs.friction = friction;
    change(&mut scene);
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    session.advance_to(1e-5, &mut |_| true).expect("a stable run");
    session.advance_to(2e-5, &mut |_| true).expect("a stable run");
    session
}

/// Strong friction is capped: part of the contact sticks, the force falls and friction works less; the ledger
/// stays closed (1 %, the bound). Without friction nothing sticks.
#[test]
fn strong_friction_is_capped_in_a_cut() {
    // Where chip and work part most of the face sticks to Coulomb's tool already, and the cap takes less.
    for (formulation, most) in [(Formulation::Plain, 0.95), (Formulation::Separated, 1.0)] {
        caps(formulation, most);
    }
}

/// See above; `most` is the part of Coulomb's thrust that the capped one may be.
fn caps(formulation: Formulation, most: f64) {
    let cut = |friction: f64, sticks: bool| {
        cut(friction, |scene: &mut Scene| {
            (scene.effects.sticking, scene.numerics.formulation) = (sticks, formulation);
        })
    };
    let (capped, coulomb) = (cut(0.8, true), cut(0.8, false));
    let (capped, coulomb) = (capped.outputs(), coulomb.outputs());
    println!(
        "share {}, force {} and {} N, thrust {} and {} N, friction work {} and {} J, ledger {}",
        capped.sticking_share,
        capped.cutting_force,
        coulomb.cutting_force,
        capped.thrust_force,
        coulomb.thrust_force,
        capped.friction_work,
        coulomb.friction_work,
        capped.balance_error
    );
    assert!((0.05..=1.0).contains(&capped.sticking_share), "share {}", capped.sticking_share);
    assert_eq!(coulomb.sticking_share, 0.0);
    assert!(capped.cutting_force < coulomb.cutting_force, "the force is not capped");
    assert!(capped.thrust_force < most * coulomb.thrust_force, "the thrust is not capped");
    assert!(capped.balance_error.abs() < 1e-2, "ledger {}", capped.balance_error);
    assert_eq!(cut(0.0, true).outputs().sticking_share, 0.0);
}

/// A strength out of reach caps nothing: the run is the same to the bit as without the effect.
#[test]
fn a_strength_out_of_reach_changes_no_bit() {
    let hard = |has_effect: bool| {
        cut(0.2, |scene: &mut Scene| {
            scene.material.name = "custom".into();
            scene.material.constants.yield_stress = 1e11;
            scene.inputs.tool_velocity = 5.0;
            scene.effects.sticking = has_effect;
        })
    };
    let (with, without) = (hard(true), hard(false));
    assert!(without.outputs().cutting_force > 0.0, "the tool was never touched");
    assert_eq!(with.outputs().cutting_force, without.outputs().cutting_force);
    assert_eq!(with.outputs().thrust_force, without.outputs().thrust_force);
    assert_eq!(with.outputs().friction_work, without.outputs().friction_work);
    assert!(with.outputs().sticking_share <= 1.0);
}

/// The laws on nodes know no touching points, so they refuse the effect by name.
#[test]
fn laws_on_nodes_refuse_it() {
    use swarf::scene::ContactChoice::{Distance, Velocity};
    for contact in [Distance, Velocity] {
        let mut scene = Scene::default();
        scene.numerics.contact = contact;
        scene.effects.sticking = true;
        let Err(error) = Session::new(&scene, 0.0) else { panic!("{contact:?} goes with sticking") };
        let text = error.to_string();
        assert!(text.contains("effects.sticking") && text.contains("numerics.contact"), "{text}");
    }
}
