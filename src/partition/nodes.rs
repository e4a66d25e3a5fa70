//! The nodes around a chunk's points, and what a substep does to them.
//!
//! In two halves, between which the threads meet:
//!
//! 1. what all chunks have deposited is added up, the momentum equation solved, body forces and walls
//!    applied. Contact needs the same deposits and nothing of this, so it is solved on one thread while the
//!    others are here;
//! 2. what contact changes is added, increments are smoothed where the scene wants it, and the substep is
//!    judged by what it will do to the points.

use crate::dimension::Dimension;
use crate::grid::body_force::BodyForce;
use crate::grid::{self, FixedNodes, Layout, MARGIN};
use crate::partition::smoothing::Smoothing;
use crate::partition::step_bounds::{Bounds, BoundsPass};
use crate::simd::{InstructionSet, Real, dispatch};
use crate::transfer::{NodeRun, NodesPass};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// A fixed node of a chunk.
#[derive(Clone, Copy, Debug)]
struct Fixed {
    index: usize,
    axes: [bool; 3],
}

/// Areas of contact (m2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactAreas {
    /// All of it.
    pub all: f64,
    /// The part where friction is below Coulomb's.
    pub sticking: f64,
}

/// What a chunk's nodes add up in one substep, over the nodes it owns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeSums {
    /// ½ Σ m |Δv|² (J); with an affine transfer ½ Σ m Δv·v; with smoothed increments what
    /// `partition::smoothing` has.
    pub increment_energy: f64,
    /// Impulse of the tool on the workpiece (N s).
    pub tool_impulse: [f64; 2],
    /// Work of that impulse at the tool's velocity (J).
    pub tool_work: f64,
    /// Friction work (J), at least 0.
    pub friction_work: f64,
    /// ½ Σ m |Δv|² along the directions that contact or a wall prescribes (J): inelastic impact.
    pub contact_loss: f64,
    /// Work of the contact impulses on what is left of the points' approach (J), negative where points are
    /// pushed out.
    pub approach_work: f64,
    /// Areas of contact, where strength caps friction.
    pub contact_areas: ContactAreas,
    /// Furthest coordinate of contact along the rake face (m).
    pub contact_reach: f64,
    /// Whether any node is in contact.
    pub touches: bool,
}

/// What contact does to a node.
#[derive(Clone, Copy, Debug)]
pub struct VelocityChange {
    /// Index of the node in the layout.
    pub node: usize,
    /// Its change of velocity (m/s).
    pub change: [f64; 3],
}

/// What contact changes in a substep, found beside the first half of it.
#[derive(Clone, Debug, Default)]
pub struct NodalImpulses {
    /// The nodes that contact moves, in rising order.
    pub nodes: Vec<VelocityChange>,
    /// Index of the node in the layout and the friction heat of the substep there (J, at least 0), in rising
    /// order; it adds up to the friction work. Empty unless asked for.
    pub friction_heat: Vec<(usize, f64)>,
    /// For the ledger and the outputs.
    pub sums: NodeSums,
}

impl NodalImpulses {
    /// Forgets all, but not its memory.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.friction_heat.clear();
        self.sums = NodeSums::default();
    }
}

/// The nodes around a chunk's points.
#[derive(Clone, Default)]
pub struct ChunkNodes<R> {
    /// Their velocities and increments, and their masses.
    pub run: NodeRun<R>,
    /// What smoothing changes, where increments are smoothed.
    smoothing: Smoothing<R>,
    /// Their pencils.
    pencils: Range<usize>,
    /// Those that the chunk owns, as indices of the layout.
    owned: Range<usize>,
    fixed: Vec<Fixed>,
    /// Sums over the owned nodes in the last substep.
    pub sums: NodeSums,
    /// What the last substep does to the points at most.
    pub bounds: Bounds,
}

/// What points, nodes and contact share in one substep, beside the arrangement of the nodes.
#[derive(Clone)]
pub struct StepContext {
    /// Time at the start of the substep (s).
    pub time: f64,
    /// Substep (s).
    pub dt: f64,
    /// Nodes lighter than this (kg) stay at rest: nothing but rounding is left there.
    pub lightest: f64,
    /// Steepness of the shape function over the mass of the lightest point (1/kg), see
    /// `partition::step_bounds`.
    pub share_per_mass: f64,
    /// Acceleration of the nodes by a body force, if the scene has one.
    pub body_force: Option<Arc<dyn BodyForce>>,
    /// Whether points hold an affine velocity field (APIC).
    pub is_affine: bool,
    /// Motion of the grid in the substep (cells).
    pub drift: [f64; 3],
    /// Instruction set of the kernels.
    pub instructions: InstructionSet,
}

/// Where a chunk stands among the pencils.
#[derive(Clone, Copy, Debug)]
pub struct ChunkPencils {
    /// Lowest pencil of its points.
    pub first: usize,
    /// Highest pencil of its points.
    pub last: usize,
    /// Lowest pencil of the following chunk that has points, if there is one.
    pub next: Option<usize>,
}

impl<R: Real> ChunkNodes<R> {
    /// Takes the nodes around a chunk's points; `owned_from` is where the ownership of the chunk before
    /// ended.
    ///
    /// Returns where its ownership ends.
    pub fn arrange<D: Dimension>(
        &mut self,
        layout: &Layout,
        place: ChunkPencils,
        owned_from: usize,
        fixed: &[FixedNodes],
        deposits: [&mut NodeRun<R>; 2],
    ) -> usize {
        let ChunkPencils { first, last, next } = place;
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
        for run in deposits.into_iter().chain([&mut self.run]) {
            run.reset::<D>(nodes.start, nodes.len(), layout.shares_masses);
        }
        // Own up to the next chunk's first pencil, but no further than the nodes reach.
        let end_pencil = next.map_or(count, |next| next.min(self.pencils.end));
        let end = layout.start[end_pencil].max(owned_from);
        // A chunk without points may stand before what has been given away: it owns nothing, within its
        // nodes.
        let begin = owned_from.clamp(nodes.start, nodes.end);
        self.owned = begin..end.clamp(begin, nodes.end);
        self.list_fixed::<D>(layout, fixed);
        // There may be more when the grid has moved under the walls.
        self.fixed.reserve(self.fixed.len() / 2 + 256);
        end
    }

    /// The nodes it owns, as indices of the layout.
    pub fn owned(&self) -> Range<usize> {
        self.owned.clone()
    }

    /// Lists the fixed nodes among its own.
    pub fn list_fixed<D: Dimension>(&mut self, layout: &Layout, fixed: &[FixedNodes]) {
        self.fixed.clear();
        for pencil in self.pencils.clone() {
            for boundary in fixed {
                let Some((low, high)) = boundary.on_pencil::<D>(layout, pencil) else { continue };
                let existing = (layout.start[pencil + 1] - layout.start[pencil]) as i32;
                let bottom = layout.low[pencil];
                for along in low.max(bottom)..=high.min(bottom + existing - 1) {
                    let index = (layout.offset[pencil] + along) as usize - self.run.first;
                    self.fixed.push(Fixed { index, axes: boundary.axes });
                }
            }
        }
    }

    /// First half of a substep, up to contact: the nodes' new velocities from `incoming` deposits.
    ///
    /// It changes no point and can be done again at another length.
    pub fn update_nodes<D: Dimension>(
        &mut self,
        layout: &Layout,
        incoming: &[NodeRun<R>],
        step: &StepContext,
    ) {
        dispatch(
            step.instructions,
            NodesPass::<R, D> {
                nodes: &mut self.run,
                incoming,
                lightest: R::from_f64(step.lightest),
                dt: R::from_f64(step.dt),
                dimension: std::marker::PhantomData,
            },
        );
        if let Some(force) = &step.body_force {
            self.accelerate::<D>(force.as_ref(), layout, step);
        }
        self.sums = NodeSums::default();
        self.fix::<D>();
    }

    /// Second half: what contact has `touched`, smoothing, and what the nodes will do to the points.
    pub fn apply_contact<D: Dimension>(
        &mut self,
        layout: &Layout,
        touched: &NodalImpulses,
        step: &StepContext,
    ) {
        self.apply_nodal_impulses::<D>(touched);
        let owned = self.owned.start - self.run.first..self.owned.end - self.run.first;
        let records = &self.run.records[owned.start * D::QUADS..owned.end * D::QUADS];
        let mass = &self.run.mass[owned];
        self.sums.increment_energy = if step.is_affine {
            grid::half_work::<R, D>(records, mass)
        } else {
            grid::increment_energy::<R, D>(records, mass)
        };
        if layout.shares_masses {
            self.smooth(layout, touched, step);
        }
        self.bounds = dispatch(
            step.instructions,
            BoundsPass::<R, D> {
                nodes: &self.run,
                layout,
                pencils: self.pencils.clone(),
                share_per_mass: step.share_per_mass,
                per_cell: step.dt / layout.cell,
                dimension: std::marker::PhantomData,
            },
        );
    }

    /// Gives the nodes the velocities back that their increments belong to, where those that move the points
    /// are smoothed.
    pub fn take_smoothing_back(&mut self, layout: &Layout) {
        if layout.shares_masses {
            self.smoothing.take_back(&mut self.run);
        }
    }

    /// Adds Δt b to velocity and increment of every node that has mass.
    fn accelerate<D: Dimension>(&mut self, force: &dyn BodyForce, layout: &Layout, step: &StepContext) {
        for pencil in self.pencils.clone() {
            for index in layout.start[pencil]..layout.start[pencil + 1] {
                let node = index - self.run.first;
                if self.run.mass[node].to_f64() <= step.lightest {
                    continue;
                }
                let position =
                    layout.position::<D>(pencil, layout.low[pencil] + (index - layout.start[pencil]) as i32);
                let acceleration = force.acceleration(position, step.time);
                let record = &mut self.run.records[node * D::QUADS..(node + 1) * D::QUADS];
                let (velocity, gain) = (grid::velocity::<R, D>(record), grid::increment::<R, D>(record));
                let add = D::vector(|axis| step.dt * acceleration[axis]);
                let sum = |old: D::Vector<f64>| D::vector(|axis| old[axis] + add[axis]);
                grid::set_node::<R, D>(record, sum(velocity), sum(gain));
            }
        }
    }

    /// Adds to the nodes what contact changes; its sums are counted where it was found.
    fn apply_nodal_impulses<D: Dimension>(&mut self, changes: &NodalImpulses) {
        let end = self.run.first + self.run.count::<D>();
        let begin = changes.nodes.partition_point(|change| change.node < self.run.first);
        let own = changes.nodes[begin..].iter().take_while(|change| change.node < end);
        for &VelocityChange { node, change } in own {
            let node = node - self.run.first;
            let record = &mut self.run.records[node * D::QUADS..(node + 1) * D::QUADS];
            let (velocity, gain) = (grid::velocity::<R, D>(record), grid::increment::<R, D>(record));
            let sum = |old: D::Vector<f64>| D::vector(|axis| old[axis] + change[axis]);
            grid::set_node::<R, D>(record, sum(velocity), sum(gain));
        }
    }

    /// Lets points move by smoothed increments (`partition::smoothing`).
    fn smooth(&mut self, layout: &Layout, touched: &NodalImpulses, step: &StepContext) {
        let nodes = (&self.run, layout, self.pencils.clone());
        self.smoothing.find(nodes, R::from_f64(step.lightest), step.instructions);
        for node in &self.fixed {
            self.smoothing.leave(node.index, node.axes);
        }
        let owned = self.owned.start - self.run.first..self.owned.end - self.run.first;
        let touched = touched.nodes.iter().filter(|touched| self.owned.contains(&touched.node));
        let touched = touched.map(|touched| (touched.node - self.run.first, touched.change));
        self.sums.increment_energy += self.smoothing.half_work(&self.run, owned, touched);
        self.smoothing.apply(&mut self.run);
    }

    /// Sets fixed components to zero; their reaction does no work, and what their motion held is lost.
    fn fix<D: Dimension>(&mut self) {
        for node in &self.fixed {
            let record = &mut self.run.records[node.index * D::QUADS..(node.index + 1) * D::QUADS];
            let (trial, change) = (grid::velocity::<R, D>(record), grid::increment::<R, D>(record));
            let velocity = D::vector(|axis| if node.axes[axis] { 0.0 } else { trial[axis] });
            let old = D::vector(|axis| trial[axis] - change[axis]);
            grid::set_node::<R, D>(record, velocity, D::vector(|axis| velocity[axis] - old[axis]));
            if self.owned.contains(&(self.run.first + node.index)) {
                let mass = self.run.mass[node.index].to_f64();
                let square: f64 =
                    (0..D::AXES).filter(|&axis| node.axes[axis]).map(|axis| old[axis] * old[axis]).sum();
                self.sums.contact_loss += 0.5 * mass * square;
            }
        }
    }
}
