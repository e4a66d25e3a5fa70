//! The parameter `settings`: names and values as one text, for importers that cannot reach a variable itself.
//!
//! ```text
//! effects.heat=conduction; numerics.accuracy=fine; material.name=AISI_1045; feed=0.2 mm
//! ```
//!
//! Some masters drop enumerations, some take their numbers only, some have no units. A value is read as
//! `text::set_by_name` reads it. What is set by the variable itself wins: an entry counts where its variable
//! stands at its start value. So a scene that has taken its entries over takes nothing more from them.

use super::by_name;
use super::text::{set_by_name, start_text};
use crate::Error;
use crate::scene::Scene;

/// Name of the parameter.
pub const NAME: &str = "settings";

/// An entry and what became of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The variable.
    pub name: &'static str,
    /// Its value as it would be written into a file.
    pub value: String,
    /// The value that the variable was given by itself and keeps, if it was given another.
    pub kept: Option<String>,
}

/// The scene with its settings taken over, and what became of each of them.
///
/// # Errors
/// An entry that is no `name=value`, stands there twice, or is refused by `set_by_name`; the text names the
/// entry and what is allowed.
pub fn take_over(scene: &Scene) -> Result<(Scene, Vec<Entry>), Error> {
    let (start, mut taken) = (Scene::default(), scene.clone());
    let mut entries: Vec<Entry> = Vec::new();
    for (name, text) in pairs(&scene.settings)? {
        let refused = |reason: &str| Error::Inconsistent(format!("{NAME}: {name}={text}: {reason}"));
        if name == NAME {
            return Err(refused("settings do not hold settings; allowed: parameters and inputs"));
        }
        // Checked alone, so that a wrong entry is told even where another value wins.
        let mut alone = start.clone();
        set_by_name(&mut alone, name, text).map_err(|error| refused(&error.to_string()))?;
        let Some(variable) = by_name(name) else { continue };
        if entries.iter().any(|entry| entry.name == variable.name) {
            return Err(refused("this variable stands there twice; allowed: once"));
        }
        let shown = |scene: &Scene| start_text(variable, scene).unwrap_or_default();
        let (own, value) = (shown(scene), shown(&alone));
        let is_free = own == shown(&start);
        if is_free {
            set_by_name(&mut taken, name, text).map_err(|error| refused(&error.to_string()))?;
        }
        let kept = (!is_free && own != value).then_some(own);
        entries.push(Entry { name: variable.name, value, kept });
    }
    Ok((taken, entries))
}

/// One line for the log on what was taken over; `None` without settings.
pub fn summary(entries: &[Entry]) -> Option<String> {
    let told = entries.iter().map(|Entry { name, value, kept }| match kept {
        None => format!("{name} = {value}"),
        Some(own) => format!("{name} stays {own} as set by itself, not {value}"),
    });
    (!entries.is_empty()).then(|| format!("{NAME} taken over: {}", told.collect::<Vec<_>>().join(", ")))
}

/// The text of a variable in settings that can be read.
pub fn text_of<'a>(settings: &'a str, name: &str) -> Option<&'a str> {
    pairs(settings).ok()?.into_iter().find(|pair| pair.0 == name).map(|pair| pair.1)
}

/// Names and values, which semicolons or ends of lines divide.
fn pairs(settings: &str) -> Result<Vec<(&str, &str)>, Error> {
    let entries = settings.split([';', '\n']).map(str::trim).filter(|entry| !entry.is_empty());
    entries
        .map(|entry| {
            let (name, value) = entry.split_once('=').ok_or_else(|| {
                Error::Inconsistent(format!(
                    "{NAME}: '{entry}' cannot be read; allowed are entries name=value with semicolons between them, \
                     such as effects.heat=conduction; feed=0.2 mm"
                ))
            })?;
            Ok((name.trim(), value.trim()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Accuracy, Heat};

    fn scene(settings: &str) -> Scene {
        Scene { settings: settings.into(), ..Scene::default() }
    }

    /// One text reaches variables of every type, in any unit, enumerations by name and by number.
    #[test]
    fn settings_reach_every_type() {
        let text = " effects.heat=conduction;numerics.accuracy = 3 ; material.name=AISI_1045;\n\
                    feed=0.2 mm; numerics.threads=2; effects.rate=false; workpiece.initial_temperature=25 degC;";
        let (taken, entries) = take_over(&scene(text)).unwrap();
        assert_eq!(taken.effects.heat, Heat::Conduction);
        assert_eq!(taken.numerics.accuracy, Accuracy::Fine);
        assert_eq!(taken.material.name, "AISI_1045");
        assert!((taken.inputs.feed - 2e-4).abs() <= f64::EPSILON * 2e-4, "feed {}", taken.inputs.feed);
        assert_eq!((taken.numerics.threads, taken.effects.rate), (2, false));
        assert_eq!(taken.workpiece.initial_temperature, 298.15);
        assert_eq!(entries.len(), 7);
        let line = summary(&entries).unwrap();
        assert!(
            line.starts_with("settings taken over: effects.heat = conduction, numerics.accuracy = fine"),
            "{line}"
        );
        // A state holds the scene as built: taking over again changes nothing.
        assert_eq!(take_over(&taken).unwrap().0, taken);
        let plain = Scene::default();
        assert_eq!(take_over(&plain).unwrap(), (plain, Vec::new()));
        assert_eq!(summary(&[]), None);
    }

    /// Who sets a variable itself means it; the log says that the settings' value did not count.
    #[test]
    fn what_is_set_by_itself_wins() {
        let mut own = scene("feed=0.2mm; friction=0.1; tool.rake_angle=10 deg");
        own.inputs.feed = 1e-4;
        own.tool.rake_angle = 10f64.to_radians();
        let (taken, entries) = take_over(&own).unwrap();
        assert_eq!((taken.inputs.feed, taken.inputs.friction), (1e-4, 0.1));
        let line = summary(&entries).unwrap();
        assert!(line.contains("feed stays 1e-4 as set by itself, not 2e-4"), "{line}");
        assert_eq!(entries.iter().filter(|entry| entry.kept.is_some()).count(), 1, "{entries:?}");
    }

    /// A slip is answered with the entry, and with what would do.
    #[test]
    fn slips_are_refused_with_entry_and_what_is_allowed() {
        let cases = [
            ("feed", "'feed' cannot be read", "name=value"),
            ("feed=0.2 mm, friction=0", "feed=0.2 mm, friction=0", "one of: m, mm"),
            ("effects.heat=hot", "effects.heat=hot", "none (1), adiabatic (2), conduction (3)"),
            ("effects.haet=none", "effects.haet=none", "did you mean 'effects.heat'"),
            ("numerics.courant=3", "numerics.courant=3", "[0.01, 1.25]"),
            ("cutting_force=1", "cutting_force=1", "is an output"),
            ("friction=0; friction=1", "friction=1", "twice"),
            ("settings=friction", "settings=friction", "parameters and inputs"),
        ];
        for (text, entry, allowed) in cases {
            let message = take_over(&scene(text)).unwrap_err().to_string();
            assert!(message.starts_with("settings: "), "{message}");
            assert!(message.contains(entry) && message.contains(allowed), "{text}: {message}");
        }
    }

    /// A master that plans a run by a start value finds it in the settings.
    #[test]
    fn the_text_of_one_variable_is_found() {
        assert_eq!(text_of("feed=0.2 mm; friction = 0", "friction"), Some("0"));
        assert_eq!(text_of("feed=0.2 mm", "friction"), None);
    }
}
