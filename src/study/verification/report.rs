//! What verification finds: a table in Markdown and CSV, and plots.

use crate::Error;
use crate::output::plot::{Chart, Provenance, Series, draw_charts};
use std::fmt::Write;
use std::path::Path;

/// What a figure must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Criterion {
    /// Its size is at most this.
    AtMost(f64),
    /// At least this.
    AtLeast(f64),
    /// Shown for comparison.
    None,
}

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Which problem.
    pub problem: &'static str,
    /// What was measured, with its settings.
    pub quantity: String,
    /// The figure reached, in `unit`.
    pub figure: f64,
    /// Unit; empty for a plain number.
    pub unit: &'static str,
    /// What it must be.
    pub criterion: Criterion,
    /// Why it is as it is, where that is not plain.
    pub note: &'static str,
}

impl Finding {
    /// Whether the criterion is met; `None` where there is none.
    pub fn is_met(&self) -> Option<bool> {
        match self.criterion {
            Criterion::AtMost(bound) => Some(self.figure.abs() <= bound),
            Criterion::AtLeast(bound) => Some(self.figure >= bound),
            Criterion::None => None,
        }
    }

    fn criterion_text(&self) -> String {
        match self.criterion {
            Criterion::AtMost(bound) => format!("≤ {}", with_unit(bound, self.unit)),
            Criterion::AtLeast(bound) => format!("≥ {}", with_unit(bound, self.unit)),
            Criterion::None => String::new(),
        }
    }

    fn verdict(&self) -> &'static str {
        match self.is_met() {
            Some(true) => "met",
            Some(false) => "**not met**",
            None => "",
        }
    }
}

/// A figure with three digits and its unit.
pub fn with_unit(figure: f64, unit: &str) -> String {
    let size = figure.abs();
    let number = if size == 0.0 || (1e-3..1e4).contains(&size) {
        let decimals = if size == 0.0 { 0 } else { (2 - size.log10().floor() as i32).max(0) as usize };
        let text = format!("{figure:.decimals$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
    } else {
        format!("{figure:.1e}")
    };
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// A picture of one or more panels.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Name of the file, without folder.
    pub file: &'static str,
    /// Title.
    pub title: String,
    /// Label of the horizontal axis.
    pub x_label: &'static str,
    /// Panels.
    pub charts: Vec<Chart>,
}

/// Findings and plots.
#[derive(Clone, Debug, Default)]
pub struct Report {
    problem: &'static str,
    /// Lines of the table.
    pub findings: Vec<Finding>,
    /// Pictures.
    pub plots: Vec<Plot>,
}

impl Report {
    /// An empty report on a problem.
    pub fn of(problem: &'static str) -> Self {
        Report { problem, ..Report::default() }
    }

    /// Appends another report.
    pub fn join(mut self, mut other: Report) -> Report {
        self.findings.append(&mut other.findings);
        self.plots.append(&mut other.plots);
        self
    }

    /// Adds a figure whose size must be at most `bound`.
    pub fn at_most(
        &mut self,
        quantity: impl Into<String>,
        figure: f64,
        unit: &'static str,
        bound: f64,
        note: &'static str,
    ) {
        self.add(quantity.into(), figure, unit, Criterion::AtMost(bound), note);
    }

    /// Adds a figure that must be at least `bound`.
    pub fn at_least(&mut self, quantity: impl Into<String>, figure: f64, bound: f64, note: &'static str) {
        self.add(quantity.into(), figure, "", Criterion::AtLeast(bound), note);
    }

    /// Adds a figure for comparison.
    pub fn show(&mut self, quantity: impl Into<String>, figure: f64, unit: &'static str, note: &'static str) {
        self.add(quantity.into(), figure, unit, Criterion::None, note);
    }

    fn add(
        &mut self,
        quantity: String,
        figure: f64,
        unit: &'static str,
        criterion: Criterion,
        note: &'static str,
    ) {
        let problem = self.problem;
        self.findings.push(Finding { problem, quantity, figure, unit, criterion, note });
    }

    /// Adds a plot.
    pub fn plot(&mut self, file: &'static str, title: &str, x_label: &'static str, charts: Vec<Chart>) {
        self.plots.push(Plot { file, title: title.into(), x_label, charts });
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let mut text = String::from(
            "| problem | quantity | figure | criterion | | remark |\n|---|---|---|---|---|---|\n",
        );
        let mut last = "";
        for finding in &self.findings {
            let problem = if finding.problem == last { "" } else { finding.problem };
            last = finding.problem;
            let _ = writeln!(
                text,
                "| {problem} | {} | {} | {} | {} | {} |",
                finding.quantity,
                with_unit(finding.figure, finding.unit),
                finding.criterion_text(),
                finding.verdict(),
                finding.note
            );
        }
        text
    }

    /// The table as comma-separated values.
    fn csv(&self) -> String {
        let mut text = String::from("problem,quantity,figure,unit,criterion,met,remark\n");
        for finding in &self.findings {
            let met = finding.is_met().map_or("", |met| if met { "yes" } else { "no" });
            let Finding { problem, quantity, figure, unit, note, .. } = finding;
            let criterion = finding.criterion_text();
            let _ =
                writeln!(text, "{problem},\"{quantity}\",{figure:e},{unit},\"{criterion}\",{met},\"{note}\"");
        }
        text
    }

    /// Writes `table.md`, `table.csv` and all plots into a folder.
    ///
    /// # Errors
    /// `Error::File` when a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            std::fs::write(&path, text)
                .map_err(|e| Error::File { path: path.display().to_string(), reason: e.to_string() })
        };
        std::fs::create_dir_all(folder)
            .map_err(|e| Error::File { path: folder.display().to_string(), reason: e.to_string() })?;
        write("table.md", self.markdown())?;
        write("table.csv", self.csv())?;
        for plot in &self.plots {
            let path = folder.join(plot.file);
            draw_charts(&path, &plot.title, plot.x_label, &plot.charts, &Provenance::default())?;
        }
        Ok(())
    }
}

/// A line of a chart.
pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.into(), is_background: false, points }
}

/// A panel.
pub fn panel(y_label: impl Into<String>, series: Vec<Series>) -> Chart {
    Chart { y_label: y_label.into(), series }
}

/// Points with both coordinates as decimal logarithms.
pub fn logarithms(points: impl IntoIterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    points.into_iter().map(|(x, y)| (x.log10(), y.log10())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A figure has three digits, whatever its size, and bounds are judged by size or from below.
    #[test]
    fn figures_and_verdicts_are_plain() {
        for (figure, text) in [(0.04321, "0.0432 %"), (-12.0, "-12 %"), (1e-13, "1.0e-13 %"), (1.998, "2 %")]
        {
            assert_eq!(with_unit(figure, "%"), text);
        }
        let mut report = Report::of("test");
        report.at_most("a", -2.0, "%", 1.0, "");
        report.at_least("b", 1.95, 1.9, "");
        report.show("c", 7.0, "", "");
        let met: Vec<_> = report.findings.iter().map(Finding::is_met).collect();
        assert_eq!(met, [Some(false), Some(true), None]);
        assert!(
            report.markdown().contains("| test | a | -2 % | ≤ 1 % | **not met** |"),
            "{}",
            report.markdown()
        );
    }
}
