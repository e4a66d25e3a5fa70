//! What a run shows: a table on the terminal and in `summary.txt`, plots over travel, pictures of the fields.

use std::path::{Path, PathBuf};

use swarf::fields::PointFields;
use swarf::plot::colours::Colours;
use swarf::plot::{Chart, FieldPicture, Provenance, Series, View, draw_charts, draw_field, draw_scatter};
use swarf::results::{frames_in, history_head};
use swarf::vtk::read_points;

use crate::history::History;
use crate::options::Options;
use crate::run::Cut;

/// Travel over which means are taken (m): behind the entry, before the end.
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
pub fn write(options: &Options, cut: &Cut) -> Result<(), String> {
    let out = options.out.as_path();
    let table = summary(cut);
    print!("{table}");
    let path = out.join("summary.txt");
    let text = format!("{}{table}", history_head(&cut.parameters));
    swarf::vtk::replace(&path, text.as_bytes()).map_err(|e| e.to_string())?;
    let provenance = Provenance { footer: footer(cut), parameters: cut.parameters.clone() };
    plots(out, cut, &provenance).map_err(|e| e.to_string())?;
    let pictures = pictures(cut, out, &provenance).map_err(|e| e.to_string())?;
    println!("history, {pictures} pictures of the fields and plots are in '{}'", out.display());
    Ok(())
}

/// The table.
fn summary(cut: &Cut) -> String {
    let history = &cut.history;
    let width = 1e3 * value(cut, "workpiece.width");
    let largest = |name: &str| history.column(name).iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let smallest = |name: &str| history.column(name).iter().copied().fold(f64::INFINITY, f64::min);
    let mean = |name: &str, scale: f64, shift: f64, decimals: usize| match history.mean(name, STEADY) {
        Some(value) => format!("{:.decimals$}", scale * value + shift),
        None => "not reached".into(),
    };
    let celsius = |name: &str| format!("{:.0}", history.last(name) - KELVIN);
    let rows = [
        ("mean over 1.0 to 1.6 mm of travel", String::new(), ""),
        ("  cutting force", mean("cutting_force", 1.0 / width, 0.0, 1), "N/mm"),
        ("  thrust force", mean("thrust_force", 1.0 / width, 0.0, 1), "N/mm"),
        ("  chip temperature", mean("chip_temperature", 1.0, -KELVIN, 0), "degC"),
        ("  chip thickness", mean("chip_thickness", 1e3, 0.0, 3), "mm"),
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
    rows.iter()
        .map(|(name, value, unit)| format!("{name:<34}{value:>12} {unit}").trim_end().to_string() + "\n")
        .collect()
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

/// Strain and temperature on the points at several travels, and the scatter of strain over x; gives their number.
fn pictures(cut: &Cut, out: &Path, provenance: &Provenance) -> Result<usize, swarf::Error> {
    let folder = text(cut, "results.directory").map_or_else(|| out.join("fields"), PathBuf::from);
    let files = if folder.is_dir() { frames_in(&folder)? } else { Vec::new() };
    let mut frames: Vec<(f64, PointFields)> = Vec::new();
    for wanted in PICTURES {
        // The frame nearest to the travel wanted; none where the run ended before.
        if cut.history.last("travel") < wanted - 2e-5 {
            continue;
        }
        let mut nearest: Option<(f64, &(PathBuf, PathBuf))> = None;
        for pair in &files {
            let travel = cut.history.travel_at(swarf::vtk::read_time(&pair.0)?);
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
