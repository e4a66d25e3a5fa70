//! Inputs that jump, and communication steps of every length.
//!
//! A tool at rest does no work; one that has left feels nothing; how the time is cut into communication steps
//! changes no bit of the state. On every way the ledger stays closed.

use super::monitor::{NO_SLOPE, Watched, cut, soundness};
use super::{Setting, Sheet};
use crate::scene::{Inputs, Scene};
use crate::session::Session;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let scene = cut(setting.pick(4e-5, 2e-5));
    stopped(sheet, &scene);
    reversed(sheet, &scene);
    lifted(sheet, &scene);
    let mut run = begun(&scene, Inputs { friction: 0.0, ..scene.inputs });
    run.steer(Inputs { friction: 1.0, ..scene.inputs }, NO_SLOPE).run(10e-6, 10);
    soundness(sheet, "friction 0 to 1 between two steps", &run);
    ramped(sheet, &scene);
    thrown_about(sheet, &scene);
    cut_into_steps(setting, sheet, &scene);
}

/// A run in the middle of its cut, 0.5 mm on.
fn begun(scene: &Scene, inputs: Inputs) -> Watched {
    let mut run = Watched::new(&Scene { inputs, ..scene.clone() });
    run.run(10e-6, 10);
    run
}

/// Stopped dead for 5 µs, then driven on.
fn stopped(sheet: &mut Sheet, scene: &Scene) {
    let mut run = begun(scene, scene.inputs);
    let at_rest = Inputs { tool_velocity: 0.0, ..scene.inputs };
    // The substep in which the order comes still moves.
    run.steer(at_rest, NO_SLOPE).run(0.1e-6, 1);
    let before = run.outputs();
    run.run(4.9e-6, 5);
    let after = run.outputs();
    let work = run.figure((after.tool_work - before.tool_work) / before.tool_work);
    sheet.at_most("stopped dead: work of the tool at rest over its work before", work, "", 0.0);
    run.steer(scene.inputs, NO_SLOPE).run(5e-6, 5);
    soundness(sheet, "stopped dead, driven on", &run);
    let state = f64::from(run.outputs().chip_state);
    sheet.at_least("stopped dead, driven on: chip.state", run.figure(state), "", 3.0);
}

/// Back out of the workpiece, then in again.
fn reversed(sheet: &mut Sheet, scene: &Scene) {
    let mut run = begun(scene, scene.inputs);
    run.steer(Inputs { tool_velocity: -50.0, ..scene.inputs }, NO_SLOPE).run(16e-6, 16);
    // Out, it feels nothing.
    run.run(1e-6, 1);
    let out = run.outputs();
    let force = out.cutting_force.abs().max(out.thrust_force.abs());
    sheet.at_most("reversed: force on the tool outside", run.figure(force), "N", 0.0);
    run.steer(scene.inputs, NO_SLOPE).run(20e-6, 20);
    soundness(sheet, "reversed, engaged again", &run);
    let gained = run.figure(run.outputs().tool_work / out.tool_work);
    sheet.at_least("reversed, engaged again: work over that before", gained, "", 1.0);
}

/// The feed stepped to 0 and back, as fast as the interface lets the tool move.
fn lifted(sheet: &mut Sheet, scene: &Scene) {
    let mut scene = scene.clone();
    scene.tool.feed_rate_limit = 500.0;
    let mut run = begun(&scene, scene.inputs);
    run.steer(Inputs { feed: 0.0, ..scene.inputs }, NO_SLOPE).run(5e-6, 5);
    soundness(sheet, "feed stepped to 0", &run);
    run.steer(scene.inputs, NO_SLOPE).run(5e-6, 5);
    soundness(sheet, "feed stepped back at 500 m/s", &run);
    scene.tool.feed_rate_limit = 10.0;
    let mut run = begun(&scene, scene.inputs);
    run.steer(Inputs { feed: 2e-4, ..scene.inputs }, NO_SLOPE).run(10e-6, 10);
    run.steer(scene.inputs, NO_SLOPE).run(10e-6, 10);
    soundness(sheet, "feed stepped to 0.2 mm and back at 10 m/s", &run);
}

/// The velocity ramped up from 0 in 10 µs.
fn ramped(sheet: &mut Sheet, scene: &Scene) {
    let mut run = begun(scene, Inputs { tool_velocity: 0.0, ..scene.inputs });
    let at_rest = Inputs { tool_velocity: 0.0, ..scene.inputs };
    run.steer(at_rest, Inputs { tool_velocity: 5e6, ..NO_SLOPE }).run(10e-6, 10);
    run.steer(scene.inputs, NO_SLOPE).run(10e-6, 10);
    soundness(sheet, "velocity ramped from 0 in 10 µs", &run);
}

/// To the ends of the range and back, 0.3 µs each.
fn thrown_about(sheet: &mut Sheet, scene: &Scene) {
    let mut run = begun(scene, scene.inputs);
    for velocity in [500.0, -500.0, 500.0, 0.0, -500.0, 500.0, 50.0] {
        run.steer(Inputs { tool_velocity: velocity, ..scene.inputs }, NO_SLOPE).run(0.3e-6, 1);
    }
    run.run(3e-6, 3);
    soundness(sheet, "velocity thrown between 500 and -500 m/s", &run);
}

/// Numbers of the state that differ between one communication step and many short ones.
fn cut_into_steps(setting: &Setting, sheet: &mut Sheet, scene: &Scene) {
    let differing = |end: f64, steps: u32| -> Result<f64, crate::Error> {
        let mut once = Session::new(scene, 0.0)?;
        once.advance_to(end, &mut |_| true)?;
        let mut often = Session::new(scene, 0.0)?;
        for k in 1..=steps {
            often.advance_to(f64::from(k) / f64::from(steps) * end, &mut |_| true)?;
        }
        Ok(differences(&once, &often) as f64)
    };
    let end_of_short: f64 = setting.pick(4e-6, 4e-5);
    for (name, end, steps) in [
        (
            format!("steps of 1 ns to {} µs", 1e6 * end_of_short),
            end_of_short,
            (1e9 * end_of_short).round() as u32,
        ),
        ("the whole experiment in one step against 40".into(), 4e-5, 40),
    ] {
        let (value, remark) = match differing(end, steps) {
            Ok(value) => (value, String::new()),
            Err(error) => (f64::NAN, error.to_string()),
        };
        sheet.at_most(format!("{name}: numbers of the state that differ"), value, "", 0.0).remarked(remark);
    }
}

/// Numbers of two runs' states that are not the same to the bit.
pub fn differences(a: &Session, b: &Session) -> usize {
    let numbers = |session: &Session| -> Vec<u64> {
        let f = session.point_fields();
        let o = session.outputs();
        let vectors = f.position.iter().chain(&f.velocity).flatten();
        let scalars = f.plastic_strain.iter().chain(&f.temperature).chain(&f.jacobian);
        let totals = [f.time, o.tool_work, o.plastic_work, o.friction_work, o.damping, o.contact_loss];
        let all = vectors.chain(scalars).chain(f.stress.iter().flatten()).copied().chain(totals);
        all.map(f64::to_bits).collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    a.iter().zip(&b).filter(|(a, b)| a != b).count() + a.len().abs_diff(b.len())
}
