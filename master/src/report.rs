//! What a run shows: a table on the terminal and in `summary.txt`, plots over travel, pictures of the fields.

use std::path::{Path, PathBuf};

use swarf::output::plot::colours::Colours;
use swarf::output::plot::{
    Chart, FieldPicture, Provenance, Series, View, draw_charts, draw_field, draw_scatter,
};
use swarf::output::point_fields::PointFields;
use swarf::output::results::{frames_in, history_head};
use swarf::output::vtk::read_points;

use crate::history::History;
use crate::options::Options;
use crate::run::{Cut, FRAME_TRAVEL};

/// Travel over which means are taken (m): behind the entry, before the end. A run that ended before takes its
/// second half.
const STEADY: [f64; 2] = [1.0e-3, 1.6e-3];
/// Travels at which pictures are drawn (m).
const PICTURES: [f64; 4] = [0.5e-3, 1.0e-3, 1.5e-3, 2.0e-3];
/// Travel over which the plotted forces are smoothed (mm); the pale line behind is every communication step.
const WINDOW: f64 = 0.1;
const KELVIN: f64 = 273.15;

/// Writes and prints everything.
///
/// # Errors
/// When a file cannot be read or written.
pub fn write(options: &Options, cut: &Cut, twin: Option<&Cut>) -> Result<(), String> {
    let out = options.out.as_path();
    let frames = frames_folder(cut, out).join("frames.pvd");
    let table = summary(cut, twin, Some(frames.as_path()).filter(|path| path.is_file()));
    print!("{table}");
    let path = out.join("summary.txt");
    let text = format!("{}{table}", history_head(&cut.heads));
    swarf::output::vtk::replace(&path, text.as_bytes()).map_err(|e| e.to_string())?;
    let provenance = Provenance { footer: footer(cut), parameters: cut.heads.clone() };
    plots(out, cut, &provenance).map_err(|e| e.to_string())?;
    let pictures = pictures(cut, out, &provenance).map_err(|e| e.to_string())?;
    println!("history, {pictures} pictures of the fields and plots are in '{}'", out.display());
    Ok(())
}

/// Folder of the fields' files.
fn frames_folder(cut: &Cut, out: &Path) -> PathBuf {
    text(cut, "results.directory").map_or_else(|| out.join("fields"), PathBuf::from)
}

/// The travel over which means are taken (m).
fn steady(history: &History) -> [f64; 2] {
    let end = history.last("travel");
    // Travel is read from a position in the FMU: a rounding is forgiven.
    if end >= STEADY[1] - 1e-9 { STEADY } else { [0.5 * end, end] }
}

/// By how much the cutting force may be off, as it stands behind the force.
fn band_text(band: f64) -> String {
    if band > 0.0 && band < 1.0 {
        format!("N/mm, within \u{b1}{:.1} % by the price list", 100.0 * band)
    } else {
        "N/mm, of unknown error: the price list has no such cut".into()
    }
}

/// Factor from the difference of two spacings, one twice the other, to the band at the finer one: that of two
/// grids of unknown order (Roache 1994).
const OF_TWO_GRIDS: f64 = 3.0;

/// Band of a mean (in its own unit), by a twin at twice the spacing.
fn twin_band(cut: &Cut, twin: &Cut, name: &str, span: [f64; 2]) -> Option<f64> {
    let (fine, coarse) = (cut.history.mean(name, span)?, twin.history.mean(name, span)?);
    Some(OF_TWO_GRIDS * (fine - coarse).abs())
}

/// The table.
///
/// * `twin`: the same cut at twice the spacing, for bands
/// * `frames`: the file that ParaView opens, if there is one
fn summary(cut: &Cut, twin: Option<&Cut>, frames: Option<&Path>) -> String {
    let history = &cut.history;
    let width = 1e3 * value(cut, "workpiece.width");
    let largest = |name: &str| history.column(name).iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let smallest = |name: &str| history.column(name).iter().copied().fold(f64::INFINITY, f64::min);
    let span = steady(history);
    let mean = |name: &str, scale: f64, shift: f64, decimals: usize| match history.mean(name, span) {
        Some(value) => format!("{:.decimals$}", scale * value + shift),
        None => "not reached".into(),
    };
    let celsius = |name: &str| format!("{:.0}", history.last(name) - KELVIN);
    let decimals = if span == STEADY { 1 } else { 2 };
    let [from, to] = span.map(|travel| format!("{:.decimals$}", 1e3 * travel));
    let means = format!("mean over {from} to {to} mm of travel");
    let band = band_text(history.last("numerics.force_error_band"));
    // What a twin tells of this scene counts more than the price list of the reference cut.
    let unit = |name: &str, scale: f64, unit: &str, otherwise: &str| {
        let band = twin.and_then(|twin| twin_band(cut, twin, name, span));
        band.map_or_else(
            || otherwise.to_string(),
            |band| {
                let share = 100.0 * band / history.mean(name, span).map_or(f64::NAN, f64::abs);
                format!(
                    "{unit}, within \u{b1}{:.3} ({share:.1} %) by a cut at twice the spacing",
                    scale * band
                )
            },
        )
    };
    let units = [
        unit("cutting_force", 1.0 / width, "N/mm", &band),
        unit("thrust_force", 1.0 / width, "N/mm", "N/mm"),
        unit("chip_temperature", 1.0, "degC", "degC"),
        unit("chip_thickness", 1e3, "mm", "mm"),
    ];
    let rows = [
        (means.as_str(), String::new(), if span == STEADY { "" } else { "(short: not yet steady)" }),
        ("  cutting force", mean("cutting_force", 1.0 / width, 0.0, 1), units[0].as_str()),
        ("  thrust force", mean("thrust_force", 1.0 / width, 0.0, 1), units[1].as_str()),
        ("  chip temperature", mean("chip_temperature", 1.0, -KELVIN, 0), units[2].as_str()),
        ("  chip thickness", mean("chip_thickness", 1e3, 0.0, 3), units[3].as_str()),
        ("at the end", String::new(), ""),
        ("  travel", format!("{:.3}", 1e3 * history.last("travel")), "mm"),
        ("  chip temperature", celsius("chip_temperature"), "degC"),
        ("  highest temperature", celsius("chip_temperature_peak"), "degC"),
        ("  peak plastic strain", format!("{:.2}", history.last("peak_strain")), ""),
        ("  99.9th percentile of it", format!("{:.2}", history.last("peak_strain_p999")), ""),
        ("over the run", String::new(), ""),
        ("  largest ledger error", format!("{:.3}", 100.0 * largest("energy.balance_error")), "%"),
        ("  smallest Jacobian", format!("{:.3}", smallest("numerics.min_jacobian")), ""),
        ("  points at the start", format!("{:.0}", first(history, "numerics.active_points")), ""),
        ("  points that left the domain", format!("{:.0}", history.last("numerics.retired_points")), ""),
        ("  substeps", format!("{:.0}", history.column("numerics.substeps").iter().sum::<f64>()), ""),
        ("  CPU time, all threads", format!("{:.1}", cut.cpu_seconds), "s"),
        ("  wall time", format!("{:.1}", cut.wall_seconds), "s"),
    ];
    let line = |(name, value, unit): &(&str, String, &str)| {
        format!("{name:<34}{value:>12} {unit}").trim_end().to_string() + "\n"
    };
    let mut text: String = rows.iter().map(line).collect();
    if let Some(frames) = frames {
        text += &format!("fields over time, for ParaView      {}\n", frames.display());
    }
    text
}

/// Forces, temperatures and strains, and the energy ledger over travel.
fn plots(out: &Path, cut: &Cut, provenance: &Provenance) -> Result<(), swarf::Error> {
    let history = &cut.history;
    let width = 1e3 * value(cut, "workpiece.width");
    let line = |label: &str, name: &str, scale: f64, shift: f64| {
        let travel = history.column("travel").into_iter().map(|x| 1e3 * x);
        let values = history.column(name).into_iter().map(|v| scale * v + shift);
        // The first line is the state before the first step: no step mean yet.
        Series { name: label.into(), is_background: false, points: travel.zip(values).skip(1).collect() }
    };
    let travel = "travel of the tool (mm)";
    let forces = Chart {
        y_label: "force per width (N/mm)".into(),
        series: [("cutting force", "cutting_force"), ("thrust force", "thrust_force")]
            .into_iter()
            .flat_map(|(label, name)| {
                let raw = line("", name, 1.0 / width, 0.0);
                let name = format!("{label}, mean over {WINDOW} mm");
                let mean = Series { name, is_background: false, points: running_mean(&raw.points, WINDOW) };
                [Series { is_background: true, ..raw }, mean]
            })
            .collect(),
    };
    draw_charts(&out.join("forces.png"), "Forces on the tool", travel, &[forces], provenance)?;

    let temperatures = Chart {
        y_label: "temperature (\u{b0}C)".into(),
        series: vec![
            line("highest of all points", "chip_temperature_peak", 1.0, -KELVIN),
            line("mean of the chip", "chip_temperature", 1.0, -KELVIN),
        ],
    };
    let strains = Chart {
        y_label: "eq. plastic strain (-)".into(),
        series: vec![
            line("highest of all points", "peak_strain", 1.0, 0.0),
            line("99.9th percentile", "peak_strain_p999", 1.0, 0.0),
        ],
    };
    let panels = [temperatures, strains];
    draw_charts(
        &out.join("temperatures.png"),
        "Temperature and plastic strain",
        travel,
        &panels,
        provenance,
    )?;

    let parts = ["tool_work", "plastic", "friction", "kinetic", "elastic", "contact", "retired", "damping"];
    let named = |part: &str| line(&part.replace('_', " "), &format!("energy.{part}"), 1e3, 0.0);
    let is_there = |series: &Series| series.points.iter().any(|point| point.1.is_finite() && point.1 != 0.0);
    let energy = Chart {
        y_label: "energy (mJ)".into(),
        series: parts.iter().map(|part| named(part)).filter(is_there).collect(),
    };
    let error = Chart {
        y_label: "unaccounted (%)".into(),
        series: vec![line("balance error", "energy.balance_error", 100.0, 0.0)],
    };
    draw_charts(&out.join("energy.png"), "Energy ledger", travel, &[energy, error], provenance)
}

/// Travels (m) at which there are pictures, of a run that ended at `end` (m): those it reached, and its end.
fn picture_travels(end: f64) -> Vec<f64> {
    let mut wanted: Vec<f64> = PICTURES.into_iter().filter(|travel| end >= travel - 2e-5).collect();
    let last = wanted.last().copied().unwrap_or(0.0);
    // Within a frame of the last one, or of the start, there is nothing else to see.
    if end >= last + FRAME_TRAVEL {
        wanted.push(end);
    }
    wanted
}

/// Removes what an earlier run drew at travels that this one may not have reached; a picture that this
/// program did not draw stays.
fn remove_old_pictures(out: &Path) -> Result<(), swarf::Error> {
    let refused = |path: &Path, e: std::io::Error| swarf::Error::File {
        path: path.display().to_string(),
        reason: e.to_string(),
    };
    for entry in std::fs::read_dir(out).map_err(|e| refused(out, e))? {
        let path = entry.map_err(|e| refused(out, e))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_picture = ["strain_", "temperature_"].iter().any(|start| name.starts_with(start));
        if is_picture && name.ends_with(".png") && is_ours(&path) {
            std::fs::remove_file(&path).map_err(|e| refused(&path, e))?;
        }
    }
    Ok(())
}

/// Whether a picture is signed by this program, near its beginning.
fn is_ours(path: &Path) -> bool {
    let start = std::fs::read(path).unwrap_or_default();
    let mark = swarf::output::vtk::MARK.as_bytes();
    start.windows(mark.len()).take(200).any(|window| window == mark)
}

/// Strain and temperature on the points at several travels, and the scatter of strain over x; gives their
/// number.
fn pictures(cut: &Cut, out: &Path, provenance: &Provenance) -> Result<usize, swarf::Error> {
    remove_old_pictures(out)?;
    let folder = frames_folder(cut, out);
    let files = if folder.is_dir() { frames_in(&folder)? } else { Vec::new() };
    let mut frames: Vec<(f64, PointFields)> = Vec::new();
    for wanted in picture_travels(cut.history.last("travel")) {
        // The frame nearest to the travel wanted.
        let mut nearest: Option<(f64, &(PathBuf, PathBuf))> = None;
        for pair in &files {
            let travel = cut.history.travel_at(swarf::output::vtk::read_time(&pair.0)?);
            if nearest.is_none_or(|best| (travel - wanted).abs() < (best.0 - wanted).abs()) {
                nearest = Some((travel, pair));
            }
        }
        if let Some((travel, (points, outline))) = nearest.filter(|n| (n.0 - wanted).abs() < 1e-4) {
            frames.push((travel, read_points(points, Some(outline))?));
        }
    }
    let spacing = value(cut, "numerics.point_spacing");
    let all: Vec<&PointFields> = frames.iter().map(|frame| &frame.1).collect();
    let view = View::of(&all, spacing);
    let hottest = frames.iter().flat_map(|frame| &frame.1.temperature).copied().fold(0.0, f64::max) - KELVIN;
    let top = (hottest / 100.0).ceil().clamp(1.0, 15.0) * 100.0;
    for (travel, fields) in &frames {
        let travel = 1e3 * travel;
        let celsius: Vec<f64> = fields.temperature.iter().map(|t| t - KELVIN).collect();
        let strain = FieldPicture {
            title: &format!("Equivalent plastic strain after {travel:.2} mm of travel"),
            label: "equivalent plastic strain (-)",
            values: &fields.plastic_strain,
            range: [0.0, 3.0],
            colours: Colours::Viridis,
            view,
            spacing,
        };
        draw_field(&out.join(format!("strain_{travel:.1}mm.png")), fields, &strain, provenance)?;
        let temperature = FieldPicture {
            title: &format!("Temperature after {travel:.2} mm of travel"),
            label: "temperature (\u{b0}C)",
            values: &celsius,
            range: [0.0, top],
            colours: Colours::Inferno,
            ..strain
        };
        draw_field(&out.join(format!("temperature_{travel:.1}mm.png")), fields, &temperature, provenance)?;
    }
    if let Some((travel, fields)) = frames.last() {
        let close_up = FieldPicture {
            title: &format!("Equivalent plastic strain after {:.2} mm of travel", 1e3 * travel),
            label: "equivalent plastic strain (-)",
            values: &fields.plastic_strain,
            range: [0.0, 3.0],
            colours: Colours::Viridis,
            view: around_edge(fields, value(cut, "feed")),
            spacing,
        };
        draw_field(&out.join("cutting_zone.png"), fields, &close_up, provenance)?;
        let points: Vec<(f64, f64)> = fields
            .position
            .iter()
            .zip(&fields.plastic_strain)
            .map(|(p, strain)| (1e3 * p[0], *strain))
            .collect();
        let title =
            format!("Equivalent plastic strain of every point after {:.2} mm of travel", 1e3 * travel);
        let labels = ["x (mm)", "equivalent plastic strain (-)"];
        draw_scatter(&out.join("strain_over_x.png"), &title, labels, &points, provenance)?;
    }
    Ok(2 * frames.len())
}

/// Where the cutting happens: some feeds around the tool's lowest point.
fn around_edge(fields: &PointFields, feed: f64) -> View {
    let lower = |a: [f64; 2], b: [f64; 2]| if b[1] < a[1] { b } else { a };
    let edge = fields.tool_outline.iter().copied().reduce(lower).unwrap_or_default();
    View { x: [edge[0] - 2.2 * feed, edge[0] + 0.9 * feed], y: [edge[1] - 0.55 * feed, edge[1] + 1.7 * feed] }
}

/// Each value's mean with its neighbours within half a window on either side.
fn running_mean(points: &[(f64, f64)], window: f64) -> Vec<(f64, f64)> {
    let near = |x: f64| points.iter().filter(move |p| (p.0 - x).abs() <= 0.5 * window).map(|p| p.1);
    points.iter().map(|&(x, _)| (x, near(x).sum::<f64>() / near(x).count() as f64)).collect()
}

/// One line that tells runs apart.
fn footer(cut: &Cut) -> String {
    let microns = 1e6 * value(cut, "numerics.point_spacing");
    format!(
        "{}, feed {:.3} mm, friction {}, {} m/s, rake {:.1}\u{b0}, spacing {} \u{b5}m, {:.0} points.",
        text(cut, "material.name").unwrap_or_default(),
        1e3 * value(cut, "feed"),
        text(cut, "friction").unwrap_or_default(),
        text(cut, "tool_velocity").unwrap_or_default(),
        value(cut, "tool.rake_angle").to_degrees(),
        (1e3 * microns).round() / 1e3,
        first(&cut.history, "numerics.active_points"),
    )
}

fn text(cut: &Cut, name: &str) -> Option<String> {
    cut.parameters
        .iter()
        .find(|pair| pair.0 == name)
        .map(|pair| pair.1.clone())
        .filter(|text| !text.is_empty())
}

fn value(cut: &Cut, name: &str) -> f64 {
    text(cut, name).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}

fn first(history: &History, name: &str) -> f64 {
    history.column(name).into_iter().find(|v| *v > 0.0).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Ending;

    /// A run with two outputs, that went so far (mm) in steps of a tenth.
    fn cut_to(name: &str, tenths: u32, band: f64) -> Cut {
        let path = std::env::temp_dir().join(format!("swarf-report-{name}-{}.csv", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let columns = ["cutting_force", "numerics.force_error_band"].map(String::from);
        let mut history = History::begin(&path, &[], &columns).unwrap();
        for k in 0..=tenths {
            let travel = 1e-4 * f64::from(k);
            history.add(vec![travel / 50.0, travel, 1e3 * f64::from(k), band]).unwrap();
        }
        std::fs::remove_file(path).unwrap();
        let parameters = vec![("workpiece.width".to_string(), "0.001".to_string())];
        let heads = parameters.clone();
        Cut { history, parameters, heads, ending: Ending::Complete, cpu_seconds: 1.0, wall_seconds: 1.0 }
    }

    /// A force means nothing without its error, and the fields are of no use to who does not know which file
    /// to open.
    #[test]
    fn the_summary_has_the_band_and_the_file_of_the_fields() {
        let text = summary(&cut_to("band", 20, 0.054), None, Some(Path::new("out/fields/frames.pvd")));
        // The means of the steps that end at 1.1 to 1.6 mm.
        let force = " 13500.0 N/mm, within \u{b1}5.4 % by the price list";
        assert!(text.starts_with("mean over 1.0 to 1.6 mm of travel\n"), "{text}");
        assert!(
            text.lines().any(|line| line.starts_with("  cutting force ") && line.ends_with(force)),
            "{text}"
        );
        assert!(text.lines().last().is_some_and(|line| line.ends_with("out/fields/frames.pvd")), "{text}");
        let unknown = summary(&cut_to("unknown", 20, 1.0), None, None);
        assert!(unknown.contains("13500.0 N/mm, of unknown error"), "{unknown}");
        assert!(!unknown.contains("ParaView"), "{unknown}");
    }

    /// A twin at twice the spacing whose force is a tenth higher gives the force a band of three tenths: what
    /// counts is this scene, not the price list.
    #[test]
    fn a_twin_gives_this_scene_its_own_band() {
        let fine = cut_to("fine", 20, 0.054);
        let mut coarse = cut_to("coarse", 20, 0.054);
        coarse.history = {
            let path = std::env::temp_dir().join(format!("swarf-report-twin-{}.csv", std::process::id()));
            let _ = std::fs::remove_file(&path);
            let columns = ["cutting_force", "numerics.force_error_band"].map(String::from);
            let mut history = History::begin(&path, &[], &columns).unwrap();
            for k in 0..=20 {
                let travel = 1e-4 * f64::from(k);
                history.add(vec![travel / 50.0, travel, 1.1e3 * f64::from(k), 0.054]).unwrap();
            }
            std::fs::remove_file(path).unwrap();
            history
        };
        let text = summary(&fine, Some(&coarse), None);
        assert!(text.contains("13500.0 N/mm, within \u{b1}4050.000 (30.0 %) by a cut at twice"), "{text}");
    }

    /// A run that was stopped tells what it has: the mean over its second half, and says that this is no
    /// steady one.
    #[test]
    fn a_short_run_has_means_of_its_second_half() {
        let text = summary(&cut_to("short", 8, 0.054), None, None);
        let head = text.lines().next().unwrap_or_default();
        assert!(
            head.starts_with("mean over 0.40 to 0.80 mm of travel") && head.contains("not yet"),
            "{text}"
        );
        // The steps that end at 0.5 to 0.8 mm.
        assert!(text.contains("6500.0 N/mm"), "{text}");
        assert!(summary(&cut_to("none", 0, 0.0), None, None).contains("not reached"));
    }

    /// Wherever a run ends there is a picture of its end, and none twice.
    #[test]
    fn a_run_that_ends_early_is_seen_at_its_end() {
        assert_eq!(picture_travels(2e-3), PICTURES);
        assert_eq!(picture_travels(1.99e-3), PICTURES);
        assert_eq!(picture_travels(0.83e-3), [0.5e-3, 0.83e-3]);
        assert_eq!(picture_travels(0.3e-3), [0.3e-3]);
        assert_eq!(picture_travels(0.05e-3), []);
    }

    /// Pictures of an earlier run do not stand beside this one's; others' are not touched.
    #[test]
    fn old_pictures_go_and_foreign_ones_stay() {
        let folder = std::env::temp_dir().join(format!("swarf-pictures-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let ours = format!("\u{89}PNG iTXtDescription # {} 1.0\n", swarf::output::vtk::MARK);
        for (name, content) in
            [("strain_2.0mm.png", ours.as_str()), ("strain_mine.png", "a PNG"), ("forces.png", &ours)]
        {
            std::fs::write(folder.join(name), content).unwrap();
        }
        remove_old_pictures(&folder).unwrap();
        let mut left: Vec<String> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        left.sort_unstable();
        assert_eq!(left, ["forces.png", "strain_mine.png"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
