//! What the command line asks for.

use std::path::PathBuf;

const USAGE: &str = "swarf-master FMU [--paper | --quick] [--set NAME=VALUE]... [--stop S] [--step S] [--out DIR] [--estimate]";

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The packaged FMU.
    pub fmu: PathBuf,
    /// Folder for everything written.
    pub out: PathBuf,
    /// Variables to set, in this order.
    pub set: Vec<(String, String)>,
    /// End (s); otherwise 2 mm of travel.
    pub stop: Option<f64>,
    /// Communication step (s).
    pub step: Option<f64>,
    /// Only tell what the run would cost.
    pub estimate: bool,
}

impl Options {
    /// Reads the arguments behind the program's name.
    ///
    /// # Errors
    /// Says what is wrong, and what is allowed.
    pub fn read(arguments: &[String]) -> Result<Options, String> {
        let mut words = arguments.iter().map(String::as_str);
        let mut options = Options {
            fmu: PathBuf::new(),
            out: "target/cut".into(),
            set: Vec::new(),
            stop: None,
            step: None,
            estimate: false,
        };
        let mut spacing = None;
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or_else(|| format!("{word} needs a value\n{USAGE}"));
            match word {
                "--paper" | "--quick" if spacing.is_some() => {
                    return Err("--paper and --quick exclude each other".into());
                }
                "--paper" => spacing = Some("5e-6"),
                "--quick" => spacing = Some("4e-5"),
                "--set" => {
                    let pair = value()?;
                    let parts =
                        pair.split_once('=').ok_or_else(|| format!("--set {pair}: NAME=VALUE is needed"))?;
                    options.set.push((parts.0.trim().into(), parts.1.trim().into()));
                }
                "--estimate" => options.estimate = true,
                "--out" => options.out = value()?.into(),
                "--stop" => options.stop = Some(seconds(word, value()?)?),
                "--step" => options.step = Some(seconds(word, value()?)?),
                _ if word.starts_with('-') || !options.fmu.as_os_str().is_empty() => {
                    return Err(format!("unknown argument '{word}'\n{USAGE}"));
                }
                _ => options.fmu = word.into(),
            }
        }
        if options.fmu.as_os_str().is_empty() {
            return Err(format!("no FMU named\n{USAGE}"));
        }
        if let Some(spacing) = spacing {
            // In front: a `--set` of the same name counts more.
            options.set.insert(0, ("numerics.point_spacing".into(), spacing.into()));
        }
        Ok(options)
    }
}

fn seconds(name: &str, text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
    number.ok_or_else(|| format!("{name} {text}: a time in seconds above 0 is needed, like 1e-6"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Options, String> {
        Options::read(&line.split(' ').map(String::from).collect::<Vec<_>>())
    }

    /// A value set by name counts more than the preset, wherever it stands on the line.
    #[test]
    fn a_set_value_comes_after_the_preset() {
        let options = read("a.fmu --set numerics.point_spacing=2e-5 --set friction=0 --paper").unwrap();
        let last = options.set.iter().rfind(|pair| pair.0 == "numerics.point_spacing").unwrap();
        assert_eq!(last.1, "2e-5");
    }

    /// A slip on the command line is answered before anything is run.
    #[test]
    fn slips_are_refused_with_what_is_needed() {
        let cases = [
            ("--paper", "no FMU"),
            ("a.fmu --stop -1", "above 0"),
            ("a.fmu --set friction", "NAME=VALUE"),
            ("a.fmu --papre", "unknown argument"),
            ("a.fmu --paper --quick", "exclude"),
            ("a.fmu --out", "needs a value"),
        ];
        for (line, expected) in cases {
            let error = read(line).unwrap_err();
            assert!(error.contains(expected), "'{line}' gave: {error}");
        }
    }
}
