//! What a cut can be told on the command line. `cargo xtask cut` reads this file, too: it checks a line
//! before it builds anything, and its help is this one.

use std::path::PathBuf;

/// Options of a cut.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct Arguments {
    /// 120,000 points, as the paper
    #[arg(long, conflicts_with = "quick")]
    pub paper: bool,
    /// About 1,900 points, a first look
    #[arg(long)]
    pub quick: bool,
    /// Any parameter or input of the FMU: --set friction=0 --set feed=0.5mm --set tool.rake_angle=10deg
    #[arg(long, value_name = "NAME=VALUE", value_parser = pair)]
    pub set: Vec<(String, String)>,
    /// End of the run: 40us, 0.04ms, 4e-5 (seconds) [default: 2 mm of travel, less in a shorter workpiece]
    #[arg(long, value_name = "TIME", value_parser = time, allow_hyphen_values = true)]
    pub stop: Option<String>,
    /// Communication step: 0.5us, 5e-7 (seconds)
    #[arg(long, value_name = "TIME", value_parser = time, allow_hyphen_values = true)]
    pub step: Option<String>,
    /// Folder for everything written [default: target/cut]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Run a second cut at twice the spacing, some 12 % of the price, which gives each mean its own band
    #[arg(long, conflicts_with = "estimate")]
    pub band: bool,
    /// Only tell the CPU time that the run would take, and the error band of its force
    #[arg(long)]
    pub estimate: bool,
}

/// What a time has to be.
pub const A_TIME: &str = "a time above 0 is needed, like 40us, 0.04ms or 4e-5 (seconds)";

/// The text of a time: a number above zero with or without a unit, which only the FMU's own table of units
/// can read.
fn time(text: &str) -> Result<String, String> {
    let number = text.trim_end_matches(char::is_alphabetic).trim();
    let is_time = number.parse().is_ok_and(|value: f64| value.is_finite() && value > 0.0);
    if is_time { Ok(text.into()) } else { Err(A_TIME.into()) }
}

/// Name and value, as they stand around the first equals sign.
fn pair(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    let parts = parts.filter(|(name, _)| !name.is_empty());
    parts.map(|(name, value)| (name.into(), value.into())).ok_or_else(|| "NAME=VALUE is needed".into())
}
