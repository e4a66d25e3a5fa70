//! Colour scales of even perceived steps, as polynomials.
//!
//! Least-squares fits of degree 6 to matplotlib's scales, colour by colour in [0, 1] (Zucker 2019,
//! shadertoy.com/view/WlfXRN, public domain); largest deviation about 0.02.

use plotters::style::RGBColor;

/// A colour scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colours {
    /// Violet over green to yellow: strain.
    Viridis,
    /// Dark violet over red to light yellow: temperature. The scale's black end is left out: it hides the
    /// outlines.
    Inferno,
}

const VIRIDIS: [[f64; 3]; 7] = [
    [0.277_727_3, 0.005_407_3, 0.334_099_8],
    [0.105_093_0, 1.404_613_5, 1.384_590_2],
    [-0.330_861_8, 0.214_847_6, 0.095_095_2],
    [-4.634_230_5, -5.799_101_0, -19.332_441_0],
    [6.228_269_9, 14.179_933_4, 56.690_552_6],
    [4.776_385_0, -13.745_145_4, -65.353_032_6],
    [-5.435_455_9, 4.645_852_6, 26.312_435_2],
];
const INFERNO: [[f64; 3]; 7] = [
    [0.000_218_9, 0.001_651_0, -0.019_480_9],
    [0.106_513_4, 0.563_956_4, 3.932_712_4],
    [11.602_493_1, -3.972_854_0, -15.942_394_1],
    [-41.703_996_1, 17.436_398_9, 44.354_145_2],
    [77.162_935_7, -33.402_358_9, -81.807_309_3],
    [-71.319_428_2, 32.626_064_3, 73.209_519_9],
    [25.131_126_2, -12.242_669_0, -23.070_325_0],
];

impl Colours {
    /// The colour of a share of the scale, held at its ends; a value that is not a number is grey.
    pub fn at(self, share: f64) -> RGBColor {
        if share.is_nan() {
            return RGBColor(128, 128, 128);
        }
        let (terms, first) = match self {
            Colours::Viridis => (&VIRIDIS, 0.0),
            Colours::Inferno => (&INFERNO, 0.14),
        };
        let x = first + (1.0 - first) * share.clamp(0.0, 1.0);
        let channel = |k: usize| {
            let value = terms.iter().rev().fold(0.0, |sum, term| sum * x + term[k]);
            (value.clamp(0.0, 1.0) * 255.0).round() as u8
        };
        RGBColor(channel(0), channel(1), channel(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along an even scale brightness only grows, so a reader can rank two values, in print too.
    #[test]
    fn brightness_grows_along_each_scale() {
        for scale in [Colours::Viridis, Colours::Inferno] {
            let brightness = |step: i32| {
                let RGBColor(r, g, b) = scale.at(f64::from(step) / 50.0);
                0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
            };
            for step in 1..=50 {
                // One step of 255 is rounding.
                let (before, now) = (brightness(step - 1), brightness(step));
                assert!(now > before - 1.0, "{scale:?}: {now} after {before} at {step}");
            }
        }
    }
}
