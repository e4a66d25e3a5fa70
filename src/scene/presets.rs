//! The price list: what accuracy costs, as `cargo xtask accuracy` measured it, and the presets of
//! `numerics.accuracy`.
//!
//! The figures stand in `resources/price_list.csv`, written by the study and compiled in; nothing else
//! repeats them. Each line gives error bands, as shares of the reference cut's outputs at the finest spacing:
//!
//! | line | meaning of its bands |
//! |---|---|
//! | `spacing` | for an effect of heat: safety factor times what halving the spacing changes, and the scatter of runs with shifted starts |
//! | `speed` | what the speed level changes at equal spacing, at most |
//! | `preset` | both of them for a preset, beside the CPU time of the reference cut over the study's 1.6 mm of travel |
//! | `preset with conduction` | the same with `effects.heat` = conduction |
//!
//! A preset sets a parameter that stands at its start value; one that was set by hand keeps what it was set
//! to, as for the speed levels. The bands belong to the reference cut. What carries them over to another cut
//! is the number of points over the feed; other materials, frictions and edges are not covered by a
//! measurement.

use crate::scene::{Accuracy, ContactChoice, Heat, Numerics, Scene, Speed, TransferChoice};
use std::sync::OnceLock;

/// Outputs that have a band, in the order of the columns.
pub const BANDS: [&str; 5] =
    ["cutting_force", "thrust_force", "chip_thickness", "chip_temperature", "peak_strain_p999"];

/// Feed of the reference cut (m), over whose points per feed bands are carried to other feeds.
const REFERENCE_FEED: f64 = 3e-4;
/// Point spacings in an edge radius, or in a feed, below which its shape is not resolved (-).
pub const LEAST_SPACINGS: f64 = 4.0;
/// A band above this share (-) says only that nothing is known.
const NOTHING_KNOWN: f64 = 1.0;

/// Kind of a preset's line, with the start value of `effects.heat`.
pub const PRESET: &str = "preset";
/// Kind of a preset's line with conduction.
pub const PRESET_WITH_CONDUCTION: &str = "preset with conduction";

/// What a preset sets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Its item of `numerics.accuracy`.
    pub accuracy: Accuracy,
    /// Name of the item.
    pub name: &'static str,
    /// Distance between points (m).
    pub point_spacing: f64,
    /// Transfer from grid to points.
    pub transfer: TransferChoice,
    /// Contact law.
    pub contact: ContactChoice,
    /// Speed level.
    pub speed: Speed,
}

/// The presets, from cheap to dear.
pub const PRESETS: [Preset; 4] = [
    preset(Accuracy::Draft, "draft", 4e-5, Speed::Balanced),
    preset(Accuracy::Standard, "standard", 2e-5, Speed::Balanced),
    preset(Accuracy::Fine, "fine", 1e-5, Speed::Balanced),
    preset(Accuracy::Paper, "paper", 5e-6, Speed::Exact),
];

const fn preset(accuracy: Accuracy, name: &'static str, point_spacing: f64, speed: Speed) -> Preset {
    let (transfer, contact) = (TransferChoice::Flip, ContactChoice::Surface);
    Preset { accuracy, name, point_spacing, transfer, contact, speed }
}

/// One line of the list.
#[derive(Clone, Debug, PartialEq)]
pub struct Price {
    /// `spacing`, `speed`, `PRESET` or `PRESET_WITH_CONDUCTION`.
    pub kind: String,
    /// The level's or the preset's name; for a spacing that of the effect of heat.
    pub name: String,
    /// Distance between points (m); 0 where the line holds for any.
    pub point_spacing: f64,
    /// CPU time of the reference cut over 1.6 mm of travel (s); 0 where it means nothing.
    pub cpu_seconds: f64,
    /// Bands (-) in the order of `BANDS`.
    pub bands: [f64; 5],
}

/// The whole list.
///
/// # Panics
/// When the file compiled in is damaged, which `the_list_is_complete` would have told.
pub fn prices() -> &'static [Price] {
    static PRICES: OnceLock<Vec<Price>> = OnceLock::new();
    PRICES.get_or_init(|| read(include_str!("../../resources/price_list.csv")).expect("a sound price list"))
}

/// Head of the list's file.
pub const HEAD: &str = "kind,name,point_spacing,cpu_seconds,cutting_force,thrust_force,chip_thickness,chip_temperature,peak_strain_p999";

/// The lines of a list; those that begin with # are remarks.
///
/// # Errors
/// Names the line that cannot be read.
pub fn read(text: &str) -> Result<Vec<Price>, String> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    if lines.next() != Some(HEAD) {
        return Err(format!("the price list does not begin with '{HEAD}'"));
    }
    lines
        .map(|line| price(line).ok_or_else(|| format!("the price list cannot be read at '{line}'")))
        .collect()
}

fn price(line: &str) -> Option<Price> {
    let fields: Vec<&str> = line.split(',').collect();
    let [kind, name, numbers @ ..] = fields.as_slice() else { return None };
    let numbers: Vec<f64> = numbers.iter().map(|text| text.parse().ok()).collect::<Option<_>>()?;
    let [point_spacing, cpu_seconds, ref bands @ ..] = numbers[..] else { return None };
    let bands = bands.try_into().ok()?;
    Some(Price { kind: (*kind).into(), name: (*name).into(), point_spacing, cpu_seconds, bands })
}

impl Price {
    /// The line of the file.
    pub fn line(&self) -> String {
        let bands: Vec<String> = self.bands.iter().map(|band| format!("{band:.4}")).collect();
        let Price { kind, name, point_spacing, cpu_seconds, .. } = self;
        format!("{kind},{name},{point_spacing:e},{cpu_seconds:.2},{}", bands.join(","))
    }
}

/// Sets what the scene's preset sets; doing it again changes nothing.
pub fn take_preset(scene: &mut Scene) {
    let Some(preset) = PRESETS.iter().find(|preset| preset.accuracy == scene.numerics.accuracy) else {
        return;
    };
    let start = Scene::default().numerics;
    let Numerics { point_spacing, transfer, contact, speed, .. } = &mut scene.numerics;
    if *point_spacing == start.point_spacing {
        *point_spacing = preset.point_spacing;
    }
    if *transfer == start.transfer {
        *transfer = preset.transfer;
    }
    if *contact == start.contact {
        *contact = preset.contact;
    }
    if *speed == start.speed {
        *speed = preset.speed;
    }
}

/// Share of the cutting force (-) that a scene's own may be off by.
///
/// Between the spacings measured the band is interpolated over points per feed, both as logarithms; for
/// coarser ones it grows with the spacing, for finer ones it stays, as nothing was measured there. At most 1,
/// and 1 where the list knows nothing: under another contact law than `surface`, with mean dilatation, with
/// other than two points along a cell's edge, and with an edge radius that is rounder than sharp and has
/// fewer than four point spacings.
pub fn force_error_band(scene: &Scene, feed: f64) -> f64 {
    band(prices(), scene, feed)
}

/// Smallest length (m) that a scene's points resolve.
pub fn resolved(scene: &Scene) -> f64 {
    // Decimal fractions: 40 µm are four spacings of 10 µm.
    (LEAST_SPACINGS - 1e-9) * scene.numerics.point_spacing
}

fn band(prices: &[Price], scene: &Scene, feed: f64) -> f64 {
    // What the list holds was measured with the plain scheme and its locking control; and a tool that is
    // lifted clear has no points per feed.
    let radius = scene.tool.edge_radius;
    let is_known = scene.numerics.contact == ContactChoice::Surface
        && scene.numerics.separates()
        && scene.numerics.points_per_cell_edge == 2
        && (radius == 0.0 || radius >= resolved(scene));
    if !is_known || feed <= 0.0 {
        return NOTHING_KNOWN;
    }
    let spacing = scene.numerics.point_spacing * REFERENCE_FEED / feed;
    // Nothing was measured for a scene without heat: it takes the bands of the start value.
    let heat = if scene.effects.heat == Heat::Conduction { "conduction" } else { "adiabatic" };
    let mut known: Vec<(f64, f64)> = prices
        .iter()
        .filter(|price| price.kind == "spacing" && price.name == heat)
        .map(|price| (price.point_spacing, price.bands[0]))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(&finest), Some(&coarsest)) = (known.first(), known.last()) else { return NOTHING_KNOWN };
    let of_spacing = if spacing <= finest.0 {
        finest.1
    } else if spacing >= coarsest.0 {
        coarsest.1 * spacing / coarsest.0
    } else {
        let k = known.partition_point(|entry| entry.0 < spacing);
        let ((h0, b0), (h1, b1)) = (known[k - 1], known[k]);
        let share = (spacing / h0).ln() / (h1 / h0).ln();
        (b0.ln() + share * (b1 / b0).ln()).exp()
    };
    let name =
        Speed::ALL.iter().find(|(_, speed)| *speed == scene.numerics.speed).map_or("", |(name, _)| name);
    let level = prices.iter().find(|price| price.kind == "speed" && price.name == name);
    (of_spacing + level.map_or(0.0, |price| price.bands[0])).min(NOTHING_KNOWN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list() -> Vec<Price> {
        let line = |kind: &str, name: &str, point_spacing: f64, band: f64| Price {
            kind: kind.into(),
            name: name.into(),
            point_spacing,
            cpu_seconds: 1.0,
            bands: [band; 5],
        };
        vec![
            line("spacing", "adiabatic", 4e-5, 0.16),
            line("spacing", "adiabatic", 1e-5, 0.04),
            line("spacing", "conduction", 1e-5, 0.01),
            line("speed", "fast", 0.0, 0.02),
        ]
    }

    /// The study has filled in every preset, every level and at least three spacings, and what it writes can
    /// be read.
    #[test]
    fn the_list_is_complete() {
        let named = |kind: &str, name: &str| {
            let found = prices().iter().any(|price| price.kind == kind && price.name == name);
            assert!(found, "no {kind} '{name}' in the price list");
        };
        for preset in PRESETS {
            [PRESET, PRESET_WITH_CONDUCTION].iter().for_each(|kind| named(kind, preset.name));
        }
        ["balanced", "fast"].iter().for_each(|level| named("speed", level));
        for heat in ["adiabatic", "conduction"] {
            let of_heat = |price: &&Price| price.kind == "spacing" && price.name == heat;
            assert!(prices().iter().filter(of_heat).count() >= 3, "{heat}");
        }
        assert!(prices().iter().all(|price| price.bands.iter().all(|band| *band >= 0.0)), "{:?}", prices());
        let text = prices().iter().map(Price::line).collect::<Vec<_>>().join("\n");
        assert_eq!(read(&format!("{HEAD}\n{text}\n")).unwrap(), prices());
    }

    /// Half as dear per halving between what was measured; what lies outside is not promised to be better.
    #[test]
    fn bands_follow_the_points_per_feed() {
        let mut scene = Scene::default();
        let mut at = |spacing: f64, feed: f64, speed: Speed| {
            (scene.numerics.point_spacing, scene.numerics.speed) = (spacing, speed);
            band(&list(), &scene, feed)
        };
        // Exact in decimal fractions, so only rounding is left.
        for (spacing, feed, speed, expected) in [
            (2e-5, 3e-4, Speed::Exact, 0.08),
            (1e-5, 1.5e-4, Speed::Exact, 0.08),
            (2e-5, 3e-4, Speed::Fast, 0.10),
            (8e-5, 3e-4, Speed::Exact, 0.32),
            (1e-6, 3e-4, Speed::Exact, 0.04),
            (1e-5, 0.0, Speed::Exact, 1.0),
            (1e-5, -1e-3, Speed::Exact, 1.0),
        ] {
            let band = at(spacing, feed, speed);
            assert!((band - expected).abs() < 1e-12, "{band} at spacing {spacing}, feed {feed}, {speed:?}");
        }
        (scene.numerics.point_spacing, scene.numerics.speed) = (1e-5, Speed::Exact);
        scene.effects.heat = Heat::Conduction;
        assert_eq!(band(&list(), &scene, 3e-4), 0.01, "conduction has its own line");
        scene.numerics.contact = ContactChoice::Distance;
        assert_eq!(band(&list(), &scene, 3e-4), 1.0, "nothing was measured under this law");
    }

    /// Forces with one to four points along a cell's edge differ by a factor of two, and an edge of three
    /// points is no arc: the list, measured with two and a sharp edge, does not speak for them.
    #[test]
    fn where_nothing_was_measured_the_band_is_one() {
        let at = |per_edge: i32, radius: f64| {
            let mut scene = Scene::default();
            (scene.numerics.points_per_cell_edge, scene.tool.edge_radius) = (per_edge, radius);
            band(&list(), &scene, 3e-4)
        };
        assert_eq!([at(1, 0.0), at(3, 0.0), at(4, 0.0)], [1.0; 3]);
        assert_eq!([at(2, 1e-6), at(2, 3.9e-5)], [1.0; 2]);
        assert_eq!([at(2, 0.0), at(2, 4e-5), at(2, 1e-4)], [0.04; 3]);
    }

    /// As with the speed levels: what was set by hand stays, and twice is once.
    #[test]
    fn presets_leave_what_was_set_by_hand() {
        for preset in PRESETS {
            let mut scene = Scene::default();
            scene.numerics.accuracy = preset.accuracy;
            take_preset(&mut scene);
            assert_eq!(scene.numerics.point_spacing, preset.point_spacing, "{}", preset.name);
            let once = scene.clone();
            take_preset(&mut scene);
            assert_eq!(scene, once, "{} taken twice", preset.name);
            scene = Scene::default();
            (scene.numerics.accuracy, scene.numerics.point_spacing) = (preset.accuracy, 3e-5);
            take_preset(&mut scene);
            assert_eq!(scene.numerics.point_spacing, 3e-5, "{}", preset.name);
        }
        let mut custom = Scene::default();
        take_preset(&mut custom);
        assert_eq!(custom, Scene::default());
    }
}
