//! Shear bands of the chip: how many, how far apart, how pronounced, and the frequency at which they form.
//!
//! The equivalent plastic strain is followed along a fibre of the chip: the points that stood between a third
//! and 0.467 of the feed above the cutting plane before the cut (0.10 to 0.14 mm of 0.3 mm), over their
//! distance s along the cut from the side where the tool came in. Material coordinates do not curl with the
//! chip, and need no search for its outline; what has joined the chip's rigid tail keeps the strain that it
//! had, and where the tail goes does not matter. The fibre is sampled in bins of one point spacing, from one
//! feed behind the entry to one feed behind the edge, where it has passed the shear zone.
//!
//! A band is a maximum of that strain, averaged over three bins, whose prominence (its height over the higher
//! of the two lowest strains between it and higher maxima or the ends) exceeds
//!
//! * 0.1 of the mean strain, and
//! * 6 standard deviations of what noise is left in a mean of three: σ/√3, with σ² the mean square of the
//!   second differences over 6, which is the variance of white noise (von Neumann and others 1941, for first
//!   differences).
//!
//! A maximum at the fibre's end has only one flank and does not count. From three bands on, the spacing is
//! the mean of their distances; with fewer the estimator says that it found none. Each maximum is known to a
//! bin, so the mean spacing of n bands to √2 bins / (n − 1). Waves that short look like noise to second
//! differences, so spacings below eight bins (four cells) are not resolved and count as none.
//!
//! The spacing is that of the uncut material, so the frequency is cutting speed / spacing, at the speed of
//! the moment; in the chip the bands stand closer by the chip compression, feed / chip thickness.

use crate::output::point_fields::PointFields;
use crate::scene::lattice::StartLattice;

/// The fibre's place above the cutting plane, in feeds (-).
const FIBRE: [f64; 2] = [1.0 / 3.0, 1.4 / 3.0];
/// Distance from the entry and from the edge, in feeds (-).
const CLEAR: f64 = 1.0;
/// Least prominence over the mean strain (-).
const PROMINENCE: f64 = 0.1;
/// Least prominence over the noise (-).
const NOISE: f64 = 6.0;
/// Fewest bands that have a spacing.
const FEWEST: usize = 3;
/// Least spacing in bins (-): four cells.
const SHORTEST: f64 = 8.0;

/// What was found along a fibre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bands {
    /// Bands found, those too few for a spacing too.
    pub count: usize,
    /// Mean distance (m) in the uncut material; `None` where none was found.
    pub spacing: Option<f64>,
    /// Standard deviation of the distances (m), 0 without a spacing.
    pub spread: f64,
    /// To how much the mean distance is known (m): √2 bins / (bands − 1); 0 without a spacing.
    pub resolution: f64,
    /// Rms of the strain less its moving mean over 0.8 feeds, over its mean (-); 0 on a fibre shorter than
    /// that.
    pub contrast: f64,
}

/// The mean equivalent plastic strain along the fibre, by bins of one point spacing (-).
///
/// * `length`: the workpiece's along the cut (m)
/// * `plane`: height of the cutting plane (m), the tool's lowest point
/// * `feed`: its depth below the top (m)
/// * `edge`: x of the tool's lowest point (m)
///
/// Empty before the chip is long enough.
pub fn fibre(fields: &PointFields, lattice: &StartLattice, plane: f64, feed: f64, edge: f64) -> Vec<f64> {
    let [step, height, _] = lattice.step;
    let cut = lattice.count[0] as f64 * step - edge;
    // Bins that lie whole between the two ends.
    let first = (CLEAR * feed / step - 1e-6).ceil().max(0.0) as usize;
    let last = (((cut - CLEAR * feed) / step + 1e-6).max(0.0) as usize).min(lattice.count[0]);
    let mut sums = vec![(0.0, 0.0); last.saturating_sub(first)];
    for (i, &id) in fields.id.iter().enumerate() {
        let [x, y, _] = lattice.index(id as usize);
        let above = (y as f64 + 0.5) * height - plane;
        let Some(bin) = lattice.count[0].checked_sub(1 + x).and_then(|bin| bin.checked_sub(first)) else {
            continue;
        };
        if bin < sums.len() && (FIBRE[0] * feed..FIBRE[1] * feed).contains(&above) {
            sums[bin].0 += fields.mass[i] * fields.plastic_strain[i];
            sums[bin].1 += fields.mass[i];
        }
    }
    // A bin whose points have all left ends the fibre.
    sums.iter().take_while(|sum| sum.1 > 0.0).map(|sum| sum.0 / sum.1).collect()
}

/// Finds the bands of a fibre.
///
/// * `strain`: equivalent plastic strain by bins (-)
/// * `bin`: width of a bin (m)
/// * `feed`: (m), sets the window of the contrast
pub fn bands(strain: &[f64], bin: f64, feed: f64) -> Bands {
    let contrast = contrast(strain, 2 * (0.4 * feed / bin + 1e-6) as usize + 1);
    if strain.len() < 5 {
        return Bands { contrast, ..Bands::default() };
    }
    let second: Vec<f64> = strain.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2) / 6.0).collect();
    let noise = (mean(&second) / 3.0).sqrt();
    let smooth: Vec<f64> = strain.windows(3).map(mean).collect();
    let least = (PROMINENCE * mean(strain)).max(NOISE * noise);
    let places: Vec<f64> = (1..smooth.len() - 1)
        .filter(|&i| smooth[i] > smooth[i - 1] && smooth[i] >= smooth[i + 1])
        .filter(|&i| prominence(&smooth, i) > least)
        .map(|i| i as f64)
        .collect();
    let count = places.len();
    let found = Bands { count, contrast, ..Bands::default() };
    if count < FEWEST {
        return found;
    }
    let distances: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let spacing = mean(&distances);
    if spacing < SHORTEST {
        return found;
    }
    let squares: Vec<f64> = distances.iter().map(|d| (d - spacing).powi(2)).collect();
    Bands {
        spacing: Some(bin * spacing),
        spread: bin * mean(&squares).sqrt(),
        resolution: std::f64::consts::SQRT_2 * bin / (count - 1) as f64,
        ..found
    }
}

/// Height of a maximum over the higher of the lowest values on its two sides, each side up to a higher value
/// or the end.
fn prominence(values: &[f64], at: usize) -> f64 {
    let top = values[at];
    let base = |side: &mut dyn Iterator<Item = &f64>| {
        side.take_while(|v| **v <= top).fold(top, |low, v| low.min(*v))
    };
    let (left, right) = (base(&mut values[..at].iter().rev()), base(&mut values[at + 1..].iter()));
    top - left.max(right)
}

/// Rms of the values less their moving mean, over their mean (-).
fn contrast(values: &[f64], window: usize) -> f64 {
    if values.len() < window || mean(values) <= 0.0 {
        return 0.0;
    }
    let squares: Vec<f64> =
        values.windows(window).map(|part| (part[window / 2] - mean(part)).powi(2)).collect();
    mean(&squares).sqrt() / mean(values)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Head of the table that `line` fills.
pub const TABLE_HEAD: &str = "time (s),cut (m),shear bands (1),spacing uncut (m),spread of spacing (m),\
     resolution of spacing (m),spacing in chip (m),frequency (Hz),contrast (1)";

/// A line of the table; `nan` stands where no spacing was found.
///
/// * `cut`: length cut so far (m)
/// * `speed`: cutting speed (m/s)
/// * `compression`: feed / chip thickness (-), 0 where there is no chip thickness yet
pub fn line(bands: &Bands, time: f64, cut: f64, speed: f64, compression: f64) -> String {
    let known = |value: f64| if bands.spacing.is_some() { value } else { f64::NAN };
    let spacing = bands.spacing.unwrap_or(f64::NAN);
    let in_chip = if compression > 0.0 { compression * spacing } else { f64::NAN };
    let values =
        [spacing, known(bands.spread), known(bands.resolution), in_chip, speed / spacing, bands.contrast];
    let text = values.map(|value| if value.is_nan() { "nan".into() } else { format!("{value:e}") });
    format!("{time:e},{cut:e},{},{}", bands.count, text.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reproducible noise of standard deviation one: twelve uniform numbers less six.
    fn noise(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    /// Bands at a known distance come back within the stated resolution, for sine and for narrow bands, with
    /// noise.
    #[test]
    fn a_known_spacing_comes_back() {
        for period in [8.5, 10.0, 14.0, 21.3] {
            for sharpness in [1, 4] {
                for seed in 1..20 {
                    let wave =
                        |i: f64| (0.5 + 0.5 * (std::f64::consts::TAU * i / period).sin()).powi(sharpness);
                    let strain: Vec<f64> = (noise(120, seed).iter().enumerate())
                        .map(|(i, n)| 1.5 + wave(i as f64) + 0.02 * n)
                        .collect();
                    let found = bands(&strain, 1e-5, 3e-4);
                    let spacing = found.spacing.expect("bands of prominence 0.5");
                    let error = (spacing - 1e-5 * period).abs();
                    assert!(
                        error <= found.resolution,
                        "period {period}, sharpness {sharpness}, seed {seed}: {found:?}"
                    );
                    assert!(found.spread <= 1.5e-5, "equal distances, known to a bin: {found:?}");
                }
            }
        }
    }

    /// Noise of any strength, a ramp, a constant and a single step have no bands: the estimator says so.
    #[test]
    fn what_has_no_bands_has_no_spacing() {
        let mut false_alarms = 0;
        for seed in 1..=200 {
            for strength in [0.02, 0.1, 0.5] {
                let strain: Vec<f64> = noise(95, seed).iter().map(|n| 1.5 + strength * n).collect();
                false_alarms += usize::from(bands(&strain, 1e-5, 3e-4).spacing.is_some());
            }
        }
        // Three maxima of noise each six standard deviations high.
        assert!(false_alarms <= 6, "{false_alarms} of 600 noises had bands");
        let shapes: [fn(usize) -> f64; 3] =
            [|i| 0.02 * i as f64, |_| 1.0, |i| if i < 40 { 1.0 } else { 2.0 }];
        for shape in shapes {
            let strain: Vec<f64> = (0..95).map(shape).collect();
            assert_eq!(bands(&strain, 1e-5, 3e-4).spacing, None);
        }
        assert_eq!(bands(&[], 1e-5, 3e-4), Bands::default());
    }

    /// Waves of a twentieth of the mean are no bands, two bands have no spacing, and waves shorter than four
    /// cells none.
    #[test]
    fn weak_few_and_short_waves_are_none() {
        let wave = |height: f64, period: f64, count: usize| -> Vec<f64> {
            (0..count)
                .map(|i| 1.0 + height * (std::f64::consts::TAU * (i as f64 + 0.3) / period).sin())
                .collect()
        };
        assert_eq!(bands(&wave(0.04, 12.0, 96), 1e-5, 3e-4).count, 0, "8 % from trough to crest");
        let two = bands(&wave(0.3, 30.0, 60), 1e-5, 3e-4);
        assert_eq!((two.count, two.spacing), (2, None));
        for period in [3.5, 5.0, 7.5] {
            assert_eq!(bands(&wave(0.5, period, 96), 1e-5, 3e-4).spacing, None, "period {period} bins");
        }
    }

    /// A sine of amplitude a about 1 has the contrast a/√2 where its period divides the window; an even fibre
    /// has none.
    #[test]
    fn contrast_is_the_rms_of_the_waves() {
        // The window is 25 bins, the period as well: its moving mean is the mean.
        let strain: Vec<f64> =
            (0..125).map(|i| 1.0 + 0.2 * (std::f64::consts::TAU * f64::from(i) / 25.0).sin()).collect();
        let contrast = bands(&strain, 1e-5, 3e-4).contrast;
        // 101 values, four periods and a bit.
        assert!((contrast - 0.2 / 2.0_f64.sqrt()).abs() < 2e-3, "contrast {contrast}");
    }

    /// The fibre is taken by where points stood, not by where they are: strains written by start place come
    /// back in order from the entry, wherever the chip has gone.
    #[test]
    fn a_fibre_follows_its_material() {
        let lattice = StartLattice::new([3e-3, 1e-3, 1e-3], 1e-5, 2);
        assert_eq!(lattice.count, [300, 100, 1]);
        let mut fields = PointFields::default();
        for id in 0..30_000 {
            let [x, y, _] = lattice.index(id);
            fields.id.push(id as u32);
            fields.mass.push(1.0);
            // Rows 80 to 83 stand 0.10 to 0.14 mm above a plane at 0.7 mm.
            fields.plastic_strain.push(if (80..84).contains(&y) { x as f64 } else { -1e9 });
        }
        let strain = fibre(&fields, &lattice, 7e-4, 3e-4, 1.4e-3);
        // The tool has cut 1.6 mm: bins of 10 µm from 0.3 to 1.3 mm.
        assert_eq!(strain.len(), 100);
        assert!((strain[0] - 269.0).abs() < 1e-9 && (strain[99] - 170.0).abs() < 1e-9, "{strain:?}");
        assert!(fibre(&fields, &lattice, 7e-4, 3e-4, 2.6e-3).is_empty(), "no fibre in a chip of 0.4 mm");
    }

    /// One band per spacing of uncut length: at 50 m/s and 0.1 mm 500 kHz; none found is `nan`, never 0.
    #[test]
    fn the_table_gives_frequency_or_nan() {
        let found = Bands { count: 4, spacing: Some(1e-4), ..Bands::default() };
        let text = line(&found, 1e-5, 1.6e-3, 50.0, 0.5);
        let values: Vec<f64> = text.split(',').map(|v| v.parse().unwrap()).collect();
        assert_eq!(values.len(), TABLE_HEAD.split(',').count());
        assert!((values[6] - 5e-5).abs() < 1e-15 && (values[7] - 5e5).abs() < 1e-6, "{text}");
        assert_eq!(line(&Bands::default(), 0.0, 0.0, 50.0, 0.5).matches("nan").count(), 5);
    }
}
