//! Processes that are killed while they write results: what lies in the folder then must be whole.
//!
//! Files are written beside their place and renamed (`vtk::replace`), so a reader meets the old or the new
//! one. The process that is killed is `swarf hard-cases --child cut`, which writes a frame every few
//! substeps.

use super::child;
use super::monitor::cut;
use super::monitor::random;
use super::{Setting, Sheet};
use crate::Error;
use crate::output::directory_lock::LOCK_FILE;
use crate::output::vtk;
use crate::session::Session;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let kills = setting.pick(8_u64, 60);
    let folder = std::env::temp_dir().join(format!("swarf-killed-{}", std::process::id()));
    let (mut files, mut parts, mut faults) = (0, 0, Vec::new());
    for kill in 0..kills {
        let _ = fs::remove_dir_all(&folder);
        match killed(setting, &folder, 0.2 * random(7_000_003 + kill)) {
            Ok(()) => {}
            Err(text) => faults.push(text),
        }
        let mut found = Found::default();
        found.look(&folder);
        files += found.whole;
        parts += found.parts;
        faults.append(&mut found.faults);
    }
    sheet.show(format!("{kills} processes killed: whole files found"), f64::from(files), "");
    sheet.show("files cut off, by a name that no reader takes (.part)", f64::from(parts), "");
    let remark = faults.first().cloned().unwrap_or_default();
    sheet
        .at_most("files cut off or missing, by a name that a reader trusts", faults.len() as f64, "", 0.0)
        .remarked(remark);
    // The folder is taken up by the next run, and nothing of the killed one stays.
    let again = write_cut(&folder, 1e-7).map(|()| {
        let mut found = Found::default();
        found.look(&folder);
        (found.parts, found.faults.len())
    });
    let (left, remark) = match again {
        Ok((parts, faults)) => (f64::from(parts) + faults as f64, String::new()),
        Err(error) => (f64::NAN, error.to_string()),
    };
    sheet.at_most("remains after the next run in that folder", left, "", 0.0).remarked(remark);
    let _ = fs::remove_dir_all(&folder);
}

/// Starts a cut that writes into `folder` and kills it `delay` (s) after its first frame.
fn killed(setting: &Setting, folder: &Path, delay: f64) -> Result<(), String> {
    let words = ["cut".into(), folder.into()];
    let mut process = child::command(&setting.program, words).spawn().map_err(|e| e.to_string())?;
    let mut waited = 0;
    while !folder.join("history.csv").exists() {
        std::thread::sleep(Duration::from_millis(5));
        waited += 1;
        if waited > 6000 {
            let _ = process.kill();
            let _ = process.wait();
            return Err("no first frame within 30 s".into());
        }
    }
    std::thread::sleep(Duration::from_secs_f64(delay));
    process.kill().map_err(|e| e.to_string())?;
    process.wait().map_err(|e| e.to_string())?;
    Ok(())
}

/// The child's part: a cut that writes a frame every 10 ns for `end` (s).
///
/// # Errors
/// As a session has them.
pub fn write_cut(folder: &Path, end: f64) -> Result<(), Error> {
    let mut scene = cut(2e-5);
    scene.inputs.tool_velocity = 200.0;
    scene.results.directory = folder.display().to_string();
    scene.results.interval = 1e-8;
    let mut session = Session::new(&scene, 0.0)?;
    session.advance_to(end, &mut |_| true)?;
    Ok(())
}

/// What lies in a folder of results.
#[derive(Debug, Default)]
struct Found {
    whole: u32,
    parts: u32,
    faults: Vec<String>,
}

impl Found {
    fn look(&mut self, folder: &Path) {
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) => {
                self.faults.push(format!("cannot read '{}': {error}", folder.display()));
                return;
            }
        };
        for path in entries.filter_map(|entry| entry.ok().map(|entry| entry.path())) {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let fault = if name.ends_with(".part") {
                self.parts += 1;
                continue;
            } else if name == LOCK_FILE {
                // The system's lock on it has ended with its process.
                continue;
            } else if name.ends_with(".vtu") {
                vtk::read_points(&path, None).err().map(|e| e.to_string())
            } else if name.ends_with(".vtp") {
                vtk::read_time(&path).err().map(|e| e.to_string()).or_else(|| cut_off(&path, "</VTKFile>\n"))
            } else if name.ends_with(".pvd") {
                cut_off(&path, "</VTKFile>\n").or_else(|| missing(&path, folder))
            } else if name.ends_with(".csv") {
                ragged(&path)
            } else {
                Some(format!("'{name}' is no file of a run"))
            };
            match fault {
                Some(text) => self.faults.push(text),
                None => self.whole += 1,
            }
        }
    }
}

/// Says whether a file ends otherwise than it should.
fn cut_off(path: &Path, end: &str) -> Option<String> {
    match fs::read(path) {
        Ok(bytes) if bytes.ends_with(end.as_bytes()) => None,
        Ok(_) => Some(format!("'{}' is cut off", path.display())),
        Err(error) => Some(format!("'{}': {error}", path.display())),
    }
}

/// Names a file that the collection lists and that is not there.
fn missing(path: &Path, folder: &Path) -> Option<String> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let names = text.split("file=\"").skip(1).filter_map(|rest| rest.split('"').next());
    let mut paths = names.map(|name| -> PathBuf { folder.join(name) });
    paths.find(|path| !path.exists()).map(|path| format!("'{}' is listed and missing", path.display()))
}

/// Says whether a table has a line of another length than its first, or no end of its last.
fn ragged(path: &Path) -> Option<String> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) => return Some(format!("'{}': {error}", path.display())),
    };
    let mut widths = text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').count());
    let head = widths.next();
    let is_whole = text.ends_with('\n') && head.is_some() && widths.all(|width| Some(width) == head);
    (!is_whole).then(|| format!("'{}' is cut off", path.display()))
}
