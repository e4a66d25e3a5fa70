//! What is shown at communication points, however far apart they are, and what files show of it.

use std::fs;
use std::path::PathBuf;
use swarf::variables::{COLUMNS, Outputs};
use swarf::{Scene, Session};

/// The cut at 40 µm on one thread.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = 4e-5;
    scene.numerics.threads = 1;
    scene
}

fn advance(session: &mut Session, time: f64) {
    session.advance_to(time, &mut |_| true).expect("a good run");
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("swarf-communication-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    path
}

/// Masters make steps of rounding size to land on a time. Within a substep the force is the substep's own,
/// however short the step is; a difference of running totals would be one of rounding.
#[test]
fn a_remainder_step_shows_the_force_of_its_substep() {
    let mut session = Session::new(&scene(), 0.0).expect("a good scene");
    let mut time = 0.0;
    for _ in 0..5 {
        time += 1e-6;
        advance(&mut session, time);
    }
    let shown = |step: f64| {
        let mut copy = session.clone();
        advance(&mut copy, time + step);
        assert!(time + step > time, "{step} s is no step at {time} s");
        copy.outputs().clone()
    };
    // A thousandth of a substep is a sound difference of totals to compare with: 1e-12 s of impulses known to
    // 1e-16.
    let sound = shown(1e-3 * session.outputs().time_step);
    assert!(sound.cutting_force > 100.0 && sound.substeps == 0, "{sound:?}");
    // The smallest step that the clock can make, and some in between.
    let least = f64::from_bits(time.to_bits() + 1) - time;
    for step in [1e-15, 1e-17, 1e-19, 1e-20, 2.0 * least, least] {
        let o = shown(step);
        for (name, value, expected) in [
            ("cutting force", o.cutting_force, sound.cutting_force),
            ("thrust force", o.thrust_force, sound.thrust_force),
            ("power", o.cutting_power, sound.cutting_power),
        ] {
            assert_eq!(value, expected, "{name} over {step} s");
        }
        assert_eq!(o.sticking_share, sound.sticking_share, "sticking share over {step} s");
    }
}

/// Power and force are the same substep's, and the tool's speed is constant.
#[test]
fn power_over_a_remainder_step_is_force_times_speed() {
    let mut session = Session::new(&scene(), 0.0).expect("a good scene");
    advance(&mut session, 5e-6);
    advance(&mut session, 5e-6 + 1e-20);
    let o = session.outputs();
    let expected = o.cutting_force * session.scene().inputs.tool_velocity;
    // The work of one substep is a difference of totals a thousand times its size.
    assert!(
        (o.cutting_power / expected - 1.0).abs() < 1e-9,
        "{} W, force times speed {expected} W",
        o.cutting_power
    );
}

/// Rows of a history by their time: the outputs as texts.
fn rows(folder: &std::path::Path) -> Vec<(f64, Vec<f64>)> {
    let text = fs::read_to_string(folder.join("history.csv")).expect("a history");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let head = lines.next().expect("a head");
    let names: Vec<&str> = COLUMNS.iter().map(|column| column.name).collect();
    assert_eq!(head, format!("time,{}", names.join(",")));
    lines
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|number| number.parse().expect("a number")).collect();
            (numbers[0], numbers[1..].to_vec())
        })
        .collect()
}

fn values(outputs: &Outputs) -> Vec<f64> {
    COLUMNS.iter().map(|column| (column.value)(outputs)).collect()
}

/// Whoever reads the file beside the FMU's outputs finds the same numbers at the same times, be the step of
/// the length of the interval or of many; and the file does not change the run.
#[test]
fn a_row_of_the_history_holds_what_is_returned_at_its_time() {
    for (step, interval) in [(6e-6_f64, 6e-6_f64), (1e-6, 1e-6), (3e-6, 1e-6), (1e-6, 2e-6)] {
        let folder = folder("rows");
        let mut scene = scene();
        scene.results.directory = folder.display().to_string();
        scene.results.interval = interval;
        let mut session = Session::new(&scene, 0.0).expect("a good scene");
        let mut expected = vec![(0.0, values(session.outputs()))];
        for k in 1..=(6e-6 / step).round() as i32 {
            let time = f64::from(k) * step;
            advance(&mut session, time);
            expected.push((time, values(session.outputs())));
        }
        assert!(session.outputs().cutting_force > 100.0, "the tool does not cut");
        let rows = rows(&folder);
        assert_eq!(rows.len(), 1 + (6e-6 / interval).round() as usize, "rows of {interval} s");
        let mut compared = 0;
        for (time, row) in &rows {
            if let Some((_, outputs)) = expected.iter().find(|(at, _)| at == time) {
                assert_eq!(row, outputs, "row at {time} s, steps of {step} s");
                compared += 1;
            }
        }
        let both = step.max(interval);
        assert_eq!(compared, 1 + (6e-6 / both).round() as i32, "rows at communication points");
        // Between them a row is what a step that ends there returns, in a run without files.
        if interval < step {
            let (time, row) = &rows[2];
            let plain = Scene { results: Scene::default().results, ..scene.clone() };
            let mut other = Session::new(&plain, 0.0).expect("a good scene");
            advance(&mut other, *time);
            assert_eq!(row, &values(other.outputs()), "row at {time} s in a step of {step} s");
        }
        drop(session);
        fs::remove_dir_all(&folder).expect("own folder");
    }
}

/// Two runs in one directory would leave files of both; the second is told, the first goes on, and the
/// directory is free when it is gone.
#[test]
fn a_second_run_in_the_same_directory_is_refused() {
    let folder = folder("twice");
    let mut scene = scene();
    scene.results.directory = folder.display().to_string();
    let mut first = Session::new(&scene, 0.0).expect("a good scene");
    advance(&mut first, 1e-7);
    scene.results.directory = folder.join(".").display().to_string();
    let second = |scene: &Scene| Session::new(scene, 0.0).map(|_| ()).expect_err("taken").to_string();
    let text = second(&scene);
    assert!(text.contains("results.directory is in use by another run"), "{text}");
    // A state of the first is no second run until it writes; by then the first may be gone.
    let (mut copy, bytes) = (first.clone(), first.save());
    let mut restored = Session::restore(&bytes).expect("own bytes");
    advance(&mut first, 2.5e-6);
    let error = copy.advance_to(2.5e-6, &mut |_| true).expect_err("the first is there").to_string();
    assert!(error.contains("in use by another run"), "{error}");
    let history = fs::read_to_string(folder.join("history.csv")).expect("a history");
    drop(first);
    advance(&mut restored, 2.5e-6);
    assert_eq!(fs::read_to_string(folder.join("history.csv")).expect("a history"), history);
    assert!(second(&scene).contains("in use by another run"));
    restored.release_results();
    drop(Session::new(&scene, 0.0).expect("a free directory"));
    assert!(!folder.join(".swarf.lock").exists(), "a lock is left behind");
    fs::remove_dir_all(&folder).expect("own folder");
}
