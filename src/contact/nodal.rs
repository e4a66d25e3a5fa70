//! The paper's own contact laws: `velocity` and `distance`, on nodes that workpiece and tool share.
//!
//! Both bodies are points (`contact::tool_particles`) and map their velocities on the same nodes. Node i is shared where a
//! point of each reaches it, that is, has weight there. The tool is rigid and so heavy that the common velocity v_i of eq. 18 is its own.
//! With n the tool's outward normal at the node:
//!
//! * `velocity` (Bardenhagen): a shared node is in contact where the workpiece's velocity there approaches the tool,
//!   (v_i^b − v_i) · n_i^b > 0 (eq. 18), n^b = −n. It acts up to two cells ahead of the tool.
//! * `distance`: besides, the bodies must be close to each other (eqs. 19 to 22),
//!
//!   D_i = n · d_i^A − n · d_i^B ≤ L/2,
//!
//!   where d points from a body's foremost point to the node: D is how far the workpiece's nearest point is ahead of the tool's,
//!   n · (x_b − x_a), over the points that reach the node. Points half a cell apart stand a quarter of a cell below
//!   their surface, so D = L/2 where surfaces meet. Eq. 20 is printed with the maximum over the tool's points, which
//!   would be the hindmost; the foremost have the minimum.
//!
//! In contact the normal velocity becomes the tool's, which is eq. 23 for a rigid tool at constant speed, and the impulse
//! m (v − v_trial) pushes only; of the sliding Coulomb's law takes away what it can (`contact::Contact`).
//!
//! n is that of the exact shape: gradients of the tool's mass, which have no direction inside it and turn near its
//! corners, would only blur it.
//!
//! Source: Ambati et al. (2011), eqs. 18 to 23; Bardenhagen et al. (2000), doi:10.1016/S0045-7825(99)00338-2.
//!
//! Form of the effect: an optional pass before points move, as `contact::surface`, on one thread; nothing of it is part
//! of the state.

use crate::contact::nodes::{Conditions, assemble, closest, for_each_weight};
use crate::contact::tool_particles::RigidPoints;
use crate::contact::{Contact, coulomb};
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::partition::nodes::{NodalImpulses, NodeSums};
use crate::points::{BLOCK, PointState};
use crate::simd::Real;
use crate::tool::profile::Face;

/// The list of near points is made anew when points and tool may have moved this far (cells).
const MOTION: f64 = 1.0;
/// Marks a node of the layout that is not in the list.
const NONE: u32 = u32::MAX;
/// Largest D in contact (cells), eq. 22.
const CLOSE: f64 = 0.5;

/// Contact at shared nodes: working memory only.
#[derive(Clone, Debug, Default)]
pub struct NodalContact {
    tool_points: RigidPoints,
    /// Chunk, block and lane of the points near the tool.
    near: Vec<[u32; 3]>,
    /// Whether the list serves, and how far points and tool may have moved since it was made (cells).
    is_fresh: bool,
    moved: f64,
    /// By node of the layout: its place in `nodes`, or `NONE`.
    places: Vec<u32>,
    nodes: Vec<SharedNode>,
    touched: NodalImpulses,
    /// Nodes in contact.
    count: usize,
}

/// A node near the tool that the workpiece reaches.
#[derive(Clone, Copy, Debug)]
struct SharedNode {
    /// Index in the layout.
    index: usize,
    /// Unit normal out of the tool, and the coordinate along the rake face (m), if the node faces it.
    normal: [f64; 2],
    rake_coordinate: Option<f64>,
    /// Foremost point of the tool and nearest of the workpiece along the normal (m); no tool, no contact.
    front: Option<f64>,
    nearest: f64,
    /// Velocity after the substep without contact, and before it (m/s).
    free: [f64; 3],
    old: [f64; 3],
    /// One over the mass (1/kg), 0 along fixed axes.
    inverse_mass: [f64; 3],
}

impl NodalContact {
    /// What contact changed in the last substep.
    pub fn touched(&self) -> &NodalImpulses {
        &self.touched
    }

    /// Nodes in contact in the last substep.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The points have been sorted: they stand elsewhere in memory.
    pub fn note_sort(&mut self) {
        self.is_fresh = false;
    }

    /// Points and tool have moved by up to so many cells.
    pub fn note_motion(&mut self, cells: f64) {
        self.moved += cells;
    }

    /// Solves the contact of a substep by a law, `Distance` or `Velocity`.
    pub fn solve<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
        &mut self,
        law: Contact,
        partition: &Partition<R, D, S>,
        shape: &F,
        conditions: &Conditions<'_>,
    ) {
        let cell = partition.layout.cell;
        let reach = shape.reach() * cell;
        if !self.tool_points.fit(cell) {
            self.tool_points = RigidPoints::new(&conditions.tool.shape, cell);
        }
        if !self.is_fresh || self.moved > MOTION || self.places.len() != partition.layout.nodes() {
            self.list_near(partition, conditions, reach);
        }
        self.find(partition, shape, conditions, reach);
        self.exchange::<D>(law, conditions, cell);
    }

    /// Lists the points of the workpiece that reach a node that the tool may reach.
    fn list_near<R: Real, D: Dimension, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        conditions: &Conditions<'_>,
        reach: f64,
    ) {
        let layout = &partition.layout;
        self.places.clear();
        self.places.resize(layout.nodes(), NONE);
        self.nodes.clear();
        self.near.clear();
        // Each of the two reaches the node within a square.
        let distance = 2.0 * std::f64::consts::SQRT_2 * reach + MOTION * layout.cell;
        for (number, chunk) in partition.chunks.iter().enumerate() {
            for (place, block) in chunk.blocks.iter().enumerate() {
                for lane in (0..BLOCK).filter(|&lane| block.is_point(lane)) {
                    if closest(layout, conditions.tool, block, lane).distance < distance {
                        self.near.push([number as u32, place as u32, lane as u32]);
                    }
                }
            }
        }
        self.is_fresh = true;
        self.moved = 0.0;
    }

    /// The nodes near the tool that the workpiece reaches, with the nearest of its points.
    fn find<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        shape: &F,
        conditions: &Conditions<'_>,
        reach: f64,
    ) {
        let NodalContact { tool_points, near, places, nodes, .. } = self;
        for node in nodes.drain(..) {
            places[node.index] = NONE;
        }
        let layout = &partition.layout;
        let tool = conditions.tool;
        let from_tool =
            |axis: usize, cells: f64| layout.origin[axis] + layout.cell * cells - tool.position[axis];
        for &[chunk, block, lane] in near.iter() {
            let block = &partition.chunks[chunk as usize].blocks[block as usize];
            let lane = lane as usize;
            let cells = block.grid_position(lane);
            let point = [from_tool(0, cells[0]), from_tool(1, cells[1])];
            for_each_weight::<R, D, F, S>(block, lane, [0.0; 2], layout, shape, |index, at, weight, _| {
                if weight <= 0.0 {
                    return;
                }
                let place = &mut places[index];
                if *place == NONE {
                    *place = nodes.len() as u32;
                    let position = [from_tool(0, f64::from(at[0])), from_tool(1, f64::from(at[1]))];
                    let closest = tool.shape.closest(position);
                    let (node, start) = assemble::<R, D, S>(partition, conditions, index, at);
                    let is_near = start.is_there && closest.distance < std::f64::consts::SQRT_2 * reach;
                    let front = || tool_points.front(position, closest.normal, reach);
                    nodes.push(SharedNode {
                        index,
                        normal: closest.normal,
                        rake_coordinate: (closest.face == Face::Rake).then_some(closest.along),
                        front: if is_near { front() } else { None },
                        nearest: f64::INFINITY,
                        free: start.free,
                        old: start.old,
                        inverse_mass: [node.inverse_mass[0], node.inverse_mass[1], node.inverse_mass[2]],
                    });
                }
                let node = &mut nodes[*place as usize];
                node.nearest = node.nearest.min(node.normal[0] * point[0] + node.normal[1] * point[1]);
            });
        }
    }

    /// Exchanges momentum at the nodes in contact.
    fn exchange<D: Dimension>(&mut self, law: Contact, conditions: &Conditions<'_>, cell: f64) {
        let NodalImpulses { nodes: changes, friction_heat, sums } = &mut self.touched;
        changes.clear();
        friction_heat.clear();
        *sums = NodeSums::default();
        self.count = 0;
        for node in &self.nodes {
            let Some(front) = node.front else { continue };
            if law == Contact::Distance && node.nearest - front > CLOSE * cell {
                continue;
            }
            // A node that is fixed along all axes cannot be pushed.
            let inverse_mass = node.inverse_mass.into_iter().fold(0.0, f64::max);
            if inverse_mass == 0.0 {
                continue;
            }
            let trial = D::vector(|axis| node.free[axis]);
            let contact = coulomb::<D>(conditions.tool, node.normal, node.rake_coordinate, &trial);
            let Some(mut contact) = contact else { continue };
            for axis in (0..D::AXES).filter(|&axis| node.inverse_mass[axis] == 0.0) {
                contact.velocity[axis] = node.free[axis];
            }
            let old = D::vector(|axis| node.old[axis]);
            let friction = sums.count_node(conditions.tool, 1.0 / inverse_mass, [&trial, &old], &contact);
            if conditions.wants_heat && friction > 0.0 {
                friction_heat.push((node.index, friction));
            }
            let mut change = [0.0; 3];
            for axis in 0..D::AXES {
                change[axis] = contact.velocity[axis] - node.free[axis];
            }
            changes.push((node.index, change));
            self.count += 1;
        }
        changes.sort_unstable_by_key(|change| change.0);
        friction_heat.sort_unstable_by_key(|entry| entry.0);
    }
}
