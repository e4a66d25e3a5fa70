//! The packaged FMU as an importer meets it, through the `fmi` crate. `cargo xtask package` makes it first.

use std::path::{Path, PathBuf};

use fmi::fmi2::instance::Common;
use fmi::traits::FmiStatus;
use swarf_master::fmu::output_variables;
use swarf_master::{Fmu, Instance};

/// A spacing that runs a cut in about a second.
const DRAFT: &str = "4e-5";

fn packaged() -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/swarf.fmu");
    assert!(path.is_file(), "'{}' is missing: run `cargo xtask package`", path.display());
    path
}

/// An instance of the cut at draft size, initialized.
fn begun<'a>(fmu: &'a Fmu, name: &str, set: &[(&str, &str)]) -> Instance<'a> {
    let mut instance = fmu.instantiate(name).unwrap();
    instance.set_text("numerics.point_spacing", DRAFT).unwrap();
    for (variable, value) in set {
        instance.set_text(variable, value).unwrap();
    }
    instance.initialize(0.0, 4e-5).unwrap();
    instance
}

/// Steps of one microsecond from one to another; the bits of all outputs after each.
fn run(instance: &mut Instance, from: u32, to: u32) -> Vec<Vec<u64>> {
    let step = |number: u32| f64::from(number) * 1e-6;
    (from..to)
        .map(|number| {
            instance.step(step(number), step(number + 1) - step(number)).unwrap();
            instance.outputs().unwrap().into_iter().map(f64::to_bits).collect()
        })
        .collect()
}

/// A results file is read beside the FMU's outputs, so the columns must go by the same names and units.
#[test]
fn the_columns_of_result_files_are_outputs_of_the_fmu() {
    let fmu = Fmu::load(&packaged()).unwrap();
    for column in swarf::variables::COLUMNS {
        let variable = fmu.description.variable(column.name).unwrap();
        assert_eq!(variable.causality, "output", "{}", column.name);
        if let swarf_master::description::Type::Real(unit) = &variable.kind {
            let unit = if unit.is_empty() { "1" } else { unit };
            assert_eq!(unit, column.unit, "unit of {}", column.name);
        }
    }
    assert_eq!(output_variables(&fmu.description).len(), swarf::variables::COLUMNS.len());
}

/// A reset instance has nothing left of its first life.
#[test]
fn a_reset_instance_runs_bit_identically() {
    let fmu = Fmu::load(&packaged()).unwrap();
    let mut instance = begun(&fmu, "reset", &[("friction", "0.1")]);
    let first = run(&mut instance, 0, 6);
    instance.raw.reset().unwrap();
    instance.set_text("numerics.point_spacing", DRAFT).unwrap();
    instance.set_text("friction", "0.1").unwrap();
    instance.initialize(0.0, 4e-5).unwrap();
    assert!(run(&mut instance, 0, 6) == first, "a run after reset differs");
}

/// A saved state holds everything: kept in the instance or as bytes in another one, the run goes on as if
/// unbroken.
#[test]
fn a_restored_state_continues_bit_identically() {
    let fmu = Fmu::load(&packaged()).unwrap();
    let mut instance = begun(&fmu, "save", &[]);
    run(&mut instance, 0, 4);
    let state = instance.raw.get_fmu_state().unwrap();
    let bytes = instance.raw.serialize_fmu_state(&state).unwrap();
    let unbroken = run(&mut instance, 4, 8);
    instance.raw.set_fmu_state(&state).ok().unwrap();
    assert!(run(&mut instance, 4, 8) == unbroken, "a run after setFMUstate differs");
    let mut other = begun(&fmu, "other", &[]);
    let state = other.raw.deserialize_fmu_state(&bytes).unwrap();
    other.raw.set_fmu_state(&state).ok().unwrap();
    assert!(run(&mut other, 4, 8) == unbroken, "a run after deSerializeFMUstate differs");
}

/// Two instances in one process share no state, whatever their order of calls.
#[test]
fn a_second_instance_beside_changes_nothing() {
    let fmu = Fmu::load(&packaged()).unwrap();
    let alone = run(&mut begun(&fmu, "alone", &[]), 0, 5);
    let (mut one, mut two) =
        (begun(&fmu, "one", &[]), begun(&fmu, "two", &[("feed", "2e-4"), ("friction", "0")]));
    let mut beside = Vec::new();
    for number in 0..5 {
        beside.extend(run(&mut one, number, number + 1));
        run(&mut two, number, number + 1);
    }
    assert!(beside == alone, "a run beside another differs");
}

/// A refused value changes nothing: the run that follows is the one without the attempt.
#[test]
fn a_refused_value_changes_nothing() {
    let fmu = Fmu::load(&packaged()).unwrap();
    let plain = run(&mut begun(&fmu, "plain", &[]), 0, 3);
    let mut instance = begun(&fmu, "refused", &[]);
    for (name, value) in [("tool_velocity", "900"), ("friction", "-1"), ("feed", "NaN"), ("feed", "2e-3")] {
        assert!(instance.set_text(name, value).is_err(), "{name} = {value} was accepted");
    }
    assert!(
        instance.set_text("workpiece.height", "2e-3").is_err(),
        "a fixed parameter was changed on the way"
    );
    assert!(run(&mut instance, 0, 3) == plain, "a refused value changed the run");
}

/// The FMU's own files can be read back, name the run, and hold every point.
#[test]
fn results_are_written_where_asked() {
    let folder = std::env::temp_dir().join(format!("swarf-fmu-results-{}", std::process::id()));
    let fmu = Fmu::load(&packaged()).unwrap();
    let place = folder.display().to_string();
    let mut instance = begun(&fmu, "results", &[("results.directory", &place), ("results.interval", "1e-6")]);
    run(&mut instance, 0, 3);
    let points = instance.get("numerics.active_points").unwrap();
    let frames = swarf::output::results::frames_in(&folder).unwrap();
    // At 0, 1 and 2 µs, and at 3 µs where the solver's clock has passed it.
    assert!((3..=4).contains(&frames.len()), "{} frames", frames.len());
    let (file, outline) = &frames[2];
    let fields = swarf::output::vtk::read_points(file, Some(outline)).unwrap();
    assert_eq!(fields.position.len() as f64, points, "points in the file");
    assert!((2e-6..2.1e-6).contains(&fields.time), "time {}", fields.time);
    assert!(fields.tool_outline.len() >= 4, "{:?}", fields.tool_outline);
    let history = std::fs::read_to_string(folder.join("history.csv")).unwrap();
    assert!(history.contains("# friction = 0.2") && history.contains(swarf::VERSION), "{history}");
    std::fs::remove_dir_all(&folder).unwrap();
}
