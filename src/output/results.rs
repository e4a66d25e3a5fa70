//! The files of `results.directory`: frames for ParaView, their collection, and a history table.
//!
//! Every `results.interval` of simulated time: `frame_00012.vtu` (points) and `tool_00012.vtp` (the tool's
//! outline); `frames.pvd`, which lists them with their times, and `history.csv`, one line of outputs per
//! frame, are whole and readable after every frame. Where a cut has a machined surface and a chip, each frame
//! has `surface_00012.csv` and `rake_00012.csv` (`output::profiles`) as well, and `segmentation.csv` a line
//! (`output::segmentation`). All of them name the program's version and the parameters in use. Files of an
//! earlier run by these names are removed when a run starts; a file by one of these names that this program
//! did not write is never touched: the run is refused.
//!
//! A row of `history.csv` holds what the FMU returns at its time: at a communication point, that point's
//! outputs; between two, those of a communication step that ends there, so that means and extremes are over
//! the step so far.
//!
//! Two runs at the same time need two directories: the second is refused (`output::directory_lock`). A run
//! holds its directory from its start to its end; a copy of it, as FMU states are, takes it up with its first
//! frame.

use std::fmt::Write as _;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::output::directory_lock::DirectoryLock;
use crate::output::point_fields::PointFields;
use crate::output::profiles::{self, RAKE_QUANTITIES, RakeFace, SURFACE_QUANTITIES};
use crate::output::segmentation;
use crate::scene::lattice::StartLattice;
use crate::variables::{COLUMNS, Outputs};
use crate::{Error, Scene, output::vtk};

/// Writes the files of one run. Plain data: a copy continues where the original stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResultsWriter {
    directory: PathBuf,
    interval: f64,
    parameters: Vec<(String, String)>,
    /// The block that is cut, where this is a cut of one block.
    cut: Option<CutBlock>,
    /// Time of the first frame (s), from which the frames are counted.
    start: Option<f64>,
    frames: Vec<Frame>,
    notice: String,
    #[serde(skip)]
    lock: Lock,
}

/// The lock of the directory, if this writer holds it; a copy does not, and is equal all the same.
#[derive(Debug, Default)]
struct Lock(Option<DirectoryLock>);

impl Clone for Lock {
    fn clone(&self) -> Self {
        Lock(None)
    }
}

impl PartialEq for Lock {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// What profiles and segmentation need to know of a block that is cut.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutBlock {
    /// Length along the cut, height, width (m).
    pub size: [f64; 3],
    /// Distance of points at the start (m).
    pub spacing: f64,
    /// Axes with more than one point: 2 or 3.
    pub axes: usize,
}

/// One frame on disk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Frame {
    number: u64,
    time: f64,
    history_line: String,
    segmentation_line: Option<String>,
}

impl ResultsWriter {
    /// Makes the directory ready, or gives `None` where the scene names none.
    ///
    /// * `parameters_in_use`: names and values, written into every file
    ///
    /// * `cut`: the block whose surface, chip and bands are profiled, where the process cuts one
    ///
    /// # Errors
    /// `Error::File` when the directory cannot be made, is in use by another run, or holds a foreign file by
    /// one of the names used here.
    pub fn new(
        scene: &Scene,
        cut: Option<CutBlock>,
        parameters_in_use: &[(String, String)],
    ) -> Result<Option<Self>, Error> {
        if scene.results.directory.is_empty() {
            return Ok(None);
        }
        let directory = std::path::absolute(&scene.results.directory)
            .map_err(|e| refused(Path::new(&scene.results.directory), &e.to_string()))?;
        fs::create_dir_all(&directory).map_err(|e| refused(&directory, &e.to_string()))?;
        let lock = Lock(Some(DirectoryLock::take(&directory)?));
        let removed = remove_earlier_run(&directory)?;
        let notice = match removed {
            0 => format!("results go to '{}'", directory.display()),
            n => format!(
                "results go to '{}'; {n} files of an earlier run were removed there",
                directory.display()
            ),
        };
        Ok(Some(ResultsWriter {
            directory,
            interval: scene.results.interval,
            parameters: parameters_in_use.to_vec(),
            cut,
            start: None,
            frames: Vec::new(),
            notice,
            lock,
        }))
    }

    /// One line for the log: where results go, and what was removed there.
    pub fn notice(&self) -> &str {
        &self.notice
    }

    /// Whether a frame is to be written at `time` (s): at the first call, then once per interval.
    pub fn due(&self, time: f64) -> bool {
        self.frames.last().is_none_or(|last| self.number_at(time) > last.number)
    }

    /// Lets another run have the directory until the next frame.
    pub fn release(&mut self) {
        self.lock = Lock(None);
    }

    /// Writes a frame, and the collection and the history anew.
    ///
    /// * `fields`: the points at the solver's clock, which counts the frames
    /// * `time`, `outputs`: the row of the history; at a communication point that point's time (s), which the
    ///   clock has passed by less than a substep
    ///
    /// # Errors
    /// `Error::File` when a file cannot be written, or another run has taken the directory meanwhile.
    pub fn write_frame(&mut self, fields: &PointFields, time: f64, outputs: &Outputs) -> Result<(), Error> {
        if self.lock.0.is_none() {
            self.lock = Lock(Some(DirectoryLock::take(&self.directory)?));
        }
        self.start.get_or_insert(fields.time);
        let number = self.number_at(fields.time);
        self.frames.retain(|frame| frame.number < number);
        self.frames.push(Frame {
            number,
            time: fields.time,
            history_line: history_line(time, outputs),
            segmentation_line: self.segmentation_line(fields, outputs),
        });
        vtk::write_points(&self.directory.join(points_name(number)), fields, &self.parameters)?;
        let outline = self.directory.join(outline_name(number));
        vtk::write_outline(&outline, fields.time, &fields.tool_outline, &self.parameters)?;
        self.write_profiles(number, fields)?;
        replace(&self.directory.join("frames.pvd"), &self.collection())?;
        if self.frames.iter().any(|frame| frame.segmentation_line.is_some()) {
            replace(&self.directory.join("segmentation.csv"), &self.segmentation())?;
        }
        replace(&self.directory.join("history.csv"), &self.history())
    }

    /// Writes the profiles that this frame has: none of the surface before there is enough of it, none along
    /// the rake face before something is near it.
    fn write_profiles(&self, number: u64, fields: &PointFields) -> Result<(), Error> {
        let outline = &fields.tool_outline;
        let (Some(CutBlock { size, spacing, .. }), Some(edge), Some(face)) =
            (&self.cut, profiles::lowest_point(outline), RakeFace::of(outline))
        else {
            return Ok(());
        };
        let write = |name: &str, table: String| {
            let path = self.directory.join(format!("{name}_{number:05}.csv"));
            let time = format!("# time = {:e} s\n", fields.time);
            replace(&path, &(history_head(&self.parameters) + &time + &table))
        };
        if let Some(stretch) = profiles::stretch_behind(edge[0], size[0], size[1] - edge[1]) {
            let rows = profiles::under_surface(fields, stretch, edge[1], *spacing);
            write("surface", profiles::table("depth (m)", SURFACE_QUANTITIES, &rows))?;
        }
        let rows = profiles::along_rake(fields, &face, *spacing);
        if !rows.is_empty() {
            write("rake", profiles::table("distance from edge (m)", RAKE_QUANTITIES, &rows))?;
        }
        Ok(())
    }

    /// The chip's bands at this frame, where there is a chip to look at.
    fn segmentation_line(&self, fields: &PointFields, outputs: &Outputs) -> Option<String> {
        let block = self.cut.as_ref()?;
        let [x, plane] = profiles::lowest_point(&fields.tool_outline)?;
        let feed = block.size[1] - plane;
        let lattice = StartLattice::new(block.size, block.spacing, block.axes);
        let strain = segmentation::fibre(fields, &lattice, plane, feed, x);
        if strain.is_empty() {
            return None;
        }
        let bands = segmentation::bands(&strain, lattice.step[0], feed);
        let thickness = outputs.chip_thickness;
        let compression = if thickness > 0.0 { feed / thickness } else { 0.0 };
        let speed = -fields.tool_velocity[0];
        Some(segmentation::line(&bands, fields.time, block.size[0] - x, speed, compression))
    }

    fn segmentation(&self) -> String {
        let lines = self.frames.iter().filter_map(|frame| frame.segmentation_line.as_deref());
        let lines: Vec<&str> = std::iter::once(segmentation::TABLE_HEAD).chain(lines).collect();
        history_head(&self.parameters) + &lines.join("\n") + "\n"
    }

    /// How many intervals fit between the first frame and `time`, a billionth of one forgiven.
    fn number_at(&self, time: f64) -> u64 {
        let since = time - self.start.unwrap_or(time);
        if self.interval > 0.0 {
            (since / self.interval + 1e-9).max(0.0) as u64
        } else {
            self.frames.last().map_or(0, |last| last.number + 1)
        }
    }

    fn collection(&self) -> String {
        let mut out = format!(
            "<?xml version=\"1.0\"?>\n{}<VTKFile type=\"Collection\" version=\"1.0\" \
             byte_order=\"LittleEndian\">\n  <Collection>\n",
            vtk::comment(&self.parameters)
        );
        for Frame { number, time, .. } in &self.frames {
            for (part, file) in [points_name(*number), outline_name(*number)].iter().enumerate() {
                let _ = writeln!(out, "    <DataSet timestep=\"{time:e}\" part=\"{part}\" file=\"{file}\"/>");
            }
        }
        out + "  </Collection>\n</VTKFile>\n"
    }

    fn history(&self) -> String {
        let mut out = history_head(&self.parameters) + HISTORY_NOTE;
        let names: Vec<String> = COLUMNS.iter().map(|column| column.name.into()).collect();
        let _ = writeln!(out, "time,{}", names.join(","));
        for frame in &self.frames {
            let _ = writeln!(out, "{}", frame.history_line);
        }
        out
    }
}

/// What a row of the history means, in its own head.
const HISTORY_NOTE: &str = "\
# a row holds what the FMU returns at its time, in SI units; between two communication points, what it would
# return were this time one: means, extremes and numerics.substeps are over the communication step so far
";

/// Comment lines that begin every table: version, then a parameter per line.
pub fn history_head(parameters: &[(String, String)]) -> String {
    let mut out = format!("# {} {}\n", vtk::MARK, crate::version::VERSION);
    for (name, value) in parameters {
        let _ = writeln!(out, "# {name} = {}", value.replace(['\n', '\r'], " "));
    }
    out
}

/// Name of the points' file of a frame.
pub fn points_name(number: u64) -> String {
    format!("frame_{number:05}.vtu")
}

/// Name of the outline's file of a frame.
pub fn outline_name(number: u64) -> String {
    format!("tool_{number:05}.vtp")
}

/// The frames in a directory by number, as paths of points and outline.
///
/// # Errors
/// `Error::File` when the directory cannot be read.
pub fn frames_in(directory: &Path) -> Result<Vec<(PathBuf, PathBuf)>, Error> {
    let mut numbers: Vec<u64> =
        file_names(directory)?.iter().filter_map(|name| frame_number(name, "frame_", ".vtu")).collect();
    numbers.sort_unstable();
    Ok(numbers.iter().map(|&n| (directory.join(points_name(n)), directory.join(outline_name(n)))).collect())
}

fn history_line(time: f64, outputs: &Outputs) -> String {
    let mut line = format!("{time:e}");
    for column in COLUMNS {
        let _ = write!(line, ",{:e}", (column.value)(outputs));
    }
    line
}

/// Removes the files of an earlier run and counts them; refuses where a foreign file has one of their names.
///
/// What a killed run left half written (`vtk::replace`) goes as well, and is not counted.
fn remove_earlier_run(directory: &Path) -> Result<usize, Error> {
    let is_ours = |name: &str| {
        ["frames.pvd", "history.csv", "segmentation.csv"].contains(&name)
            || frame_number(name, "surface_", ".csv").is_some()
            || frame_number(name, "rake_", ".csv").is_some()
            || frame_number(name, "frame_", ".vtu").is_some()
            || frame_number(name, "tool_", ".vtp").is_some()
    };
    let names = file_names(directory)?;
    let paths: Vec<PathBuf> = names.iter().filter(|n| is_ours(n)).map(|n| directory.join(n)).collect();
    for path in &paths {
        if !start_of(path)?.contains(vtk::MARK) {
            let reason = "results.directory needs this name, but the file there was not written by swarf; \
                          it is left as it is: choose another directory";
            return Err(refused(path, reason));
        }
    }
    for path in &paths {
        fs::remove_file(path).map_err(|e| refused(path, &e.to_string()))?;
    }
    for name in names.iter().filter(|name| name.strip_suffix(vtk::PART).is_some_and(is_ours)) {
        let path = directory.join(name);
        let start = start_of(&path)?;
        if start.is_empty() || start.contains(vtk::MARK) {
            fs::remove_file(&path).map_err(|e| refused(&path, &e.to_string()))?;
        }
    }
    Ok(paths.len())
}

/// The first bytes of a file, which hold the mark where this program wrote it.
fn start_of(path: &Path) -> Result<String, Error> {
    let mut start = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(200).read_to_end(&mut start));
    read.map_err(|e| refused(path, &e.to_string()))?;
    Ok(String::from_utf8_lossy(&start).into_owned())
}

fn file_names(directory: &Path) -> Result<Vec<String>, Error> {
    let entries = fs::read_dir(directory).map_err(|e| refused(directory, &e.to_string()))?;
    Ok(entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect())
}

fn frame_number(name: &str, before: &str, after: &str) -> Option<u64> {
    let digits = name.strip_prefix(before)?.strip_suffix(after)?;
    let is_number = digits.len() >= 5 && digits.bytes().all(|b| b.is_ascii_digit());
    if is_number { digits.parse().ok() } else { None }
}

fn replace(path: &Path, text: &str) -> Result<(), Error> {
    vtk::replace(path, text.as_bytes())
}

fn refused(path: &Path, reason: &str) -> Error {
    Error::File { path: path.display().to_string(), reason: reason.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("swarf-results-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn scene(directory: &Path) -> Scene {
        let mut scene = Scene::default();
        scene.results.directory = directory.display().to_string();
        scene.results.interval = 1e-6;
        scene
    }

    fn fields(time: f64) -> PointFields {
        PointFields { time, tool_outline: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], ..PointFields::default() }
    }

    /// An importer that asks for nothing gets no file.
    #[test]
    fn an_empty_directory_name_writes_nothing() {
        assert_eq!(ResultsWriter::new(&Scene::default(), None, &[]).unwrap(), None);
    }

    /// Substeps do not fall on the interval; every interval still gets one frame, and the history a line for
    /// each.
    #[test]
    fn every_interval_gets_one_frame() {
        let folder = folder("frames");
        let mut writer =
            ResultsWriter::new(&scene(&folder), None, &[("friction".into(), "0.2".into())]).unwrap().unwrap();
        for substep in 0..1000 {
            let time = 7.0 + f64::from(substep) * 3.3e-9;
            if writer.due(time) {
                writer.write_frame(&fields(time), time, &Outputs::default()).unwrap();
            }
        }
        // 999 substeps of 3.3 ns are 3.3 intervals of 1 µs: frames 0, 1, 2 and 3.
        assert_eq!(frames_in(&folder).unwrap().len(), 4);
        let history = fs::read_to_string(folder.join("history.csv")).unwrap();
        assert!(history.contains("# friction = 0.2"), "{history}");
        assert_eq!(history.lines().filter(|line| !line.starts_with('#')).count(), 1 + 4);
        let collection = fs::read_to_string(folder.join("frames.pvd")).unwrap();
        assert_eq!(collection.matches("<DataSet").count(), 8);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A run that goes back to a saved state is a copy of the writer at that time, and lists no frame twice.
    #[test]
    fn a_copy_goes_on_where_it_was_made_once_the_original_is_gone() {
        let folder = folder("copy");
        let mut writer = ResultsWriter::new(&scene(&folder), None, &[]).unwrap().unwrap();
        let write = |writer: &mut ResultsWriter, time: f64| {
            writer.write_frame(&fields(time), time, &Outputs::default())
        };
        for time in [0.0, 1e-6] {
            write(&mut writer, time).unwrap();
        }
        let mut copy = writer.clone();
        for time in [2e-6, 3e-6] {
            write(&mut writer, time).unwrap();
        }
        let error = write(&mut copy, 2e-6).unwrap_err();
        assert!(error.to_string().contains("in use by another run"), "{error}");
        writer.release();
        assert!(copy.due(2e-6) && !copy.due(1.5e-6));
        write(&mut copy, 2e-6).unwrap();
        assert_eq!(fs::read_to_string(folder.join("frames.pvd")).unwrap().matches("<DataSet").count(), 6);
        drop(copy);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// Own files of an earlier run are replaced; a user's file is never lost, by whatever name.
    #[test]
    fn earlier_frames_are_replaced_and_foreign_files_kept() {
        let folder = folder("foreign");
        let mut writer = ResultsWriter::new(&scene(&folder), None, &[]).unwrap().unwrap();
        writer.write_frame(&fields(0.0), 0.0, &Outputs::default()).unwrap();
        fs::write(folder.join("notes.txt"), "mine").unwrap();
        // A killed run's remains go, whatever came of them; a foreign file by such a name stays.
        fs::write(folder.join("frame_00007.vtu.part"), "").unwrap();
        fs::write(folder.join("history.csv.part"), format!("# {} cut off", vtk::MARK)).unwrap();
        fs::write(folder.join("frames.pvd.part"), "mine").unwrap();
        let error = ResultsWriter::new(&scene(&folder), None, &[]).unwrap_err();
        assert!(error.to_string().contains("in use by another run"), "{error}");
        drop(writer);
        let again = ResultsWriter::new(&scene(&folder), None, &[]).unwrap().unwrap();
        assert!(again.notice().contains("4 files of an earlier run were removed"), "{}", again.notice());
        assert!(!folder.join("frame_00007.vtu.part").exists() && !folder.join("history.csv.part").exists());
        assert_eq!(fs::read_to_string(folder.join("frames.pvd.part")).unwrap(), "mine");
        assert_eq!(fs::read_to_string(folder.join("notes.txt")).unwrap(), "mine");
        drop(again);
        fs::write(folder.join("history.csv"), "my own table").unwrap();
        let error = ResultsWriter::new(&scene(&folder), None, &[]).unwrap_err();
        assert!(error.to_string().contains("not written by swarf"), "{error}");
        assert_eq!(fs::read_to_string(folder.join("history.csv")).unwrap(), "my own table");
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A directory that cannot be made is refused with its path, not found out at the first frame.
    #[test]
    fn a_directory_that_cannot_be_made_is_refused() {
        let folder = folder("file");
        fs::write(&folder, "a file").unwrap();
        let error = ResultsWriter::new(&scene(&folder.join("below")), None, &[]).unwrap_err();
        assert!(matches!(&error, Error::File { path, .. } if path.contains("below")), "{error}");
        fs::remove_file(&folder).unwrap();
    }
}
