//! Pictures of a field on the points: every pixel in the colour of its nearest point, the tool in grey, axes
//! in mm.

use std::path::Path;

use plotters::prelude::*;

use super::colours::Colours;
use super::{INK, PALE, Provenance, failed, footer, sign, text, tick};
use crate::Error;
use crate::output::point_fields::PointFields;

/// The part of the x-y plane a picture shows (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Left and right.
    pub x: [f64; 2],
    /// Lower and upper.
    pub y: [f64; 2],
}

/// What is drawn and how.
#[derive(Clone, Debug)]
pub struct FieldPicture<'a> {
    /// Title above the picture.
    pub title: &'a str,
    /// Label of the colour bar, with unit.
    pub label: &'a str,
    /// One value per point, in the label's unit.
    pub values: &'a [f64],
    /// Values of the colour bar's ends; beyond them the end's colour holds.
    pub range: [f64; 2],
    /// The scale.
    pub colours: Colours,
    /// The part shown.
    pub view: View,
    /// Distance of neighbouring points at the start (m), which tells how far a point's colour reaches.
    pub spacing: f64,
}

impl View {
    /// A part that holds the points of all given frames but for stray ones, and the tool's edge with some of
    /// the tool.
    ///
    /// One point in 2,000 may lie outside on each side: a shaving that flies off does not shrink the picture.
    pub fn of(frames: &[&PointFields], spacing: f64) -> View {
        let coordinate = |k: usize| {
            let mut all: Vec<f64> =
                frames.iter().flat_map(|frame| frame.position.iter().map(move |p| p[k])).collect();
            all.retain(|value| value.is_finite());
            all.sort_by(f64::total_cmp);
            let stray = all.len() / 2000;
            match (all.get(stray), all.iter().nth_back(stray)) {
                (Some(&low), Some(&high)) => [low - 3.0 * spacing, high + 3.0 * spacing],
                _ => [0.0, 1e-3],
            }
        };
        let (mut x, mut y) = (coordinate(0), coordinate(1));
        let height = y[1] - y[0];
        y[1] += 0.08 * height;
        let edge = frames.iter().flat_map(|frame| &frame.tool_outline).map(|p| p[0]);
        // The first frame's tool stands farthest to the right; a part of it is enough.
        if let Some(right) = edge.reduce(f64::max) {
            x[1] = x[1].max(right.min(x[1] + 0.12 * (x[1] - x[0])));
        }
        View { x, y }
    }
}

/// Draws a field with the tool's outline into a PNG file about 1400 pixels wide, at equal scale on both axes.
///
/// # Errors
/// `Error::File` when the file cannot be written.
pub fn draw_field(
    path: &Path,
    fields: &PointFields,
    picture: &FieldPicture,
    provenance: &Provenance,
) -> Result<(), Error> {
    field_into(path, fields, picture, provenance).map_err(|e| failed(path, &e))?;
    sign(path, provenance)
}

/// Room around the plane, in pixels: left and right, above and below.
const LEFT: u32 = 96;
const RIGHT: u32 = 180;
const ABOVE: u32 = 84;
const BELOW: u32 = 112;

fn field_into(
    path: &Path,
    fields: &PointFields,
    picture: &FieldPicture,
    provenance: &Provenance,
) -> Result<(), Box<dyn std::error::Error>> {
    // Millimetres from here on.
    let [left, right] = picture.view.x.map(|v| 1e3 * v);
    let [lower, upper] = picture.view.y.map(|v| 1e3 * v);
    let scale = (1124.0 / (right - left)).min(820.0 / (upper - lower));
    let (width, height) = ((scale * (right - left)).round() as u32, (scale * (upper - lower)).round() as u32);
    let page_size = (LEFT + width + RIGHT, ABOVE + height + BELOW);
    let page = BitMapBackend::new(path, page_size).into_drawing_area();
    page.fill(&WHITE)?;
    page.draw(&Text::new(picture.title.to_string(), (LEFT as i32, 26), text(30, &INK)))?;
    let foot = (LEFT as i32, page_size.1 as i32 - 30);
    page.draw(&Text::new(footer(provenance), foot, text(16, &PALE)))?;

    let area = page.clone().shrink((0, ABOVE), (LEFT + width, height + 70));
    let mut plane = ChartBuilder::on(&area)
        .margin_left(20)
        .x_label_area_size(70)
        .y_label_area_size(LEFT - 20)
        .build_cartesian_2d(left..right, lower..upper)?;
    plane
        .configure_mesh()
        .disable_mesh()
        .x_desc("x (mm)")
        .y_desc("y (mm)")
        .x_labels((width / 110).max(3) as usize)
        .y_labels((height / 80).max(3) as usize)
        .axis_style(PALE)
        .label_style(text(19, &INK))
        .axis_desc_style(text(21, &INK))
        .x_label_formatter(&|value| tick(*value, right - left))
        .y_label_formatter(&|value| tick(*value, upper - lower))
        .draw()?;

    let [low, high] = picture.range;
    let canvas = plane.plotting_area().strip_coord_spec();
    for (pixel, nearest) in nearest_points(fields, picture, scale, [width, height]).iter().enumerate() {
        if let Some(&value) = nearest.and_then(|point| picture.values.get(point as usize)) {
            let at = (pixel as i32 % width as i32, pixel as i32 / width as i32);
            canvas.draw_pixel(at, &picture.colours.at((value - low) / (high - low)))?;
        }
    }

    let outline: Vec<(f64, f64)> = fields.tool_outline.iter().map(|p| (1e3 * p[0], 1e3 * p[1])).collect();
    let shown = clipped(&outline, [left, right], [lower, upper]);
    if shown.len() >= 3 {
        plane.draw_series([Polygon::new(shown.clone(), RGBColor(0xb4, 0xba, 0xc2).filled())])?;
        let closed = shown.iter().chain(shown.first()).copied();
        plane.draw_series([PathElement::new(closed.collect::<Vec<_>>(), INK.stroke_width(2))])?;
    }
    colour_bar(&page, picture, (LEFT + width + 28) as i32, ABOVE as i32, height as i32)?;
    page.present()?;
    Ok(())
}

/// For each pixel, row by row from the top, the point that colours it: the nearest one, or none outside the
/// body.
///
/// The body is the points' discs of 0.6 spacings, closed: gaps up to 2.8 spacings wide belong to it, as
/// between the points of stretched material, while a free surface stays within 0.6 spacings of its points.
///
/// * `scale`: pixels per millimetre
/// * `size`: width and height in pixels
fn nearest_points(
    fields: &PointFields,
    picture: &FieldPicture,
    scale: f64,
    [width, height]: [u32; 2],
) -> Vec<Option<u32>> {
    let mut nearest = vec![None; (width * height) as usize];
    let mut distance = vec![f64::INFINITY; nearest.len()];
    let spacing = 1e3 * picture.spacing * scale;
    let (disc, reach) = ((0.6 * spacing).max(0.75), (1.4 * spacing).max(0.75));
    // The pixels of one axis that a point reaches; none for a point outside, or one that is nowhere.
    let reached = |centre: f64, size: u32| {
        let first = (centre - reach - 0.5).ceil().max(0.0) as u32;
        let last = (centre + reach + 0.5).floor().max(0.0) as u32;
        first..last.min(size)
    };
    for (number, point) in (0u32..).zip(&fields.position) {
        let x = (1e3 * (point[0] - picture.view.x[0])) * scale;
        let y = (1e3 * (picture.view.y[1] - point[1])) * scale;
        for row in reached(y, height) {
            for column in reached(x, width) {
                // Pixel centres lie at halves.
                let square = (f64::from(column) + 0.5 - x).powi(2) + (f64::from(row) + 0.5 - y).powi(2);
                let at = (row * width + column) as usize;
                if square <= reach * reach && square < distance[at] {
                    (nearest[at], distance[at]) = (Some(number), square);
                }
            }
        }
    }
    // Closing: of what lies beyond the discs, stays what no outside pixel comes near.
    let (margin, disc) = ((reach - disc).floor() as i32, disc * disc);
    let around: Vec<(i32, i32)> = (-margin..=margin)
        .flat_map(|y| (-margin..=margin).map(move |x| (x, y)))
        .filter(|(x, y)| x * x + y * y <= margin * margin)
        .collect();
    let is_outside = |column: i32, row: i32| {
        let is_on_page = (0..width as i32).contains(&column) && (0..height as i32).contains(&row);
        is_on_page && distance[row as usize * width as usize + column as usize].is_infinite()
    };
    for (at, point) in nearest.iter_mut().enumerate() {
        let (column, row) = (at as i32 % width as i32, at as i32 / width as i32);
        if distance[at] > disc && around.iter().any(|(x, y)| is_outside(column + x, row + y)) {
            *point = None;
        }
    }
    nearest
}

/// The bar with its ends, its marks and its label.
fn colour_bar(
    page: &DrawingArea<BitMapBackend, plotters::coord::Shift>,
    picture: &FieldPicture,
    x: i32,
    top: i32,
    height: i32,
) -> Result<(), Box<dyn std::error::Error>> {
    let width = 26;
    for row in 0..height {
        let share = 1.0 - (f64::from(row) + 0.5) / f64::from(height);
        let colour = picture.colours.at(share).filled();
        page.draw(&Rectangle::new([(x, top + row), (x + width, top + row + 1)], colour))?;
    }
    page.draw(&Rectangle::new([(x, top), (x + width, top + height)], PALE.stroke_width(1)))?;
    let [low, high] = picture.range;
    for value in marks(low, high) {
        let y = top + height - ((value - low) / (high - low) * f64::from(height)).round() as i32;
        page.draw(&PathElement::new([(x + width, y), (x + width + 6, y)], PALE.stroke_width(1)))?;
        page.draw(&Text::new(tick(value, high - low), (x + width + 11, y - 9), text(19, &INK)))?;
    }
    let turned = text(21, &INK).transform(FontTransform::Rotate90);
    let label = picture.label.to_string();
    let length = text(21, &INK).font.box_size(&label).map_or(0, |size| size.0 as i32);
    page.draw(&Text::new(label, (x + 128, top + (height - length) / 2), turned))?;
    Ok(())
}

/// Five to ten round values between two ends.
fn marks(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].iter().map(|k| k * power).find(|step| *step >= 0.8 * rough);
    let step = step.unwrap_or(rough);
    let first = (low / step - 1e-9).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|value| *value <= high + 1e-9 * step).collect()
}

/// The part of a polygon inside a rectangle (Sutherland and Hodgman 1974), one side after the other.
fn clipped(polygon: &[(f64, f64)], x: [f64; 2], y: [f64; 2]) -> Vec<(f64, f64)> {
    // A side keeps the points with sign · coordinate ≥ sign · limit.
    let sides = [(0, 1.0, x[0]), (0, -1.0, x[1]), (1, 1.0, y[0]), (1, -1.0, y[1])];
    sides.iter().fold(polygon.to_vec(), |points, &(axis, sign, limit)| {
        let depth = |p: (f64, f64)| sign * (if axis == 0 { p.0 } else { p.1 } - limit);
        let mut kept = Vec::new();
        for (i, &b) in points.iter().enumerate() {
            let a = points[(i + points.len() - 1) % points.len()];
            let (da, db) = (depth(a), depth(b));
            if (da < 0.0) != (db < 0.0) {
                let t = da / (da - db);
                kept.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
            }
            if db >= 0.0 {
                kept.push(b);
            }
        }
        kept
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tool may be larger than the view; what is drawn must stay inside it.
    #[test]
    fn a_clipped_square_keeps_the_common_part() {
        let square = [(-1.0, -1.0), (2.0, -1.0), (2.0, 2.0), (-1.0, 2.0)];
        let part = clipped(&square, [0.0, 1.0], [0.5, 3.0]);
        let area: f64 = (0..part.len())
            .map(|i| (part[i], part[(i + 1) % part.len()]))
            .map(|(a, b)| 0.5 * (a.0 * b.1 - b.0 * a.1))
            .sum();
        // Common part: 1 by 1.5; a dozen roundings.
        assert!((area - 1.5).abs() < 1e-14, "area {area} of {part:?}");
    }

    /// A bar with one mark, or with thirty, cannot be read.
    #[test]
    fn a_bar_has_a_readable_number_of_marks() {
        for (low, high) in [(0.0, 3.0), (25.0, 700.0), (0.0, 1e-3), (298.0, 298.5), (-1.0, 1.0)] {
            let count = marks(low, high).len();
            assert!((4..=10).contains(&count), "{count} marks between {low} and {high}");
        }
    }

    /// A gap between two points is closed half by half, and nothing is coloured far from both.
    #[test]
    fn pixels_belong_to_the_nearest_point_of_the_closed_body() {
        let position =
            vec![[0.35e-3, 0.5e-3, 0.0], [0.65e-3, 0.5e-3, 0.0], [f64::NAN, 0.0, 0.0], [-9.0, 9.0, 0.0]];
        let fields = PointFields { position, ..PointFields::default() };
        let picture = FieldPicture {
            title: "",
            label: "",
            values: &[0.0; 4],
            range: [0.0, 1.0],
            colours: Colours::Viridis,
            view: View { x: [0.0, 1e-3], y: [0.0, 1e-3] },
            spacing: 0.2e-3,
        };
        // 100 pixels a side: discs of 12 pixels around columns 35 and 65.
        let nearest = nearest_points(&fields, &picture, 100.0, [100, 100]);
        let row = &nearest[5000..5100];
        assert_eq!((row[36], row[49], row[50], row[63]), (Some(0), Some(0), Some(1), Some(1)));
        // Beside the discs the closing adds nothing; a pixel of the margin is rounding.
        assert_eq!((row[21], row[78], nearest[0]), (None, None, None));
    }

    /// A block with a curled chip and a tool, drawn by formula: strained in bands, hot along the rake face.
    fn chip() -> PointFields {
        let spacing = 1e-5;
        let mut fields = PointFields {
            time: 2e-5,
            tool_outline: vec![[2e-3, 0.7e-3], [2.5e-3, 0.74e-3], [2.5e-3, 1.74e-3], [2e-3, 1.7e-3]],
            ..PointFields::default()
        };
        let mut add = |x: f64, y: f64, strain: f64| {
            fields.position.push([x, y, 0.0]);
            fields.plastic_strain.push(strain);
            fields.temperature.push(298.15 + 260.0 * strain);
        };
        for i in 0..300 {
            for j in 0..100 {
                let (x, y) = ((f64::from(i) + 0.5) * spacing, (f64::from(j) + 0.5) * spacing);
                if y < 0.7e-3 {
                    let depth = (0.7e-3 - y) / 2e-5;
                    add(x, y, if x > 2e-3 { 2.5 * (-depth).exp() } else { 0.0 });
                } else if x < 1.8e-3 {
                    add(x, y, 0.0);
                } else if x < 2.6e-3 {
                    let (turn, out) = ((x - 1.8e-3) / 0.45e-3, (y - 0.7e-3) * 1.4);
                    let radius = 0.12e-3 + out;
                    let band = 0.5 + 0.5 * (40.0 * turn).sin();
                    let centre = [1.42e-3, 1.15e-3];
                    let at = [centre[0] + radius * turn.cos(), centre[1] + radius * turn.sin()];
                    add(at[0], at[1], 0.8 + 1.6 * band * band * band);
                }
            }
        }
        fields
    }

    /// Draws strain and temperature; with SWARF_PICTURES set to a folder the pictures stay there to be looked
    /// at.
    #[test]
    fn a_field_picture_is_drawn_at_equal_scale() {
        let keep = std::env::var_os("SWARF_PICTURES");
        let folder = keep.clone().map_or_else(std::env::temp_dir, std::path::PathBuf::from);
        let fields = chip();
        let spacing = 1e-5;
        let provenance = Provenance { footer: "a chip by formula".into(), parameters: Vec::new() };
        let celsius: Vec<f64> = fields.temperature.iter().map(|t| t - 273.15).collect();
        let view = View::of(&[&fields], spacing);
        for (name, title, label, values, range, colours) in [
            (
                "strain",
                "Equivalent plastic strain after 1.00 mm",
                "equivalent plastic strain",
                &fields.plastic_strain,
                [0.0, 3.0],
                Colours::Viridis,
            ),
            (
                "heat",
                "Temperature after 1.00 mm",
                "temperature (°C)",
                &celsius,
                [25.0, 700.0],
                Colours::Inferno,
            ),
        ] {
            let path = folder.join(format!("swarf-field-{name}-{}.png", std::process::id()));
            let picture = FieldPicture { title, label, values, range, colours, view, spacing };
            draw_field(&path, &fields, &picture, &provenance).unwrap();
            let png = std::fs::read(&path).unwrap();
            let number = |at: usize| u32::from_be_bytes([png[at], png[at + 1], png[at + 2], png[at + 3]]);
            let (width, height) =
                (f64::from(number(16) - LEFT - RIGHT), f64::from(number(20) - ABOVE - BELOW));
            let ratio = (view.x[1] - view.x[0]) / (view.y[1] - view.y[0]);
            // Each side is rounded to a pixel of several hundred.
            assert!((width / height / ratio - 1.0).abs() < 4e-3, "{width} by {height} for {ratio}");
            if keep.is_none() {
                std::fs::remove_file(&path).unwrap();
            }
        }
    }
}
