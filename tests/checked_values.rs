//! No session begins or goes on with a value that is not finite, out of range or at odds with the others,
//! whoever asks.

use swarf::checkpoint::Envelope;
use swarf::material::library;
use swarf::scene::{Accuracy, Inputs, Speed};
use swarf::setup::checks;
use swarf::variables::{self, Causality, Kind};
use swarf::{Error, Scene, Session};

const NO_SLOPES: Inputs = Inputs { tool_velocity: 0.0, feed: 0.0, friction: 0.0 };

/// The values that a range rules out.
fn wrong_values(min: f64, max: f64) -> Vec<f64> {
    let below = min - (1e-9 * min.abs()).max(1e-12);
    let above = max + (1e-9 * max.abs()).max(1e-12);
    let ends = [(min, below), (max, above)].into_iter().filter(|(end, _)| end.is_finite());
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().chain(ends.map(|(_, value)| value)).collect()
}

fn refusal(result: Result<Session, Error>, name: &str, value: f64) -> String {
    match result {
        Ok(_) => panic!("{name} = {value} was taken"),
        Err(error) => error.to_string(),
    }
}

/// A library material's constants are not those in use, yet a wrong one is a mistake that its writer wants to
/// hear of; so every Real is checked, and the text tells what to mend.
#[test]
fn every_real_out_of_its_range_is_refused_by_name() {
    let mut tried = 0;
    for variable in variables::all().filter(|variable| variable.causality() != Causality::Output) {
        let Kind::Real(real) = &variable.kind else { continue };
        for value in wrong_values(real.min, real.max) {
            let mut scene = Scene::default();
            real.access.set_start(&mut scene, value);
            let text = refusal(Session::new(&scene, 0.0), variable.name, value);
            let range = format!("[{}, {}]", real.min, real.max);
            let asked = format!("{} = {value}", variable.name);
            assert!(text.contains(&asked) && text.contains(&range), "{asked} of {range}: {text}");
            tried += 1;
        }
    }
    assert!(tried > 3 * 40, "only {tried} values tried");
}

/// The same for whole numbers, and for a start that no clock can begin at.
#[test]
fn every_integer_out_of_its_range_and_a_start_without_a_time_are_refused() {
    for variable in variables::all().filter(|variable| variable.causality() == Causality::Parameter) {
        let Kind::Integer(integer) = &variable.kind else { continue };
        let wrong = [integer.min.checked_sub(1), integer.max.checked_add(1)];
        for value in wrong.into_iter().flatten() {
            let mut scene = Scene::default();
            integer.access.set_start(&mut scene, value);
            let text = refusal(Session::new(&scene, 0.0), variable.name, value.into());
            assert!(text.contains(&format!("{} = {value}", variable.name)), "{text}");
        }
    }
    for start in [f64::NAN, f64::INFINITY] {
        assert!(refusal(Session::new(&Scene::default(), start), "start", start).contains("start time"));
    }
}

/// A state holds the scene as built, and is checked like any other: what a library, a preset or a speed level
/// puts in must lie inside the ranges, or no state of such a run could be read back.
#[test]
fn what_is_filled_in_lies_inside_the_ranges() {
    let mut tried = 0;
    for material in library::names() {
        for (_, accuracy) in Accuracy::ALL {
            for (_, speed) in Speed::ALL {
                let mut scene = Scene::default();
                scene.material.name = material.into();
                (scene.numerics.accuracy, scene.numerics.speed) = (*accuracy, *speed);
                let built = checks::check(&scene).expect("a good scene");
                if let Err(error) = variables::check_ranges(&built) {
                    panic!("{material}, {accuracy:?}, {speed:?}: {error}");
                }
                tried += 1;
            }
        }
    }
    assert!(tried > 12, "only {tried} scenes tried");
}

/// A small cut, four microseconds old.
fn session() -> Session {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = 4e-5;
    scene.numerics.threads = 1;
    let mut session = Session::new(&scene, 0.0).expect("a good scene");
    session.advance_to(4e-6, &mut |_| true).expect("a good run");
    session
}

/// Inputs may come at every communication point, and what is refused leaves the old ones in force.
#[test]
fn inputs_and_slopes_that_cannot_be_are_refused_and_change_nothing() {
    let mut session = session();
    let good = session.scene().inputs;
    let before = session.save();
    for variable in variables::all().filter(|variable| variable.causality() == Causality::Input) {
        let Kind::Real(real) = &variable.kind else { continue };
        let variables::Access::Input { set, .. } = &real.access else { continue };
        for value in wrong_values(real.min, real.max) {
            let mut inputs = good;
            set(&mut inputs, value);
            let text = session.set_inputs(inputs, NO_SLOPES).expect_err(variable.name).to_string();
            assert!(text.contains(&format!("{} = {value}", variable.name)), "{text}");
        }
        for value in [f64::NAN, f64::INFINITY] {
            let mut slopes = NO_SLOPES;
            set(&mut slopes, value);
            let text = session.set_inputs(good, slopes).expect_err(variable.name).to_string();
            assert!(text.contains(&format!("slope {value} of {}", variable.name)), "{text}");
        }
    }
    let too_deep = Inputs { feed: 0.99e-3, ..good };
    assert!(session.set_inputs(too_deep, NO_SLOPES).is_err(), "a feed of nearly the workpiece's height");
    assert!(session.save() == before, "a refused input changed the state");
}

/// The envelope of a session's bytes, as `session` has it.
const ENVELOPE: Envelope = Envelope { word: *b"SWARFRUN", format: 10, origin: &[], of: "swarf" };

/// Bytes whose checksum is right may still hold anything: each number of the state is looked at, not only the
/// sum over it.
#[test]
fn a_state_with_a_wrong_value_is_refused_though_its_checksum_is_right() {
    let session = session();
    let saved = session.save();
    let content = ENVELOPE.open(&saved).expect("own bytes").to_vec();
    assert!(Session::restore(&ENVELOPE.seal(&[&content])).is_ok(), "sealed again it is the same state");
    let scene = session.scene();
    let outputs = session.outputs();
    let fields = session.point_fields();
    let most = |values: Vec<f64>| {
        values.into_iter().fold(0.0, |most: f64, v| if v.abs() > most.abs() { v } else { most })
    };
    let hottest = most(fields.temperature.clone());
    let fastest = most(fields.velocity.iter().map(|velocity| velocity[0]).collect());
    let wrong = [
        ("numerics.point_spacing", scene.numerics.point_spacing, f64::NAN),
        ("numerics.point_spacing", scene.numerics.point_spacing, 1.0),
        ("workpiece.initial_temperature", scene.workpiece.initial_temperature, -1.0),
        ("tool_velocity", scene.inputs.tool_velocity, 1e9),
        ("time", session.time(), f64::INFINITY),
        ("time", session.time(), 1.0),
        ("clock", fields.time, f64::NAN),
        ("clock", fields.time, 1e-9),
        ("time step", outputs.time_step, f64::NAN),
        ("energy ledger", outputs.tool_work, f64::NAN),
        ("tool_position_x", outputs.tool_position_x, f64::NAN),
        ("cutting_force", outputs.cutting_force, f64::NEG_INFINITY),
        ("point", hottest, f64::NAN),
        ("point", hottest, -1.0),
        ("point", fastest, f64::NAN),
    ];
    for (name, old, new) in wrong {
        let (old, new_bytes) = (old.to_le_bytes(), new.to_le_bytes());
        // Points stand behind all else, and outputs show some of their numbers.
        let mut places = (0..content.len() - 8).filter(|&at| content[at..at + 8] == old);
        let place = if name == "point" { places.next_back() } else { places.next() };
        let place = place.unwrap_or_else(|| panic!("{name} is not in the bytes"));
        let mut changed = content.clone();
        changed[place..place + 8].copy_from_slice(&new_bytes);
        match Session::restore(&ENVELOPE.seal(&[&changed])) {
            Ok(_) => panic!("a state with {name} = {new} at byte {place} was taken"),
            Err(error) => assert!(matches!(error, Error::DamagedState(_)), "{name} = {new}: {error}"),
        }
    }
    let more = [content.as_slice(), &[0; 8]].concat();
    assert!(Session::restore(&ENVELOPE.seal(&[&more])).is_err(), "bytes behind the state were taken");
}
