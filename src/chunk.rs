//! A run of sorted points with its own copy of the nodes around them: the unit of parallel work.
//!
//! ```text
//!   points, sorted:   │ chunk 0 │ chunk 1 │ chunk 2 │
//!   its nodes:       ├───────────┤
//!                            ├───────────┤            a few pencils of overlap
//!                                      ├───────────┤
//! ```
//!
//! A chunk adds up, on its own nodes, what all chunks deposited there in the last substep, always in the order of
//! the chunks; solves the momentum equation; and moves its points, which deposit into a buffer of its own. It reads
//! only the deposits of the last substep and writes only its own, so a substep needs no lock and one meeting of the
//! threads, and its result does not depend on how many there are. On the overlap neighbours do the same work twice
//! and get the same bits; sums over nodes count those that a chunk owns.

use crate::body_force::BodyForce;
use crate::contact::{Contact, Correction, RigidTool};
use crate::dimension::Dimension;
use crate::grid::{self, FixedNodes, Layout, MARGIN};
use crate::guards::{Bounds, BoundsPass};
use crate::material::ConstitutiveModel;
use crate::points::{Block, PointState};
use crate::shape::ShapeFunction;
use crate::simd::{InstructionSet, Real, dispatch};
use crate::smoothing::Smoothing;
use crate::transfer::{Look, NodeRun, NodesPass, PassSums, PointsPass, Suspect};
use crate::velocity_range::{self, Stray};
use std::ops::Range;
use std::time::{Duration, Instant};

/// What a chunk's nodes add up in one substep, over the nodes it owns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeSums {
    /// ½ Σ m |Δv|² (J); with an affine transfer ½ Σ m Δv·v; with smoothed increments what `smoothing` has.
    pub increment_energy: f64,
    /// Impulse of the tool on the workpiece (N s).
    pub tool_impulse: [f64; 2],
    /// Work of that impulse at the tool's velocity (J).
    pub tool_work: f64,
    /// Friction work (J), at least 0.
    pub friction_work: f64,
    /// ½ Σ m |Δv|² along the directions that contact or a wall prescribes (J): inelastic impact.
    pub contact_loss: f64,
    /// Work of the contact impulses on what is left of the points' approach (J), negative where points are pushed out.
    pub approach_work: f64,
    /// Area of contact, and of the part where friction is below Coulomb's (m2): where strength caps friction (`sticking`).
    pub contact_areas: [f64; 2],
    /// Furthest coordinate of contact along the rake face (m).
    pub contact_reach: f64,
    /// Whether any node is in contact.
    pub touches: bool,
}

impl NodeSums {
    /// Counts the contact of a node of `mass` (kg); returns its friction work (J).
    ///
    /// * `trial`, `old`: its velocity without contact, and before the substep (m/s)
    pub fn count_node<D: Dimension>(
        &mut self,
        tool: &RigidTool,
        mass: f64,
        [trial, old]: [&D::Vector<f64>; 2],
        contact: &Correction<D>,
    ) -> f64 {
        let change = D::vector(|axis| contact.velocity[axis] - old[axis]);
        let impulse = D::vector(|axis| mass * (contact.velocity[axis] - trial[axis]));
        let tool_work = impulse[0] * tool.velocity[0] + impulse[1] * tool.velocity[1];
        // The friction impulse is the tangential part; only it works on the slip.
        let friction = -(0..D::AXES).map(|axis| impulse[axis] * contact.slip[axis]).sum::<f64>();
        self.tool_impulse[0] += impulse[0];
        self.tool_impulse[1] += impulse[1];
        self.tool_work += tool_work;
        self.friction_work += friction;
        self.contact_loss += 0.5 * mass * contact.prescribed_square(&change);
        self.contact_reach = self.contact_reach.max(contact.rake_coordinate.unwrap_or(0.0));
        self.touches = true;
        friction
    }
}

/// What contact changes in a substep, found before the chunks set out (`touching`, `nodal_contact`).
#[derive(Clone, Debug, Default)]
pub struct TouchedNodes {
    /// Index of the node in the layout and its change of velocity (m/s), in rising order.
    pub nodes: Vec<(usize, [f64; 3])>,
    /// Index of the node in the layout and the friction heat of the substep there (J, at least 0), in rising order; it adds
    /// up to the friction work. Empty unless asked for.
    pub friction_heat: Vec<(usize, f64)>,
    /// For the ledger and the outputs.
    pub sums: NodeSums,
}

/// Sums of one chunk in one substep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChunkSums {
    /// Over its nodes.
    pub nodes: NodeSums,
    /// Over its points.
    pub points: PassSums,
    /// What the substep does to the points at most.
    pub bounds: Bounds,
}

/// A fixed node of a chunk.
#[derive(Clone, Copy, Debug)]
struct Fixed {
    index: usize,
    axes: [bool; 3],
}

/// Strays, and points suspected of being some, of a chunk that are found without asking for memory.
const USUAL_STRAYS: usize = 256;
const USUAL_SUSPECTS: usize = 1024;

/// A run of sorted points and the nodes around them.
#[derive(Clone)]
pub struct Chunk<R: Real, D: Dimension, S> {
    /// Its points; only the last block of the last chunk may have empty places.
    pub blocks: Vec<Block<R, D, S>>,
    /// Velocities and increments of its nodes, and their masses.
    nodes: NodeRun<R>,
    /// What smoothing changes, where increments are smoothed.
    smoothing: Smoothing<R>,
    /// Pencils of its nodes.
    pencils: Range<usize>,
    /// The nodes it owns, as indices of the layout.
    owned: Range<usize>,
    fixed: Vec<Fixed>,
    /// Sums of the last substep.
    pub sums: ChunkSums,
    /// What the last pass over its points took, so that the longest can come first; not part of the state.
    pub effort: Duration,
    /// Points whose velocities the last pass had to look at.
    suspects: Vec<Suspect>,
    /// Those found out of bounds.
    pub strays: Vec<Stray>,
}

impl<R: Real, D: Dimension, S> Default for Chunk<R, D, S> {
    fn default() -> Self {
        Chunk {
            blocks: Vec::new(),
            nodes: NodeRun::default(),
            smoothing: Smoothing::default(),
            pencils: 0..0,
            owned: 0..0,
            fixed: Vec::new(),
            sums: ChunkSums::default(),
            effort: Duration::ZERO,
            suspects: Vec::with_capacity(USUAL_SUSPECTS),
            strays: Vec::with_capacity(USUAL_STRAYS),
        }
    }
}

/// What all chunks share in one substep.
pub struct Substep<'a, F, M> {
    /// Arrangement of the nodes.
    pub layout: &'a Layout,
    /// Shape function.
    pub shape: &'a F,
    /// Constitutive model.
    pub model: &'a M,
    /// Contact law.
    pub contact: Contact,
    /// The tool at the start of the substep.
    pub tool: &'a RigidTool,
    /// Nodes lighter than this (kg) stay at rest: nothing but rounding is left there.
    pub lightest: f64,
    /// Steepness of the shape function over the mass of the lightest point (1/kg), see `guards`.
    pub share_per_mass: f64,
    /// What contact changes; nothing under `NodesInside`.
    pub touched: &'a TouchedNodes,
    /// Acceleration of the nodes by a body force, if the scene has one.
    pub body_force: Option<&'a dyn BodyForce>,
    /// Time at the start of the substep (s).
    pub time: f64,
    /// Substep (s).
    pub dt: f64,
    /// Instruction set of the kernels.
    pub instructions: InstructionSet,
}

impl<R: Real, D: Dimension, S: PointState<R>> Chunk<R, D, S> {
    /// Takes the nodes around its points; `first` and `last` are its lowest and highest pencil, `next` the lowest of
    /// the following chunk (or the end), `owned_from` where the ownership of the chunk before ended.
    ///
    /// Returns where its ownership ends.
    pub fn arrange(
        &mut self,
        layout: &Layout,
        (first, last, next): (usize, usize, Option<usize>),
        owned_from: usize,
        fixed: &[FixedNodes],
        deposits: [&mut NodeRun<R>; 2],
    ) -> usize {
        let plane = layout.pencils_per_plane::<D>() as usize;
        let margin = MARGIN as usize;
        // In space a pencil's neighbours reach one plane further and one row to each side.
        let mut reach = margin * plane + if D::AXES == 3 { margin } else { 0 };
        if layout.shares_masses {
            // What smooths a node's increment is one further.
            reach += plane;
        }
        let count = layout.low.len();
        self.pencils = first.saturating_sub(reach)..(last + reach + 1).min(count);
        let nodes = layout.start[self.pencils.start]..layout.start[self.pencils.end];
        for run in deposits.into_iter().chain([&mut self.nodes]) {
            run.reset::<D>(nodes.start, nodes.len(), layout.shares_masses);
        }
        // Own up to the next chunk's first pencil, but no further than the nodes reach.
        let end_pencil = next.map_or(count, |next| next.min(self.pencils.end));
        let end = layout.start[end_pencil].max(owned_from);
        // A chunk without points may stand before what has been given away: it owns nothing, within its nodes.
        let begin = owned_from.clamp(nodes.start, nodes.end);
        self.owned = begin..end.clamp(begin, nodes.end);
        self.fixed.clear();
        for pencil in self.pencils.clone() {
            for boundary in fixed {
                let Some((low, high)) = boundary.on_pencil::<D>(layout, pencil) else { continue };
                let existing = (layout.start[pencil + 1] - layout.start[pencil]) as i32;
                let bottom = layout.low[pencil];
                for along in low.max(bottom)..=high.min(bottom + existing - 1) {
                    let index = (layout.offset[pencil] + along) as usize - nodes.start;
                    self.fixed.push(Fixed { index, axes: boundary.axes });
                }
            }
        }
        end
    }

    /// First half of a substep: the nodes' new velocities from `incoming` deposits, and what they will do to the points.
    ///
    /// It changes no point and can be done again at another length.
    pub fn solve_nodes<F, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        incoming: &[NodeRun<R>],
        common: &Substep<'_, F, M>,
    ) {
        dispatch(
            common.instructions,
            NodesPass::<R, D> {
                nodes: &mut self.nodes,
                incoming,
                lightest: R::from_f64(common.lightest),
                dt: R::from_f64(common.dt),
                dimension: std::marker::PhantomData,
            },
        );
        if let Some(force) = common.body_force {
            self.accelerate(force, common);
        }
        let mut sums = NodeSums::default();
        self.fix_nodes(&mut sums);
        match common.contact {
            Contact::Surface | Contact::Distance | Contact::Velocity => self.take_over(common.touched),
            Contact::NodesInside => self.touch(common, &mut sums),
        }
        let owned = self.owned.start - self.nodes.first..self.owned.end - self.nodes.first;
        let records = &self.nodes.records[owned.start * D::QUADS..owned.end * D::QUADS];
        let mass = &self.nodes.mass[owned];
        sums.increment_energy = if M::State::IS_AFFINE {
            grid::half_work::<R, D>(records, mass)
        } else {
            grid::increment_energy::<R, D>(records, mass)
        };
        if common.layout.shares_masses {
            self.smooth(common, &mut sums);
        }
        self.sums.nodes = sums;
        self.sums.bounds = dispatch(
            common.instructions,
            BoundsPass::<R, D> {
                nodes: &self.nodes,
                layout: common.layout,
                pencils: self.pencils.clone(),
                share_per_mass: common.share_per_mass,
                per_cell: common.dt / common.layout.cell,
                dimension: std::marker::PhantomData,
            },
        );
    }

    /// Second half of a substep: moves the points, which deposit into `outgoing`; with a bound (m/s), notes in `strays` those
    /// whose velocity differs by more from the ones that all nodes around them had in the substep.
    pub fn move_points<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        outgoing: &mut NodeRun<R>,
        common: &Substep<'_, F, M>,
        stray_bound: Option<f64>,
    ) {
        let begin = Instant::now();
        self.sums.points = self.pass_points(outgoing, common, stray_bound);
        self.effort = begin.elapsed();
        self.strays.clear();
        let Some(bound) = stray_bound else { return };
        if common.layout.shares_masses {
            // A point's velocity is judged by those that its increment belongs to.
            self.smoothing.take_back(&mut self.nodes);
        }
        for suspect in self.suspects.drain(..) {
            let block = &self.blocks[suspect.block];
            let nodes = (&self.nodes, common.layout, common.shape);
            let point = (&suspect, &block.places(), &block.velocity);
            self.strays.extend(velocity_range::judge::<R, D, F>(point, nodes, bound));
        }
    }

    /// Moves the points by the nodes' present velocities; with nodes at rest it only deposits.
    fn pass_points<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        outgoing: &mut NodeRun<R>,
        common: &Substep<'_, F, M>,
        stray_bound: Option<f64>,
    ) -> PassSums {
        self.suspects.clear();
        let look = stray_bound.map(|bound| Look { bound, suspects: &mut self.suspects });
        dispatch(
            common.instructions,
            PointsPass {
                blocks: &mut self.blocks,
                nodes: &self.nodes,
                deposit: outgoing,
                layout: common.layout,
                shape: common.shape,
                model: common.model,
                dt: common.dt,
                look,
            },
        )
    }

    /// Deposits mass, momentum and force of points that have just been sorted, without moving them.
    pub fn deposit<F: ShapeFunction<R>, M: ConstitutiveModel<R, D, State = S>>(
        &mut self,
        outgoing: &mut NodeRun<R>,
        common: &Substep<'_, F, M>,
    ) {
        self.nodes.clear();
        let _ = self.pass_points(outgoing, &Substep { dt: 0.0, ..*common }, None);
    }

    /// Adds Δt b to velocity and increment of every node that has mass.
    fn accelerate<F, M>(&mut self, force: &dyn BodyForce, common: &Substep<'_, F, M>) {
        let layout = common.layout;
        for pencil in self.pencils.clone() {
            for index in layout.start[pencil]..layout.start[pencil + 1] {
                let node = index - self.nodes.first;
                if self.nodes.mass[node].to_f64() <= common.lightest {
                    continue;
                }
                let position =
                    layout.position::<D>(pencil, layout.low[pencil] + (index - layout.start[pencil]) as i32);
                let acceleration = force.acceleration(position, common.time);
                let record = &mut self.nodes.records[node * D::QUADS..(node + 1) * D::QUADS];
                let (velocity, gain) = (grid::velocity::<R, D>(record), grid::increment::<R, D>(record));
                let add = D::vector(|axis| common.dt * acceleration[axis]);
                let sum = |old: D::Vector<f64>| D::vector(|axis| old[axis] + add[axis]);
                grid::set_node::<R, D>(record, sum(velocity), sum(gain));
            }
        }
    }

    /// Adds to the nodes what contact changes; its sums are counted where it was found.
    fn take_over(&mut self, changes: &TouchedNodes) {
        let end = self.nodes.first + self.nodes.count::<D>();
        let begin = changes.nodes.partition_point(|change| change.0 < self.nodes.first);
        for &(index, change) in changes.nodes[begin..].iter().take_while(|change| change.0 < end) {
            let node = index - self.nodes.first;
            let record = &mut self.nodes.records[node * D::QUADS..(node + 1) * D::QUADS];
            let (velocity, gain) = (grid::velocity::<R, D>(record), grid::increment::<R, D>(record));
            let sum = |old: D::Vector<f64>| D::vector(|axis| old[axis] + change[axis]);
            grid::set_node::<R, D>(record, sum(velocity), sum(gain));
        }
    }

    /// Lets points move by smoothed increments (`smoothing`).
    fn smooth<F, M>(&mut self, common: &Substep<'_, F, M>, sums: &mut NodeSums) {
        let nodes = (&self.nodes, common.layout, self.pencils.clone());
        self.smoothing.find(nodes, R::from_f64(common.lightest), common.instructions);
        for node in &self.fixed {
            self.smoothing.leave(node.index, node.axes);
        }
        let owned = self.owned.start - self.nodes.first..self.owned.end - self.nodes.first;
        let touched = common.touched.nodes.iter().filter(|(index, _)| self.owned.contains(index));
        let touched = touched.map(|&(index, change)| (index - self.nodes.first, change));
        sums.increment_energy += self.smoothing.half_work(&self.nodes, owned, touched);
        self.smoothing.apply(&mut self.nodes);
    }

    /// Sets fixed components to zero; their reaction does no work, and what their motion held is lost.
    fn fix_nodes(&mut self, sums: &mut NodeSums) {
        for node in &self.fixed {
            let record = &mut self.nodes.records[node.index * D::QUADS..(node.index + 1) * D::QUADS];
            let (trial, change) = (grid::velocity::<R, D>(record), grid::increment::<R, D>(record));
            let velocity = D::vector(|axis| if node.axes[axis] { 0.0 } else { trial[axis] });
            let old = D::vector(|axis| trial[axis] - change[axis]);
            grid::set_node::<R, D>(record, velocity, D::vector(|axis| velocity[axis] - old[axis]));
            if self.owned.contains(&(self.nodes.first + node.index)) {
                let mass = self.nodes.mass[node.index].to_f64();
                let square: f64 =
                    (0..D::AXES).filter(|&axis| node.axes[axis]).map(|axis| old[axis] * old[axis]).sum();
                sums.contact_loss += 0.5 * mass * square;
            }
        }
    }

    /// Contact of the tool with nodes.
    fn touch<F, M>(&mut self, common: &Substep<'_, F, M>, sums: &mut NodeSums) {
        let Substep { layout, tool, .. } = *common;
        let (low, high) = tool.bounds();
        let index = |axis: usize, x: f64| (x - layout.origin[axis]) / layout.cell;
        let plane = layout.pencils_per_plane::<D>() as usize;
        // Only nodes within the tool's box can be inside it.
        let columns =
            index(0, low[0]).ceil().max(0.0) as usize..(index(0, high[0]).floor() + 1.0).max(0.0) as usize;
        let window =
            (columns.start * plane).max(self.pencils.start)..(columns.end * plane).min(self.pencils.end);
        for pencil in window {
            let count = layout.start[pencil + 1] - layout.start[pencil];
            let begin = layout.start[pencil].wrapping_sub(self.nodes.first);
            for k in 0..count {
                let position = layout.position::<D>(pencil, layout.low[pencil] + k as i32);
                if position[1] < low[1] || position[1] > high[1] {
                    continue;
                }
                let node = begin + k;
                let mass = self.nodes.mass[node].to_f64();
                if mass <= common.lightest {
                    continue;
                }
                let record = &mut self.nodes.records[node * D::QUADS..(node + 1) * D::QUADS];
                let trial = grid::velocity::<R, D>(record);
                let Some(contact) = common.contact.correct::<D>(tool, [position[0], position[1]], &trial)
                else {
                    continue;
                };
                let gain = grid::increment::<R, D>(record);
                let old = D::vector(|axis| trial[axis] - gain[axis]);
                let velocity = contact.velocity;
                let change = D::vector(|axis| velocity[axis] - old[axis]);
                grid::set_node::<R, D>(record, velocity, change);
                if self.owned.contains(&(self.nodes.first + node)) {
                    sums.count_node(tool, mass, [&trial, &old], &contact);
                }
            }
        }
    }
}

impl<D: Dimension> Correction<D> {
    /// Square of the velocity change along the directions that contact prescribes: the normal, and all when the node
    /// sticks.
    fn prescribed_square(&self, change: &D::Vector<f64>) -> f64 {
        if self.slip.as_ref().iter().all(|&component| component == 0.0) {
            change.as_ref().iter().map(|component| component * component).sum()
        } else {
            (change[0] * self.normal[0] + change[1] * self.normal[1]).powi(2)
        }
    }
}
