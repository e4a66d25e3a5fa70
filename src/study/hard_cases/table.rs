//! The table of the hard cases. Each case writes its lines into a file of its own as it ends, so that a run
//! of some of them takes the place of their lines alone.

use super::sheet::HEAD;
use super::{CASES, Case, Setting, Sheet, case, endurance, interrupted};
use rayon::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Runs the cases of these numbers or names, or all, and gives the table of all that have been run into the
/// folder.
///
/// # Errors
/// A case that there is not, or files that cannot be written. A case that fails is no error: it stands in the
/// table.
pub fn run(
    setting: &Setting,
    keys: &[&str],
    folder: &Path,
    tell: &(dyn Fn(String) + Sync),
) -> Result<String, String> {
    let chosen: Result<Vec<Case>, String> = keys
        .iter()
        .map(|key| case(key).ok_or_else(|| format!("there is no hard case '{key}'; they are {}", names())))
        .collect();
    let chosen = if keys.is_empty() { CASES.to_vec() } else { chosen? };
    fs::create_dir_all(folder).map_err(|e| format!("cannot make '{}': {e}", folder.display()))?;
    let written: Result<Vec<()>, String> = chosen
        .par_iter()
        .with_max_len(1)
        .map(|case| {
            let begin = Instant::now();
            let sheet = case.run(setting);
            tell(summary(&sheet, begin.elapsed().as_secs_f64()));
            write(&file(folder, case), &sheet.lines())
        })
        .collect();
    written?;
    let lines: String = CASES.iter().filter_map(|case| fs::read_to_string(file(folder, case)).ok()).collect();
    let table = format!("{HEAD}{lines}");
    write(&folder.join("table.md"), &table)?;
    Ok(table)
}

/// Does what the words ask for, in the other process.
///
/// # Errors
/// What went wrong, as text.
pub fn run_child(words: &[&str]) -> Result<(), String> {
    let number = |text: &str| text.parse().map_err(|_| format!("'{text}' is no number of a step"));
    match *words {
        ["replay", state, from, to, out] => endurance::replay(state, number(from)?, number(to)?, out),
        ["instances", rounds] => endurance::hold_instances(
            rounds.parse().map_err(|_| format!("'{rounds}' is no number of turns"))?,
        ),
        ["cut", folder] => interrupted::write_cut(folder.as_ref(), 1e-5).map_err(|e| e.to_string()),
        _ => Err(format!("no such part of a hard case: '{}'", words.join(" "))),
    }
}

/// A line on how a case ended.
fn summary(sheet: &Sheet, seconds: f64) -> String {
    let bounds = sheet.figures.iter().filter(|figure| figure.passes().is_some()).count();
    let failed: Vec<&str> = sheet.failures().map(|figure| figure.name.as_str()).collect();
    let fails = if failed.is_empty() { String::new() } else { format!("; fails: {}", failed.join("; ")) };
    format!("{}: {} of {bounds} bounds kept, {seconds:.1} s{fails}", sheet.name, bounds - failed.len())
}

fn names() -> String {
    let names: Vec<String> = CASES
        .iter()
        .map(|case| if case.number > 0 { case.number.to_string() } else { format!("'{}'", case.name) })
        .collect();
    names.join(", ")
}

fn file(folder: &Path, case: &Case) -> PathBuf {
    folder.join(format!("{}.lines", case.name.replace([' ', '\'', ','], "_")))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("cannot write '{}': {e}", path.display()))
}
