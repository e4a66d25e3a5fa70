//! The guards of a run: silent in sound cuts, and heard in unsound ones.

use swarf::Error;
use swarf::scene::{Formulation, Inputs, Scene, Speed};
use swarf::session::Session;
use swarf::simulation::ToolMotion;
use swarf::{setup, setup::checks};

/// A cut of 1,900 points: half the length and half the resolution of the reference.
fn scene(velocity: f64) -> Scene {
    let mut scene = Scene::default();
    scene.workpiece.length = 1.5e-3;
    scene.numerics.point_spacing = 2e-5;
    scene.numerics.threads = 1;
    scene.inputs = Inputs { tool_velocity: velocity, feed: 3e-4, friction: 0.2 };
    scene
}

/// A steel as soft to pressure as rubber: its waves are hardly faster than the tool.
fn soft_scene(velocity: f64) -> Scene {
    let mut scene = scene(velocity);
    scene.material.name = "custom".into();
    scene.material.constants.youngs_modulus = 1e9;
    scene.material.constants.yield_stress = 2e7;
    scene.material.constants.hardening_modulus = 1e7;
    scene
}

/// Retries after `travel` (m) of the tool, or the error that ended the run.
fn retries(scene: &Scene, travel: f64) -> Result<i32, Error> {
    let mut session = Session::new(scene, 0.0).expect("a good scene");
    for k in 1..=20 {
        session.advance_to(f64::from(k) / 20.0 * travel / scene.inputs.tool_velocity, &mut |_| true)?;
    }
    let o = session.outputs();
    println!(
        "{} m/s: {} retries, J ≥ {:.3}, ledger {:.3} %, damping {:.2} % of the work",
        scene.inputs.tool_velocity,
        o.retries,
        o.min_jacobian,
        100.0 * o.balance_error,
        100.0 * o.damping / o.tool_work
    );
    Ok(o.retries)
}

/// No bound is near in cuts of a metal, from ordinary speed to the fastest that the interface takes.
#[test]
fn sound_cuts_need_no_retry() {
    for velocity in [50.0, 200.0, 500.0] {
        assert_eq!(retries(&scene(velocity), 6e-4), Ok(0), "at {velocity} m/s");
    }
}

/// An impact near the speed of sound breaks the bound on the volume; the substep is solved again, and
/// counted.
#[test]
fn a_hit_near_the_speed_of_sound_is_retried() {
    let outcome = retries(&soft_scene(450.0), 3e-4);
    println!("{outcome:?}");
    match outcome {
        Ok(retries) => assert!(retries > 0, "no substep was solved again"),
        Err(error) => assert!(matches!(error, Error::Unstable(_)), "{error}"),
    }
}

/// Courant numbers above the limit let the scheme feed itself while the force looks right. They are refused,
/// and the watch sees a run that got past.
#[test]
fn a_scheme_that_feeds_itself_is_stopped() {
    let mut scene = scene(50.0);
    scene.numerics.courant = 0.58;
    let error = Session::new(&scene, 0.0).map(|_| ()).expect_err("above the limit").to_string();
    assert!(
        error.contains("numerics.courant = 0.58 is above the stability limit of the scheme, 0.54"),
        "{error}"
    );
    scene.numerics.courant = 0.5;
    // The limit is worked out for points that act by themselves; those that share their cells' stresses bear
    // more.
    scene.numerics.formulation = Formulation::Plain;
    let mut scene = checks::check(&scene).expect("a good scene");
    scene.numerics.courant = 0.68;
    let mut solver = setup::build(&scene).expect("a solver");
    let motion = ToolMotion { velocity: [-50.0, 0.0], friction: 0.2 };
    let error = loop {
        if let Err(error) = solver.step(&motion, false) {
            break error.to_string();
        }
        assert!(solver.progress().clock < 2e-5, "an unstable run must not pass");
    };
    println!("{error}");
    assert!(error.contains("became unstable"), "{error}");
}

/// A number that was not set by hand follows the material: at Poisson's ratio 0.48 the default of 0.5 would
/// be too large.
#[test]
fn the_time_step_is_that_of_the_material() {
    let mut scene = scene(50.0);
    assert_eq!(checks::check(&scene).map(|scene| scene.numerics.courant), Ok(0.5));
    scene.material.name = "custom".into();
    scene.material.constants.poissons_ratio = 0.48;
    let once = checks::check(&scene).expect("a good scene");
    assert!((0.45..0.5).contains(&once.numerics.courant), "{}", once.numerics.courant);
    assert_eq!(checks::check(&once).as_ref(), Ok(&once), "checked twice");
    scene.numerics.speed = Speed::Balanced;
    assert_eq!(checks::check(&scene).map(|scene| scene.numerics.courant), Ok(once.numerics.courant));
    scene.numerics.formulation = Formulation::Plain;
    // With smoothed increments the limit is about twice as high, and below the level's 1.1 here.
    scene.numerics.speed = Speed::Fast;
    let fast = checks::check(&scene).expect("a good scene");
    assert!((0.95..1.05).contains(&fast.numerics.courant), "{}", fast.numerics.courant);
    assert_eq!(checks::check(&fast).as_ref(), Ok(&fast), "checked twice");
}
