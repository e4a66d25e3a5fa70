//! `--record`: what a measuring command found goes into `results/`, with command, commit, processor and date
//! at its head.
//!
//! `cargo xtask book` makes the tables of README and book from there. Only whole measurements are recorded: a
//! quick or short form is refused.

mod rows;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::Value;

use crate::tables::{HEAD, Measured, path_of};
use crate::{Outcome, process, root, target};
use rows::{conditions, cuts, flatness, speeds, step_rates, ways};

/// Tables that a command writes into a Markdown file: how a table's head begins, the result file, its title.
type Tables = &'static [[&'static str; 3]];

const VERIFY: Tables = &[["problem,quantity", "verification", "problems with exact solutions"]];
const ACCURACY: Tables = &[
    ["method,spacing", "accuracy_methods", "error over CPU time of every method on the reference cut"],
    ["problem,method", "accuracy_problems", "error over CPU time against exact solutions"],
    ["output,", "accuracy_default", "convergence of the reference cut, adiabatic"],
    ["output,", "accuracy_conduction", "convergence of the reference cut with conduction"],
];
const VALIDATE: Tables = &[
    ["cut,speed", "validation_cuts", "cuts of AISI 1045, each predicted from a fit to the others"],
    ["trend,", "validation_trends", "changes with rake, feed and speed"],
    ["cut,cutting force", "validation_spacing", "the same cuts at two spacings"],
    ["feed (mm),", "shear_plane", "reference cut against the single shear plane of least work"],
];
const HARD_CASES: Tables = &[["case,figure", "hard_cases", "hard cases in full"]];
const EFFECTS: Tables = &[[
    "effect,",
    "effects",
    "what each effect costs and changes in the reference cut, with it against without it",
]];

/// Runs a command that measures and writes its result files, with the commit that it began with.
///
/// # Errors
/// A command that measures nothing, or a form of it whose figures mean nothing; what the command says; files
/// that lack a table, or cannot be read or written.
pub fn around(words: &[&str], run: impl FnOnce() -> Outcome) -> Outcome {
    check(words)?;
    let made = Made { command: format!("cargo xtask {}", words.join(" ")), commit: commit() };
    run()?;
    record(words, &made)
}

/// What a head tells of how figures were made.
struct Made {
    command: String,
    commit: String,
}

/// Whether a command can be recorded as its arguments are.
fn check(words: &[&str]) -> Outcome {
    let (command, rest) = words.split_first().ok_or("--record needs a command that measures")?;
    let lacks = |needed: &str| !rest.contains(&needed);
    let refusal = match *command {
        "verify" => None,
        "accuracy" | "validate" if !lacks("--quick") => Some("not with --quick"),
        "hard-cases" if !rest.is_empty() => Some("all cases in full only"),
        "effects" if lacks("--full") || !lacks("--effect") => Some("with --full and without --effect only"),
        "bench" if lacks("--row") && lacks("--quick") => Some("with --quick, or --row NAME --full"),
        "bench" if !lacks("--row") && lacks("--full") => Some("a row with --full only"),
        "accuracy" | "validate" | "hard-cases" | "effects" | "bench" => None,
        other => return Err(format!("{other} measures nothing that could be recorded")),
    };
    refusal.map_or(Ok(()), |text| Err(format!("{command} --record: {text}")))
}

/// Writes the result files of a command that has just run.
fn record(words: &[&str], made: &Made) -> Outcome {
    let (command, rest) = words.split_first().ok_or("--record needs a command")?;
    let after = |option: &str| rest.iter().skip_while(|word| **word != option).nth(1).copied();
    let folder = after("--out").map_or_else(|| target().join(command), PathBuf::from);
    match *command {
        "verify" => markdown(&folder.join("table.md"), VERIFY, made)?,
        "accuracy" => {
            markdown(&folder.join("accuracy.md"), ACCURACY, made)?;
            price_list(&folder.join("price_list.csv"), made)?;
        }
        "validate" => {
            markdown(&folder.join("validation.md"), VALIDATE, made)?;
            mean_errors(&folder.join("validation.md"), made)?;
        }
        "hard-cases" => markdown(&folder.join("table.md"), HARD_CASES, made)?,
        "effects" => {
            markdown(&folder.join("effects.md"), EFFECTS, made)?;
            library(&folder.join("effects.md"), made)?;
        }
        "bench" => bench(after("--row"), made)?,
        other => return Err(format!("{other} measures nothing that could be recorded")),
    }
    println!("xtask: recorded; now `cargo xtask book` writes the tables");
    Ok(())
}

/// Takes the tables of a Markdown file over.
fn markdown(path: &Path, wanted: Tables, made: &Made) -> Outcome {
    let text = process::read(path)?;
    let mut found = tables_of(&text);
    for [head, name, title] in wanted {
        let at = found.iter().position(|rows| rows[0].join(",").starts_with(head));
        let mut rows =
            found.remove(at.ok_or_else(|| format!("'{}' has no table '{head}…'", path.display()))?);
        fill(&mut rows);
        write(name, title, made, rows)?;
    }
    Ok(())
}

/// The tables of a Markdown text.
fn tables_of(text: &str) -> Vec<Vec<Vec<String>>> {
    let (mut tables, mut rows) = (Vec::new(), Vec::new());
    for line in text.lines().chain([""]) {
        match line.trim().strip_prefix('|').and_then(|line| line.strip_suffix('|')) {
            Some(line) if line.chars().all(|letter| "-| ".contains(letter)) && rows.len() == 1 => {}
            Some(line) => rows.push(line.replace("\\|", "\u{1}").split('|').map(cell).collect()),
            None if rows.is_empty() => {}
            None => tables.push(std::mem::take(&mut rows)),
        }
    }
    tables
}

fn cell(text: &str) -> String {
    text.trim().replace('\u{1}', "|")
}

/// Repeats what a table's first column leaves out, and names its column of verdicts.
fn fill(rows: &mut [Vec<String>]) {
    let mut last = String::new();
    for row in rows.iter_mut().skip(1) {
        if row[0].is_empty() {
            row[0].clone_from(&last);
        }
        last.clone_from(&row[0]);
    }
    rows[0].iter_mut().filter(|cell| cell.is_empty()).for_each(|cell| *cell = "verdict".into());
}

/// The price list goes where the library reads it.
fn price_list(path: &Path, made: &Made) -> Outcome {
    let text = process::read(path)?;
    let rows = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    let rows = rows.map(|line| line.split(',').map(str::to_string).collect()).collect();
    let old = Measured::read("price_list")?;
    let head = head(old.entry("title"), made, Some(old.entry("note")));
    process::write(&path_of("price_list"), Measured { head, rows }.text().as_bytes())
}

/// The lines "Mean error of the predicted …: … % (…)".
fn mean_errors(path: &Path, made: &Made) -> Outcome {
    let text = process::read(path)?;
    let mut rows = vec![["quantity", "mean error", "criterion"].map(str::to_string).to_vec()];
    for line in text.lines().filter_map(|line| line.strip_prefix("Mean error of the predicted ")) {
        let parts = line.split_once(": ").and_then(|(name, rest)| Some((name, rest.split_once(" (")?)));
        let (name, (figure, criterion)) = parts.ok_or_else(|| format!("'{line}' cannot be read"))?;
        rows.push(vec![name.into(), figure.into(), criterion.trim_end_matches(['.', ')']).into()]);
    }
    write(
        "validation_errors",
        "mean errors of the forces predicted for cuts that were not fitted to",
        made,
        rows,
    )
}

/// The line on kernels and size of the library below the table of effects.
fn library(path: &Path, made: &Made) -> Outcome {
    let text = process::read(path)?;
    let line = text.lines().find(|line| line.contains("compiled kernels")).ok_or("no line on the library")?;
    let mut rows = vec![["what", "size"].map(str::to_string).to_vec()];
    for part in line.split("; ") {
        let row = if let Some(count) = part.strip_suffix(" compiled kernels for AVX2") {
            ["kernels compiled for AVX2", count]
        } else if let Some(size) =
            part.strip_prefix("library ").and_then(|text| text.strip_suffix(" stripped"))
        {
            ["library, stripped", size]
        } else if let Some(time) =
            part.strip_prefix("built in ").and_then(|text| text.strip_suffix(" from nothing"))
        {
            ["built from nothing", time]
        } else {
            return Err(format!("'{part}' cannot be read"));
        };
        rows.push(row.map(str::to_string).to_vec());
    }
    write("library", "the library", made, rows)
}

/// What `bench` wrote as JSON.
fn bench(row: Option<&str>, made: &Made) -> Outcome {
    let path = target().join(format!("bench/{}.json", row.unwrap_or("bench")));
    let all: Value =
        serde_json::from_str(&process::read(&path)?).map_err(|e| format!("'{}': {e}", path.display()))?;
    let measured = &all["measured"];
    let rows = match row {
        None => speeds(&all["rows"]),
        Some("step-rate") => step_rates(measured),
        Some("flatness") => flatness(measured),
        Some("levels") => conditions(measured, "levels"),
        Some("smoothing") => conditions(measured, "cuts"),
        Some("steel-1045") => ways(measured),
        Some("contact-laws") => cuts(&measured["cuts"]),
        Some(_) => cuts(measured),
    };
    let name = row.map_or_else(|| "speed".into(), |row| row.replace('-', "_"));
    let title = Measured::read(&name).map_or_else(|_| name.clone(), |old| old.entry("title").to_string());
    write(&name, &title, made, rows)
}

fn write(name: &str, title: &str, made: &Made, rows: Vec<Vec<String>>) -> Outcome {
    let path = path_of(name);
    process::write(&path, Measured { head: head(title, made, None), rows }.text().as_bytes())?;
    println!("xtask: recorded {}", path.display());
    Ok(())
}

/// The head of what is recorded now.
fn head(title: &str, made: &Made, note: Option<&str>) -> Vec<(String, String)> {
    let values = [title.to_string(), made.command.clone(), made.commit.clone(), processor(), date(seconds())];
    let mut head: Vec<(String, String)> = HEAD.iter().map(|name| name.to_string()).zip(values).collect();
    head.extend(note.filter(|note| !note.is_empty()).map(|note| ("note".into(), note.into())));
    head
}

/// The commit of the sources, and whether they have been changed since.
fn commit() -> String {
    let git = |arguments: &[&str]| process::output(Command::new("git").current_dir(root()).args(arguments));
    let Ok(commit) = git(&["rev-parse", "--short=7", "HEAD"]) else { return "not recorded".into() };
    let changed = git(&["status", "--porcelain", "--untracked-files=no", "--", ":!results", ":!resources"]);
    let is_changed = changed.is_ok_and(|text| !text.trim().is_empty());
    format!("{}{}", commit.trim(), if is_changed { " with changes" } else { "" })
}

/// The processor's name and number of threads, as Linux tells them.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let entry = |name: &str| {
        let line = text.lines().find(|line| line.split(':').next().is_some_and(|key| key.trim() == name))?;
        line.split_once(':').map(|(_, value)| value.trim().to_string())
    };
    let threads = std::thread::available_parallelism().map_or(1, |number| number.get());
    match (entry("model name"), entry("cpu family"), entry("model")) {
        (Some(name), Some(family), Some(model)) => {
            format!("{name}, family {family}, model {model}, {threads} threads")
        }
        _ => format!("{}, {threads} threads", std::env::consts::ARCH),
    }
}

fn seconds() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |span| span.as_secs())
}

/// The day of a time (s since 1970, UTC), by Hinnant's civil calendar.
fn date(seconds: u64) -> String {
    let days = (seconds / 86_400) as i64 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month + 2) / 5 + 1;
    let (month, year) = if month < 10 { (month + 3, year) } else { (month - 9, year + 1) };
    format!("{:04}-{month:02}-{day_of_month:02}", year + 400 * era)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Days known by hand, a leap day among them.
    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, day) in [(0, "1970-01-01"), (951_782_400, "2000-02-29"), (1_798_761_600, "2027-01-01")]
        {
            assert_eq!(date(seconds), day);
        }
    }

    /// Short forms are refused: their figures mean nothing.
    #[test]
    fn only_whole_measurements_are_recorded() {
        for words in [
            &["verify"][..],
            &["validate"],
            &["effects", "--full", "--build"],
            &["bench", "--quick"],
            &["bench", "--row", "levels", "--full"],
        ] {
            check(words).unwrap();
        }
        for words in [
            &["cut"][..],
            &["accuracy", "--quick"],
            &["hard-cases", "--short"],
            &["hard-cases", "7"],
            &["effects"],
            &["bench"],
            &["bench", "--row", "levels"],
        ] {
            assert!(check(words).is_err(), "{words:?}");
        }
    }

    /// A table of Markdown becomes rows: groups repeated, bars kept, the column of verdicts named.
    #[test]
    fn tables_of_markdown_become_rows() {
        let text = "words\n| problem | | figure |\n|---|---|---|\n| bar | met | 1 |\n\
            | | **not met** | \\|x\\| |\n\n| b |\n|---|\n";
        let mut tables = tables_of(text);
        assert_eq!(tables.len(), 2);
        fill(&mut tables[0]);
        assert_eq!(
            tables[0],
            [["problem", "verdict", "figure"], ["bar", "met", "1"], ["bar", "**not met**", "|x|"]]
        );
    }
}
