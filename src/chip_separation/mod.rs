//! How chip and work part at the edge.
//!
//! Left to itself the grid tears the material: points on either side of the edge share nodes until they are two
//! cells apart, and the work of tearing grows with the cell. Here the edge parts it:
//!
//! * points that come near the edge get a side, by their height against its path (`Side`);
//! * rows that the path would cut are laid anew so that the chip's lowest row ends at it (`rows`);
//! * from the edge on, points of the chip have nodes of their own (`grid::SecondField`), and the grid moves so
//!   that the edge is always one of its nodes (`partition::moving_grid`);
//! * points of the chip meet the rake face only, those of the work the flank (`contact::surface`), and where
//!   both fields stand on nodes at the edge, they do not move into each other.
//!
//! Form of the effect: a pass when points are sorted; without it nothing is kept or done.
//!
//! What may be touched: where the path lies (`ChipSeparation::edge`, `Path`); a side is given once, when a point
//! comes within `REACH` of the edge, and forgotten when it is ahead of that again.

mod rows;

use crate::dimension::Dimension;
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::{BLOCK, Side};
use crate::simd::Real;
use crate::tool::RigidTool;
use rows::Row;
pub(crate) use rows::Rows;

/// How far ahead of the edge a point gets its side (cells): no point that has none may reach a node that the
/// two fields do not share before the next sort.
const REACH: f64 = 1.8;
/// How much further ahead a side is forgotten (cells).
const FORGET: f64 = 1.0;
/// Steepest path that is looked for ahead of the edge (-): a tool that plunges has no path ahead.
const STEEPEST: f64 = 0.5;

/// How chip and work part.
#[derive(Clone, Debug)]
pub struct ChipSeparation {
    /// Spacing of points at the start (m).
    pub spacing: f64,
    /// How far a round edge's normal leans forward from straight down where the material parts (rad).
    pub parting_angle: f64,
    /// How deep the plane is that points' volumes are for (m); says nothing in space.
    pub depth: f64,
}

/// Where the edge will be: a straight line ahead of it.
#[derive(Clone, Copy, Debug)]
struct Path {
    edge: [f64; 2],
    /// Change of height per way ahead (-).
    slope: f64,
}

impl Path {
    /// Height of the path (m) where it passes `x` (m).
    fn height(&self, x: f64) -> f64 {
        self.edge[1] + self.slope * (self.edge[0] - x).max(0.0)
    }
}

impl ChipSeparation {
    /// Where the tool parts the material (m).
    pub fn edge(&self, tool: &RigidTool) -> [f64; 2] {
        let (_, place) = tool.shape.on_edge(self.parting_angle);
        [0, 1].map(|axis| tool.position[axis] + place[axis])
    }

    /// Out of the edge where it parts the material, of length one.
    pub fn normal(&self, tool: &RigidTool) -> [f64; 2] {
        tool.shape.on_edge(self.parting_angle).0
    }

    /// Height of a point of this volume (m3) as part of a row (m).
    fn row_height<D: Dimension>(&self, volume: f64) -> f64 {
        volume / (self.spacing * if D::AXES == 2 { self.depth } else { self.spacing })
    }

    /// Gives points near the edge their side; the points must be sorted anew afterwards. Returns the energy
    /// (J) that rows lose which are laid anew.
    pub(crate) fn part<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &self,
        partition: &mut Partition<R, D, M::State>,
        tool: &RigidTool,
        model: &M,
        rows: &mut Rows,
    ) -> f64 {
        let edge = self.edge(tool);
        let [vx, vy] = tool.velocity;
        let slope = if vx < 0.0 { (vy / -vx).clamp(-STEEPEST, STEEPEST) } else { 0.0 };
        let path = Path { edge, slope };
        let Partition { layout, chunks, .. } = partition;
        let line = edge[0] - REACH * layout.cell;
        rows.begin(self.spacing, line);
        for (number, chunk) in chunks.iter_mut().enumerate() {
            for (place, block) in chunk.blocks.iter_mut().enumerate() {
                for lane in 0..BLOCK {
                    if !block.is_point(lane) {
                        continue;
                    }
                    let [x, y] = layout.place(block, lane);
                    if x < line - FORGET * layout.cell {
                        if block.side[lane] != Side::Uncut {
                            block.side[lane] = Side::Uncut;
                            block.node[0][lane] = layout.second.moved_to(block.node[0][lane], false);
                        }
                        continue;
                    }
                    let height = self.row_height::<D>(block.volume[lane].to_f64());
                    let z = if D::AXES == 3 { layout.cell * block.grid_position(lane)[2] } else { 0.0 };
                    let at = [number, place, lane];
                    let row =
                        Row { at, place: [x, y, z], height, path: path.height(x), side: block.side[lane] };
                    if rows.takes(&row) {
                        continue;
                    }
                    if block.side[lane] == Side::Uncut && x >= line {
                        let side = if y > row.path { Side::Chip } else { Side::Work };
                        block.side[lane] = side;
                        block.node[0][lane] = layout.second.moved_to(block.node[0][lane], side == Side::Chip);
                    }
                }
            }
        }
        rows.part(partition, model)
    }
}
