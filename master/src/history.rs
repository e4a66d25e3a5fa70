//! The table of a run: time, travel and all outputs at every communication point, in memory and as a CSV
//! file.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use swarf::output::results::history_head;
use swarf::output::vtk::MARK;

/// The table, whose file is whole after every line.
pub struct History {
    /// Where it is written.
    pub path: PathBuf,
    file: File,
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl History {
    /// Begins a table with a version and parameters on top; replaces one of an earlier run.
    ///
    /// # Errors
    /// When the file cannot be written, or is there and is no table of this program.
    pub fn begin(
        path: &Path,
        parameters: &[(String, String)],
        outputs: &[String],
    ) -> Result<History, String> {
        let refused = |e: std::io::Error| format!("cannot write '{}': {e}", path.display());
        if std::fs::read(path).is_ok_and(|old| !String::from_utf8_lossy(&old).contains(MARK)) {
            return Err(format!(
                "'{}' was not written by swarf and is left as it is; choose another --out",
                path.display()
            ));
        }
        let mut names = vec!["time".to_string(), "travel".to_string()];
        names.extend_from_slice(outputs);
        let mut file = File::create(path).map_err(refused)?;
        let head = format!("{}{}\n", history_head(parameters), names.join(","));
        file.write_all(head.as_bytes()).map_err(refused)?;
        Ok(History { path: path.into(), file, names, rows: Vec::new() })
    }

    /// Adds a line, in the file too.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn add(&mut self, row: Vec<f64>) -> Result<(), String> {
        debug_assert_eq!(row.len(), self.names.len(), "a value for every column");
        let line = row.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>().join(",") + "\n";
        // One call a line: what is in the file ends with a whole line, whenever the run ends.
        self.file
            .write_all(line.as_bytes())
            .map_err(|e| format!("cannot write '{}': {e}", self.path.display()))?;
        self.rows.push(row);
        Ok(())
    }

    /// How many lines there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no line yet.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A column by name; not-a-number throughout for a name the FMU does not have.
    pub fn column(&self, name: &str) -> Vec<f64> {
        match self.names.iter().position(|n| n == name) {
            Some(k) => self.rows.iter().map(|row| row[k]).collect(),
            None => vec![f64::NAN; self.rows.len()],
        }
    }

    /// The last value of a column.
    pub fn last(&self, name: &str) -> f64 {
        self.column(name).last().copied().unwrap_or(f64::NAN)
    }

    /// Time mean of a column of step means over the communication steps that lie within a span of travel (m).
    ///
    /// `None` where the run did not pass the whole span.
    pub fn mean(&self, name: &str, travel: [f64; 2]) -> Option<f64> {
        let (times, travels, values) = (self.column("time"), self.column("travel"), self.column(name));
        // Travel is read from a position in the FMU: a rounding is forgiven.
        let slack = 1e-6 * (travel[1] - travel[0]);
        travels.last().filter(|last| **last >= travel[1] - slack)?;
        let mut sums = (0.0, 0.0);
        for i in 1..times.len() {
            if travels[i - 1] >= travel[0] - slack && travels[i] <= travel[1] + slack {
                let step = times[i] - times[i - 1];
                sums = (sums.0 + step * values[i], sums.1 + step);
            }
        }
        (sums.1 > 0.0).then(|| sums.0 / sums.1)
    }

    /// The travel (m) at a time (s), between lines by proportion.
    pub fn travel_at(&self, time: f64) -> f64 {
        let (times, travels) = (self.column("time"), self.column("travel"));
        let next = times.partition_point(|t| *t < time);
        match (next.checked_sub(1), travels.get(next)) {
            (None, first) => first.copied().unwrap_or(0.0),
            (Some(before), None) => travels[before],
            (Some(before), Some(after)) => {
                let share = (time - times[before]) / (times[next] - times[before]);
                travels[before] + share * (after - travels[before])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(name: &str) -> (PathBuf, History) {
        let path = std::env::temp_dir().join(format!("swarf-history-{name}-{}.csv", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let parameters = [("friction".to_string(), "0.2".to_string())];
        let history = History::begin(&path, &parameters, &["cutting_force".to_string()]).unwrap();
        (path, history)
    }

    /// Steps of different length count by their length, and only those inside the span.
    #[test]
    fn a_mean_weighs_steps_by_their_length() {
        let (path, mut history) = table("mean");
        for (time, travel, force) in
            [(0.0, 0.0, 0.0), (1.0, 1.0, 9.0), (2.0, 2.0, 1.0), (5.0, 5.0, 3.0), (6.0, 6.0, 9.0)]
        {
            history.add(vec![time, travel, force]).unwrap();
        }
        // (1 s of 1 N and 3 s of 3 N) over 4 s.
        assert_eq!(history.mean("cutting_force", [1.0, 5.0]), Some(2.5));
        assert_eq!(history.mean("cutting_force", [1.0, 7.0]), None, "the run ended before");
        assert_eq!(history.travel_at(3.5), 3.5);
        std::fs::remove_file(path).unwrap();
    }

    /// After every line the file is a whole table, so a run that is stopped leaves one.
    #[test]
    fn the_file_is_readable_after_every_line() {
        let (path, mut history) = table("lines");
        for i in 0..3 {
            history.add(vec![f64::from(i), 0.0, -1.5]).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
            assert_eq!(lines.len(), 2 + i as usize);
            assert!(text.ends_with('\n') && lines.iter().all(|line| line.split(',').count() == 3), "{text}");
            assert!(text.contains("# friction = 0.2") && text.contains(swarf::VERSION), "{text}");
        }
        std::fs::remove_file(path).unwrap();
    }

    /// A user's table is not lost to a careless `--out`.
    #[test]
    fn a_foreign_table_is_kept() {
        let path = std::env::temp_dir().join(format!("swarf-history-foreign-{}.csv", std::process::id()));
        std::fs::write(&path, "my,table\n").unwrap();
        assert!(History::begin(&path, &[], &[]).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "my,table\n");
        std::fs::remove_file(path).unwrap();
    }
}
