//! What accuracy costs: the short study, the estimate, and the presets.

use std::fs;
use swarf::scene::{Accuracy, Precision, Scene, Speed};
use swarf::session::Session;
use swarf::session::cost_estimate::Estimate;
use swarf::study::accuracy::{Options, study};

/// 0.2 mm of a small cut.
fn small(spacing: f64, speed: Speed) -> Scene {
    let mut scene = Scene::default();
    (scene.workpiece.length, scene.workpiece.height) = (1e-3, 8e-4);
    (scene.numerics.point_spacing, scene.numerics.speed, scene.numerics.threads) = (spacing, speed, 1);
    scene
}

/// The number of substeps follows from the first one's length: it must be met whatever the machine is doing.
/// CPU time is not compared here; `cargo xtask accuracy` shows its ratio for every run.
#[test]
fn the_estimate_knows_the_number_of_substeps() {
    for (spacing, speed) in
        [(5e-5, Speed::Exact), (2.5e-5, Speed::Exact), (4e-5, Speed::Balanced), (4e-5, Speed::Fast)]
    {
        let mut session = Session::new(&small(spacing, speed), 0.0).unwrap();
        let stop = 4e-6;
        let Estimate { substeps, cpu_seconds } = session.estimate(stop).unwrap();
        assert!(cpu_seconds > 0.0 && session.outputs().estimated_cpu_time == cpu_seconds);
        session.advance_to(stop, &mut |_| true).unwrap();
        let made = f64::from(session.outputs().substeps);
        let ratio = made / substeps;
        println!("{spacing:e} m, {speed:?}: {made} substeps, {substeps:.0} estimated");
        // 5 %: what compression at the tool adds to the speed of sound, beside what the formula takes for it.
        assert!(
            (ratio - 1.0).abs() < 0.05,
            "{made} substeps made, {substeps} estimated at {spacing} m, {speed:?}"
        );
    }
}

/// A scene too large to calibrate on itself is calibrated on a coarser copy; its substeps are longer by the
/// coarseness.
#[test]
fn a_large_scene_is_estimated_from_a_coarser_one() {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = 4e-6;
    let mut session = Session::new(&scene, 0.0).unwrap();
    let estimate = session.estimate(4e-5).unwrap();
    // Sound and tool cross a cell of 8 µm: the substep that the solver itself takes first.
    session.advance_to(1e-12, &mut |_| true).unwrap();
    let first = session.outputs().time_step;
    let ratio = estimate.substeps * first / 4e-5;
    assert!((ratio - 1.0).abs() < 0.05, "{} substeps estimated, the first of {first} s", estimate.substeps);
}

/// The measured estimate makes substeps of a copy: the run itself must not know of it.
#[test]
fn an_estimate_leaves_no_trace() {
    let mut asked = Session::new(&small(5e-5, Speed::Exact), 0.0).unwrap();
    let mut other = asked.clone();
    assert!(asked.estimate_on_this_machine(4e-6).unwrap() > 0.0);
    for session in [&mut asked, &mut other] {
        session.advance_to(5e-7, &mut |_| true).unwrap();
    }
    assert!(asked.save() == other.save(), "states differ after an estimate");
}

/// Regressions compare all outputs, so an output may not hang on the machine: what is returned is the same in
/// every run, goes with the inverse of the rate and is part of a state.
#[test]
fn the_estimate_that_is_returned_is_the_same_in_every_run() {
    let estimate = |rate: f64| {
        let mut scene = small(5e-5, Speed::Exact);
        scene.numerics.point_rate = rate;
        let mut session = Session::new(&scene, 0.0).unwrap();
        let estimate = session.estimate(4e-5).unwrap().cpu_seconds;
        let restored = Session::restore(&session.save()).unwrap();
        assert_eq!(restored.outputs().estimated_cpu_time, estimate);
        estimate
    };
    let start = Scene::default().numerics.point_rate;
    let first = estimate(start);
    for _ in 0..5 {
        assert_eq!(estimate(start).to_bits(), first.to_bits());
    }
    // Halving is exact.
    assert_eq!(estimate(0.5 * start).to_bits(), (2.0 * first).to_bits());
}

/// A preset reaches the solver: spacing and speed level are in use, and the band is that of the price list.
#[test]
fn presets_reach_the_solver() {
    let mut bands = Vec::new();
    for accuracy in [Accuracy::Draft, Accuracy::Standard] {
        let mut scene = Scene::default();
        scene.numerics.accuracy = accuracy;
        let session = Session::new(&scene, 0.0).unwrap();
        let preset =
            swarf::scene::presets::PRESETS.iter().find(|preset| preset.accuracy == accuracy).unwrap();
        assert_eq!(session.scene().numerics.point_spacing, preset.point_spacing);
        let is_single = session.scene().numerics.precision == Precision::Single;
        assert_eq!(is_single, preset.speed != Speed::Exact);
        let band = session.outputs().force_error_band;
        let listed =
            swarf::scene::presets::prices().iter().find(|price| price.name == preset.name).unwrap().bands[0];
        // The list is rounded to 1e-4, and a band above 1 is shown as 1.
        assert!((band - listed.min(1.0)).abs() < 2e-4, "band {band}, in the list {listed}");
        bands.push(band);
    }
    assert!(bands[1] <= bands[0], "a dearer preset promises less: {bands:?}");
}

/// The short form of the study: every line stands in the table, those that fail too; a second call runs
/// nothing again.
#[test]
fn the_study_is_complete_and_resumes() {
    let folder = std::env::temp_dir().join(format!("swarf-accuracy-{}", std::process::id()));
    let options = Options { is_quick: true, threads: 2, runs: true };
    let text = study(&folder, options, &|_| {}).unwrap();
    for method in
        ["default", "shape linear", "speed fast", "transfer apic", "contact velocity", "piston shock"]
    {
        assert!(text.contains(&format!("| {method} |")), "no {method} in\n{text}");
    }
    for name in ["accuracy.md", "pareto_cut.png", "pareto_exact.png", "convergence.png"] {
        assert!(folder.join(name).exists(), "{name} is missing");
    }
    let before = fs::read_to_string(folder.join("runs.csv")).unwrap();
    let told = std::sync::Mutex::new(Vec::new());
    study(&folder, options, &|line| told.lock().unwrap().push(line)).unwrap();
    assert_eq!(fs::read_to_string(folder.join("runs.csv")).unwrap(), before);
    let told = told.into_inner().unwrap();
    // What this version refuses is asked again each time, and costs nothing.
    assert!(told[1..].iter().all(|line| line.contains("refused")), "{told:?}");
    // A run that failed is told in its line of the table, and not left out.
    let line = before.lines().find(|line| line.contains("shape linear")).unwrap();
    let failed = before.replace(line, &line.replace(",done,", ",failed: made up for the test,"));
    assert_ne!(failed, before);
    fs::write(folder.join("runs.csv"), failed).unwrap();
    let text = study(&folder, Options { runs: false, ..options }, &|_| {}).unwrap();
    let has_failed = |line: &str| line.starts_with("| shape linear |") && line.contains("failed: made up");
    assert!(text.lines().any(has_failed), "{text}");
    fs::remove_dir_all(&folder).unwrap();
}
