//! What a machinist asks of the points: the chip's temperature, strain, thickness and shear angle.
//!
//! The chip is the material above the machined surface whose equivalent plastic strain exceeds 0.05. Its
//! rigid tail (`speedups::rigid_chip`) counts for its temperature, and for nothing that is measured by place:
//! thickness and what follows from it.

use crate::simulation::PointView;
use crate::tool::RigidTool;

/// Equivalent plastic strain from which material above the machined surface is chip (-).
const CHIP_STRAIN: f64 = 0.05;
/// Chip thickness is measured between these distances along the rake face, in feeds: above the shear zone,
/// whose upper end is one feed up at a rake angle of zero.
const STRIP: [f64; 2] = [1.0, 1.5];

/// Sums over all points at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Kinetic energy (J).
    pub kinetic: f64,
    /// Elastic energy (J).
    pub elastic: f64,
    /// Heat stored since the start (J).
    pub heat: f64,
    /// Smallest volume ratio det F (-).
    pub min_jacobian: f64,
    /// Highest temperature (K).
    pub peak_temperature: f64,
    /// Highest equivalent plastic strain (-).
    pub peak_strain: f64,
    /// Equivalent plastic strains above zero.
    strains: Vec<f64>,
    chip_mass: f64,
    chip_heat: f64,
    strip_volume: f64,
    strip_reach: f64,
    /// Mass of the chip within a cell of the rake face (kg), and of it what has no strength left.
    face_mass: [f64; 2],
    face: Face,
}

/// Where and when the layer at the rake face counts as molten.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Thickness of the layer (m): a cell.
    pub layer: f64,
    /// Temperature from which it has no strength (K); infinite where heat does not soften.
    pub melting: f64,
}

impl Default for Face {
    fn default() -> Self {
        Face { layer: 0.0, melting: f64::INFINITY }
    }
}

impl Survey {
    /// Nothing yet.
    pub fn new(face: Face) -> Self {
        Survey { min_jacobian: f64::MAX, face, ..Survey::default() }
    }

    /// Counts one point.
    ///
    /// * `feed`: depth of the tool's lowest point below the workpiece's top (m)
    pub fn count(&mut self, point: &PointView, tool: &RigidTool, feed: f64) {
        let report = &point.report;
        let square: f64 = point.velocity.iter().map(|v| v * v).sum();
        self.kinetic += 0.5 * point.mass * square;
        self.elastic += point.volume * report.elastic_energy;
        self.heat += point.volume * report.heat;
        self.min_jacobian = self.min_jacobian.min(report.jacobian);
        self.peak_temperature = self.peak_temperature.max(report.temperature);
        self.peak_strain = self.peak_strain.max(report.plastic_strain);
        if report.plastic_strain <= 0.0 {
            return;
        }
        self.strains.push(report.plastic_strain);
        if point.position[1] <= tool.position[1] || report.plastic_strain <= CHIP_STRAIN {
            return;
        }
        self.chip_mass += point.mass;
        self.chip_heat += point.mass * report.temperature;
        // A tail is chip, and as hot, but it passes through whatever is in its way: where it is says nothing
        // of the chip's shape.
        if point.is_tail {
            return;
        }
        let from_edge = [point.position[0] - tool.position[0], point.position[1] - tool.position[1]];
        let dot = |a: [f64; 2]| from_edge[0] * a[0] + from_edge[1] * a[1];
        let (along, across) = (dot(tool.shape.rake_direction()), dot(tool.shape.rake_normal()));
        if (0.0..self.face.layer).contains(&across) && (0.0..feed).contains(&along) {
            self.face_mass[0] += point.mass;
            if report.temperature >= self.face.melting {
                self.face_mass[1] += point.mass;
            }
        }
        // A chip is at most a few feeds thick; further away it has curled back over the workpiece.
        if (0.0..4.0 * feed).contains(&across) || (across < 0.0 && across > -0.1 * feed) {
            self.strip_reach = self.strip_reach.max(along);
            if along >= STRIP[0] * feed && along < STRIP[1] * feed {
                self.strip_volume += point.volume * report.jacobian;
            }
        }
    }

    /// Whether most of the layer at the rake face, up to one feed from the edge, has melted: it lubricates
    /// the face, with a thickness that is the grid's.
    pub fn is_face_molten(&self) -> bool {
        let [all, molten] = self.face_mass;
        molten > 0.5 * all
    }

    /// Mass-weighted mean temperature of the chip (K), if there is one.
    pub fn chip_temperature(&self) -> Option<f64> {
        (self.chip_mass > 0.0).then(|| self.chip_heat / self.chip_mass)
    }

    /// Mean chip thickness normal to the rake face (m); 0 before the chip reaches past the strip.
    pub fn chip_thickness(&self, feed: f64, width: f64) -> f64 {
        if feed > 0.0 && self.strip_reach >= STRIP[1] * feed {
            self.strip_volume / (width * (STRIP[1] - STRIP[0]) * feed)
        } else {
            0.0
        }
    }

    /// The 99.9th percentile of the equivalent plastic strain over points that have yielded (-).
    pub fn strain_p999(&self) -> f64 {
        if self.strains.is_empty() {
            return 0.0;
        }
        let rank = (0.999 * self.strains.len() as f64).ceil() as usize - 1;
        *self.strains.clone().select_nth_unstable_by(rank, f64::total_cmp).1
    }
}

/// Shear angle (rad) from the chip thickness ratio r = feed / thickness and the rake angle γ:
/// tan φ = r cos γ / (1 − r sin γ); 0 without a chip.
pub fn shear_angle(feed: f64, thickness: f64, rake: f64) -> f64 {
    if thickness <= 0.0 {
        return 0.0;
    }
    let ratio = feed / thickness;
    (ratio * rake.cos()).atan2(1.0 - ratio * rake.sin())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::PointReport;
    use crate::tool::profile::ToolShape;

    /// A survey of a chip of points 10 µm apart that stands on an upright rake face, 0.2 mm thick and 0.3 mm
    /// high; `temperature` (K) by distance from the face (m).
    fn chip(feed: f64, is_tail: bool, survey: &mut Survey, temperature: impl Fn(f64) -> f64) {
        let shape = ToolShape::new(0.0, 0.1, 0.0, 5e-4, 1e-3).unwrap();
        let position = [1e-3, 5e-4];
        let tool = RigidTool { shape, position, velocity: [0.0; 2], friction: 0.0 };
        for (row, column) in (0..30).flat_map(|row| (0..20).map(move |column| (row, column))) {
            let [x, y] = [column, row].map(|index| (f64::from(index) + 0.5) * 1e-5);
            let point = PointView {
                id: 0,
                position: [position[0] - x, position[1] + y, 0.0],
                velocity: [0.0; 3],
                volume: 1e-10 * WIDTH,
                mass: 1.0,
                is_tail,
                report: PointReport {
                    jacobian: 1.0,
                    plastic_strain: 1.0,
                    temperature: temperature(x),
                    ..Default::default()
                },
            };
            survey.count(&point, &tool, feed);
        }
    }

    const WIDTH: f64 = 1e-3;

    /// A tail that has curled back through the chip is no part of its thickness, and part of its temperature.
    #[test]
    fn a_tail_in_the_chip_does_not_thicken_it() {
        let feed = 1e-4;
        let mut survey = Survey::new(Face { layer: 2e-5, melting: 450.0 });
        chip(feed, false, &mut survey, |_| 400.0);
        chip(feed, true, &mut survey, |_| 500.0);
        let thickness = survey.chip_thickness(feed, WIDTH);
        // Rounding of a hundred sums.
        assert!((thickness / 2e-4 - 1.0).abs() < 1e-12, "{thickness} m");
        assert_eq!(survey.chip_temperature(), Some(450.0));
        assert!(!survey.is_face_molten(), "the tail is hot, the face is not");
    }

    /// The band of the force knows nothing of a face that is lubricated by molten points: one cell of them is
    /// enough, half of it is not, and hot points further off do not count.
    #[test]
    fn a_molten_layer_at_the_face_is_seen() {
        for (hot, expected) in [([0.0, 2e-5], true), ([0.0, 1e-5], false), ([2e-5, 2e-4], false)] {
            let mut survey = Survey::new(Face { layer: 2e-5, melting: 1500.0 });
            let is_hot = |x| (hot[0]..hot[1]).contains(&x);
            chip(1e-4, false, &mut survey, |x| if is_hot(x) { 1600.0 } else { 600.0 });
            assert_eq!(survey.is_face_molten(), expected, "hot from {} to {} m", hot[0], hot[1]);
        }
        assert!(!Survey::new(Face::default()).is_face_molten(), "no chip yet");
    }

    /// With a chip as thick as the feed and no rake the shear plane stands at 45 degrees.
    #[test]
    fn equal_thickness_shears_at_45_degrees() {
        let angle = shear_angle(3e-4, 3e-4, 0.0);
        assert!((angle - std::f64::consts::FRAC_PI_4).abs() < 1e-15, "shear angle = {angle}");
    }
}
