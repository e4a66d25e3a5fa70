//! The shape against a search over its outline, and its normals against differences of the distance.

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
            assert!((got - exact).abs() <= tolerance, "{got} instead of {exact} at {point:?} of {shape:?}");
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
            assert!((nx.hypot(ny) - 1.0).abs() <= 1e-14, "normal ({nx}, {ny}) at ({x}, {y}) of {shape:?}");
            let foot = [x - here.distance * nx, y - here.distance * ny];
            let left_over = shape.closest(foot).distance;
            assert!(left_over.abs() <= 1e-17, "foot {foot:?} is {left_over} off {shape:?}");

            // Central differences straddle no kink if both ends see the same face, and curvature 1/d is
            // small.
            let ends = [[x - step, y], [x + step, y], [x, y - step], [x, y + step]].map(|p| shape.closest(p));
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
                assert!(off <= 1e-7, "gradient {slope:?}, normal ({nx}, {ny}) at ({x}, {y}) of {shape:?}");
                compared += 1;
            }
        }
    }
    assert!(compared > 10_000, "only {compared} points were compared");
}

/// The sharp tool is the limit of rounded ones: faces move by at most 2 r and the corner by at most r /
/// sin(β/2).
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
        let extreme =
            |axis: usize, pick: fn(f64, f64) -> f64| outline.iter().map(|p| p[axis]).reduce(pick).unwrap();
        // Sagitta of the outline's chords again, for the arc's extremes.
        let tolerance = shape.radius * 1e-7 + 1e-18;
        let found = [extreme(0, f64::min), extreme(1, f64::min), extreme(0, f64::max), extreme(1, f64::max)];
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
        let ([x, y], [tx, ty], [nx, ny]) = (shape.rake_start(), shape.rake_direction(), shape.rake_normal());
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
    let faces =
        |shape: &ToolShape| shape.sides[..shape.side_count].iter().map(|side| side.face).collect::<Vec<_>>();
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

/// The closed form against all points of the outline: a sharp and a rounded edge, faces that lean either way,
/// and heights within the edge, on the face and above the tool.
#[test]
fn the_foremost_point_is_that_of_the_outline() {
    for (rake, radius) in [(0.0, 0.0), (0.3, 0.0), (-0.4, 0.0), (0.0, 5e-5), (0.5, 5e-5), (-0.5, 5e-5)] {
        let shape = ToolShape::new(rake, 0.1, radius, 5e-4, 1e-3).unwrap();
        let mut outline = shape.outline(20_000);
        // The face is one straight line of the outline; points on it, too.
        let ([x, y], [dx, dy]) = (shape.rake_start(), shape.rake_direction());
        outline.extend((0..=20_000).map(|k| {
            let along = 1e-3 / dy * f64::from(k) / 20_000.0;
            [x + along * dx, y + along * dy]
        }));
        for height in [0.0_f64, 1e-5, 4e-5, 7e-5, 3e-4, 9.9e-4, 2e-3] {
            let within = outline.iter().filter(|point| point[1] <= height.min(1e-3) + 1e-12);
            let expected = within.map(|point| point[0]).fold(0.0, f64::min);
            let found = shape.foremost(height);
            // Half a step along face or arc is below 0.1 µm.
            assert!(
                (found - expected).abs() < 1e-7,
                "{found} m, outline {expected} m: {rake}, {radius}, {height}"
            );
        }
    }
}

/// Above the place where a round edge parts the material the outline is that of the whole tool, and below it
/// that of the flank; a point on the far side of the place sees the tangent there. A sharp edge goes on as the
/// face itself.
#[test]
fn an_edge_that_parts_has_two_outlines() {
    let shape = ToolShape::new(f64::to_radians(10.0), f64::to_radians(5.0), 4e-5, 5e-4, 1e-3).unwrap();
    let (normal, place) = shape.on_edge(f64::to_radians(35.0));
    assert!((place[1] - 4e-5 * (1.0 - f64::to_radians(35.0).cos())).abs() < 1e-18, "parts at {place:?}");
    // Ahead of rake face and upper arc; below flank and lower arc.
    for (point, above) in
        [([-2e-5, 3e-4], true), ([-6e-5, 4e-5], true), ([-1e-5, -1e-5], false), ([2e-4, -1e-5], false)]
    {
        let (whole, part) = (shape.closest(point), shape.closest_beside(normal, above, point, 1e-5).unwrap());
        assert!((whole.distance - part.distance).abs() < 1e-18, "{point:?}: {whole:?} and {part:?}");
        assert_eq!(whole.face, part.face, "{point:?}");
    }
    // 5 µm beyond the place, 1 µm off the tangent.
    let tangent = [-normal[1], normal[0]];
    for (way, above) in [(5e-6, true), (-5e-6, false)] {
        let point = [0, 1].map(|axis| place[axis] + 1e-6 * normal[axis] + way * tangent[axis]);
        let beside = shape.closest_beside(normal, above, point, 1.2e-5).unwrap();
        assert!((beside.distance - 1e-6).abs() < 1e-18, "{beside:?}");
        // A rounding of the length.
        assert!((Vector2::from(beside.normal) - Vector2::from(normal)).norm() < 1e-15, "{beside:?}");
        assert!(shape.closest_beside(normal, above, point, 1e-6).is_none(), "too far beyond the place");
    }
    // An edge that is sharp for the points goes on as its faces do.
    let below = [place[0] - 5e-6 * shape.rake_direction()[0], place[1] - 5e-6 * shape.rake_direction()[1]];
    let coarse = shape.closest_beside(normal, true, below, 1.0).unwrap();
    assert!((Vector2::from(coarse.normal) - shape.sides[0].normal).norm() < 1e-4, "{coarse:?}");
    let sharp = ToolShape::new(f64::to_radians(10.0), f64::to_radians(5.0), 0.0, 5e-4, 1e-3).unwrap();
    let below = sharp.closest_beside([0.0, -1.0], true, [-1e-5, -5e-6], 1e-5).unwrap();
    assert_eq!(below.face, Face::Rake);
    assert!((Vector2::from(below.normal) - Vector2::from(sharp.rake_normal())).norm() < 1e-15, "{below:?}");
}
