//! `cargo xtask hard-cases`: the hard cases in full, and the random scenes.

use crate::test::tests;
use crate::{Outcome, process, root, setup, target, verify};

/// Random scenes of the full form.
const SCENES: &str = "2000";
/// Between these lines of docs/hard-cases.md stands the table.
const MARKS: [&str; 2] = ["<!-- table -->\n", "<!-- end of table -->\n"];

/// Which cases are run, and how.
#[derive(clap::Args)]
pub struct Arguments {
    /// Cases by number or name, without the random scenes; all and the random scenes if there is none
    #[arg(value_name = "CASE")]
    cases: Vec<String>,
    /// As in the tests, seconds each
    #[arg(long)]
    short: bool,
    /// Put the table, of the full form, into docs/hard-cases.md
    #[arg(long, conflicts_with = "short")]
    write: bool,
}

/// Runs the cases into `target/hard-cases`, or `target/hard-cases-short`; those named, or all and the random scenes.
///
/// # Errors
/// A failed build, random scenes that broke a promise, or files that cannot be written. A case that fails is no error: it
/// stands in the table.
pub fn run(arguments: &Arguments) -> Outcome {
    let is_short = arguments.short;
    let out = target().join(if is_short { "hard-cases-short" } else { "hard-cases" });
    let mut rest: Vec<&str> = arguments.cases.iter().map(String::as_str).collect();
    if is_short {
        rest.insert(0, "--short");
    }
    verify::swarf("hard-cases", &out, &rest)?;
    if arguments.write {
        put_table(&process::read(&out.join("table.md"))?)?;
    }
    if arguments.cases.is_empty() {
        let tools = setup::prepare()?;
        process::compile(tools.apply(tests()?.args(["--test", "random_scenes", "--no-run"])))?;
        let mut command = tests()?;
        command.args(["--test", "random_scenes"]);
        if !is_short {
            command.env("PROPTEST_CASES", SCENES);
        }
        process::run(tools.apply(&mut command))?;
    }
    Ok(())
}

/// Puts the table between its marks.
fn put_table(table: &str) -> Outcome {
    let path = root().join("docs/hard-cases.md");
    process::write(&path, with_table(&process::read(&path)?, table)?.as_bytes())
}

fn with_table(text: &str, table: &str) -> Outcome<String> {
    let parts =
        text.split_once(MARKS[0]).and_then(|(before, rest)| Some((before, rest.split_once(MARKS[1])?.1)));
    let (before, after) = parts.ok_or("docs/hard-cases.md has no place for the table")?;
    Ok(format!("{before}{}\n{table}\n{}{after}", MARKS[0], MARKS[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table replaces what stands between the marks, and the text around them stays; so does the committed page.
    #[test]
    fn the_table_goes_between_its_marks() {
        let text = "before\n<!-- table -->\nold\n<!-- end of table -->\nafter\n";
        let new = with_table(text, "new\n").unwrap();
        assert_eq!(new, "before\n<!-- table -->\n\nnew\n\n<!-- end of table -->\nafter\n");
        assert_eq!(with_table(&new, "new\n").unwrap(), new);
        assert!(with_table("no marks", "").is_err());
        let page = process::read(&root().join("docs/hard-cases.md")).unwrap();
        assert!(with_table(&page, "").is_ok());
    }
}
