//! The rigid tool as points, for the paper's own contact laws (`contact::nodal`).
//!
//! Points fill the tool's cross-section half a cell apart, as the workpiece's do: a first layer a quarter of
//! a cell below the surface, along the faces and around the edge, so that a flat face is flat to the points,
//! too; behind it a square lattice. They are kept by squares of a cell, from the tool's lowest point, and
//! move with it. In space the tool is the same everywhere along z.

use crate::tool::profile::ToolShape;

/// Distance of the tool's points (cells).
const SPACING: f64 = 0.5;
/// Chords of a rounded edge when its layer of points is laid.
const ARC: usize = 32;

/// The tool's points, by squares of a cell.
#[derive(Clone, Debug, Default)]
pub(super) struct RigidPoints {
    /// Edge of a square (m); 0 before there are points.
    cell: f64,
    /// Lower left corner of the first square from the tool's lowest point (m), and the number of squares
    /// along x and y.
    corner: [f64; 2],
    counts: [i32; 2],
    /// Positions (m), square by square.
    points: Vec<[f64; 2]>,
    /// The first point of each square, and one more entry with the number of points.
    first: Vec<u32>,
}

impl RigidPoints {
    /// Points for a tool on a grid of cells of `cell` (m).
    pub(super) fn new(shape: &ToolShape, cell: f64) -> Self {
        let all = place(shape, SPACING * cell);
        let (corner, high) = shape.bounds();
        let counts = [0, 1].map(|axis| ((high[axis] - corner[axis]) / cell).floor() as i32 + 1);
        let mut points = RigidPoints { cell, corner, counts, points: all, first: Vec::new() };
        let mut squares: Vec<(i32, [f64; 2])> = points
            .points
            .iter()
            .map(|&point| {
                let [x, y] = points.square(point).map(i64::from);
                ((x * i64::from(counts[1]) + y) as i32, point)
            })
            .collect();
        squares.sort_by_key(|entry| entry.0);
        points.first = (0..=counts[0] * counts[1])
            .map(|square| squares.partition_point(|entry| entry.0 < square) as u32)
            .collect();
        points.points = squares.into_iter().map(|entry| entry.1).collect();
        points
    }

    /// Whether these are the points for such a grid.
    pub(super) fn fit(&self, cell: f64) -> bool {
        self.cell == cell
    }

    /// The square that holds a position from the tool's lowest point.
    fn square(&self, position: [f64; 2]) -> [i32; 2] {
        std::array::from_fn(|axis| {
            let along = ((position[axis] - self.corner[axis]) / self.cell).floor() as i32;
            along.min(self.counts[axis] - 1)
        })
    }

    /// How far along `normal` the tool's points stand (m) that reach a node, or `None` where none does.
    ///
    /// * `node`: from the tool's lowest point (m)
    /// * `reach`: of a point along each axis (m), at most two cells; it reaches a node that is closer
    pub(super) fn front(&self, node: [f64; 2], normal: [f64; 2], reach: f64) -> Option<f64> {
        let low = self.square([node[0] - reach, node[1] - reach]);
        let high = self.square([node[0] + reach, node[1] + reach]);
        let mut front = None;
        for x in low[0].max(0)..=high[0] {
            for y in low[1].max(0)..=high[1] {
                let square = (x * self.counts[1] + y) as usize;
                for point in &self.points[self.first[square] as usize..self.first[square + 1] as usize] {
                    if (0..2).all(|axis| (point[axis] - node[axis]).abs() < reach) {
                        let along = normal[0] * point[0] + normal[1] * point[1];
                        front = Some(front.map_or(along, |most: f64| most.max(along)));
                    }
                }
            }
        }
        front
    }
}

/// Positions of a tool's points at a `spacing` (m).
fn place(shape: &ToolShape, spacing: f64) -> Vec<[f64; 2]> {
    let depth = |point: [f64; 2]| -shape.closest(point).distance;
    let mut points = Vec::new();
    // The layer below the surface: equal parts of each side, none longer than the spacing.
    for side in shape.outline(ARC).windows(2) {
        let [from, to] = [side[0], side[1]];
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        if length == 0.0 {
            continue;
        }
        let inwards = [-along[1] / length, along[0] / length].map(|n| 0.5 * spacing * n);
        let count = (length / spacing - 1e-9).ceil().max(1.0);
        for k in 0..count as usize {
            let share = (k as f64 + 0.5) / count;
            let point = [0, 1].map(|axis| from[axis] + share * along[axis] + inwards[axis]);
            // Near a corner it may lie too close to the other side.
            if depth(point) >= 0.5 * spacing * (1.0 - 1e-6) {
                points.push(point);
            }
        }
    }
    let (low, high) = shape.bounds();
    let counts = [0, 1].map(|axis| ((high[axis] - low[axis]) / spacing).ceil() as usize);
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            let point = [low[0] + (i as f64 + 0.5) * spacing, low[1] + (j as f64 + 0.5) * spacing];
            if depth(point) >= spacing {
                points.push(point);
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tools() -> Vec<ToolShape> {
        [(0.0, 0.0873, 0.0), (0.2, 0.1, 0.0), (-0.2, 0.0873, 5e-5), (0.0, 0.0, 0.0), (0.3, 0.2, 3e-6)]
            .into_iter()
            .map(|(rake, clearance, edge)| {
                ToolShape::new(rake, clearance, edge, 5e-4, 1e-3).expect("a plain wedge")
            })
            .collect()
    }

    /// The paper's tool, 0.5 mm by 1 mm with points 5 µm apart, has 20,000 points; clearance takes a wedge
    /// away.
    #[test]
    fn the_papers_tool_has_its_number_of_points() {
        let shape = ToolShape::new(0.0, 0.0, 0.0, 5e-4, 1e-3).expect("a right-angled wedge");
        let count = RigidPoints::new(&shape, 1e-5).points.len();
        // The layer and the lattice meet within a row of 600 points.
        assert!((19_400..=20_600).contains(&count), "{count} points");
    }

    /// All points lie a quarter of a cell or more inside, and everything deeper has one within a cell: seen
    /// from a node ahead of a face, the foremost lies a quarter of a cell below it to rounding.
    #[test]
    fn points_fill_the_tool_behind_flat_faces() {
        let cell = 2e-5;
        for shape in tools() {
            let points = RigidPoints::new(&shape, cell);
            for &point in &points.points {
                let depth = -shape.closest(point).distance;
                assert!(depth >= 0.25 * cell * (1.0 - 1e-5), "a point {depth} m deep");
            }
            let (low, high) = shape.bounds();
            for i in 0..200 {
                for j in 0..200 {
                    let place = [i, j].map(|k| f64::from(k) / 199.0);
                    let node = [0, 1].map(|axis| low[axis] + place[axis] * (high[axis] - low[axis]));
                    let closest = shape.closest(node);
                    if closest.distance < -0.25 * cell {
                        let front = points.front(node, closest.normal, cell);
                        assert!(front.is_some(), "no point near {node:?}, {} m deep", -closest.distance);
                    }
                }
            }
            let ([x, y], up, out) = (shape.rake_start(), shape.rake_direction(), shape.rake_normal());
            for k in 0..50 {
                let along = 2e-4 + 1e-5 * f64::from(k);
                let node = [x + along * up[0] + 0.7 * cell * out[0], y + along * up[1] + 0.7 * cell * out[1]];
                let closest = shape.closest(node);
                let front = points.front(node, closest.normal, 1.25 * cell).expect("points behind the face");
                let ahead = closest.normal[0] * node[0] + closest.normal[1] * node[1] - front;
                assert!((ahead / cell - 0.95).abs() < 1e-9, "foremost {} cells away", ahead / cell);
            }
        }
    }
}
