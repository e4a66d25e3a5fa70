//! What accuracy costs: the work–precision study, the convergence of the cut, and the price list.
//!
//! `cargo xtask accuracy` runs the design of `design`; runs go side by side (`queue`), each is a line of a
//! table that outlives a kill (`store`), and `report` makes tables, plots and `price_list.csv` from it.
//! `validation` compares with measured cuts: `cargo xtask validate`.

mod convergence;
mod design;
mod queue;
mod report;
mod run;
mod store;
pub mod validation;

use crate::Error;
use crate::scene::presets;
use design::Design;
use report::Report;
use std::fs;
use std::path::Path;
use store::Store;

/// How a study is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The short form, which takes seconds and whose figures mean nothing.
    pub is_quick: bool,
    /// Runs side by side, each on one thread.
    pub threads: usize,
    /// Whether missing runs are made; otherwise tables and plots are made from what is there.
    pub runs: bool,
}

/// Runs the study into a folder, or what is left of it.
///
/// Writes `runs.csv` while it runs, then `accuracy.md`, `pareto_cut.png`, `pareto_exact.png`,
/// `convergence.png` and, from the full design, `price_list.csv` for `resources`.
///
/// # Errors
/// `Error::File` when something cannot be written.
pub fn study(folder: &Path, options: Options, tell: &(dyn Fn(String) + Sync)) -> Result<String, Error> {
    let design = if options.is_quick { Design::quick() } else { Design::full() };
    fs::create_dir_all(folder).map_err(|e| failed(folder, &e))?;
    let program = store::program();
    let mut store = Store::open(&folder.join("runs.csv"), &program)?;
    if options.runs {
        queue::run_all(&design.tasks(), &mut store, options.threads, tell)?;
    }
    let report = Report::new(&design, &store);
    let mut text = format!(
        "Written by `cargo xtask accuracy` of swarf {program}. Means over {:.2} to {:.2} mm of travel.\n\n\
         ## Work and precision on the cut\n\n{}\n## Work and precision against exact solutions\n\n{}\n\
         ## Convergence\n\n{}",
        1e3 * design.span[0],
        1e3 * design.span[1],
        report.work_precision(),
        report.verification(),
        report.convergence()
    );
    if let Some(prices) = report.prices() {
        let lines: Vec<String> = prices.iter().map(presets::Price::line).collect();
        let csv = format!(
            "# Written by `cargo xtask accuracy`, swarf {program}; meaning of the lines: \
             src/price_list.rs\n{}\n{}\n",
            presets::HEAD,
            lines.join("\n")
        );
        write(&folder.join("price_list.csv"), &csv)?;
        text.push_str(&format!("\n## Price list\n\n{}", report::price_table(&prices)));
    }
    write(&folder.join("accuracy.md"), &text)?;
    report.draw(folder)?;
    Ok(text)
}

fn write(path: &Path, text: &str) -> Result<(), Error> {
    fs::write(path, text).map_err(|e| failed(path, &e))
}

fn failed(path: &Path, error: &std::io::Error) -> Error {
    Error::File { path: path.display().to_string(), reason: error.to_string() }
}
