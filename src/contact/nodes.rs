//! What contact laws see of points and nodes before a substep.

use crate::contact::gauss_seidel::Node;
use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::partition::nodes::StepContext;
use crate::points::{BLOCK, Block, PointState};
use crate::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use crate::tool::RigidTool;
use crate::tool::profile::Closest;
use crate::transfer::first_node;

/// Marks a node of the layout that is not in a law's list.
pub(super) const NOT_LISTED: u32 = u32::MAX;

/// A node that contact may push.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodePredictor {
    /// Index in the layout.
    pub(super) index: usize,
    /// Whether it has mass.
    pub(super) is_there: bool,
    /// Velocity after the substep without contact (m/s).
    pub(super) free: [f64; 3],
    /// Velocity before the substep (m/s).
    pub(super) old: [f64; 3],
    /// One over the mass (1/kg), 0 along fixed axes.
    pub(super) inverse_mass: [f64; 3],
}

impl NodePredictor {
    /// The node as the sweeps need it.
    pub(super) fn for_sweeps(&self) -> Node {
        let padded = |[x, y, z]: [f64; 3]| [x, y, z, 0.0];
        Node { velocity: padded(self.free), inverse_mass: padded(self.inverse_mass) }
    }
}

/// Where a point stands in memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    chunk: u32,
    block: u32,
    lane: u32,
}

impl Place {
    /// A place for a point that has not been listed since a state was restored.
    pub(super) const UNKNOWN: Place = Place { chunk: 0, block: 0, lane: 0 };

    /// Its block.
    #[inline(always)]
    pub(super) fn block<R: Real, D: Dimension, S>(self, partition: &Partition<R, D, S>) -> &Block<R, D, S> {
        &partition.chunks[self.chunk as usize].blocks[self.block as usize]
    }

    /// Its lane there.
    #[inline(always)]
    pub(super) fn lane(self) -> usize {
        self.lane as usize
    }
}

/// Shows to `visit` every point within `reach` (cells) of the tool, and some that are further, in the order
/// of memory: place, block, and distance from the tool (m).
pub(super) fn list_near<R: Real, D: Dimension, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    tool: &RigidTool,
    reach: f64,
    mut visit: impl FnMut(Place, &Block<R, D, S>, f64),
) {
    let layout = &partition.layout;
    let (low, high) = tool.bounds();
    let side = |axis: usize, x: f64| (x - layout.origin[axis]) / layout.cell;
    // A point stands within half a cell of its node.
    let margin = reach + 0.5;
    let low: [i32; 2] = std::array::from_fn(|axis| (side(axis, low[axis]) - margin).floor() as i32);
    let high: [i32; 2] = std::array::from_fn(|axis| (side(axis, high[axis]) + margin).ceil() as i32);
    for (chunk_number, chunk) in partition.chunks.iter().enumerate() {
        for (number, block) in chunk.blocks.iter().enumerate() {
            let is_beside = (0..2).any(|axis| {
                let column = |&node| if axis == 0 { layout.second.column(node) } else { node };
                let (first, last) = block.node[axis]
                    .iter()
                    .map(column)
                    .fold((i32::MAX, i32::MIN), |(first, last), node| (first.min(node), last.max(node)));
                last < low[axis] || first > high[axis]
            });
            if is_beside {
                continue;
            }
            for lane in (0..BLOCK).filter(|&lane| block.is_point(lane)) {
                let place = Place { chunk: chunk_number as u32, block: number as u32, lane: lane as u32 };
                visit(place, block, closest(layout, tool, block, lane).distance);
            }
        }
    }
}

/// Where the tool is closest to a point.
#[inline(always)]
pub(super) fn closest<R: Real, D: Dimension, S: PointState<R>>(
    layout: &Layout,
    tool: &RigidTool,
    block: &Block<R, D, S>,
    lane: usize,
) -> Closest {
    tool.shape.closest(from_tool(layout, tool, block, lane))
}

/// A point's position from the tool's lowest point (m).
#[inline(always)]
pub(super) fn from_tool<R: Real, D: Dimension, S: PointState<R>>(
    layout: &Layout,
    tool: &RigidTool,
    block: &Block<R, D, S>,
    lane: usize,
) -> [f64; 2] {
    let position = layout.place(block, lane);
    [position[0] - tool.position[0], position[1] - tool.position[1]]
}

/// A node's velocity at the end of the substep without contact, from what points have deposited.
///
/// * `index`: in the layout; `at`: along the axes
pub(super) fn assemble<R: Real, D: Dimension, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    step: &StepContext,
    index: usize,
    at: [i32; 3],
) -> NodePredictor {
    let (mut mass, mut momentum, mut force) = (0.0, [0.0; 3], [0.0; 3]);
    for run in &partition.incoming {
        if !(run.first..run.first + run.count::<D>()).contains(&index) {
            continue;
        }
        let local = index - run.first;
        mass += run.mass[local].to_f64();
        let records = &run.records[local * D::QUADS..(local + 1) * D::QUADS];
        for axis in 0..D::AXES {
            momentum[axis] += records[0].0[axis].to_f64();
            force[axis] +=
                if D::QUADS == 1 { records[0].0[2 + axis].to_f64() } else { records[1].0[axis].to_f64() };
        }
    }
    let is_there = mass > step.lightest;
    let mut node = NodePredictor { index, is_there, free: [0.0; 3], old: [0.0; 3], inverse_mass: [0.0; 3] };
    if !is_there {
        return node;
    }
    let layout = &partition.layout;
    let dt = step.dt;
    let index = [layout.second.column(at[0]), at[1], at[2]];
    let position = std::array::from_fn(|axis| layout.origin[axis] + layout.cell * f64::from(index[axis]));
    let body = step.body_force.as_ref().map_or([0.0; 3], |force| force.acceleration(position, step.time));
    for axis in 0..D::AXES {
        let is_fixed = partition.fixed.iter().any(|fixed| fixed.axes[axis] && fixed.holds::<D>(layout, &at));
        if !is_fixed {
            node.old[axis] = momentum[axis] / mass;
            node.free[axis] = (momentum[axis] + dt * force[axis]) / mass + dt * body[axis];
            node.inverse_mass[axis] = 1.0 / mass;
        }
    }
    node
}

/// A node that a point touches.
#[derive(Clone, Copy, Debug)]
pub(super) struct TouchedNode {
    /// Index in the layout.
    pub(super) index: usize,
    /// Indices along the axes.
    pub(super) at: [i32; 3],
    /// The point's weight there, carried on.
    pub(super) weight: f64,
    /// The point's own weight.
    pub(super) own: f64,
}

/// Shows to `visit` every node that a point touches, with weights carried on by `shift` (cells) along x and
/// y.
pub(super) fn for_each_weight<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
    block: &Block<R, D, S>,
    lane: usize,
    shift: [f64; 2],
    layout: &Layout,
    shape: &F,
    mut visit: impl FnMut(TouchedNode),
) {
    let offsets: [R; 3] =
        std::array::from_fn(|axis| if axis < D::AXES { block.offset[axis][lane] } else { R::ZERO });
    let [own_weights, own_slopes] = dispatch(InstructionSet::Portable, TouchingWeights { offsets, shape });
    let node = D::vector(|axis| block.node[axis][lane]);
    for pencil in 0..D::PENCILS {
        let first = first_node::<D>(layout, 0, &node, pencil);
        for k in 0..3 {
            let place = if D::AXES == 2 { [pencil, k, 1] } else { [pencil / 3, pencil % 3, k] };
            let along = |axis: usize| own_weights[axis][place[axis]].to_f64();
            let across = if D::AXES == 3 { along(2) } else { 1.0 };
            let own = along(0) * along(1) * across;
            let slope = |axis: usize| own_slopes[axis][place[axis]].to_f64();
            let weight = own + (shift[0] * slope(0) * along(1) + shift[1] * slope(1) * along(0)) * across;
            if weight != 0.0 {
                let at =
                    std::array::from_fn(
                        |axis| {
                            if axis < D::AXES { node[axis] + place[axis] as i32 - 1 } else { 0 }
                        },
                    );
                visit(TouchedNode { index: first + k, at, weight, own });
            }
        }
    }
}

/// Fills weights and slopes of one point that touches the tool, by axis and node of the stencil.
struct TouchingWeights<'a, R, F> {
    offsets: [R; 3],
    shape: &'a F,
}

impl<R: Real, F: ShapeFunction<R>> Kernel<R> for TouchingWeights<'_, R, F> {
    type Output = [[[R; 3]; 3]; 2];

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> Self::Output {
        let stencils = self.offsets.map(|offset| self.shape.stencil(S::Lanes::splat(offset)));
        [
            stencils.map(|stencil| stencil.weights.map(|weight| weight.max_lane())),
            stencils.map(|stencil| stencil.slopes.map(|slope| slope.max_lane())),
        ]
    }
}
