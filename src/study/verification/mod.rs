//! Verification: problems with exact solutions, and how far the solver is from them.
//!
//! Each problem is one file with its exact solution, a run, and the findings that `verify` reports for the
//! table and the plots. The tests of the same names call the same runs with coarser settings. A criterion
//! that is not met stays in the table with the figure reached and the reason.

pub mod bar;
pub mod disks;
pub mod expansion;
pub mod heat;
pub mod incline;
pub mod manufactured;
pub mod material_point;
pub mod neo_hookean;
pub mod piston;
pub mod plastic_cut;
pub mod punch;
pub mod report;

pub use report::{Finding, Report};

use rayon::prelude::*;

/// A problem's name and what reports on it.
type Problem = (&'static str, fn(&mut Report));

/// All problems, in the order of the table.
const PROBLEMS: [Problem; 10] = [
    ("material point", material_point::verify),
    ("manufactured solutions", manufactured::verify),
    ("vibrating bar", bar::verify),
    ("piston shock", piston::verify),
    ("inclined plane", incline::verify),
    ("two disks", disks::verify),
    ("flat punch", punch::verify),
    ("plastic cut", plastic_cut::verify),
    ("heat conduction", heat::verify),
    ("thermal expansion", expansion::verify),
];

/// Runs every problem, side by side on the threads of the current pool; calls `done` as each ends.
pub fn verify(done: impl Fn(&str, f64) + Sync) -> Report {
    let parts: Vec<Report> = PROBLEMS
        .par_iter()
        .with_max_len(1)
        .map(|&(name, verify)| {
            let begin = std::time::Instant::now();
            let mut part = Report::of(name);
            verify(&mut part);
            done(name, begin.elapsed().as_secs_f64());
            part
        })
        .collect();
    parts.into_iter().fold(Report::default(), Report::join)
}
