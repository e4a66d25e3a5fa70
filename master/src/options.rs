//! What the command line asks for.

use std::path::PathBuf;

use clap::Parser;

use crate::arguments::Arguments;
use crate::units::seconds;

/// Runs one cut through a packaged FMU: tables, plots and pictures
#[derive(Parser, Clone, Debug, PartialEq)]
#[command(name = "swarf-master", version)]
pub struct CommandLine {
    /// The packaged FMU
    pub fmu: PathBuf,
    /// What a cut can be told.
    #[command(flatten)]
    pub cut: Arguments,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The packaged FMU.
    pub fmu: PathBuf,
    /// Folder for everything written.
    pub out: PathBuf,
    /// Variables to set, in this order.
    pub set: Vec<(String, String)>,
    /// End (s); otherwise 2 mm of travel, or what the workpiece lets it.
    pub stop: Option<f64>,
    /// Communication step (s).
    pub step: Option<f64>,
    /// Run a twin at twice the spacing, for bands of this scene's own.
    pub band: bool,
    /// Only tell what the run would cost.
    pub estimate: bool,
}

impl Options {
    /// The run that a command line asks for.
    ///
    /// # Errors
    /// Says which value is wrong, and what is allowed.
    pub fn of(line: CommandLine) -> Result<Options, String> {
        let CommandLine { fmu, cut } = line;
        let time = |option: &str, text: Option<String>| text.map(|text| seconds(option, &text)).transpose();
        let mut set = cut.set;
        let spacing = [(cut.paper, "5e-6"), (cut.quick, "4e-5")].into_iter().find(|preset| preset.0);
        if let Some((_, spacing)) = spacing {
            // In front: a `--set` of the same name counts more.
            set.insert(0, ("numerics.point_spacing".into(), spacing.into()));
        }
        Ok(Options {
            fmu,
            out: cut.out.unwrap_or_else(|| "target/cut".into()),
            set,
            stop: time("--stop", cut.stop)?,
            step: time("--step", cut.step)?,
            band: cut.band,
            estimate: cut.estimate,
        })
    }

    /// What was set for a variable; the last counts.
    pub fn set_value(&self, name: &str) -> Option<&str> {
        self.set.iter().rfind(|pair| pair.0 == name).map(|pair| pair.1.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Options, String> {
        let words = std::iter::once("swarf-master").chain(line.split(' '));
        Options::of(CommandLine::try_parse_from(words).map_err(|e| e.to_string())?)
    }

    /// A value set by name counts more than the preset, wherever it stands on the line.
    #[test]
    fn a_set_value_comes_after_the_preset() {
        let options = read("a.fmu --set numerics.point_spacing=2e-5 --set friction=0 --paper").unwrap();
        assert_eq!(options.set_value("numerics.point_spacing"), Some("2e-5"));
        assert_eq!(options.set.len(), 3);
        assert_eq!(options.set_value("feed"), None);
    }

    /// Every option reaches the run by the name that scripts use.
    #[test]
    fn every_option_is_read() {
        let line = "--stop 40us --step 0.5us --out there --estimate --quick --set feed=0.5mm a.fmu";
        let options = read(line).unwrap();
        let set = [("numerics.point_spacing", "4e-5"), ("feed", "0.5mm")];
        let expected = Options {
            fmu: "a.fmu".into(),
            out: "there".into(),
            set: set.map(|(name, value)| (name.into(), value.into())).into(),
            stop: options.stop,
            step: options.step,
            band: false,
            estimate: true,
        };
        assert_eq!(options, expected);
        let times = [(options.stop, 4e-5), (options.step, 5e-7)];
        for (read, wanted) in times {
            // One division by a million.
            assert!(
                read.is_some_and(|t| (t - wanted).abs() <= f64::EPSILON * wanted),
                "{read:?} for {wanted}"
            );
        }
        assert_eq!(read("a.fmu").unwrap().out, PathBuf::from("target/cut"));
    }

    /// A slip on the command line is answered before anything is run, in a few lines.
    #[test]
    fn slips_are_refused_with_what_is_needed() {
        let cases = [
            ("--paper", "<FMU>"),
            ("a.fmu --stop -1", "above 0"),
            ("a.fmu --step 1um", "0.04ms"),
            ("a.fmu --set friction", "NAME=VALUE"),
            ("a.fmu --set =0", "NAME=VALUE"),
            ("a.fmu --papre", "'--paper'"),
            ("a.fmu b.fmu", "unexpected argument 'b.fmu'"),
            ("a.fmu --paper --quick", "cannot be used with"),
            ("a.fmu --band --estimate", "cannot be used with"),
            ("a.fmu --out", "a value is required"),
        ];
        for (line, expected) in cases {
            let error = read(line).unwrap_err();
            assert!(error.contains(expected), "'{line}' gave: {error}");
            assert!(error.lines().count() <= 9, "'{line}' gave a manual: {error}");
        }
    }
}
