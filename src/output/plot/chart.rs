//! Line charts, one above the other over a common axis, and the scatter of a quantity over all points.

use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::{GRID, INK, PALE, Provenance, failed, footer, sign, text, tick};
use crate::Error;

/// Colours of the lines, told apart with colour-blind eyes too (Okabe and Ito 2008).
const LINES: [RGBColor; 7] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x44, 0x44, 0x44),
];

/// Room for the labels of the vertical axis, in pixels.
const Y_LABELS: i32 = 96;

/// One line.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Drawn pale and thin, in the colour of the next line: what that one is a mean of.
    pub is_background: bool,
    /// Points in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

/// One panel.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Label of the vertical axis, with unit.
    pub y_label: String,
    /// Its lines.
    pub series: Vec<Series>,
}

/// Draws panels one above the other over a common horizontal axis, into a PNG file of 1400 by 800 pixels.
///
/// # Errors
/// `Error::File` when the file cannot be written.
pub fn draw_charts(
    path: &Path,
    title: &str,
    x_label: &str,
    charts: &[Chart],
    provenance: &Provenance,
) -> Result<(), Error> {
    charts_into(path, title, x_label, charts, provenance).map_err(|e| failed(path, &e))?;
    sign(path, provenance)
}

/// Draws a dot per point, (x, y) in the units of the labels, into a PNG file of 1400 by 800 pixels.
///
/// # Errors
/// `Error::File` when the file cannot be written.
pub fn draw_scatter(
    path: &Path,
    title: &str,
    labels: [&str; 2],
    points: &[(f64, f64)],
    provenance: &Provenance,
) -> Result<(), Error> {
    scatter_into(path, title, labels, points, provenance).map_err(|e| failed(path, &e))?;
    sign(path, provenance)
}

type Drawn = Result<(), Box<dyn std::error::Error>>;
type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
type Plane<'a, 'b> = ChartContext<'a, BitMapBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn charts_into(path: &Path, title: &str, x_label: &str, charts: &[Chart], provenance: &Provenance) -> Drawn {
    let page = BitMapBackend::new(path, (1400, 800)).into_drawing_area();
    let body = frame(&page, title, provenance)?;
    let all = || charts.iter().flat_map(|chart| &chart.series).flat_map(|series| &series.points);
    let x_range = range(all().map(|point| point.0), 0.0);
    for (row, (panel, chart)) in body.split_evenly((charts.len(), 1)).iter().zip(charts).enumerate() {
        let values = chart.series.iter().flat_map(|series| &series.points).map(|point| point.1);
        let is_last = row + 1 == charts.len();
        let x_label = if is_last { x_label } else { "" };
        let mut plane = axes(panel, [x_label, &chart.y_label], x_range.clone(), range(values, 0.06))?;
        let mut colours = LINES.iter().cycle();
        let mut colour = LINES[0];
        let mut is_paired = false;
        let mut entries = Vec::new();
        for series in &chart.series {
            if !is_paired {
                colour = *colours.next().unwrap_or(&INK);
            }
            is_paired = series.is_background;
            let style =
                if series.is_background { colour.mix(0.35).stroke_width(1) } else { colour.stroke_width(2) };
            for line in series.points.split(|p| !(p.0.is_finite() && p.1.is_finite())) {
                plane.draw_series(LineSeries::new(line.iter().copied(), style))?;
            }
            if !series.name.is_empty() {
                entries.push((series.name.as_str(), style));
            }
        }
        legend(panel, &entries)?;
    }
    page.present()?;
    Ok(())
}

fn scatter_into(
    path: &Path,
    title: &str,
    labels: [&str; 2],
    points: &[(f64, f64)],
    provenance: &Provenance,
) -> Drawn {
    let page = BitMapBackend::new(path, (1400, 800)).into_drawing_area();
    let body = frame(&page, title, provenance)?;
    let x_range = range(points.iter().map(|point| point.0), 0.01);
    let y_range = range(points.iter().map(|point| point.1).chain([0.0]), 0.04);
    let mut plane = axes(&body, labels, x_range, y_range)?;
    let style = LINES[0].mix(0.35).filled();
    let finite = points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
    plane.draw_series(
        finite.map(|&(x, y)| EmptyElement::at((x, y)) + Rectangle::new([(-1, -1), (1, 1)], style)),
    )?;
    page.present()?;
    Ok(())
}

/// Title and footer; gives what is left between them.
fn frame<'a>(
    page: &Area<'a>,
    title: &str,
    provenance: &Provenance,
) -> Result<Area<'a>, Box<dyn std::error::Error>> {
    page.fill(&WHITE)?;
    page.draw(&Text::new(title.to_string(), (40, 22), text(30, &INK)))?;
    let (_, height) = page.dim_in_pixel();
    page.draw(&Text::new(footer(provenance), (40, height as i32 - 30), text(16, &PALE)))?;
    Ok(page.margin(64, 40, 20, 40))
}

/// The lines' names beside each other above a panel.
fn legend(panel: &Area, entries: &[(&str, ShapeStyle)]) -> Drawn {
    let mut x = Y_LABELS + 4;
    for (name, style) in entries {
        panel.draw(&PathElement::new([(x, 12), (x + 28, 12)], style.stroke_width(3)))?;
        panel.draw(&Text::new(name.to_string(), (x + 36, 4), text(19, &INK)))?;
        let width = text(19, &INK).font.box_size(name).map_or(100, |size| size.0 as i32);
        x += 36 + width + 34;
    }
    Ok(())
}

fn axes<'a, 'b>(
    area: &'a Area<'b>,
    [x_label, y_label]: [&str; 2],
    x_range: std::ops::Range<f64>,
    y_range: std::ops::Range<f64>,
) -> Result<Plane<'a, 'b>, Box<dyn std::error::Error>> {
    let (x_span, y_span) = (x_range.end - x_range.start, y_range.end - y_range.start);
    let mut plane = ChartBuilder::on(area)
        .margin_top(38)
        .margin_bottom(8)
        .x_label_area_size(if x_label.is_empty() { 30 } else { 62 })
        .y_label_area_size(Y_LABELS)
        .build_cartesian_2d(x_range, y_range)?;
    let (_, height) = area.dim_in_pixel();
    plane
        .configure_mesh()
        .x_desc(x_label)
        .y_desc(y_label)
        .x_labels(11)
        .y_labels((height as usize / 45).max(4))
        .max_light_lines(0)
        .bold_line_style(GRID)
        .axis_style(PALE)
        .label_style(text(19, &INK))
        .axis_desc_style(text(21, &INK))
        .x_label_formatter(&|value| tick(*value, x_span))
        .y_label_formatter(&|value| tick(*value, y_span))
        .draw()?;
    Ok(plane)
}

/// The finite values' range with some room at both ends; zero is taken in where it is near.
fn range(values: impl Iterator<Item = f64>, room: f64) -> std::ops::Range<f64> {
    let finite = values.filter(|value| value.is_finite());
    let (mut low, mut high) = finite.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        (low, high) = (0.0, 1.0);
    }
    if low > 0.0 && low < 0.5 * high {
        low = 0.0;
    }
    if high - low <= 1e-9 * high.abs().max(low.abs()) {
        let half = if high == 0.0 { 1.0 } else { 0.05 * high.abs() };
        (low, high) = (low - half, high + half);
    }
    let margin = room * (high - low);
    let low = if low == 0.0 { 0.0 } else { low - margin };
    low..high + margin
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A constant, an empty or a broken series still has an axis to be drawn on.
    #[test]
    fn every_series_has_a_range() {
        for values in [vec![], vec![0.0], vec![300.0, 300.0], vec![f64::NAN, 2.0], vec![-1.0, 1.0]] {
            let range = range(values.iter().copied(), 0.05);
            assert!(range.start < range.end && range.end.is_finite(), "{range:?} from {values:?}");
        }
    }

    /// A file is made, is a PNG, and names version and parameters.
    #[test]
    fn a_chart_is_a_png_that_names_its_run() {
        let path = std::env::temp_dir().join(format!("swarf-chart-{}.png", std::process::id()));
        let series = Series {
            name: "sine".into(),
            is_background: false,
            points: (0..50).map(|i| (0.1 * i as f64, (0.1 * i as f64).sin())).collect(),
        };
        let provenance =
            Provenance { footer: String::new(), parameters: vec![("friction".into(), "0.2".into())] };
        let chart = Chart { y_label: "force (N)".into(), series: vec![series] };
        draw_charts(&path, "test", "travel (mm)", &[chart.clone(), chart], &provenance).unwrap();
        let png = std::fs::read(&path).unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        let text = String::from_utf8_lossy(&png[..300]);
        assert!(text.contains(crate::version::VERSION) && text.contains("friction = 0.2"), "{text}");
        std::fs::remove_file(&path).unwrap();
    }
}
