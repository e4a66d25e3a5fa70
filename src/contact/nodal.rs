//! The paper's own contact laws: `velocity` and `distance`, on nodes that workpiece and tool share.
//!
//! Both bodies are points (`contact::tool_particles`) and map their velocities on the same nodes. Node i is
//! shared where a point of each reaches it, that is, has weight there. The tool is rigid and so heavy that
//! the common velocity v_i of eq. 18 is its own. With n the tool's outward normal at the node:
//!
//! * `velocity` (Bardenhagen): a shared node is in contact where the workpiece's velocity there approaches
//!   the tool, (v_i^b − v_i) · n_i^b > 0 (eq. 18), n^b = −n. It acts up to two cells ahead of the tool.
//! * `distance`: besides, the bodies must be close to each other (eqs. 19 to 22),
//!
//!   D_i = n · d_i^A − n · d_i^B ≤ L/2,
//!
//!   where d points from a body's foremost point to the node: D is how far the workpiece's nearest point is
//!   ahead of the tool's, n · (x_b − x_a), over the points that reach the node. Points half a cell apart
//!   stand a quarter of a cell below their surface, so D = L/2 where surfaces meet. Eq. 20 is printed with
//!   the maximum over the tool's points, which would be the hindmost; the foremost have the minimum.
//!
//! In contact the normal velocity becomes the tool's, which is eq. 23 for a rigid tool at constant speed, and
//! the impulse m (v − v_trial) pushes only; of the sliding Coulomb's law takes away what it can
//! (`contact::coulomb`).
//!
//! n is that of the exact shape: gradients of the tool's mass, which have no direction inside it and turn
//! near its corners, would only blur it.
//!
//! Source: Ambati et al. (2011), eqs. 18 to 23; Bardenhagen et al. (2000), doi:10.1016/S0045-7825(99)00338-2.
//!
//! Form of the effect: an optional pass before points move, as `contact::surface`, on one thread; nothing of
//! it is part of the state.

use crate::checkpoint::{BulkReader, StateBytes};
use crate::contact::contact_law::{BoxedLaw, ContactCost, ContactLaw, ContactStep};
use crate::contact::coulomb::TrialNode;
use crate::contact::nodes::{NOT_LISTED, Place, TouchedNode, assemble, for_each_weight, list_near};
use crate::contact::tool_particles::RigidPoints;
use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::shape_function::ShapeFunction;
use crate::partition::Partition;
use crate::partition::nodes::NodalImpulses;
use crate::points::PointState;
use crate::simd::Real;
use crate::tool::RigidTool;
use std::f64::consts::SQRT_2;

/// The list of near points is made anew when points and tool may have moved this far (cells).
const MOTION: f64 = 1.0;
/// Largest D in contact (cells), eq. 22.
const CLOSE: f64 = 0.5;

/// Contact at shared nodes: working memory only.
#[derive(Clone, Debug)]
pub(super) struct NodalContact {
    /// Largest D in contact (cells).
    most_distance: f64,
    tool_points: RigidPoints,
    /// The points near the tool.
    near: Vec<Place>,
    /// Whether the list serves, and how far points and tool may have moved since it was made (cells).
    is_fresh: bool,
    moved: f64,
    /// By node of the layout: its place in `nodes`, or `NOT_LISTED`.
    places: Vec<u32>,
    nodes: Vec<SharedNode>,
    touched: NodalImpulses,
}

/// A node near the tool that the workpiece reaches.
#[derive(Clone, Copy, Debug)]
struct SharedNode {
    node: TrialNode,
    /// Foremost point of the tool and nearest of the workpiece along the normal (m); no tool, no contact.
    front: Option<f64>,
    nearest: f64,
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>> ContactLaw<R, D, F, S> for NodalContact {
    fn solve(&mut self, partition: &Partition<R, D, S>, shape: &F, contact: &ContactStep<'_, S>) {
        let cell = partition.layout.cell;
        let reach = shape.reach() * cell;
        if !self.tool_points.fit(cell) {
            self.tool_points = RigidPoints::new(&contact.tool.shape, cell);
        }
        if !self.is_fresh || self.moved > MOTION || self.places.len() != partition.layout.nodes() {
            self.list_near(partition, contact, reach);
        }
        self.find(partition, shape, contact, reach);
        self.exchange::<D>(contact.tool, contact.wants_heat, cell);
    }

    fn touched(&self) -> &NodalImpulses {
        &self.touched
    }

    fn cost(&self) -> ContactCost {
        ContactCost { touching: self.touched.nodes.len(), sweeps: 0 }
    }

    fn note_motion(&mut self, cells: f64) {
        self.moved += cells;
    }

    fn note_sort(&mut self) {
        self.is_fresh = false;
    }

    fn save(&self, _: &mut StateBytes) {}

    fn restore(&mut self, _: &mut BulkReader<'_>) -> Result<(), Error> {
        self.is_fresh = false;
        Ok(())
    }

    fn fork(&self) -> BoxedLaw<R, D, F, S> {
        Box::new(self.clone())
    }
}

impl NodalContact {
    /// The law `distance`.
    pub(super) fn distance() -> Self {
        Self::within(CLOSE)
    }

    /// The law `velocity`: bodies may be as far apart as they reach the same node.
    pub(super) fn velocity() -> Self {
        Self::within(f64::INFINITY)
    }

    fn within(most_distance: f64) -> Self {
        NodalContact {
            most_distance,
            tool_points: RigidPoints::default(),
            near: Vec::new(),
            is_fresh: false,
            moved: 0.0,
            places: Vec::new(),
            nodes: Vec::new(),
            touched: NodalImpulses::default(),
        }
    }

    /// Lists the points of the workpiece that reach a node that the tool may reach; `reach` is a point's (m).
    fn list_near<R: Real, D: Dimension, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        contact: &ContactStep<'_, S>,
        reach: f64,
    ) {
        let layout = &partition.layout;
        self.places.clear();
        self.places.resize(layout.nodes(), NOT_LISTED);
        self.nodes.clear();
        self.near.clear();
        // Each of the two reaches the node within a square.
        let most = 2.0 * SQRT_2 * reach + MOTION * layout.cell;
        list_near(partition, contact.tool, most / layout.cell, |place, _, distance| {
            if distance < most {
                self.near.push(place);
            }
        });
        self.is_fresh = true;
        self.moved = 0.0;
    }

    /// The nodes near the tool that the workpiece reaches, with the nearest of its points.
    fn find<R: Real, D: Dimension, F: ShapeFunction<R>, S: PointState<R>>(
        &mut self,
        partition: &Partition<R, D, S>,
        shape: &F,
        contact: &ContactStep<'_, S>,
        reach: f64,
    ) {
        let NodalContact { tool_points, near, places, nodes, .. } = self;
        for shared in nodes.drain(..) {
            places[shared.node.start.index] = NOT_LISTED;
        }
        let layout = &partition.layout;
        let tool = contact.tool;
        let from_tool =
            |axis: usize, cells: f64| layout.origin[axis] + layout.cell * cells - tool.position[axis];
        for &place in near.iter() {
            let (block, lane) = (place.block(partition), place.lane());
            let cells = block.grid_position(lane);
            let point = [from_tool(0, cells[0]), from_tool(1, cells[1])];
            for_each_weight::<R, D, F, S>(block, lane, [0.0; 2], layout, shape, |reached| {
                let TouchedNode { index, at, weight, .. } = reached;
                if weight <= 0.0 {
                    return;
                }
                let place = &mut places[index];
                if *place == NOT_LISTED {
                    *place = nodes.len() as u32;
                    let position = [from_tool(0, f64::from(at[0])), from_tool(1, f64::from(at[1]))];
                    let closest = tool.shape.closest(position);
                    let start = assemble::<R, D, S>(partition, contact.step, index, at);
                    let is_near = start.is_there && closest.distance < SQRT_2 * reach;
                    let front = || tool_points.front(position, closest.normal, reach);
                    nodes.push(SharedNode {
                        node: TrialNode { start, closest },
                        front: if is_near { front() } else { None },
                        nearest: f64::INFINITY,
                    });
                }
                let shared = &mut nodes[*place as usize];
                let normal = shared.node.closest.normal;
                shared.nearest = shared.nearest.min(normal[0] * point[0] + normal[1] * point[1]);
            });
        }
    }

    /// Exchanges momentum at the nodes in contact; `cell` is the cell length (m).
    fn exchange<D: Dimension>(&mut self, tool: &RigidTool, wants_heat: bool, cell: f64) {
        self.touched.clear();
        let most = self.most_distance * cell;
        for SharedNode { node, front, nearest } in &self.nodes {
            if front.is_some_and(|front| nearest - front <= most) {
                node.exchange::<D>(tool, wants_heat, &mut self.touched);
            }
        }
        self.touched.nodes.sort_unstable_by_key(|change| change.node);
        self.touched.friction_heat.sort_unstable_by_key(|entry| entry.0);
    }
}
