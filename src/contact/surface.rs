//! Contact of the tool with the material points themselves, solved on the grid before each substep: the law
//! `surface`.
//!
//! A point is a square of its own; it touches when the tool reaches it, that is, when its distance from the
//! tool is at most half its width. Each touching point p asks that the grid's velocity there does not enter
//! the tool,
//!
//! (Σ_i w_ip v_i − v_tool) · n ≥ b,
//!
//! where the tool's surface is nearest to the point: w_ip are the point's weights carried on to that place c
//! by their slopes, w_ip = N_i(x_p) + (c − x_p) · ∇N_i(x_p), as its velocity is by the velocity gradient.
//! (The weights at c itself would mostly move nodes behind the surface, which have next to no mass.) The
//! impulse j_p that sees to it acts on the nodes with the same weights, Δv_i = w_ip j_p/m_i, so momentum and
//! its moment are exchanged where the material is, wherever the tool's face lies between the nodes. Pushing
//! only and Coulomb's cone, |j_t| ≤ μ j_n, are kept at every point by projected Gauss–Seidel sweeps
//! (`contact::gauss_seidel`). They start from the forces of the last substep, which are part of the state. b
//! is 0 for a point outside the tool; one that has come inside leaves at `RETURN` of its depth per substep.
//!
//! Source: Moreau (1999) and Jean (1999), Computer Methods in Applied Mechanics and Engineering 177 (contact
//! dynamics, and the projected sweeps).
//!
//! Form of the effect: an optional pass before the points. Points near the tool are listed, and listed anew
//! when they are sorted or may have come from further away than `REACH`; the list only saves looking at the
//! others. The pass runs on one thread: its result does not depend on how many there are.

use crate::checkpoint::{BulkReader, StateBytes};
use crate::contact::contact_law::{BoxedLaw, ContactCost, ContactLaw, ContactStep, Parting};
use crate::contact::gauss_seidel::{ContactPoint, GaussSeidel, Node, NodeWeight, warm_start};
use crate::contact::nodes::{
    NOT_LISTED, NodePredictor, Place, TouchedNode, assemble, closest, for_each_weight, from_tool, list_near,
};
use crate::contact::sticking::{Layer, SLIDING, Sticking};
use crate::contact::two_fields::{FieldPair, meet_at_edge};
use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::Layout;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::partition::nodes::{NodalImpulses, StepContext, VelocityChange};
use crate::points::{Block, PointState, Side};
use crate::simd::{Real, dispatch};
use crate::tool::RigidTool;
use crate::tool::profile::Closest;

/// Points are listed up to this far from the tool, beyond half their width (cells).
const REACH: f64 = 1.0;
/// Part of its depth that a point inside the tool comes out in a substep (-).
const RETURN: f64 = 0.02;

/// Contact at the points: the list of those near the tool with their last forces, and working memory that is
/// kept.
#[derive(Clone, Debug, Default)]
pub(super) struct SurfaceContact {
    /// Whether the material's shear strength caps friction.
    caps: bool,
    near: Vec<NearPoint>,
    /// Whether the list is of no use any more, and how far points and tool may have moved since it was made
    /// (cells).
    is_stale: bool,
    moved: f64,
    /// By node of the layout: its place in `nodes`, or `NOT_LISTED`.
    places: Vec<u32>,
    nodes: Vec<Node>,
    starts: Vec<NodePredictor>,
    /// Nodes that chip and work press together.
    pairs: Vec<FieldPair>,
    touches: Vec<ContactPoint>,
    /// Nodes of the touching points, one point after another, with weights carried on to the surface.
    reached: Vec<NodeWeight>,
    /// The points' own weights there, where friction heat is wanted, and the heat by node (J).
    own_weights: Vec<f64>,
    heat: Vec<f64>,
    /// Forces of points by number, while the list is made anew.
    forces: Vec<(u32, [f64; 3])>,
    touched: NodalImpulses,
    /// The points as neighbours on the face, where strength caps friction.
    sticking: Sticking,
    /// Sweeps of the last substep.
    sweeps: u32,
}

/// A point near the tool.
#[derive(Clone, Copy, Debug)]
struct NearPoint {
    place: Place,
    /// Its number.
    id: u32,
    /// Contact force in the last substep (N).
    force: [f64; 3],
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>> ContactLaw<R, D, F, S> for SurfaceContact {
    fn solve(&mut self, partition: &Partition<R, D, S>, shape: &F, contact: &ContactStep<'_, S>) {
        if self.is_stale || self.moved > REACH || self.places.len() != partition.layout.nodes() {
            self.list_near(partition, contact);
        }
        self.find(partition, shape, contact);
        self.touched.clear();
        self.sweeps = 0;
        if self.touches.is_empty() && self.starts.is_empty() {
            return;
        }
        let cell = partition.layout.cell;
        self.sweep_points(contact.tool, contact.step, cell);
        self.sum_up::<D>(contact.tool, contact.step.dt, contact.wants_heat);
        if self.caps {
            let areas = self.sticking.areas(&self.touches, contact.tool.friction, cell);
            self.touched.sums.contact_areas = areas;
        }
    }

    fn touched(&self) -> &NodalImpulses {
        &self.touched
    }

    fn cost(&self) -> ContactCost {
        ContactCost { touching: self.touches.len(), sweeps: self.sweeps }
    }

    fn note_motion(&mut self, cells: f64) {
        self.moved += cells;
    }

    fn note_sort(&mut self) {
        self.is_stale = true;
    }

    fn save(&self, bulk: &mut StateBytes) {
        self.save_forces(bulk);
    }

    fn restore(&mut self, reader: &mut BulkReader<'_>) -> Result<(), Error> {
        self.restore_forces(reader)
    }

    fn fork(&self) -> BoxedLaw<R, D, F, S> {
        Box::new(self.clone())
    }
}

impl SurfaceContact {
    /// Contact at the points; `caps` where the material's shear strength caps friction (`contact::sticking`).
    pub(super) fn new(caps: bool) -> Self {
        SurfaceContact { caps, ..SurfaceContact::default() }
    }

    /// Appends the points' forces to a state.
    fn save_forces(&self, bulk: &mut StateBytes) {
        let pressed = || self.near.iter().filter(|point| point.force != [0.0; 3]);
        bulk.put_counts([pressed().count()]);
        for point in pressed() {
            bulk.put([point.id.to_le_bytes()].into_iter());
            bulk.put_reals(&point.force);
        }
    }

    /// Takes what `save_forces` gave.
    fn restore_forces(&mut self, reader: &mut BulkReader<'_>) -> Result<(), Error> {
        *self = SurfaceContact { is_stale: true, ..SurfaceContact::new(self.caps) };
        let count = reader.count_of(28)?;
        for _ in 0..count {
            let id = u32::from_le_bytes(reader.take()?);
            let force = [reader.real()?, reader.real()?, reader.real()?];
            self.near.push(NearPoint { place: Place::UNKNOWN, id, force });
        }
        Ok(())
    }

    /// Lists the points near the tool, each with the force that it had in the list before.
    fn list_near<R: Real, D: Dimension, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        contact: &ContactStep<'_, S>,
    ) {
        let layout = &partition.layout;
        self.places.clear();
        self.places.resize(layout.nodes(), NOT_LISTED);
        // They tell of places of the nodes before, of which there may have been more.
        self.starts.clear();
        self.forces.clear();
        let pressed = self.near.drain(..).filter(|point| point.force != [0.0; 3]);
        self.forces.extend(pressed.map(|point| (point.id, point.force)));
        self.forces.sort_unstable_by_key(|entry| entry.0);
        self.near.reserve(256);
        // A point is at most a cell wide.
        list_near(partition, contact.tool, REACH + 0.5, |place, block, distance| {
            let lane = place.lane();
            if distance > half_width::<R, D, S>(block, lane, contact.depth) + REACH * layout.cell {
                return;
            }
            let id = block.id[lane];
            let force = self.forces.binary_search_by_key(&id, |entry| entry.0);
            let force = force.map_or([0.0; 3], |place| self.forces[place].1);
            self.near.push(NearPoint { place, id, force });
        });
        self.is_stale = false;
        self.moved = 0.0;
        // Enough for all to touch, so that substeps between lists ask for no memory.
        let room = self.near.len().max(256);
        let stencil = 3 * D::PENCILS;
        self.touches.reserve(room);
        self.reached.reserve(stencil * room);
        self.own_weights.reserve(stencil * room);
        self.forces.reserve(room);
        if self.caps {
            self.sticking.reserve(room);
        }
        self.nodes.reserve(stencil * room);
        self.starts.reserve(stencil * room);
        self.heat.reserve(stencil * room);
        self.touched.nodes.reserve(stencil * room);
        self.touched.friction_heat.reserve(stencil * room);
    }

    /// The touching points, with the nodes they reach as the last substep's forces leave them.
    fn find<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        shape: &F,
        contact: &ContactStep<'_, S>,
    ) {
        let SurfaceContact {
            caps,
            near,
            places,
            nodes,
            starts,
            pairs,
            touches,
            reached,
            own_weights,
            sticking,
            ..
        } = self;
        for start in starts.drain(..) {
            places[start.index] = NOT_LISTED;
        }
        nodes.clear();
        touches.clear();
        reached.clear();
        own_weights.clear();
        sticking.clear();
        let layout = &partition.layout;
        let dt = contact.step.dt;
        if contact.parting.is_some() {
            meet_at_edge::<R, D, S>(partition, contact.step, (nodes, starts), (places, pairs));
        }
        for (number, point) in near.iter_mut().enumerate() {
            let (block, lane) = (point.place.block(partition), point.place.lane());
            let Some(closest) = touching::<R, D, S>((block, lane), layout, contact) else {
                point.force = [0.0; 3];
                continue;
            };
            let shift = closest.normal.map(|n| -closest.distance * n / layout.cell);
            let first = reached.len();
            for_each_weight::<R, D, F, S>(block, lane, shift, layout, shape, |touched| {
                let TouchedNode { index, at, weight, own } = touched;
                let place = &mut places[index];
                if *place == NOT_LISTED {
                    *place = nodes.len() as u32;
                    let start = assemble::<R, D, S>(partition, contact.step, index, at);
                    nodes.push(start.for_sweeps());
                    starts.push(start);
                }
                if starts[*place as usize].is_there {
                    reached.push(NodeWeight { place: *place, weight });
                    if contact.wants_heat {
                        own_weights.push(own);
                    }
                }
            });
            // Nodes without mass cannot carry a share.
            let carried = reached[first..].iter().map(|reached| reached.weight).sum::<f64>();
            // Velocity per impulse; along a fixed axis the point cannot be moved as much as elsewhere.
            let mut compliance = [0.0_f64; 3];
            for NodeWeight { place, weight } in &mut reached[first..] {
                *weight /= carried;
                for axis in 0..D::AXES {
                    compliance[axis] += *weight * *weight * nodes[*place as usize].inverse_mass[axis];
                }
            }
            let compliance = compliance.into_iter().fold(0.0, f64::max);
            let mut touch = ContactPoint {
                near: number as u32,
                first: first as u32,
                end: reached.len() as u32,
                normal: [closest.normal[0], closest.normal[1], 0.0],
                impulse: [0.0; 3],
                leaving: RETURN * (-closest.distance).max(0.0) / dt,
                compliance,
                inertia: if compliance > 0.0 { 1.0 / compliance } else { 0.0 },
                rake_coordinate: closest.along,
                friction: contact.tool.friction,
            };
            if *caps {
                let width = 2.0 * half_width::<R, D, S>(block, lane, contact.depth);
                let place = from_tool(layout, contact.tool, block, lane);
                let across = if D::AXES == 3 { layout.cell * block.grid_position(lane)[2] } else { 0.0 };
                sticking.push(Layer {
                    along: contact.tool.shape.along_outline(place, &closest),
                    strip: (across / width).floor() as i64,
                    width,
                    depth: if D::AXES == 3 { width } else { contact.depth },
                    strength: (contact.strength)(&block.state, lane),
                });
            }
            let start = warm_start(point.force, touch.normal, contact.tool.friction, dt);
            touch.push::<D>(start, reached, nodes);
            touches.push(touch);
        }
    }

    /// Sweeps over the touching points until their velocities settle; `cell` is the cell length (m).
    fn sweep_points(&mut self, tool: &RigidTool, step: &StepContext, cell: f64) {
        let SurfaceContact { caps, nodes, touches, reached, sticking, .. } = self;
        if *caps {
            sticking.measure(cell);
        }
        let prepare = &mut |touches: &mut [ContactPoint]| {
            if *caps {
                sticking.cap(touches, tool.friction, cell, step.dt);
            }
        };
        let velocity = [tool.velocity[0], tool.velocity[1], 0.0];
        let sweep = GaussSeidel { touches, reached, nodes, tool: velocity, prepare };
        self.sweeps = dispatch(step.instructions, sweep);
    }

    /// What the impulses found amount to in a substep of `dt` (s).
    fn sum_up<D: Dimension>(&mut self, tool: &RigidTool, dt: f64, wants_heat: bool) {
        let SurfaceContact {
            near,
            nodes,
            starts,
            pairs,
            touches,
            reached,
            own_weights,
            heat: heated,
            touched,
            ..
        } = self;
        heated.clear();
        if wants_heat {
            heated.resize(nodes.len(), 0.0);
        }
        let tool_velocity = [tool.velocity[0], tool.velocity[1], 0.0];
        let sums = &mut touched.sums;
        for pair in pairs.iter() {
            pair.count(nodes, starts, sums);
        }
        for touch in touches.iter() {
            near[touch.near as usize].force = touch.impulse.map(|j| j / dt);
            if touch.impulse == [0.0; 3] {
                continue;
            }
            let new = touch.velocity::<D>(reached, |place| {
                let [x, y, z, _] = nodes[place].velocity;
                [x, y, z]
            });
            let old = touch.velocity::<D>(reached, |place| starts[place].old);
            let dot = |a: [f64; 3], b: [f64; 3]| (0..D::AXES).map(|axis| a[axis] * b[axis]).sum::<f64>();
            let relative: [f64; 3] = std::array::from_fn(|axis| new[axis] - tool_velocity[axis]);
            let change: [f64; 3] = std::array::from_fn(|axis| new[axis] - old[axis]);
            let push = dot(touch.impulse, touch.normal);
            let drag: [f64; 3] = std::array::from_fn(|axis| touch.impulse[axis] - push * touch.normal[axis]);
            let work = dot(touch.impulse, relative);
            let heat = (-dot(drag, relative)).max(0.0);
            sums.tool_work += dot(touch.impulse, tool_velocity);
            sums.friction_work += heat;
            // Complementary to friction, so that the work of all contact impulses is counted.
            sums.approach_work += work + heat;
            sums.contact_loss += 0.5 * push * dot(change, touch.normal);
            if touch.friction > 0.0 && dot(drag, drag) < SLIDING * (touch.friction * push).powi(2) {
                // It sticks.
                sums.contact_loss += 0.5 * dot(drag, change);
            }
            sums.tool_impulse[0] += touch.impulse[0];
            sums.tool_impulse[1] += touch.impulse[1];
            sums.touches = true;
            sums.contact_reach = sums.contact_reach.max(touch.rake_coordinate);
            if wants_heat && heat > 0.0 {
                // The point's own weights are never negative and add up to one.
                for k in touch.first as usize..touch.end as usize {
                    heated[reached[k].place as usize] += own_weights[k] * heat;
                }
            }
        }
        touched.nodes.extend(starts.iter().zip(nodes.iter()).map(|(start, node)| VelocityChange {
            node: start.index,
            change: std::array::from_fn(|axis| node.velocity[axis] - start.free[axis]),
        }));
        touched.nodes.sort_unstable_by_key(|change| change.node);
        let by_node = starts.iter().zip(heated.iter()).filter(|(_, heat)| **heat > 0.0);
        touched.friction_heat.extend(by_node.map(|(start, &heat)| (start.index, heat)));
        touched.friction_heat.sort_unstable_by_key(|entry| entry.0);
    }
}

/// Where the tool reaches a point, if it does.
///
/// Where chip and work part, points of the chip meet the rake face and those of the work the flank, and rows
/// that were laid anew are higher or lower than they are wide.
#[inline(always)]
fn touching<R: Real, D: Dimension, S: PointState<R>>(
    (block, lane): (&Block<R, D, S>, usize),
    layout: &Layout,
    contact: &ContactStep<'_, S>,
) -> Option<Closest> {
    let half = half_width::<R, D, S>(block, lane, contact.depth);
    let Some(Parting { normal, spacing }) = contact.parting else {
        let closest = closest(layout, contact.tool, block, lane);
        return (closest.distance <= half).then_some(closest);
    };
    let place = from_tool(layout, contact.tool, block, lane);
    let shape = &contact.tool.shape;
    let closest = match block.side[lane] {
        Side::Uncut => shape.closest(place),
        Side::Chip => shape.closest_beside(normal, true, place, spacing)?,
        Side::Work => shape.closest_beside(normal, false, place, spacing)?,
    };
    let [x, y] = closest.normal;
    let height = if D::AXES == 2 { (2.0 * half).powi(2) } else { (2.0 * half).powi(3) / spacing } / spacing;
    let reach = 0.5 * (spacing * x * x + height * y * y);
    (closest.distance <= reach).then_some(closest)
}

/// Half the width of a point (m), whose volume in the plane goes `depth` (m) deep.
#[inline(always)]
fn half_width<R: Real, D: Dimension, S: PointState<R>>(
    block: &Block<R, D, S>,
    lane: usize,
    depth: f64,
) -> f64 {
    let volume = block.volume[lane].to_f64();
    0.5 * if D::AXES == 2 { (volume / depth).sqrt() } else { volume.cbrt() }
}
