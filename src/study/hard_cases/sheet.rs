//! What a hard case finds: figures beside their bounds, with the retries that the run took.

use crate::study::verification::report::{Criterion, with_unit};
use std::fmt::Write;

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What was measured, with its settings.
    pub name: String,
    /// The figure reached, in `unit`; no number where the run ended before there was one.
    pub value: f64,
    /// Unit; empty for a plain number.
    pub unit: &'static str,
    /// What it must be.
    pub bound: Criterion,
    /// Substeps of the run that were solved again, where a run stands behind the figure.
    pub retries: Option<i32>,
    /// The error that ended the run, or why the figure is as it is.
    pub remark: String,
}

impl Figure {
    /// Whether the bound is kept; `None` where there is none. A figure that is no number keeps no bound.
    pub fn passes(&self) -> Option<bool> {
        match self.bound {
            Criterion::AtMost(bound) => Some(self.value.abs() <= bound),
            Criterion::AtLeast(bound) => Some(self.value >= bound),
            Criterion::None => None,
        }
    }

    /// Adds what a run took in retries.
    pub fn retried(&mut self, retries: i32) -> &mut Self {
        self.retries = Some(retries);
        self
    }

    /// Adds a remark.
    pub fn remarked(&mut self, remark: impl Into<String>) -> &mut Self {
        self.remark = remark.into();
        self
    }

    /// Adds to the remark why it fails, where it does.
    pub fn failing_because(&mut self, reason: &str) -> &mut Self {
        if self.passes() == Some(false) {
            let between = if self.remark.is_empty() { "" } else { "; " };
            self.remark = format!("{}{between}{reason}", self.remark);
        }
        self
    }

    fn line(&self) -> String {
        let value = if self.value.is_finite() { with_unit(self.value, self.unit) } else { "none".into() };
        let bound = match self.bound {
            Criterion::AtMost(bound) => format!("≤ {}", with_unit(bound, self.unit)),
            Criterion::AtLeast(bound) => format!("≥ {}", with_unit(bound, self.unit)),
            Criterion::None => String::new(),
        };
        let verdict = match self.passes() {
            Some(true) => "pass",
            Some(false) => "**fail**",
            None => "",
        };
        let retries = self.retries.map_or(String::new(), |count| count.to_string());
        let remark = self.remark.replace('|', "/").replace('\n', " ");
        format!("{} | {value} | {bound} | {retries} | {verdict} | {remark} |", self.name)
    }
}

/// The figures of one case.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Number of the case; 0 for what has none.
    pub number: u8,
    /// Its name.
    pub name: &'static str,
    /// Its figures.
    pub figures: Vec<Figure>,
}

/// Head of the table.
pub const HEAD: &str =
    "| case | figure | value | bound | retries | | remark |\n|---|---|---|---|---|---|---|\n";

impl Sheet {
    /// An empty sheet.
    pub fn new(number: u8, name: &'static str) -> Self {
        Sheet { number, name, figures: Vec::new() }
    }

    /// Adds a figure whose size must be at most `bound`.
    pub fn at_most(
        &mut self,
        name: impl Into<String>,
        value: f64,
        unit: &'static str,
        bound: f64,
    ) -> &mut Figure {
        self.add(name.into(), value, unit, Criterion::AtMost(bound))
    }

    /// Adds a figure that must be at least `bound`.
    pub fn at_least(
        &mut self,
        name: impl Into<String>,
        value: f64,
        unit: &'static str,
        bound: f64,
    ) -> &mut Figure {
        self.add(name.into(), value, unit, Criterion::AtLeast(bound))
    }

    /// Adds a figure for comparison.
    pub fn show(&mut self, name: impl Into<String>, value: f64, unit: &'static str) -> &mut Figure {
        self.add(name.into(), value, unit, Criterion::None)
    }

    fn add(&mut self, name: String, value: f64, unit: &'static str, bound: Criterion) -> &mut Figure {
        let place = self.figures.len();
        self.figures.push(Figure { name, value, unit, bound, retries: None, remark: String::new() });
        &mut self.figures[place]
    }

    /// The figures that miss their bounds.
    pub fn failures(&self) -> impl Iterator<Item = &Figure> {
        self.figures.iter().filter(|figure| figure.passes() == Some(false))
    }

    /// The sheet's lines of the table in Markdown.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for (k, figure) in self.figures.iter().enumerate() {
            let case = match (k, self.number) {
                (0, 0) => self.name.to_string(),
                (0, number) => format!("{number}. {}", self.name),
                _ => String::new(),
            };
            let _ = writeln!(text, "| {case} | {}", figure.line());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run that ended early has no figure, and no figure passes no bound.
    #[test]
    fn a_missing_figure_is_a_failure() {
        let mut sheet = Sheet::new(7, "test");
        sheet.at_most("a", f64::NAN, "%", 1.0).remarked("stopped | early");
        sheet.at_least("b", f64::NAN, "", 1.0);
        sheet.at_most("c", -0.5, "%", 1.0).retried(3);
        sheet.show("d", 7.0, "");
        assert_eq!(sheet.failures().count(), 2);
        let text = sheet.lines();
        assert!(text.contains("| 7. test | a | none | ≤ 1 % |  | **fail** | stopped / early |"), "{text}");
        assert!(text.contains("|  | c | -0.5 % | ≤ 1 % | 3 | pass |  |"), "{text}");
    }
}
