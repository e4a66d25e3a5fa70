//! Contact of the tool with the material points themselves, solved on the grid before each substep.
//!
//! A point is a square of its own; it touches when the tool reaches it, that is, when its distance from the tool is at most
//! half its width. Each touching point p asks that the grid's velocity there does not enter the tool,
//!
//! (Σ_i w_ip v_i − v_tool) · n ≥ 0,
//!
//! where the tool's surface is nearest to the point: w_ip are the point's weights carried on to that place c by their
//! slopes, w_ip = N_i(x_p) + (c − x_p) · ∇N_i(x_p), as its velocity is by the velocity gradient. (The weights at c itself
//! would mostly move nodes behind the surface, which have next to no mass.) The impulse j_p that sees to it acts on the
//! nodes with the same weights, Δv_i = w_ip j_p/m_i, so momentum and its moment are exchanged where the material is,
//! wherever the tool's face lies between the nodes. Pushing only and Coulomb's cone,
//! |j_t| ≤ μ j_n, are kept at every point by projected Gauss–Seidel sweeps over the points, in the order of memory.
//!
//! Source: Moreau (1999) and Jean (1999), Computer Methods in Applied Mechanics and Engineering 177 (contact dynamics, and
//! the projected sweeps).
//!
//! Form of the effect: an optional pass in the place of a contact law on nodes. It runs on one thread: its result does not
//! depend on how many there are.

use crate::body_force::BodyForce;
use crate::chunk::{NodeSums, TouchedNodes};
use crate::contact::RigidTool;
use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::partition::Partition;
use crate::points::{BLOCK, Block, PointState};
use crate::shape::ShapeFunction;
use crate::simd::{InstructionSet, Kernel, Real, Simd, Vector, dispatch};
use crate::tool_shape::Face;
use crate::transfer::first_node;

/// Most sweeps of a substep.
const MOST_SWEEPS: usize = 50;
/// Sweeps end when none changes a point's velocity by more than this part of the fastest speed (-).
const TOLERANCE: f64 = 1e-6;

/// A node that a touching point reaches.
struct Node {
    index: usize,
    velocity: [f64; 3],
    change: [f64; 3],
    /// One over the mass (1/kg), 0 along fixed axes.
    inverse_mass: [f64; 3],
}

/// A touching point.
struct Touch {
    normal: [f64; 3],
    impulse: [f64; 3],
    /// Place in the list of nodes, and weight.
    stencil: Vec<(usize, f64)>,
    rake_coordinate: f64,
}

/// What the substep is about, beside points and nodes.
pub struct Conditions<'a> {
    /// The tool.
    pub tool: &'a RigidTool,
    /// Body force, if there is one.
    pub body_force: Option<&'a dyn BodyForce>,
    /// Nodes lighter than this (kg) stay at rest.
    pub lightest: f64,
    /// Time at the start of the substep (s) and its length (s).
    pub time: [f64; 2],
}

/// Solves the contact of a substep.
pub fn solve<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    shape: &F,
    conditions: &Conditions<'_>,
) -> TouchedNodes {
    let mut nodes: Vec<Node> = Vec::new();
    let mut places = std::collections::HashMap::new();
    let mut touches = find(partition, shape, conditions, &mut nodes, &mut places);
    if touches.is_empty() {
        return TouchedNodes::default();
    }
    let tool = conditions.tool;
    let tool_velocity = [tool.velocity[0], tool.velocity[1], 0.0];
    let fastest = nodes
        .iter()
        .flat_map(|node| node.velocity)
        .chain(tool_velocity)
        .fold(1e-300, |most: f64, v| most.max(v.abs()));
    for _ in 0..MOST_SWEEPS {
        let mut largest = 0.0_f64;
        for touch in &mut touches {
            largest = largest.max(sweep(touch, &mut nodes, tool_velocity, tool.friction));
        }
        if largest <= TOLERANCE * fastest {
            break;
        }
    }
    let mut sums = NodeSums::default();
    for touch in &touches {
        let relative = relative_velocity(touch, &nodes, tool_velocity);
        let along: f64 = (0..3).map(|k| relative[k] * touch.normal[k]).sum();
        for k in 0..3 {
            sums.tool_work += touch.impulse[k] * tool_velocity[k];
            sums.friction_work -= touch.impulse[k] * (relative[k] - along * touch.normal[k]);
        }
        sums.tool_impulse[0] += touch.impulse[0];
        sums.tool_impulse[1] += touch.impulse[1];
        if touch.impulse.iter().any(|&j| j != 0.0) {
            sums.touches = true;
            sums.contact_reach = sums.contact_reach.max(touch.rake_coordinate);
        }
    }
    let mut changes: Vec<(usize, [f64; 3])> = nodes.iter().map(|node| (node.index, node.change)).collect();
    changes.sort_unstable_by_key(|change| change.0);
    TouchedNodes { nodes: changes, sums }
}

/// Velocity of a point on the grid relative to the tool (m/s).
fn relative_velocity(touch: &Touch, nodes: &[Node], tool: [f64; 3]) -> [f64; 3] {
    let mut relative = tool.map(|v| -v);
    for &(place, weight) in &touch.stencil {
        for k in 0..3 {
            relative[k] += weight * nodes[place].velocity[k];
        }
    }
    relative
}

/// Corrects one point's impulse; returns by how much that changed its velocity (m/s).
fn sweep(touch: &mut Touch, nodes: &mut [Node], tool: [f64; 3], friction: f64) -> f64 {
    let relative = relative_velocity(touch, nodes, tool);
    // Velocity per impulse; along a fixed axis the point cannot be moved as much as elsewhere.
    let mut compliance = [0.0_f64; 3];
    for &(place, weight) in &touch.stencil {
        for k in 0..3 {
            compliance[k] += weight * weight * nodes[place].inverse_mass[k];
        }
    }
    let compliance = compliance.into_iter().fold(0.0, f64::max);
    if compliance <= 0.0 {
        return 0.0;
    }
    let wanted: [f64; 3] = std::array::from_fn(|k| touch.impulse[k] - relative[k] / compliance);
    let push = (0..3).map(|k| wanted[k] * touch.normal[k]).sum::<f64>();
    let drag: [f64; 3] = std::array::from_fn(|k| wanted[k] - push * touch.normal[k]);
    let push = push.max(0.0);
    let size = drag.iter().map(|j| j * j).sum::<f64>().sqrt();
    let kept = if size > friction * push { friction * push / size } else { 1.0 };
    let impulse: [f64; 3] = std::array::from_fn(|k| push * touch.normal[k] + kept * drag[k]);
    let change: [f64; 3] = std::array::from_fn(|k| impulse[k] - touch.impulse[k]);
    touch.impulse = impulse;
    for &(place, weight) in &touch.stencil {
        let node = &mut nodes[place];
        for k in 0..3 {
            let gain = weight * change[k] * node.inverse_mass[k];
            node.velocity[k] += gain;
            node.change[k] += gain;
        }
    }
    compliance * change.iter().fold(0.0_f64, |most, j| most.max(j.abs()))
}

/// The touching points, with the nodes they reach.
fn find<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    shape: &F,
    conditions: &Conditions<'_>,
    nodes: &mut Vec<Node>,
    places: &mut std::collections::HashMap<usize, usize>,
) -> Vec<Touch> {
    let layout = &partition.layout;
    let tool = conditions.tool;
    let (low, high) = tool.bounds();
    let box_of = |axis: usize| {
        let index = |x: f64| (x - layout.origin[axis]) / layout.cell;
        index(low[axis]).floor() as i32 - 1..=index(high[axis]).ceil() as i32 + 1
    };
    let (columns, rows) = (box_of(0), box_of(1));
    let mut touches = Vec::new();
    for block in partition.chunks.iter().flat_map(|chunk| &chunk.blocks) {
        for lane in 0..BLOCK {
            if !columns.contains(&block.node[0][lane])
                || !rows.contains(&block.node[1][lane])
                || !block.is_point(lane)
            {
                continue;
            }
            let cells = block.grid_position(lane);
            let position: [f64; 2] =
                std::array::from_fn(|axis| layout.origin[axis] + layout.cell * cells[axis]);
            let closest =
                tool.shape.closest([position[0] - tool.position[0], position[1] - tool.position[1]]);
            let half_width = 0.5 * block.volume[lane].to_f64().powf(1.0 / D::AXES as f64);
            if closest.distance > half_width {
                continue;
            }
            let mut stencil = Vec::with_capacity(27);
            let shift = closest.normal.map(|n| -closest.distance * n / layout.cell);
            for_each_weight::<R, D, F, S>(block, lane, shift, layout, shape, |index, axes, weight| {
                let place = *places.entry(index).or_insert_with(|| {
                    nodes.push(assemble::<R, D, S>(partition, conditions, index, axes));
                    nodes.len() - 1
                });
                stencil.push((place, weight));
            });
            touches.push(Touch {
                normal: [closest.normal[0], closest.normal[1], 0.0],
                impulse: [0.0; 3],
                stencil,
                rake_coordinate: if closest.face == Face::Rake { closest.along } else { 0.0 },
            });
        }
    }
    touches
}

/// A node's velocity at the end of the substep without contact.
fn assemble<R: Real, D: Dimension, S: PointState<R>>(
    partition: &Partition<R, D, S>,
    conditions: &Conditions<'_>,
    index: usize,
    at: [i32; 3],
) -> Node {
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
    let mut node = Node { index, velocity: [0.0; 3], change: [0.0; 3], inverse_mass: [0.0; 3] };
    if mass <= conditions.lightest {
        return node;
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
            node.velocity[axis] = (momentum[axis] + dt * force[axis]) / mass + dt * body[axis];
            node.inverse_mass[axis] = 1.0 / mass;
        }
    }
    node
}

/// Calls `visit` with index in the layout, indices along the axes, and weight of every node that a point touches; weights
/// are carried on by `shift` (cells) along x and y.
fn for_each_weight<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
    block: &Block<R, D, S>,
    lane: usize,
    shift: [f64; 2],
    layout: &Layout,
    shape: &F,
    mut visit: impl FnMut(usize, [i32; 3], f64),
) {
    let offsets: [R; 3] =
        std::array::from_fn(|axis| if axis < D::AXES { block.offset[axis][lane] } else { R::ZERO });
    let weights = dispatch(InstructionSet::Portable, PointWeights { offsets, shape });
    let node = D::vector(|axis| block.node[axis][lane]);
    for pencil in 0..D::PENCILS {
        let first = first_node::<D>(layout, 0, &node, pencil);
        for k in 0..3 {
            let place = if D::AXES == 2 { [pencil, k, 1] } else { [pencil / 3, pencil % 3, k] };
            let along = |axis: usize| weights[0][axis][place[axis]].to_f64();
            let product =
                |except: usize| (0..D::AXES).filter(|&axis| axis != except).map(along).product::<f64>();
            let mut weight = product(D::AXES);
            let mut at = [0; 3];
            for axis in 0..D::AXES {
                at[axis] = node[axis] + place[axis] as i32 - 1;
                if axis < 2 {
                    weight += shift[axis] * weights[1][axis][place[axis]].to_f64() * product(axis);
                }
            }
            if weight != 0.0 {
                visit(first + k, at, weight);
            }
        }
    }
}

/// Weights and slopes of one point by axis and node of the stencil.
struct PointWeights<'a, R, F> {
    offsets: [R; 3],
    shape: &'a F,
}

impl<R: Real, F: ShapeFunction<R>> Kernel<R> for PointWeights<'_, R, F> {
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
