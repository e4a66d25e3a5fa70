//! Pictures: line charts and scatters (`chart`), fields on the points with the tool (`field`).
//!
//! Drawn by plotters into PNG files with a font that comes along, so that a picture looks alike on every
//! machine. Each file carries the program's version and the run's parameters as text inside the PNG.

pub mod chart;
pub mod colours;
pub mod field;

use std::path::Path;
use std::sync::Once;

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::{Error, output::vtk};

pub use chart::{Chart, Series, draw_charts, draw_scatter};
pub use field::{FieldPicture, View, draw_field};

/// Name under which the pictures' font is registered.
const FONT: &str = "swarf";
const INK: RGBColor = RGBColor(0x26, 0x2b, 0x33);
const PALE: RGBColor = RGBColor(0x6b, 0x72, 0x7d);
const GRID: RGBColor = RGBColor(0xe3, 0xe6, 0xea);

/// What every picture says of its run.
#[derive(Clone, Debug, Default)]
pub struct Provenance {
    /// One short line at the foot of the picture.
    pub footer: String,
    /// Names and values in use, written into the file.
    pub parameters: Vec<(String, String)>,
}

/// A text style of the pictures.
fn text(size: i32, colour: &RGBColor) -> TextStyle<'_> {
    static REGISTER: Once = Once::new();
    REGISTER.call_once(|| {
        for style in [FontStyle::Normal, FontStyle::Bold] {
            let registered = register_font(FONT, style, epaint_default_fonts::UBUNTU_LIGHT);
            debug_assert!(registered.is_ok(), "the font's bytes are a font");
        }
    });
    (FONT, size).into_font().color(colour)
}

/// A number on an axis: as many decimals as the step of the axis needs.
fn tick(value: f64, span: f64) -> String {
    let decimals = (2.0 - span.max(1e-300).log10()).ceil().clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.replace('-', "\u{2212}") }
}

/// Puts the version and the parameters into a PNG file as a text chunk (PNG specification, 11.3.4, iTXt).
fn sign(path: &Path, provenance: &Provenance) -> Result<(), Error> {
    let refused = |reason: String| Error::File { path: path.display().to_string(), reason };
    let png = std::fs::read(path).map_err(|e| refused(e.to_string()))?;
    // Signature (8) and the header chunk: length, name, 13 bytes, checksum.
    let after_header = 8 + 4 + 4 + 13 + 4;
    if png.len() < after_header {
        return Err(refused("the picture is empty".into()));
    }
    let mut chunk = b"iTXtDescription\0\0\0\0\0".to_vec();
    chunk.extend_from_slice(crate::output::results::history_head(&provenance.parameters).as_bytes());
    let length = (chunk.len() - 4) as u32;
    let mut out = png[..after_header].to_vec();
    out.extend_from_slice(&length.to_be_bytes());
    out.extend_from_slice(&chunk);
    out.extend_from_slice(&crc32fast::hash(&chunk).to_be_bytes());
    out.extend_from_slice(&png[after_header..]);
    vtk::replace(path, &out)
}

/// An error of the drawing library as ours.
fn failed(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::File { path: path.display().to_string(), reason: format!("cannot draw: {error}") }
}

/// The footer's text: what the caller says, then the program.
fn footer(provenance: &Provenance) -> String {
    let program = format!("{} {}", vtk::MARK.trim_start_matches("written by "), crate::version::VERSION);
    if provenance.footer.is_empty() { program } else { format!("{}   {program}", provenance.footer) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Labels carry no digit the axis cannot show, and no negative zero.
    #[test]
    fn ticks_have_as_many_decimals_as_the_axis_needs() {
        let cases = [(0.5, 2.0, "0.5"), (200.0, 600.0, "200"), (-0.0, 3.0, "0"), (0.0125, 0.02, "0.0125")];
        for (value, span, expected) in cases {
            assert_eq!(tick(value, span), expected, "value {value}, span {span}");
        }
    }
}
