//! The state after a span of time is the same bits however it was reached: communication steps, threads,
//! neighbours, saved states.

use std::path::PathBuf;
use std::process::Command;
use swarf::scene::{Formulation, Inputs, Scene};
use swarf::session::{Advance, Session};
use swarf::variables::Outputs;

/// End of most runs (s): one long communication step.
const END: f64 = 7.3e-6;

/// The reference cut at spacing 2e-5, longer so that two threads pay: 12,500 points.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.workpiece.length = 5e-3;
    scene.numerics.point_spacing = 2e-5;
    scene.numerics.threads = 1;
    scene
}

fn session(scene: &Scene) -> Session {
    Session::new(scene, 0.0).expect("a good scene")
}

fn advance(session: &mut Session, time: f64) {
    let advance = session.advance_to(time, &mut |_| true).expect("a stable run");
    assert_eq!(advance, Advance::Reached);
}

/// Runs to `END` in communication steps of `step` (s), with the inputs set anew at each, as a master does.
fn run(mut session: Session, step: f64) -> Session {
    let inputs = session.scene().inputs;
    let none = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };
    let count = (END / step).round() as usize;
    for k in 1..=count {
        session.set_inputs(inputs, none).expect("good inputs");
        advance(&mut session, if k == count { END } else { k as f64 * step });
    }
    session
}

/// Every number that describes the state, as bits: points' fields, clock, totals.
fn state_bits(session: &Session) -> Vec<u64> {
    let f = session.point_fields();
    let mut numbers = vec![f.time];
    for k in 0..f.id.len() {
        numbers.extend([f64::from(f.id[k]), f.plastic_strain[k], f.temperature[k], f.jacobian[k]]);
        numbers.extend(f.position[k].iter().chain(&f.velocity[k]).chain(&f.stress[k]));
    }
    numbers.extend(f.tool_outline.iter().flatten());
    // Means and extremes over a communication step differ by what they are means of.
    let Outputs { tool_work, kinetic_energy, elastic_energy, plastic_work, friction_work, damping, .. } =
        *session.outputs();
    numbers.extend([tool_work, kinetic_energy, elastic_energy, plastic_work, friction_work, damping]);
    let o = session.outputs();
    numbers.extend([
        o.contact_loss,
        o.thermal_energy,
        o.balance_error,
        o.time_step,
        o.min_jacobian,
        o.cut_length,
    ]);
    numbers.extend([
        o.chip_temperature,
        o.peak_strain,
        o.peak_strain_p999,
        o.tool_position_x,
        o.tool_position_y,
    ]);
    assert!(numbers.iter().all(|x| x.is_finite()), "a number is not finite");
    numbers.iter().map(|x| x.to_bits()).collect()
}

/// Fails with the number of bits patterns that differ.
fn assert_same(a: &[u64], b: &[u64], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}: different sizes");
    let differing = a.iter().zip(b).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 0, "{what}: {differing} of {} numbers differ", a.len());
}

/// The solver keeps its own clock and never trims a substep to a communication point.
#[test]
fn communication_steps_do_not_change_the_state() {
    let whole = state_bits(&run(session(&scene()), 7.3e-6));
    for step in [1e-6, 1e-7] {
        assert_same(
            &whole,
            &state_bits(&run(session(&scene()), step)),
            &format!("communication steps of {step} s"),
        );
    }
}

/// The impulse, too, does not depend on the division: means times steps add up to it. Rounding of 73
/// differences of running totals: 1e-12.
#[test]
fn mean_forces_add_up_to_the_same_impulse() {
    let impulse = |step: f64| {
        let mut session = session(&scene());
        let count = (END / step).round() as usize;
        let mut sum = [0.0; 3];
        let mut last = 0.0;
        for k in 1..=count {
            let time = if k == count { END } else { k as f64 * step };
            advance(&mut session, time);
            let outputs = session.outputs();
            sum[0] += outputs.cutting_force * (time - last);
            sum[1] += outputs.thrust_force * (time - last);
            sum[2] += outputs.cutting_power * (time - last);
            last = time;
        }
        sum
    };
    let (whole, parts) = (impulse(7.3e-6), impulse(1e-7));
    assert!(whole[0] > 1e-3, "the tool hardly cut: {whole:?}");
    for k in 0..3 {
        let difference = (whole[k] - parts[k]).abs() / whole[0].abs();
        assert!(
            difference < 1e-11,
            "entry {k} of impulse and work: {} in one step, {} in 73",
            whole[k],
            parts[k]
        );
    }
}

/// A step shorter than a substep may run none: the outputs then describe the part of the last one, and the
/// state is that of a run without such steps.
#[test]
fn steps_shorter_than_a_substep_change_nothing() {
    let (mut small, mut whole) = (session(&scene()), session(&scene()));
    advance(&mut small, 1e-6);
    let substep = small.outputs().time_step;
    let step = substep / 7.0;
    let mut idle = 0;
    for k in 1..=70 {
        advance(&mut small, 1e-6 + f64::from(k) * step);
        let outputs = small.outputs();
        idle += usize::from(outputs.substeps == 0);
        assert!(outputs.substeps <= 1, "{} substeps of {substep} s in a step of {step} s", outputs.substeps);
        assert!(
            outputs.cutting_force.is_finite() && outputs.cutting_force >= 0.0,
            "force {}",
            outputs.cutting_force
        );
        assert!((small.time() - (1e-6 + f64::from(k) * step)).abs() < 1e-20, "time {}", small.time());
    }
    assert!((58..=62).contains(&idle), "{idle} of 70 steps of a seventh of a substep ran no substep");
    advance(&mut small, 2e-6);
    advance(&mut whole, 2e-6);
    assert_same(&state_bits(&small), &state_bits(&whole), "steps of a seventh of a substep");
}

/// Chunks are a fixed division of the points, and sums go in their order, whoever computes them.
#[test]
fn threads_do_not_change_the_state() {
    let one = run(session(&scene()), 7.3e-6).save();
    let mut two = scene();
    two.numerics.threads = 2;
    let two = run(session(&two), 7.3e-6);
    assert!(
        two.outputs().active_points >= 10_000,
        "too few points for two threads: {}",
        two.outputs().active_points
    );
    assert_states_differ_in_threads_alone(&one, &two.save());
}

/// Nor do they change the chip's tail, which follows a sum over the points below it.
#[test]
fn threads_do_not_change_the_tail() {
    let mut one = scene();
    one.numerics.active_chip = 2.0;
    // 1.5 mm of travel.
    one.inputs.tool_velocity = 200.0;
    let mut two = one.clone();
    two.numerics.threads = 2;
    let two = run(session(&two), 7.3e-6);
    let (active, all) = (two.outputs().active_points as usize, two.point_fields().id.len());
    assert!(active >= 10_000 && active + 200 < all, "{active} of {all} points move: the tail is too short");
    assert_states_differ_in_threads_alone(&run(session(&one), 7.3e-6).save(), &two.save());
}

/// Nor threads, nor communication steps, nor a state saved on the way, in the plain formulation: its grid stands
/// still and its points share nothing.
#[test]
fn the_plain_formulation_is_as_reproducible() {
    let mut one = scene();
    one.numerics.formulation = Formulation::Plain;
    let whole = run(session(&one), 7.3e-6);
    let mut two = one.clone();
    two.numerics.threads = 2;
    assert_states_differ_in_threads_alone(&whole.save(), &run(session(&two), 7.3e-6).save());
    assert_same(&state_bits(&whole), &state_bits(&run(session(&one), 1e-6)), "communication steps of 1e-6 s");
    let mut half = session(&one);
    advance(&mut half, 3.3e-6);
    let mut restored = Session::restore(&half.save()).expect("a good state");
    advance(&mut half, 7.3e-6);
    advance(&mut restored, 7.3e-6);
    assert_same(&state_bits(&half), &state_bits(&restored), "a restored state");
}

fn assert_states_differ_in_threads_alone(one: &[u8], two: &[u8]) {
    let differing = one.iter().zip(two).filter(|(a, b)| a != b).count();
    assert_eq!(one.len(), two.len());
    assert!(
        differing <= 5,
        "{differing} of {} bytes differ: more than the number of threads and the checksum",
        one.len()
    );
}

/// Instances share nothing.
#[test]
fn an_instance_beside_it_changes_nothing() {
    let alone = run(session(&scene()), 1e-6).save();
    let mut other = scene();
    other.inputs.friction = 0.5;
    other.inputs.feed = 4e-4;
    other.numerics.threads = 2;
    let (mine, _) = std::thread::scope(|threads| {
        let mine = threads.spawn(|| run(session(&scene()), 1e-6).save());
        let other = threads.spawn(|| run(session(&other), 7.3e-7).save());
        (mine.join().expect("a good run"), other.join().expect("a good run"))
    });
    assert!(alone == mine, "a second instance changed the state");
}

/// The state saved in the middle of a substep's share of a communication step holds everything that matters.
#[test]
fn a_restored_session_goes_on_bit_identically() {
    let mut original = session(&scene());
    advance(&mut original, 3e-6);
    let saved = original.save();
    advance(&mut original, END);
    let expected = original.save();
    let mut restored = Session::restore(&saved).expect("own bytes");
    assert!(restored.save() == saved, "saving a restored session gives other bytes");
    assert_eq!(restored.time(), 3e-6);
    advance(&mut restored, END);
    assert!(restored.save() == expected, "the restored session went another way");
    let mut copy = Session::restore(&saved).expect("own bytes").clone();
    advance(&mut copy, END);
    assert!(copy.save() == expected, "the copied session went another way");
    assert_eq!(copy.outputs(), original.outputs());
}

const STATE_VARIABLE: &str = "SWARF_TEST_STATE";

/// The same in a new process: nothing that matters lives outside the bytes.
#[test]
fn a_new_process_goes_on_bit_identically() {
    let mut original = session(&scene());
    advance(&mut original, 3e-6);
    let file = std::env::temp_dir().join(format!("swarf-determinism-{}.state", std::process::id()));
    std::fs::write(&file, original.save()).expect("a writable temporary folder");
    advance(&mut original, END);
    let child = Command::new(std::env::current_exe().expect("a path"))
        .args(["--exact", "continues_a_saved_state_in_another_process", "--ignored"])
        .env(STATE_VARIABLE, &file)
        .output()
        .expect("a child process");
    let text = String::from_utf8_lossy(&child.stdout).into_owned();
    assert!(child.status.success() && text.contains("1 passed"), "the child failed: {text}");
    let continued = std::fs::read(file.with_extension("continued")).expect("the child's bytes");
    for path in [file.clone(), file.with_extension("continued")] {
        std::fs::remove_file(path).expect("own file");
    }
    assert!(continued == original.save(), "the state went another way in the new process");
}

/// What the test above runs in the new process.
#[test]
#[ignore = "the part of a_new_process_goes_on_bit_identically that runs in the new process"]
fn continues_a_saved_state_in_another_process() {
    let file = PathBuf::from(
        std::env::var_os(STATE_VARIABLE).expect("run by a_new_process_goes_on_bit_identically only"),
    );
    let mut session =
        Session::restore(&std::fs::read(&file).expect("the parent's bytes")).expect("a good state");
    advance(&mut session, END);
    std::fs::write(file.with_extension("continued"), session.save()).expect("a writable folder");
}

/// A refused state leaves no session behind; a truncated, a changed and a foreign one are all refused.
#[test]
fn damaged_states_are_refused() {
    let saved = session(&scene()).save();
    let mut changed = saved.clone();
    changed[saved.len() / 2] ^= 1;
    for (bytes, name) in [
        (&saved[..saved.len() - 1], "truncated"),
        (&changed, "changed"),
        (&saved[..7], "short"),
        (&[], "empty"),
    ] {
        let error = Session::restore(bytes).map(|_| ()).expect_err(name).to_string();
        assert!(error.contains("state"), "{name}: {error}");
    }
}
