//! Shape of the rigid tool: its cross-section as an exact signed distance. In three dimensions it is extruded along z.
//!
//! The origin is the tool's lowest point; the tool cuts towards -x. With rake angle γ, clearance angle α and edge
//! radius r, the body is the set of points p that satisfy
//!
//! * rake face: n_γ · (p − c) ≤ r, n_γ = (−cos γ, sin γ),
//! * flank: n_α · (p − c) ≤ r, n_α = (sin α, −cos α),
//! * back and top: x ≤ length, y ≤ height,
//!
//! with the corner of rake face and flank replaced by the arc of radius r about c = (0, r), which both faces touch.
//! The directions from n_γ to n_α, counter-clockwise, are the arc's sector; (0, −1) always lies in it, so that the
//! arc's lowest point is the origin. For r = 0 the arc is the tip and its sector the outer normals of the sharp corner.
//!
//! The body is convex, so the distance is the largest separation over its supporting lines wherever the nearest point
//! is not a corner, and the line of largest separation always carries the nearest point.

use nalgebra::Vector2;

use crate::error::Error;

/// Smallest angle between rake face and flank (rad): one degree. Thinner wedges are refused.
const SMALLEST_WEDGE: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// A part of the tool's boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// The face the chip flows along.
    Rake,
    /// The arc of the cutting edge, or the sharp corner.
    Edge,
    /// The face above the machined surface.
    Flank,
    /// The upper end.
    Top,
    /// The end behind the cut.
    Back,
}

/// The point of the tool's boundary nearest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Signed distance (m), negative inside the tool.
    pub distance: f64,
    /// Unit vector out of the tool: the gradient of the distance (-).
    pub normal: [f64; 2],
    /// The part of the boundary the nearest point lies on.
    pub face: Face,
    /// Distance of the nearest point along the rake face from where that begins (m); 0 on the other faces.
    pub along: f64,
}

/// A straight part of the boundary, from `start` along `direction`, with the body on its left.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    face: Face,
    start: Vector2<f64>,
    direction: Vector2<f64>,
    length: f64,
    /// Out of the body.
    normal: Vector2<f64>,
    /// normal · point on the line (m).
    offset: f64,
}

impl Side {
    fn new(face: Face, start: Vector2<f64>, direction: Vector2<f64>, length: f64) -> Self {
        let normal = Vector2::new(direction.y, -direction.x);
        // A side that rounding turned inside out counts as a point.
        Side { face, start, direction, length: length.max(0.0), normal, offset: normal.dot(&start) }
    }

    fn end(&self) -> Vector2<f64> {
        self.start + self.length * self.direction
    }
}

/// Cross-section of the rigid tool relative to its lowest point.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolShape {
    /// Rake face (from its upper end to the edge), flank, then what the clipping left of back and top.
    sides: [Side; 4],
    side_count: usize,
    /// Centre of the arc.
    centre: Vector2<f64>,
    radius: f64,
}

impl ToolShape {
    /// The shape with these angles and lengths.
    ///
    /// * `rake`: γ (rad), positive when the face leans away from the cut, above −π/2
    /// * `clearance`: α (rad), from 0; γ + α leaves a wedge of at least one degree
    /// * `edge_radius`: r (m), from 0; the arc must end inside the box of length and height
    /// * `length`: extent behind the lowest point (m), above 0
    /// * `height`: extent above the lowest point (m), above 0
    pub fn new(rake: f64, clearance: f64, edge_radius: f64, length: f64, height: f64) -> Result<Self, Error> {
        check(rake, clearance, edge_radius, length, height)?;
        let centre = Vector2::new(0.0, edge_radius);
        let up_rake = Vector2::new(rake.sin(), rake.cos());
        let along_flank = Vector2::new(clearance.cos(), clearance.sin());
        let rake_start = centre + edge_radius * Vector2::new(-up_rake.y, up_rake.x);
        let flank_start = centre + edge_radius * Vector2::new(along_flank.y, -along_flank.x);

        // How far each face runs before the back or the top ends it; a face parallel to one never meets it.
        let reach = |gap: f64, slope: f64| if slope > 0.0 { gap / slope } else { f64::INFINITY };
        let rake_to_back = reach(length - rake_start.x, up_rake.x);
        let rake_to_top = reach(height - rake_start.y, up_rake.y);
        let flank_to_back = reach(length - flank_start.x, along_flank.x);
        let flank_to_top = reach(height - flank_start.y, along_flank.y);

        let rake_length = rake_to_back.min(rake_to_top);
        let rake_end = rake_start + rake_length * up_rake;
        let rake_side = Side::new(Face::Rake, rake_end, -up_rake, rake_length);
        let flank_side = Side::new(Face::Flank, flank_start, along_flank, flank_to_back.min(flank_to_top));
        let flank_end = flank_side.end();
        let back = |upper: f64| Side::new(Face::Back, flank_end, Vector2::y(), upper - flank_end.y);
        let top = |start: Vector2<f64>| Side::new(Face::Top, start, -Vector2::x(), start.x - rake_end.x);

        // The wedge has some width, so the flank never ends at the top while the rake face ends at the back.
        let (third, fourth) = if rake_to_back <= rake_to_top {
            (back(rake_end.y), None)
        } else if flank_to_top <= flank_to_back {
            (top(flank_end), None)
        } else {
            (back(height), Some(top(Vector2::new(length, height))))
        };
        Ok(ToolShape {
            sides: [rake_side, flank_side, third, fourth.unwrap_or(third)],
            side_count: if fourth.is_some() { 4 } else { 3 },
            centre,
            radius: edge_radius,
        })
    }

    /// Nearest point of the boundary, its signed distance and the normal there.
    ///
    /// * `point`: relative to the tool's lowest point (m)
    ///
    /// Outside, the distance is exact everywhere; beyond a corner the normal points from the corner to the point.
    /// Inside, the nearest face decides. At the tip of a sharp tool the normal halves the angle of the two faces'.
    #[inline]
    pub fn closest(&self, point: [f64; 2]) -> Closest {
        let point = Vector2::from(point);
        let [rake, flank] = [&self.sides[0], &self.sides[1]];
        let from_centre = point - self.centre;
        let in_sector = rake.normal.perp(&from_centre) >= 0.0 && from_centre.perp(&flank.normal) >= 0.0;

        let mut distance = f64::NEG_INFINITY;
        let mut nearest = None;
        if in_sector {
            distance = from_centre.norm() - self.radius;
            if distance >= 0.0 {
                return self.closest_on_edge(from_centre, distance);
            }
        }
        for side in &self.sides[..self.side_count] {
            let separation = side.normal.dot(&point) - side.offset;
            if separation > distance {
                distance = separation;
                nearest = Some(side);
            }
        }
        match nearest {
            None => self.closest_on_edge(from_centre, distance),
            Some(side) => closest_on_side(side, point, distance),
        }
    }

    /// Coordinate along the outline of the place that `closest` found (m): up the rake face from its start, negative down
    /// the edge and along the flank, on over top and back.
    pub fn along_outline(&self, point: [f64; 2], closest: &Closest) -> f64 {
        let [rake, flank] = [&self.sides[0], &self.sides[1]];
        let place = Vector2::from(point) - closest.distance * Vector2::from(closest.normal);
        let angle = |normal: &Vector2<f64>| rake.normal.perp(normal).atan2(rake.normal.dot(normal));
        let edge = self.radius * angle(&flank.normal);
        match closest.face {
            Face::Rake => closest.along,
            Face::Edge => -self.radius * angle(&Vector2::from(closest.normal)),
            Face::Flank => -edge - (place - flank.start).norm(),
            Face::Back => -edge - flank.length - (place - flank.end()).norm(),
            Face::Top => rake.length + (place - rake.start).norm(),
        }
    }

    /// Smallest and largest coordinates of the shape (m).
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let first = self.rake_start_vector();
        let (mut min, mut max) = (first, first);
        for side in &self.sides[..self.side_count] {
            min = min.inf(&side.start).inf(&side.end());
            max = max.sup(&side.start).sup(&side.end());
        }
        // The arc's lowest point always belongs to the shape, its leftmost one if the sector holds (−1, 0).
        min.y = 0.0;
        if self.sides[0].normal.y >= 0.0 {
            min.x = min.x.min(-self.radius);
        }
        (min.into(), max.into())
    }

    /// The boundary as a closed polygon for pictures, counter-clockwise from the start of the rake face (m).
    ///
    /// * `arc_segments`: chords of the rounded edge, at least 1; a sharp edge is one point
    pub fn outline(&self, arc_segments: usize) -> Vec<[f64; 2]> {
        let [rake, flank] = [&self.sides[0], &self.sides[1]];
        let mut points = vec![self.rake_start()];
        if self.radius > 0.0 {
            let segments = arc_segments.max(1);
            let first = rake.normal.y.atan2(rake.normal.x);
            let sector = rake.normal.perp(&flank.normal).atan2(rake.normal.dot(&flank.normal));
            for index in 1..segments {
                let angle = first + sector * index as f64 / segments as f64;
                points.push((self.centre + self.radius * Vector2::new(angle.cos(), angle.sin())).into());
            }
            points.push(flank.start.into());
        }
        points.extend(self.sides[1..self.side_count].iter().map(|side| <[f64; 2]>::from(side.end())));
        points.push(self.rake_start());
        points
    }

    /// Unit vector up along the rake face.
    pub fn rake_direction(&self) -> [f64; 2] {
        (-self.sides[0].direction).into()
    }

    /// Unit vector out of the tool, normal to the rake face.
    pub fn rake_normal(&self) -> [f64; 2] {
        self.sides[0].normal.into()
    }

    /// Where the rake face begins: the arc's end, or the tip (m).
    pub fn rake_start(&self) -> [f64; 2] {
        self.rake_start_vector().into()
    }

    fn rake_start_vector(&self) -> Vector2<f64> {
        self.centre + self.radius * self.sides[0].normal
    }

    /// The arc's point in direction `from_centre`; at the centre itself the one halfway along the arc.
    #[inline]
    fn closest_on_edge(&self, from_centre: Vector2<f64>, distance: f64) -> Closest {
        let length = distance + self.radius;
        let normal = if length > 0.0 {
            from_centre / length
        } else {
            (self.sides[0].normal + self.sides[1].normal).normalize()
        };
        Closest { distance, normal: normal.into(), face: Face::Edge, along: 0.0 }
    }
}

/// The nearest point on the side of largest separation: its foot, or its end where the point lies beyond it.
#[inline]
fn closest_on_side(side: &Side, point: Vector2<f64>, separation: f64) -> Closest {
    let along_side = side.direction.dot(&(point - side.start));
    let foot = along_side.clamp(0.0, side.length);
    // The rake face runs down to the edge; its coordinate runs up.
    let along = if side.face == Face::Rake { side.length - foot } else { 0.0 };
    let beyond = along_side - foot;
    if separation <= 0.0 || beyond == 0.0 {
        return Closest { distance: separation, normal: side.normal.into(), face: side.face, along };
    }
    let distance = (separation * separation + beyond * beyond).sqrt();
    let normal = (separation * side.normal + beyond * side.direction) / distance;
    Closest { distance, normal: normal.into(), face: side.face, along }
}

/// Refuses values that leave no tool, or an edge that does not fit.
fn check(rake: f64, clearance: f64, edge_radius: f64, length: f64, height: f64) -> Result<(), Error> {
    let refuse = |text: String| Err(Error::Inconsistent(text));
    let right_angle = std::f64::consts::FRAC_PI_2;
    let named = [
        ("rake_angle", rake, "rad"),
        ("clearance_angle", clearance, "rad"),
        ("edge_radius", edge_radius, "m"),
        ("length", length, "m"),
        ("height", height, "m"),
    ];
    if let Some((name, value, unit)) = named.iter().find(|(_, value, _)| !value.is_finite()) {
        return refuse(format!("tool.{name} = {value} {unit} is not a finite number; there is no such tool"));
    }
    if length <= 0.0 || height <= 0.0 {
        return refuse(format!(
            "tool.length = {length} m and tool.height = {height} m leave no tool; both must be above 0 m"
        ));
    }
    if rake <= SMALLEST_WEDGE - right_angle
        || clearance < 0.0
        || rake + clearance > right_angle - SMALLEST_WEDGE
    {
        return refuse(format!(
            "tool.rake_angle = {rake} rad and tool.clearance_angle = {clearance} rad leave no tool; the rake angle \
             must be above {:.4} rad, the clearance angle at least 0 rad and their sum at most {:.4} rad (89 degrees)",
            SMALLEST_WEDGE - right_angle,
            right_angle - SMALLEST_WEDGE
        ));
    }
    // The arc ends at (−r cos γ, r (1 + sin γ)) and (r sin α, r (1 − cos α)); both must lie inside the box.
    let largest_for_height = height / (1.0 + rake.sin()).max(1.0 - clearance.cos());
    let largest = largest_for_height.min(length / clearance.sin());
    if edge_radius < 0.0 || edge_radius >= largest {
        return refuse(format!(
            "tool.edge_radius = {edge_radius} m does not fit a tool of length {length} m and height {height} m with \
             rake angle {rake} rad and clearance angle {clearance} rad; it must be at least 0 m and below {largest:.4e} m"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic pseudo-random numbers in [0, 1): Knuth's 64-bit linear congruential generator, upper bits.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn between(&mut self, low: f64, high: f64) -> f64 {
            low + (high - low) * self.next()
        }

        /// A tool of some millimetres: every third one sharp, many with a corner clipped away.
        fn shape(&mut self, index: usize) -> ToolShape {
            let degrees = |angle: f64| angle.to_radians();
            loop {
                let rake = degrees(self.between(-30.0, 30.0));
                let clearance = degrees(self.between(0.0, 30.0));
                let radius = if index.is_multiple_of(3) { 0.0 } else { self.between(0.0, 4e-4) };
                let (length, height) = (self.between(2e-4, 2e-3), self.between(2e-4, 2e-3));
                if let Ok(shape) = ToolShape::new(rake, clearance, radius, length, height) {
                    return shape;
                }
            }
        }

        fn point(&mut self) -> [f64; 2] {
            [self.between(-2e-3, 3e-3), self.between(-1e-3, 3e-3)]
        }
    }

    /// Distance to a closed polygon by looking at every chord; sign by counting crossings of a ray to +x.
    fn distance_to_polygon(polygon: &[[f64; 2]], point: [f64; 2]) -> f64 {
        let (mut smallest, mut inside) = (f64::INFINITY, false);
        for pair in polygon.windows(2) {
            let ([ax, ay], [bx, by]) = (pair[0], pair[1]);
            let (dx, dy) = (bx - ax, by - ay);
            let (px, py) = (point[0] - ax, point[1] - ay);
            let squared = dx * dx + dy * dy;
            let t = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
            smallest = smallest.min((px - t * dx).hypot(py - t * dy));
            if (ay > point[1]) != (by > point[1]) && px < dx * py / dy {
                inside = !inside;
            }
        }
        if inside { -smallest } else { smallest }
    }

    fn reference_tool() -> ToolShape {
        ToolShape::new(0.0, 0.0873, 0.0, 5e-4, 1e-3).unwrap()
    }

    /// The closed form and a search over the whole outline are two independent ways to the same distance.
    #[test]
    fn distance_agrees_with_a_search_over_the_outline() {
        let mut random = Random(1);
        let arc_segments = 2000;
        for index in 0..300 {
            let shape = random.shape(index);
            let outline = shape.outline(arc_segments);
            // A chord leaves an arc of at most π by its sagitta, r (π/n)²/8; the rest is rounding on millimetres.
            let tolerance = shape.radius * (3.15 / arc_segments as f64).powi(2) / 8.0 + 1e-17;
            for _ in 0..40 {
                let point = random.point();
                let exact = distance_to_polygon(&outline, point);
                let got = shape.closest(point).distance;
                assert!(
                    (got - exact).abs() <= tolerance,
                    "{got} instead of {exact} at {point:?} of {shape:?}"
                );
            }
        }
    }

    /// The normal is the gradient of the distance, of length one, and leads back to the boundary.
    #[test]
    fn normal_is_the_gradient_of_the_distance() {
        let mut random = Random(2);
        let step = 1e-9;
        let mut compared = 0;
        for index in 0..300 {
            let shape = random.shape(index);
            for _ in 0..40 {
                let [x, y] = random.point();
                let here = shape.closest([x, y]);
                let [nx, ny] = here.normal;
                assert!(
                    (nx.hypot(ny) - 1.0).abs() <= 1e-14,
                    "normal ({nx}, {ny}) at ({x}, {y}) of {shape:?}"
                );
                let foot = [x - here.distance * nx, y - here.distance * ny];
                let left_over = shape.closest(foot).distance;
                assert!(left_over.abs() <= 1e-17, "foot {foot:?} is {left_over} off {shape:?}");

                // Central differences straddle no kink if both ends see the same face, and curvature 1/d is small.
                let ends =
                    [[x - step, y], [x + step, y], [x, y - step], [x, y + step]].map(|p| shape.closest(p));
                if here.distance.abs() < 1e-5 || ends.iter().any(|end| end.face != here.face) {
                    continue;
                }
                let slope = [ends[1].distance - ends[0].distance, ends[3].distance - ends[2].distance];
                let slope = slope.map(|difference| difference / (2.0 * step));
                // Rounding of distances of 1e-3 m over 2e-9 m gives 1e-10; truncation (step/d)² about 1e-8.
                let off = (slope[0] - nx).hypot(slope[1] - ny);
                // The curvature inside a rounded edge is that of the distance from its centre.
                let [cx, cy] = [x, y - shape.radius];
                if here.face != Face::Edge || cx.hypot(cy) > 1e-5 {
                    assert!(
                        off <= 1e-7,
                        "gradient {slope:?}, normal ({nx}, {ny}) at ({x}, {y}) of {shape:?}"
                    );
                    compared += 1;
                }
            }
        }
        assert!(compared > 10_000, "only {compared} points were compared");
    }

    /// The sharp tool is the limit of rounded ones: faces move by at most 2 r and the corner by at most r / sin(β/2).
    #[test]
    fn rounded_edge_tends_to_the_sharp_one() {
        let mut random = Random(4);
        for _ in 0..100 {
            let (rake, clearance) = (random.between(-0.5, 0.5), random.between(0.0, 0.5));
            let sharp = ToolShape::new(rake, clearance, 0.0, 5e-4, 1e-3).unwrap();
            let wedge = std::f64::consts::FRAC_PI_2 - rake - clearance;
            for radius in [1e-5, 1e-7, 1e-10, 1e-14] {
                let rounded = ToolShape::new(rake, clearance, radius, 5e-4, 1e-3).unwrap();
                for _ in 0..20 {
                    let point = [random.between(-1e-3, 1e-3), random.between(-1e-3, 1e-3)];
                    let change = (rounded.closest(point).distance - sharp.closest(point).distance).abs();
                    let allowed = radius * (2.0 + 2.0 / (wedge / 2.0).sin()) + 1e-17;
                    assert!(change <= allowed, "{change} above {allowed} at {point:?}, r = {radius}");
                }
            }
        }
    }

    /// The feed counts from the lowest point, so that must be the origin and nothing may lie below it.
    #[test]
    fn lowest_point_is_the_origin() {
        let mut random = Random(5);
        for index in 0..300 {
            let shape = random.shape(index);
            let here = shape.closest([0.0, 0.0]);
            assert!(here.distance.abs() <= 1e-19, "origin is {} off {shape:?}", here.distance);
            let below = shape.closest([0.0, -1e-5]);
            assert!((below.distance - 1e-5).abs() <= 1e-19, "{} below {shape:?}", below.distance);
            assert_eq!(below.face, Face::Edge, "{shape:?}");
            let lowest = shape.outline(999).iter().fold(f64::INFINITY, |low, point| low.min(point[1]));
            assert!(lowest >= -1e-19, "{lowest} in {shape:?}");
        }
    }

    /// Bounds are tight: each of the four sides of the box touches the shape.
    #[test]
    fn bounds_touch_the_shape() {
        let mut random = Random(6);
        for index in 0..300 {
            let shape = random.shape(index);
            let outline = shape.outline(4000);
            let (min, max) = shape.bounds();
            let extreme = |axis: usize, pick: fn(f64, f64) -> f64| {
                outline.iter().map(|p| p[axis]).reduce(pick).unwrap()
            };
            // Sagitta of the outline's chords again, for the arc's extremes.
            let tolerance = shape.radius * 1e-7 + 1e-18;
            let found =
                [extreme(0, f64::min), extreme(1, f64::min), extreme(0, f64::max), extreme(1, f64::max)];
            for (got, expected) in [min[0], min[1], max[0], max[1]].iter().zip(found) {
                assert!((got - expected).abs() <= tolerance, "{got} instead of {expected} for {shape:?}");
            }
        }
    }

    /// The arc touches both faces, so the normal turns without a jump where it ends.
    #[test]
    fn normal_is_continuous_at_the_ends_of_the_arc() {
        let mut random = Random(7);
        for _ in 0..200 {
            let (rake, clearance) = (random.between(-0.5, 0.5), random.between(0.0, 0.5));
            let radius = random.between(1e-5, 5e-5);
            let shape = ToolShape::new(rake, clearance, radius, 5e-4, 1e-3).unwrap();
            for side in [shape.sides[0], shape.sides[1]] {
                let touch = shape.centre + radius * side.normal;
                for height in [-0.2 * radius, 0.0, 0.5 * radius] {
                    let step = 1e-6 * radius;
                    let [one, other] = [-step, step].map(|along| {
                        shape.closest((touch + height * side.normal + along * side.direction).into())
                    });
                    let turn = (one.normal[0] - other.normal[0]).hypot(one.normal[1] - other.normal[1]);
                    // On the arc the normal turns by at most step / (0.8 r).
                    assert!(turn <= 1.3e-6, "turn {turn} at {touch:?} of {shape:?}");
                    assert_ne!(one.face, other.face, "{shape:?}");
                }
            }
        }
    }

    /// The reference tool's faces stand where its drawing says.
    #[test]
    fn reference_tool_has_its_faces_in_place() {
        let shape = reference_tool();
        let cases = [
            ([-1e-4, 5e-4], 1e-4, [-1.0, 0.0], Face::Rake),
            ([1e-5, 5e-4], -1e-5, [-1.0, 0.0], Face::Rake),
            ([6e-4, 5e-4], 1e-4, [1.0, 0.0], Face::Back),
            ([2.5e-4, 1.2e-3], 2e-4, [0.0, 1.0], Face::Top),
            ([-3e-5, -4e-5], 5e-5, [-0.6, -0.8], Face::Edge),
        ];
        for (point, distance, normal, face) in cases {
            let got = shape.closest(point);
            assert!((got.distance - distance).abs() <= 1e-18, "{got:?} at {point:?}");
            let off = (got.normal[0] - normal[0]).hypot(got.normal[1] - normal[1]);
            assert!(off <= 1e-12 && got.face == face, "{got:?} at {point:?}");
        }
        assert_eq!(shape.closest([-1e-4, 5e-4]).along, 5e-4);
        assert_eq!(shape.rake_start(), [0.0, 0.0]);
        assert_eq!(shape.rake_direction(), [0.0, 1.0]);
        assert_eq!(shape.rake_normal(), [-1.0, 0.0]);
        assert_eq!(shape.outline(10).len(), 5, "{:?}", shape.outline(10));
        assert_eq!(shape.closest([0.0, 0.0]).normal.map(|n| n < 0.0), [true, true]);
    }

    /// The coordinate along the rake face starts at the end of the arc and grows upward.
    #[test]
    fn along_measures_from_the_start_of_the_rake_face() {
        let mut random = Random(8);
        for index in 0..200 {
            let shape = random.shape(index);
            let ([x, y], [tx, ty], [nx, ny]) =
                (shape.rake_start(), shape.rake_direction(), shape.rake_normal());
            let along = random.between(0.05, 0.95) * shape.sides[0].length;
            let got = shape.closest([x + along * tx + 1e-4 * nx, y + along * ty + 1e-4 * ny]);
            assert_eq!(got.face, Face::Rake, "{got:?} for {shape:?}");
            assert!(
                (got.along - along).abs() <= 1e-18 && (got.distance - 1e-4).abs() <= 1e-18,
                "{got:?}, {along}"
            );
        }
    }

    /// A steep rake face ends at the back before the top, a steep flank at the top before the back.
    #[test]
    fn clipped_shapes_lose_the_right_side() {
        let degrees = f64::to_radians;
        let faces = |shape: &ToolShape| {
            shape.sides[..shape.side_count].iter().map(|side| side.face).collect::<Vec<_>>()
        };
        let no_top = ToolShape::new(degrees(30.0), degrees(5.0), 0.0, 5e-4, 1e-3).unwrap();
        assert_eq!(faces(&no_top), [Face::Rake, Face::Flank, Face::Back]);
        let apex = 5e-4 / degrees(30.0).tan();
        assert!((no_top.bounds().1[1] - apex).abs() <= 1e-18, "{:?}", no_top.bounds());

        let no_back = ToolShape::new(degrees(-10.0), degrees(30.0), 1e-5, 2e-3, 5e-4).unwrap();
        assert_eq!(faces(&no_back), [Face::Rake, Face::Flank, Face::Top]);
        assert!(no_back.bounds().1[0] < 1e-3 && no_back.bounds().0[0] < -5e-5, "{:?}", no_back.bounds());

        // Rake face through the corner of the box exactly.
        let exact = ToolShape::new(degrees(45.0), 0.0, 0.0, 1e-3, 1e-3).unwrap();
        assert!((exact.bounds().1[1] - 1e-3).abs() <= 1e-18, "{:?}", exact.bounds());
        let beyond = exact.closest([2e-3, 2e-3]).distance;
        assert!((beyond - 2f64.sqrt() * 1e-3).abs() <= 1e-18, "{beyond}");
    }

    /// Shapes that cannot be built are refused with the names the user set.
    #[test]
    fn impossible_shapes_are_refused() {
        let cases = [
            ((1.2, 0.5, 0.0, 5e-4, 1e-3), "tool.rake_angle = 1.2 rad"),
            ((0.0, -0.1, 0.0, 5e-4, 1e-3), "tool.clearance_angle = -0.1 rad"),
            ((0.0, 0.1, 1e-3, 5e-4, 1e-3), "tool.edge_radius = 0.001 m does not fit"),
            ((0.0, 0.5, 2e-4, 5e-5, 1e-3), "tool.edge_radius = 0.0002 m does not fit"),
            ((0.0, 0.1, -1e-6, 5e-4, 1e-3), "tool.edge_radius = -0.000001 m"),
            ((0.0, 0.1, 0.0, 0.0, 1e-3), "tool.length = 0 m"),
            ((0.0, 0.1, 0.0, 5e-4, -1.0), "tool.height = -1 m"),
            ((f64::NAN, 0.1, 0.0, 5e-4, 1e-3), "tool.rake_angle = NaN rad"),
        ];
        for ((rake, clearance, radius, length, height), text) in cases {
            let error = ToolShape::new(rake, clearance, radius, length, height).unwrap_err().to_string();
            assert!(error.contains(text), "{error}");
        }
    }
}
