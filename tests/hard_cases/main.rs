//! The hard cases in their short forms: the same functions as `cargo xtask hard-cases` (`study::hard_cases`).
//!
//! A case that is known to fail stands in the book (evidence, hard cases) with its figure and the reason; its
//! figures are named here, so that all others of its sheet are still held.

mod cuts;
mod material;
mod points;
mod tool;

use swarf::study::hard_cases::{Form, Setting, Sheet, case};

/// Runs a case and prints its lines.
fn sheet(key: &str) -> Sheet {
    let setting = Setting { form: Form::Short, program: env!("CARGO_BIN_EXE_swarf").into() };
    let sheet = case(key).expect("a case of the table").run(&setting);
    println!("{}", sheet.lines());
    assert!(!sheet.figures.is_empty(), "case {key} found nothing");
    sheet
}

/// All bounds of a case are kept but those of figures whose name contains one of `known`, of which each must
/// still miss one: what has been mended is not to stay excused.
fn hold_but(key: &str, known: &[&str]) {
    let sheet = sheet(key);
    let is_known = |name: &str| known.iter().any(|part| name.contains(part));
    let lines: Vec<String> = sheet
        .failures()
        .filter(|figure| !is_known(&figure.name))
        .map(|figure| {
            format!(
                "{}: {} {} against {:?} {}",
                figure.name, figure.value, figure.unit, figure.bound, figure.remark
            )
        })
        .collect();
    assert!(lines.is_empty(), "case {key} fails:\n{}", lines.join("\n"));
    for name in known {
        let fails = sheet.failures().any(|figure| figure.name.contains(name));
        assert!(fails, "case {key} keeps the bound of '{name}' now: hold it");
    }
}

/// All bounds of a case are kept.
fn hold(key: &str) {
    hold_but(key, &[]);
}
