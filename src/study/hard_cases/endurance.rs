//! Ten thousand communication steps with random inputs, replayed from saved states; and many instances side
//! by side.
//!
//! Inputs are a function of the step's number alone, so another process can go on from any of them.

use super::child;
use super::monitor::{NO_SLOPE, not_finite, outputs_not_finite, random};
use super::{Setting, Sheet};
use crate::Error;
use crate::scene::{Accuracy, Inputs, Scene};
use crate::session::{Advance, Session};
use std::path::PathBuf;

/// The scene at draft size.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.numerics.accuracy = Accuracy::Draft;
    scene.numerics.threads = 1;
    scene
}

/// Inputs of a step: every hundred steps another speed (one in eight goes back), feed and friction; the speed
/// trembles from step to step by 5 %.
fn inputs(step: u64) -> Inputs {
    let block = step / 100;
    let of = |kind: u64| random(4 * block + kind);
    let speed = 10.0 + 80.0 * of(0);
    let direction = if of(1) < 0.125 { -0.3 } else { 1.0 };
    let tremble = 0.95 + 0.1 * random(1_000_003 + step);
    Inputs { tool_velocity: direction * tremble * speed, feed: 1e-4 + 2.5e-4 * of(2), friction: 0.6 * of(3) }
}

/// Length of a step (s): 1 to 6 ns.
fn length(step: u64) -> f64 {
    1e-9 + 5e-9 * random(2_000_003 + step)
}

/// Runs the steps `from..to`; `after` sees the session after each.
///
/// # Errors
/// What ended the run.
fn run(session: &mut Session, from: u64, to: u64, mut after: impl FnMut(u64, &Session)) -> Result<(), Error> {
    for step in from..to {
        let inputs = inputs(step);
        session.set_inputs(inputs, NO_SLOPE)?;
        let time = session.time() + length(step);
        if session.advance_to(time, &mut |_| true)? != Advance::Reached {
            return Err(Error::Unstable(format!("stopped at {time} s without being asked to")));
        }
        after(step + 1, session);
    }
    Ok(())
}

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let steps = setting.pick(1000, 10_000);
    let folder = std::env::temp_dir().join(format!("swarf-endurance-{}", std::process::id()));
    let outcome = endure(setting, sheet, steps, &folder);
    let _ = std::fs::remove_dir_all(&folder);
    if let Err(error) = outcome {
        sheet.at_most("endurance: ended by an error", f64::NAN, "", 0.0).remarked(error.to_string());
    }
}

fn endure(setting: &Setting, sheet: &mut Sheet, steps: u64, folder: &std::path::Path) -> Result<(), Error> {
    let file_error =
        |e: std::io::Error| Error::File { path: folder.display().to_string(), reason: e.to_string() };
    std::fs::create_dir_all(folder).map_err(file_error)?;
    let mut session = Session::new(&scene(), 0.0)?;
    // Of the states saved, five spread over the run are replayed.
    let replayed: Vec<u64> = (1..=5).map(|k| k * steps / 6 / 100 * 100).collect();
    let (mut worst, mut wrong, mut saved, mut damaged) = (0.0_f64, 0, 0_u32, 0_u32);
    let mut failed_write = None;
    run(&mut session, 0, steps, |step, session| {
        let o = session.outputs();
        // A cut that has hardly begun has no work to compare with.
        if o.cut_length > 1e-5 {
            worst = worst.max(o.balance_error.abs());
        }
        wrong += outputs_not_finite(o);
        if step % 100 == 0 {
            wrong += not_finite(&session.point_fields());
            let bytes = session.save();
            saved += 1;
            let again = Session::restore(&bytes).map(|session| session.save());
            damaged += u32::from(again.as_ref() != Ok(&bytes));
            if replayed.contains(&step) {
                failed_write =
                    std::fs::write(folder.join(format!("{step}.state")), bytes).err().or(failed_write.take());
            }
        }
    })?;
    if let Some(error) = failed_write {
        return Err(file_error(error));
    }
    let retries = session.outputs().retries;
    let end = session.save();
    let name = format!("{steps} steps");
    sheet.at_most(format!("{name}: ledger"), 100.0 * worst, "%", 1.0).retried(retries);
    sheet.at_most(format!("{name}: numbers that are none"), wrong as f64, "", 0.0);
    let figure = sheet.at_most(
        format!("{name}: {saved} saved states, those that restore to another"),
        f64::from(damaged),
        "",
        0.0,
    );
    figure.retried(retries);
    let (mut differing, mut remark) = (0, String::new());
    for from in &replayed {
        let (state, out) = (folder.join(format!("{from}.state")), folder.join(format!("{from}.end")));
        let words = [
            "replay".into(),
            state.into(),
            from.to_string().into(),
            steps.to_string().into(),
            out.clone().into(),
        ];
        let outcome = child::command(&setting.program, words).output();
        let same = std::fs::read(&out).is_ok_and(|bytes| bytes == end);
        if !same {
            differing += 1;
            remark = match outcome {
                Ok(output) => String::from_utf8_lossy(&output.stderr).trim().to_string(),
                Err(error) => error.to_string(),
            };
        }
    }
    let name = format!("{name}: of five states replayed in new processes, those that end otherwise");
    sheet.at_most(name, f64::from(differing), "", 0.0).remarked(remark);
    Ok(())
}

/// The child's part: goes on from a saved state to step `to` and writes the state there.
///
/// # Errors
/// What went wrong, as text.
pub fn replay(state: &str, from: u64, to: u64, out: &str) -> Result<(), String> {
    let bytes = std::fs::read(state).map_err(|e| format!("cannot read '{state}': {e}"))?;
    let mut session = Session::restore(&bytes).map_err(|e| e.to_string())?;
    run(&mut session, from, to, |_, _| {}).map_err(|e| e.to_string())?;
    std::fs::write(PathBuf::from(out), session.save()).map_err(|e| format!("cannot write '{out}': {e}"))
}

/// Instances that step in turn.
const INSTANCES: usize = 32;

/// Fills the sheet of many instances: a process of its own has them, lets them go, and has them again, three
/// times.
pub fn many_instances(setting: &Setting, sheet: &mut Sheet) {
    let rounds = setting.pick(5_u32, 50);
    let words = ["instances".into(), rounds.to_string().into()];
    let output = match child::command(&setting.program, words).output() {
        Ok(output) => output,
        Err(error) => {
            sheet.at_most("32 instances: run", f64::NAN, "", 0.0).remarked(error.to_string());
            return;
        }
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [differing, points, before, first, _, second, _, third, after] = numbers[..] else {
        let text = String::from_utf8_lossy(&output.stderr).trim().to_string();
        sheet.at_most("32 instances: run", f64::NAN, "", 0.0).remarked(text);
        return;
    };
    let name = format!("{INSTANCES} instances of {points} points, {rounds} turns");
    sheet.at_most(format!("{name}: those that end unlike one that ran alone"), differing, "", 0.0);
    let per_point = 1e3 * (first - before) / points / INSTANCES as f64;
    // The project's bound for one large scene: 64 MB for 120,000 points (tests/memory.rs).
    sheet.at_most(format!("{name}: memory per point"), per_point, "byte", 64e6 / 1.2e5);
    let growth = 100.0 * (second.max(third) / first - 1.0);
    sheet.at_most(
        format!("{name}: memory the second and third time over the first"),
        growth.max(0.0),
        "%",
        5.0,
    );
    let kept = 100.0 * (after - before) / (third - before);
    sheet.at_most(format!("{name}: memory that stays when all are gone"), kept, "%", 10.0);
}

/// The child's part of many instances: prints instances that differ, points, and resident memory (kB) before,
/// then three times with all instances and without them.
///
/// # Errors
/// What went wrong, as text.
pub fn hold_instances(rounds: u32) -> Result<(), String> {
    let resident = || -> Result<f64, String> {
        let status = std::fs::read_to_string("/proc/self/status")
            .map_err(|e| format!("memory cannot be measured here: {e}"))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let number = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse().ok());
        number.ok_or_else(|| "memory cannot be measured here".to_string())
    };
    let mut scene = Scene::default();
    scene.numerics.point_spacing = 1.9e-5;
    scene.numerics.threads = 2;
    const TURN: f64 = 2e-8;
    let turn = |session: &mut Session, k: u32| {
        let advance = session.advance_to(f64::from(k) * TURN, &mut |_| true).map_err(|e| e.to_string())?;
        if advance == Advance::Reached { Ok(()) } else { Err("stopped without being asked to".to_string()) }
    };
    let mut alone = Session::new(&scene, 0.0).map_err(|e| e.to_string())?;
    for k in 1..=rounds {
        turn(&mut alone, k)?;
    }
    let (expected, points) = (alone.save(), alone.outputs().active_points);
    drop(alone);
    crate::fmi::abi::give_back_memory();
    let mut figures = vec![resident()?];
    let mut differing = 0;
    for _ in 0..3 {
        let sessions: Result<Vec<Session>, Error> =
            (0..INSTANCES).map(|_| Session::new(&scene, 0.0)).collect();
        let mut sessions = sessions.map_err(|e| e.to_string())?;
        for k in 1..=rounds {
            for session in &mut sessions {
                turn(session, k)?;
            }
        }
        figures.push(resident()?);
        differing += sessions.iter().filter(|session| session.save() != expected).count();
        drop(sessions);
        // As `fmi2FreeInstance` does.
        crate::fmi::abi::give_back_memory();
        figures.push(resident()?);
    }
    let words: Vec<String> = figures.iter().map(ToString::to_string).collect();
    println!("{differing} {points} {}", words.join(" "));
    Ok(())
}
