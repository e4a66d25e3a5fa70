//! What is measured on a cut part afterwards: profiles under the machined surface and along the rake face.
//!
//! Both sort points into bins of equal width and give, per bin, the mass-weighted mean of each quantity and
//! its standard deviation over the bin's points: x̄ = Σ m x / Σ m, s² = Σ m (x − x̄)² / Σ m. A bin is one
//! cell wide (two point spacings): finer structure than a cell is not resolved. Bins without points have no
//! row.
//!
//! The stress under the surface is that of the frame's instant: still hot and still ringing right behind the
//! tool. It is the residual stress of the finished part only after unloading and cooling.
//!
//! Points of the chip's rigid tail do not count: it passes through workpiece and chip.

use std::fmt::Write as _;

use crate::output::point_fields::PointFields;

/// Quantities under the machined surface, in the order of a row's values.
pub const SURFACE_QUANTITIES: [&str; 5] =
    ["stress_xx (Pa)", "stress_yy (Pa)", "stress_xy (Pa)", "plastic_strain (1)", "temperature (K)"];
/// Quantities along the rake face, in the order of a row's values.
pub const RAKE_QUANTITIES: [&str; 4] =
    ["contact_pressure (Pa)", "shear_stress (Pa)", "mean_pressure (Pa)", "temperature (K)"];
/// Width of a bin in point spacings (-): one cell.
const BIN: f64 = 2.0;
/// Distances to the rake face between which points count, in bins (-). In the first cell points pile up, and
/// their volumes overlap: their mean pressure missed 40 % of the force in the reference cut, that of the two
/// cells behind it 7 %.
const NEAR: [f64; 2] = [1.0, 3.0];
/// Points up to this far above the cutting plane, in bins, count into the first one: the surface springs back
/// (-).
const SPRING_BACK: f64 = 0.5;
/// Distance kept from the tool's edge and from the side where the tool came in, in feeds (-).
const CLEAR: f64 = 1.0;
/// Shortest stretch of surface that a profile is taken over, in feeds (-).
const SHORTEST: f64 = 0.5;

/// One bin of a profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<const N: usize> {
    /// Middle of the bin (m).
    pub place: f64,
    /// Its points.
    pub points: usize,
    /// Their mass (kg).
    pub mass: f64,
    /// Mass-weighted means, in the units of the quantities.
    pub mean: [f64; N],
    /// Mass-weighted standard deviations.
    pub spread: [f64; N],
}

/// A straight rake face in a frame's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RakeFace {
    /// Where it leaves the edge (m).
    pub start: [f64; 2],
    /// Unit vector up along it (-).
    pub direction: [f64; 2],
    /// Unit vector out of the tool (-).
    pub normal: [f64; 2],
    /// Length (m).
    pub length: f64,
}

impl RakeFace {
    /// The face from an outline as `ToolShape::outline` gives it: the outline's closing line, run backwards.
    ///
    /// * `outline`: counter-clockwise, first point repeated at the end (m)
    ///
    /// `None` where that is no polygon.
    pub fn of(outline: &[[f64; 2]]) -> Option<RakeFace> {
        let [.., end, start] = outline else { return None };
        let along = [end[0] - start[0], end[1] - start[1]];
        let length = along[0].hypot(along[1]);
        let direction = [along[0] / length, along[1] / length];
        (outline.len() > 3 && length > 0.0).then_some(RakeFace {
            start: *start,
            direction,
            normal: [-direction[1], direction[0]],
            length,
        })
    }
}

/// The tool's lowest point (m), from its outline.
pub fn lowest_point(outline: &[[f64; 2]]) -> Option<[f64; 2]> {
    outline.iter().copied().min_by(|a, b| a[1].total_cmp(&b[1]))
}

/// The stretch of machined surface (x from, x to; m) that is one feed clear of the edge and of the side where
/// the tool came in.
///
/// * `edge`: x of the tool's lowest point (m)
/// * `length`: the workpiece's, whose right side the tool entered (m)
/// * `feed`: depth of the tool's lowest point below the top (m), above 0
///
/// `None` before the tool has left half a feed of such surface behind it.
pub fn stretch_behind(edge: f64, length: f64, feed: f64) -> Option<[f64; 2]> {
    let stretch = [edge + CLEAR * feed, length - CLEAR * feed];
    (feed > 0.0 && edge >= 0.0 && stretch[1] - stretch[0] >= SHORTEST * feed).then_some(stretch)
}

/// Profile over the depth below the cutting plane, the height of the tool's lowest point.
///
/// * `stretch`: x from, x to (m), as `stretch_behind` gives it
/// * `plane`: height of the cutting plane (m)
/// * `spacing`: distance of points at the start (m)
///
/// Rows by depth (m) with the `SURFACE_QUANTITIES`.
pub fn under_surface(fields: &PointFields, stretch: [f64; 2], plane: f64, spacing: f64) -> Vec<Row<5>> {
    let width = BIN * spacing;
    let samples = fields.position.iter().enumerate().filter_map(|(i, position)| {
        let depth = plane - position[1];
        let is_in = (stretch[0]..stretch[1]).contains(&position[0])
            && depth >= -SPRING_BACK * width
            && !fields.is_tail(i);
        let stress = &fields.stress[i];
        let values = [stress[0], stress[1], stress[5], fields.plastic_strain[i], fields.temperature[i]];
        is_in.then_some((depth.max(0.0), fields.mass[i], values))
    });
    binned(width, samples)
}

/// Profile along the rake face, over the distance from where it leaves the edge, of the points one to three
/// cells off it; the face itself is hotter than they are.
///
/// With the normal n out of the tool and t up along the face: contact pressure −n·σn, shear stress t·σn
/// (positive where the tool holds the chip back), mean pressure −tr σ / 3, temperature.
///
/// * `spacing`: distance of points at the start (m)
///
/// Rows by distance (m) with the `RAKE_QUANTITIES`.
pub fn along_rake(fields: &PointFields, face: &RakeFace, spacing: f64) -> Vec<Row<4>> {
    let width = BIN * spacing;
    let ([nx, ny], [tx, ty]) = (face.normal, face.direction);
    let samples = fields.position.iter().enumerate().filter_map(|(i, position)| {
        let from_start = [position[0] - face.start[0], position[1] - face.start[1]];
        let along = from_start[0] * tx + from_start[1] * ty;
        let distance = from_start[0] * nx + from_start[1] * ny;
        let is_near = (0.0..face.length).contains(&along)
            && (NEAR[0] * width..NEAR[1] * width).contains(&distance)
            && !fields.is_tail(i);
        let s = &fields.stress[i];
        let traction = [s[0] * nx + s[5] * ny, s[5] * nx + s[1] * ny];
        let values = [
            -(traction[0] * nx + traction[1] * ny),
            traction[0] * tx + traction[1] * ty,
            -(s[0] + s[1] + s[2]) / 3.0,
            fields.temperature[i],
        ];
        is_near.then_some((along, fields.mass[i], values))
    });
    binned(width, samples)
}

/// Means and standard deviations by bin; running sums after West (1979), which do not cancel.
fn binned<const N: usize>(width: f64, samples: impl Iterator<Item = (f64, f64, [f64; N])>) -> Vec<Row<N>> {
    let mut rows: Vec<Row<N>> = Vec::new();
    for (place, mass, values) in samples {
        let bin = (place / width) as usize;
        while rows.len() <= bin {
            let place = (rows.len() as f64 + 0.5) * width;
            rows.push(Row { place, points: 0, mass: 0.0, mean: [0.0; N], spread: [0.0; N] });
        }
        let row = &mut rows[bin];
        row.points += 1;
        row.mass += mass;
        for k in 0..N {
            let off = values[k] - row.mean[k];
            row.mean[k] += off * mass / row.mass;
            row.spread[k] += mass * off * (values[k] - row.mean[k]);
        }
    }
    rows.retain(|row| row.points > 0);
    for row in &mut rows {
        row.spread = row.spread.map(|sum| (sum / row.mass).sqrt());
    }
    rows
}

/// The rows as lines of a table with a head of names and units; each mean is followed by its standard
/// deviation.
///
/// * `place`: name and unit of the place, such as "depth (m)"
pub fn table<const N: usize>(place: &str, quantities: [&str; N], rows: &[Row<N>]) -> String {
    let mut out = format!("{place},points,mass (kg)");
    for quantity in quantities {
        let _ = write!(out, ",{quantity},spread of {quantity}");
    }
    out.push('\n');
    for row in rows {
        let _ = write!(out, "{:e},{},{:e}", row.place, row.points, row.mass);
        for (mean, spread) in row.mean.iter().zip(row.spread) {
            let _ = write!(out, ",{mean:e},{spread:e}");
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of 200 x 100 points, 10 µm apart, with the fields that `at` gives for a position.
    fn block(at: impl Fn(f64, f64) -> ([f64; 6], f64, f64)) -> PointFields {
        let mut fields = PointFields::default();
        for number in 0..20_000 {
            let [x, y] = [number / 100, number % 100].map(|index| (f64::from(index) + 0.5) * 1e-5);
            let (stress, strain, temperature) = at(x, y);
            fields.position.push([x, y, 0.0]);
            fields.mass.push(2e-9);
            fields.stress.push(stress);
            fields.plastic_strain.push(strain);
            fields.temperature.push(temperature);
        }
        fields
    }

    /// A field that depends on depth alone in known functions comes back, each component in its own column;
    /// what lies outside the stretch (a thousandfold field) leaves no trace.
    #[test]
    fn a_known_field_comes_back_by_depth() {
        let plane = 7e-4;
        let fields = block(|x, y| {
            let depth = plane - y;
            let scale = if (6e-4..12e-4).contains(&x) { 1.0 } else { 1e3 };
            (
                [scale * 1e12 * depth, scale * 2e8, 7.0, 8.0, 9.0, -3e8 * scale],
                scale * depth * depth,
                300.0 * scale,
            )
        });
        let rows = under_surface(&fields, [6e-4, 12e-4], plane, 1e-5);
        assert_eq!(rows.len(), 35, "0.7 mm in bins of 20 µm");
        for row in &rows {
            // Two layers of points, half a spacing above and below the middle; the plane's own layer above it
            // is in the first.
            if row.place < 2e-5 {
                continue;
            }
            assert_eq!(row.points, 2 * 60);
            let [xx, yy, xy, strain, temperature] = row.mean;
            let z = row.place;
            assert!((xx - 1e12 * z).abs() < 1e-6 * 1e8, "σ_xx = {xx} Pa at {z} m");
            assert!((yy - 2e8).abs() < 1.0 && (xy + 3e8).abs() < 1.0, "σ_yy = {yy}, σ_xy = {xy} Pa");
            // Mean of (z ± h/2)² is z² + h²/4; the standard deviation of z ± h/2 is h/2.
            assert!((strain - z * z - 2.5e-11).abs() < 1e-16, "strain {strain} at {z} m");
            assert!((row.spread[0] - 5e6).abs() < 1.0, "spread of σ_xx = {} Pa", row.spread[0]);
            assert!((temperature - 300.0).abs() < 1e-9 && row.spread[4] < 1e-6, "{temperature} K");
        }
        // One layer of points lies half a spacing above the plane, within half a bin.
        assert_eq!(rows[0].points, 3 * 60);
    }

    /// Unequal masses weigh: 1 kg at 0 and 3 kg at 4 have the mean 3 and the variance (1·9 + 3·1)/4 = 3.
    #[test]
    fn means_and_spreads_are_weighted_by_mass() {
        let rows = binned(1.0, [(0.2, 1.0, [0.0]), (0.7, 3.0, [4.0]), (2.5, 1.0, [1.0])].into_iter());
        assert_eq!(rows.len(), 2, "{rows:?}");
        assert!((rows[0].mean[0] - 3.0).abs() < 1e-15, "{rows:?}");
        assert!((rows[0].spread[0] - 3.0_f64.sqrt()).abs() < 1e-15, "{rows:?}");
        assert_eq!((rows[1].place, rows[1].mean[0], rows[1].spread[0]), (2.5, 1.0, 0.0));
    }

    /// On an inclined face under a uniform stress the traction is σn with the face's own normal, whatever the
    /// angle: with σ = −p n⊗n + τ (n⊗t + t⊗n) it is pressure p and shear τ; points nearer and further do not
    /// count.
    #[test]
    fn tractions_are_those_of_the_inclined_face() {
        let (p, tau, rake) = (2e9, 0.4e9, 0.2_f64);
        let shape = crate::tool::profile::ToolShape::new(rake, 0.1, 2e-5, 5e-4, 1e-3).unwrap();
        let tip = [1e-3, 3e-4];
        let outline: Vec<[f64; 2]> =
            shape.outline(16).iter().map(|q| [q[0] + tip[0], q[1] + tip[1]]).collect();
        let face = RakeFace::of(&outline).unwrap();
        let ([nx, ny], [tx, ty]) = (shape.rake_normal(), shape.rake_direction());
        for k in 0..2 {
            assert!((face.normal[k] - shape.rake_normal()[k]).abs() < 1e-12, "{face:?}");
            assert!((face.start[k] - tip[k] - shape.rake_start()[k]).abs() < 1e-15, "{face:?}");
        }
        let stress = [
            -p * nx * nx + 2.0 * tau * nx * tx,
            -p * ny * ny + 2.0 * tau * ny * ty,
            -0.5e9,
            0.0,
            0.0,
            -p * nx * ny + tau * (nx * ty + ny * tx),
        ];
        let fields = block(|x, y| {
            let distance = (x - face.start[0]) * nx + (y - face.start[1]) * ny;
            let scale = if (2e-5..6e-5).contains(&distance) { 1.0 } else { 1e3 };
            (stress.map(|s| scale * s), 0.0, 500.0 + 1e5 * (y - face.start[1]))
        });
        let rows = along_rake(&fields, &face, 1e-5);
        assert!(rows.len() > 30, "{} rows", rows.len());
        for row in &rows {
            let [normal, shear, mean, temperature] = row.mean;
            assert!((normal - p).abs() < 10.0 && (shear - tau).abs() < 10.0, "{row:?}");
            assert!((mean - (p + 0.5e9) / 3.0).abs() < 10.0, "{row:?}");
            // A bin's points lie up to three cells beside the face and half a bin along it: 100 K per mm over
            // some 20 µm.
            assert!((temperature - 500.0 - 1e5 * row.place * ty).abs() < 4.0, "{row:?}");
        }
    }

    /// Chip that is carried on as a rigid body goes through what is in its way, and leaves no trace there.
    #[test]
    fn a_tail_is_not_in_the_profiles() {
        let fields = block(|_, _| ([1e9; 6], 1.0, 300.0));
        let mut with_tail = fields.clone();
        for number in 0..fields.position.len() {
            with_tail.position.push(fields.position[number]);
            with_tail.mass.push(2e-9);
            with_tail.stress.push([7e9; 6]);
            with_tail.plastic_strain.push(9.0);
            with_tail.temperature.push(900.0);
        }
        with_tail.tail = (0..2 * fields.position.len()).map(|i| i >= fields.position.len()).collect();
        let face = RakeFace { start: [1e-3, 3e-4], direction: [0.0, 1.0], normal: [-1.0, 0.0], length: 5e-4 };
        let surface = |fields| under_surface(fields, [6e-4, 12e-4], 7e-4, 1e-5);
        assert_eq!(surface(&with_tail), surface(&fields));
        assert_eq!(along_rake(&with_tail, &face, 1e-5), along_rake(&fields, &face, 1e-5));
    }

    /// No profile is made up before there is a surface to look at.
    #[test]
    fn no_stretch_before_enough_is_cut() {
        assert_eq!(stretch_behind(2.5e-3, 3e-3, 3e-4), None);
        assert_eq!(stretch_behind(1e-3, 3e-3, 0.0), None);
        let stretch = stretch_behind(1e-3, 3e-3, 3e-4).unwrap();
        assert!((stretch[0] - 1.3e-3).abs() < 1e-15 && (stretch[1] - 2.7e-3).abs() < 1e-15, "{stretch:?}");
        assert_eq!(RakeFace::of(&[]), None);
    }

    /// The table names every unit and has as many columns in each line as in its head.
    #[test]
    fn the_table_has_units_and_equal_lines() {
        let rows = binned(1.0, [(0.5, 1.0, [1.0, 2.0, 3.0, 4.0])].into_iter());
        let text = table("distance (m)", RAKE_QUANTITIES, &rows);
        let lines: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(lines, [11, 11], "{text}");
        assert!(
            text.lines().next().unwrap().split(',').all(|name| name == "points" || name.ends_with(')')),
            "{text}"
        );
    }
}
