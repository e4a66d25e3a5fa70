//! The table of finished runs: a line each, appended as it ends, so that a killed study goes on where it was.
//!
//! A line counts when it is whole (all fields and a line end). The head names the program by a checksum of
//! its file: runs of another build are not mixed in but set aside under another name.

use super::run::{Ending, Measured};
use crate::Error;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

const COLUMNS: &str = "identity,label,ending,cpu_seconds,estimated_cpu_seconds,substeps,estimated_substeps,points,\
    cutting_force,thrust_force,chip_thickness,chip_heating,peak_strain_p999,balance_error,error";
const FIELDS: usize = 15;

/// The table of finished runs.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    file: File,
    endings: BTreeMap<String, Ending>,
}

impl Store {
    /// Opens the table of a study, or begins one.
    ///
    /// # Errors
    /// `Error::File` when it cannot be read or written.
    pub fn open(path: &Path, program: &str) -> Result<Store, Error> {
        let failed =
            |e: std::io::Error| Error::File { path: path.display().to_string(), reason: e.to_string() };
        let head = format!("# runs of swarf {program}\n{COLUMNS}\n");
        let text = fs::read_to_string(path).unwrap_or_default();
        let mut endings = BTreeMap::new();
        let mut kept = head.clone();
        if let Some(lines) = text.strip_prefix(&head) {
            for line in lines.split_inclusive('\n').filter(|line| line.ends_with('\n')) {
                if let Some((identity, ending)) = read(line.trim_end()) {
                    endings.insert(identity, ending);
                    kept.push_str(line);
                }
            }
        } else if !text.is_empty() {
            fs::rename(path, path.with_extension("other-build.csv")).map_err(failed)?;
        }
        // A line cut short by a kill goes; the file is never seen half written.
        let draft = path.with_extension("draft");
        fs::write(&draft, kept).map_err(failed)?;
        fs::rename(&draft, path).map_err(failed)?;
        let file = OpenOptions::new().append(true).open(path).map_err(failed)?;
        Ok(Store { path: path.into(), file, endings })
    }

    /// How a run ended, if it is in the table.
    pub fn get(&self, identity: &str) -> Option<&Ending> {
        self.endings.get(identity)
    }

    /// Puts a run into the table; one that was refused is remembered but not written.
    ///
    /// # Errors
    /// `Error::File` when it cannot be written.
    pub fn put(&mut self, identity: &str, label: &str, ending: Ending) -> Result<(), Error> {
        if let Some(line) = line(identity, label, &ending) {
            let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data());
            written
                .map_err(|e| Error::File { path: self.path.display().to_string(), reason: e.to_string() })?;
        }
        self.endings.insert(identity.into(), ending);
        Ok(())
    }
}

/// The program's version and a checksum of its file.
pub fn program() -> String {
    let bytes = std::env::current_exe().and_then(fs::read).unwrap_or_default();
    format!("{} ({:08x})", crate::version::VERSION, crc32fast::hash(&bytes))
}

fn line(identity: &str, label: &str, ending: &Ending) -> Option<String> {
    let (text, m) = match ending {
        Ending::Done(measured) => ("done".to_owned(), measured),
        Ending::Failed(text, measured) => (format!("failed: {text}"), measured),
        Ending::Refused(_) => return None,
    };
    let mut numbers = vec![m.cpu_seconds, m.estimated, m.substeps[0], m.substeps[1], m.points];
    numbers.extend(m.outputs);
    numbers.extend([m.balance_error, m.error]);
    let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:.6e}")).collect();
    Some(format!("{identity},{},{text},{}\n", label.replace(',', ";"), numbers.join(",")))
}

fn read(line: &str) -> Option<(String, Ending)> {
    let fields: Vec<&str> = line.split(',').collect();
    let [identity, _, ending, numbers @ ..] = fields.as_slice() else { return None };
    if fields.len() != FIELDS {
        return None;
    }
    let n: Vec<f64> = numbers.iter().map(|text| text.parse().ok()).collect::<Option<_>>()?;
    let measured = Measured {
        cpu_seconds: n[0],
        estimated: n[1],
        substeps: [n[2], n[3]],
        points: n[4],
        outputs: [n[5], n[6], n[7], n[8], n[9]],
        balance_error: n[10],
        error: n[11],
    };
    let ending = match ending.strip_prefix("failed: ") {
        Some(text) => Ending::Failed(text.into(), measured),
        None => Ending::Done(measured),
    };
    Some(((*identity).into(), ending))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A study that is killed while it writes loses that line and no other, and one of another build starts
    /// anew.
    #[test]
    fn a_killed_study_loses_at_most_the_line_it_was_writing() {
        let folder = std::env::temp_dir().join(format!("swarf-store-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("runs.csv");
        let measured =
            Measured { cpu_seconds: 1.5, outputs: [1.0, 2.0, 3.0, 4.0, 5.0], ..Measured::default() };
        let mut store = Store::open(&path, "a").unwrap();
        store.put("one", "first, of all", Ending::Done(measured.clone())).unwrap();
        store.put("two", "", Ending::Failed("unstable".into(), measured.clone())).unwrap();
        store.put("three", "", Ending::Refused("not here".into())).unwrap();
        // As a kill does; Windows would not have an open file replaced.
        drop(store);
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, format!("{whole}four,,done,1.0e0,2.0")).unwrap();
        let again = Store::open(&path, "a").unwrap();
        assert_eq!(again.get("one"), Some(&Ending::Done(measured.clone())));
        assert_eq!(again.get("two"), Some(&Ending::Failed("unstable".into(), measured)));
        assert_eq!((again.get("three"), again.get("four")), (None, None));
        assert_eq!(fs::read_to_string(&path).unwrap(), whole);
        drop(again);
        assert!(Store::open(&path, "b").unwrap().get("one").is_none());
        assert_eq!(fs::read_to_string(path.with_extension("other-build.csv")).unwrap(), whole);
        fs::remove_dir_all(&folder).unwrap();
    }
}
