//! What the passes of contact (`contact::surface`, `contact::nodal`) see of points and nodes before a substep.

use crate::contact::gauss_seidel::Node;
use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::grid::body_force::BodyForce;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::points::{Block, PointState};
use crate::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use crate::tool::RigidTool;
use crate::tool::profile::Closest;
use crate::transfer::first_node;

/// What the substep is about, beside points and nodes.
pub struct Conditions<'a> {
    /// The tool.
    pub tool: &'a RigidTool,
    /// Body force, if there is one.
    pub body_force: Option<&'a dyn BodyForce>,
    /// Nodes lighter than this (kg) stay at rest.
    pub lightest: f64,
    /// How deep the plane is (m); says nothing in space.
    pub depth: f64,
    /// Time at the start of the substep (s) and its length (s).
    pub time: [f64; 2],
    /// Whether friction heat is wanted by node.
    pub wants_heat: bool,
    /// Instruction set of the kernels.
    pub instructions: InstructionSet,
}

/// A node that contact may push, beside what the sweeps need of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodePredictor {
    /// Index in the layout.
    pub(crate) index: usize,
    /// Velocity after the substep without contact, and before it (m/s).
    pub(crate) free: [f64; 3],
    pub(crate) old: [f64; 3],
    /// Whether it has mass.
    pub(crate) is_there: bool,
}

/// Where the tool is closest to a point.
#[inline(always)]
pub(crate) fn closest<R: Real, D: Dimension, S: PointState<R>>(
    layout: &Layout,
    tool: &RigidTool,
    block: &Block<R, D, S>,
    lane: usize,
) -> Closest {
    tool.shape.closest(from_tool(layout, tool, block, lane))
}

/// A point's position from the tool's lowest point (m).
#[inline(always)]
pub(crate) fn from_tool<R: Real, D: Dimension, S: PointState<R>>(
    layout: &Layout,
    tool: &RigidTool,
    block: &Block<R, D, S>,
    lane: usize,
) -> [f64; 2] {
    let cells = block.grid_position(lane);
    let position: [f64; 2] = std::array::from_fn(|axis| layout.origin[axis] + layout.cell * cells[axis]);
    [position[0] - tool.position[0], position[1] - tool.position[1]]
}

/// A node's velocity at the end of the substep without contact.
pub(crate) fn assemble<R: Real, D: Dimension, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    conditions: &Conditions<'_>,
    index: usize,
    at: [i32; 3],
) -> (Node, NodePredictor) {
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
    let mut node = Node::default();
    let mut start =
        NodePredictor { index, free: [0.0; 3], old: [0.0; 3], is_there: mass > conditions.lightest };
    if !start.is_there {
        return (node, start);
    }
    let layout = &partition.layout;
    let [time, dt] = conditions.time;
    let position = std::array::from_fn(|axis| layout.origin[axis] + layout.cell * f64::from(at[axis]));
    let body = conditions.body_force.map_or([0.0; 3], |force| force.acceleration(position, time));
    for axis in 0..D::AXES {
        let is_fixed = partition.fixed.iter().any(|fixed| {
            fixed.axes[axis] && (0..D::AXES).all(|k| fixed.low[k] <= at[k] && at[k] <= fixed.high[k])
        });
        if !is_fixed {
            start.old[axis] = momentum[axis] / mass;
            node.velocity[axis] = (momentum[axis] + dt * force[axis]) / mass + dt * body[axis];
            node.inverse_mass[axis] = 1.0 / mass;
        }
    }
    start.free.copy_from_slice(&node.velocity[..3]);
    (node, start)
}

/// Calls `visit` with index in the layout, indices along the axes, and weights of every node that a point touches: carried
/// on by `shift` (cells) along x and y, and the point's own.
pub(crate) fn for_each_weight<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
    block: &Block<R, D, S>,
    lane: usize,
    shift: [f64; 2],
    layout: &Layout,
    shape: &F,
    mut visit: impl FnMut(usize, [i32; 3], f64, f64),
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
                visit(first + k, at, weight, own);
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
