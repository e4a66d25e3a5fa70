//! The active window: only material that the cut can reach is integrated, the rest stands still.
//!
//! ```text
//!              chip (active)
//!            ╭──╮
//!  ──────────┴┐ │█ tool
//!  frozen │   └─┤█
//!         │ active └──────┬──────── machined surface
//!         └───────────────┘  frozen
//!              frozen
//! ```
//!
//! The window moves with the tool: `ahead` feeds in front of its lowest point, a third as many behind and
//! below it. When the points are sorted, those that have left the window are put aside as they are, with
//! stress and velocity, and those that it has reached join in. Nodes that both kinds touch are held, like
//! those of a wall.
//!
//! What is lost are the elastic give of the frozen material and waves through it; what the window costs in
//! accuracy is in the book (Evidence, performance). Points above the workpiece's first surface are chip, and
//! `speedups::rigid_chip` looks after those.
//!
//! Form of the effect: an optional pass when points are sorted; without it nothing is kept or done.

use crate::dimension::Dimension;
use crate::grid::{FixedNodes, Layout};
use crate::partition::Partition;
use crate::points::inactive::InactivePoints;
use crate::points::{BLOCK, Block, PointState};
use crate::scene::Scene;
use crate::simd::Real;
use crate::speedups::rigid_chip;
use crate::tool::RigidTool;
use serde::{Deserialize, Serialize};

/// Reach behind and below the tool over that ahead of it (-).
const BESIDE: f64 = 1.0 / 3.0;
/// Smallest reach along any direction (cells): shallow cuts need room for the tool's edge and the shear zone.
const SMALLEST: f64 = 24.0;

/// Area (m2) that substeps integrate after the tool has cut a way `travel` (m) at `feed` (m): the window
/// where it lies on the workpiece, and the chip less its tail; without a window all of the workpiece that is
/// not tail.
pub fn integrated_area(scene: &Scene, feed: f64, travel: f64) -> f64 {
    let (length, height) = (scene.workpiece.length, scene.workpiece.height);
    let chip = rigid_chip::integrated_chip(scene, feed, travel);
    if scene.numerics.active_window == 0.0 {
        return length * height - rigid_chip::chip(scene, feed, travel) + chip;
    }
    let cell = scene.numerics.cell();
    let reach = |feeds: f64| (feeds * feed).max(SMALLEST * cell);
    let (beside, ahead) = (reach(scene.numerics.active_window * BESIDE), reach(scene.numerics.active_window));
    let cut = (travel - scene.tool.initial_gap).clamp(0.0, length);
    let below = beside.min(height - feed);
    let in_front = ahead.min(length - cut) * (feed + below);
    let behind = beside.min(cut) * below;
    in_front + behind + chip
}

/// How large the window is and what it moves over.
#[derive(Clone, Debug)]
pub struct ActiveWindow {
    /// Reach ahead of the tool in feeds (-).
    pub ahead: f64,
    /// Height of the workpiece (m).
    pub height: f64,
}

/// Where the window stands, in nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowBounds {
    /// Points at nodes left of this one are frozen, up to `top`.
    left: i32,
    /// Points at nodes right of this one are frozen, up to `floor`.
    right: i32,
    /// Points at nodes below this one are frozen.
    low: i32,
    /// Node at the workpiece's first surface.
    top: i32,
    /// Node at the machined surface.
    floor: i32,
}

impl WindowBounds {
    /// Whether a point at a node is integrated.
    fn hold<D: Dimension>(&self, node: &D::Vector<i32>) -> bool {
        let (x, y) = (node[0], node[1]);
        let is_frozen =
            y < self.low || (x < self.left && y <= self.top) || (x > self.right && y <= self.floor);
        !is_frozen
    }

    /// The nodes that are held, beside the walls.
    fn fixed(&self) -> [FixedNodes; 3] {
        // A frozen point touches nodes one further in than its own, and so does the surface's outermost row.
        let everything = i32::MAX / 2;
        let held = |low: [i32; 2], high: [i32; 2]| FixedNodes {
            low: [low[0], low[1], -everything],
            high: [high[0], high[1], everything],
            axes: [true; 3],
        };
        let outside = [-everything; 2];
        [
            held(outside, [self.left, self.top + 1]),
            held([self.right, -everything], [everything, self.floor + 1]),
            held(outside, [everything, self.low]),
        ]
    }
}

impl ActiveWindow {
    /// Where the window stands around a tool.
    pub fn edges(&self, tool: &RigidTool, layout: &Layout) -> WindowBounds {
        // A tool that is lifted clear has its window where the surface is.
        let (x, y) = (tool.position[0], tool.position[1].min(self.height));
        let feed = self.height - y;
        let reach = |feeds: f64| (feeds * feed / layout.cell).max(SMALLEST);
        let node = |axis: usize, position: f64| (position - layout.origin[axis]) / layout.cell;
        let (beside, ahead) = (reach(self.ahead * BESIDE), reach(self.ahead));
        WindowBounds {
            left: (node(0, x) - ahead).floor() as i32,
            right: (node(0, x) + beside).ceil() as i32,
            low: (node(1, y) - beside).floor() as i32,
            top: node(1, self.height).round() as i32,
            floor: node(1, y).round() as i32,
        }
    }

    /// Puts aside the points outside `edges` and takes back those inside; the points must be sorted anew
    /// afterwards.
    pub fn freeze_and_thaw<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        partition: &mut Partition<R, D, S>,
        edges: &WindowBounds,
    ) {
        let Partition { layout, chunks, frozen: kept, .. } = &mut *partition;
        let layout = &*layout;
        let (here, home) = (&layout.origin, &layout.home);
        let node = |block: &Block<R, D, S>, lane: usize, from: &[f64; 3]| {
            let cells = layout.cells_of(block, lane);
            D::vector(|axis| (cells[axis] + (from[axis] - here[axis]) / layout.cell).round() as i32)
        };
        let mut thawed = InactivePoints::default();
        let mut frozen = InactivePoints::of(std::mem::take(kept));
        let mut k = 0;
        while k < frozen.count {
            let (block, lane) = (&frozen.blocks[k / BLOCK], k % BLOCK);
            if edges.hold::<D>(&node(block, lane, home)) {
                let (block, lane) = thawed.push(block, lane);
                layout.count_from((home, here), block, lane);
                frozen.remove(k);
            } else {
                k += 1;
            }
        }
        for block in chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            for lane in 0..BLOCK {
                if block.is_point(lane) && !edges.hold::<D>(&node(block, lane, here)) {
                    let (kept, place) = frozen.push(block, lane);
                    layout.count_from((here, home), kept, place);
                    block.volume[lane] = R::ZERO;
                }
            }
        }
        if let Some(chunk) = chunks.last_mut() {
            chunk.blocks.append(&mut thawed.blocks);
        }
        *kept = frozen.blocks;
        self.hold(partition, edges);
    }

    /// Holds the nodes at the window's edges.
    pub fn hold<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        partition: &mut Partition<R, D, S>,
        edges: &WindowBounds,
    ) {
        partition.held.clear();
        partition.held.extend(edges.fixed());
        partition.place_walls();
    }
}
