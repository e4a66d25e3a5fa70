//! Shape of the rigid tool: its cross-section as an exact signed distance. In three dimensions it is extruded
//! along z.
//!
//! The origin is the tool's lowest point; the tool cuts towards -x. With rake angle γ, clearance angle α and
//! edge radius r, the body is the set of points p that satisfy
//!
//! * rake face: n_γ · (p − c) ≤ r, n_γ = (−cos γ, sin γ),
//! * flank: n_α · (p − c) ≤ r, n_α = (sin α, −cos α),
//! * back and top: x ≤ length, y ≤ height,
//!
//! with the corner of rake face and flank replaced by the arc of radius r about c = (0, r), which both faces
//! touch. The directions from n_γ to n_α, counter-clockwise, are the arc's sector; (0, −1) always lies in it,
//! so that the arc's lowest point is the origin. For r = 0 the arc is the tip and its sector the outer
//! normals of the sharp corner.
//!
//! The body is convex, so the distance is the largest separation over its supporting lines wherever the
//! nearest point is not a corner, and the line of largest separation always carries the nearest point.

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
    /// Outside, the distance is exact everywhere; beyond a corner the normal points from the corner to the
    /// point. Inside, the nearest face decides. At the tip of a sharp tool the normal halves the angle of the
    /// two faces'.
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

    /// The same on the outline above or below a place on the edge, where it goes on as a plane: the tangent of
    /// an edge as round as points are apart, the face's own plane for a sharp one, in between for one between.
    ///
    /// * `parting`: out of the edge at that place, of length one
    /// * `above`: on the side of the rake face; otherwise on that of the flank
    /// * `spacing`: distance between points (m)
    ///
    /// `None` for a point that lies before that place, along the plane, by more than a spacing above and half
    /// a spacing below.
    #[inline]
    pub fn closest_beside(
        &self,
        parting: [f64; 2],
        above: bool,
        point: [f64; 2],
        spacing: f64,
    ) -> Option<Closest> {
        let (parting, point) = (Vector2::from(parting), Vector2::from(point));
        let side = &self.sides[usize::from(!above)];
        let from_centre = point - self.centre;
        let round = (self.radius / spacing).min(1.0);
        let normal = (round * parting + (1.0 - round) * side.normal).normalize();
        // Along the outline, away from the other side.
        let onward =
            if above { Vector2::new(normal.y, -normal.x) } else { Vector2::new(-normal.y, normal.x) };
        let from_place = from_centre - self.radius * parting;
        let along = onward.dot(&from_place);
        let face = if self.radius > 0.0 { Face::Edge } else { side.face };
        if along < 0.0 {
            let before = if above { spacing } else { 0.5 * spacing };
            let distance = normal.dot(&from_place);
            return (along >= -before).then_some(Closest {
                distance,
                normal: normal.into(),
                face,
                along: 0.0,
            });
        }
        let up = if above { -side.direction } else { side.direction };
        let along = up.dot(&(from_centre - self.radius * side.normal));
        if along < 0.0 {
            return Some(self.closest_on_edge(from_centre, from_centre.norm() - self.radius));
        }
        if along > side.length {
            return Some(self.closest(point.into()));
        }
        let distance = side.normal.dot(&point) - side.offset;
        let along = if above { along } else { 0.0 };
        Some(Closest { distance, normal: side.normal.into(), face: side.face, along })
    }

    /// The place on the edge whose outward normal leans forward by `angle` (rad) from straight down, or the
    /// nearest that it has: that normal, and the place from the tool's lowest point (m).
    pub fn on_edge(&self, angle: f64) -> ([f64; 2], [f64; 2]) {
        let lean = |normal: &Vector2<f64>| (-normal.x).atan2(-normal.y);
        let [rake, flank] = [&self.sides[0], &self.sides[1]];
        let angle = angle.clamp(lean(&flank.normal), lean(&rake.normal));
        let normal = Vector2::new(-angle.sin(), -angle.cos());
        (normal.into(), (self.centre + self.radius * normal).into())
    }

    /// Coordinate along the outline of the place that `closest` found (m): up the rake face from its start,
    /// negative down the edge and along the flank, on over top and back.
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

    /// Coordinate of the tool's foremost point among those no higher than `height` above its lowest one (m),
    /// at least 0.
    pub fn foremost(&self, height: f64) -> f64 {
        let (start, end) = (self.rake_start_vector(), self.sides[0].start);
        // The arc leans forward up to its centre's height, if it reaches so far.
        let low = height.clamp(0.0, start.y.min(self.radius));
        let on_edge = -(low * (2.0 * self.radius - low)).max(0.0).sqrt();
        if height <= start.y {
            return on_edge;
        }
        let [x, y] = self.rake_direction();
        on_edge.min(start.x + x / y * (height.min(end.y) - start.y))
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
            "tool.rake_angle = {rake} rad and tool.clearance_angle = {clearance} rad leave no tool; the rake \
             angle must be above {:.4} rad, the clearance angle at least 0 rad and their sum at most {:.4} \
             rad (89 degrees)",
            SMALLEST_WEDGE - right_angle,
            right_angle - SMALLEST_WEDGE
        ));
    }
    // The arc ends at (−r cos γ, r (1 + sin γ)) and (r sin α, r (1 − cos α)); both must lie inside the box.
    let largest_for_height = height / (1.0 + rake.sin()).max(1.0 - clearance.cos());
    let largest = largest_for_height.min(length / clearance.sin());
    if edge_radius < 0.0 || edge_radius >= largest {
        return refuse(format!(
            "tool.edge_radius = {edge_radius} m does not fit a tool of length {length} m and height {height} \
             m with rake angle {rake} rad and clearance angle {clearance} rad; it must be at least 0 m and \
             below {largest:.4e} m"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
