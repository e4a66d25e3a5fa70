//! Impulses at touching points: pushing only, and Coulomb's cone, by projected Gauss–Seidel sweeps.
//!
//! Point p sees the nodes' velocities with its weights, v_p = Σ_i w_ip v_i, and its impulse j_p moves them by
//! Δv_i = w_ip j_p/m_i. A correction brings the point by itself to rest against the tool (or to the speed at
//! which it is to leave), as far as its impulse stays in the cone |j_t| ≤ μ j_n, j_n ≥ 0. Sweeps go over the
//! points in an order that memory gives, and back, so that the result depends on nothing else.
//!
//! Source: Moreau (1999) and Jean (1999), Computer Methods in Applied Mechanics and Engineering 177.

use crate::dimension::Dimension;
use crate::simd::{Kernel, Simd, Vector};

/// Most sweeps of a substep, there and back counted as two.
const MOST_SWEEPS: u32 = 400;
/// Sweeps end when none changes a point's velocity by more than this part of the fastest speed (-); what is
/// left is made good in the next substep, which starts from here (figures in book/src/theory/contact.md).
const TOLERANCE: f64 = 1e-5;
/// Sweeps between two looks at their progress; even, as sweeps there and back differ.
const LOOK: u32 = 10;
/// They end as well where changes are below this part of the fastest speed (-) and fell by less than half
/// since the last look: points that share their nodes pass impulses on to each other without end, of which no
/// velocity feels much.
const STALLED: f64 = 1e-3;

/// A node that a touching point reaches, as the sweeps need it; the fourth entries are zero.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    /// Velocity (m/s).
    pub(super) velocity: [f64; 4],
    /// One over the mass (1/kg), 0 along fixed axes.
    pub(super) inverse_mass: [f64; 4],
}

/// Place of a node in the list, and a point's weight there.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeWeight {
    /// Place of the node in the list.
    pub(super) place: u32,
    /// Weight there (-), carried on to the surface.
    pub(super) weight: f64,
}

/// A touching point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ContactPoint {
    /// Its place among those near.
    pub(super) near: u32,
    /// Its nodes, in the list of all points' nodes.
    pub(super) first: u32,
    /// Where they end.
    pub(super) end: u32,
    /// Unit normal out of the tool.
    pub(super) normal: [f64; 3],
    /// Impulse of the tool on the point (N s).
    pub(super) impulse: [f64; 3],
    /// Speed at which it is to leave the tool (m/s).
    pub(super) leaving: f64,
    /// Velocity per impulse (1/kg).
    pub(super) compliance: f64,
    /// Its inverse (kg).
    pub(super) inertia: f64,
    /// Coordinate along the rake face (m), 0 elsewhere.
    pub(super) rake_coordinate: f64,
    /// Coefficient of friction (-): the scene's, or less where `contact::sticking` caps it.
    pub(super) friction: f64,
}

/// Sweeps over the touching points until their velocities settle; a kernel, as a deep tool has thousands of
/// them.
pub(super) struct GaussSeidel<'a> {
    /// The points.
    pub(super) touches: &'a mut [ContactPoint],
    /// What their `first` and `end` refer to.
    pub(super) reached: &'a [NodeWeight],
    /// What `place` refers to.
    pub(super) nodes: &'a mut [Node],
    /// Velocity of the tool (m/s).
    pub(super) tool: [f64; 3],
    /// Called before each sweep.
    pub(super) prepare: &'a mut dyn FnMut(&mut [ContactPoint]),
}

impl Kernel<f64> for GaussSeidel<'_> {
    /// How many sweeps it took.
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd<Scalar = f64>>(self) -> u32 {
        let GaussSeidel { touches, reached, nodes, tool, prepare } = self;
        let mut fastest = tool.into_iter().fold(1e-300, |most: f64, v| most.max(v.abs()));
        for node in &*nodes {
            for v in node.velocity {
                fastest = fastest.max(v.abs());
            }
        }
        let tool = padded::<S>(tool);
        let mut before = f64::MAX;
        for count in 1..=MOST_SWEEPS {
            prepare(touches);
            let mut largest = 0.0_f64;
            for place in 0..touches.len() {
                let place = if count % 2 == 1 { place } else { touches.len() - 1 - place };
                // Neighbours share their nodes, so that a correction would wait for the one before: every
                // other is half way off.
                let place = place / 2 + place % 2 * touches.len().div_ceil(2);
                largest = largest.max(correct::<S>(&mut touches[place], reached, nodes, tool));
            }
            let looks = count % LOOK == 0;
            let is_stalled = looks && largest <= STALLED * fastest && largest > 0.5 * before;
            if largest <= TOLERANCE * fastest || is_stalled {
                return count;
            }
            if looks {
                before = largest;
            }
        }
        MOST_SWEEPS
    }
}

/// Three components and a zero.
#[inline(always)]
fn padded<S: Simd<Scalar = f64>>(v: [f64; 3]) -> S::Quad {
    S::Quad::load(&[v[0], v[1], v[2], 0.0])
}

/// Corrects a point's impulse; returns by how much that changed its velocity (m/s).
#[inline(always)]
fn correct<S: Simd<Scalar = f64>>(
    touch: &mut ContactPoint,
    reached: &[NodeWeight],
    nodes: &mut [Node],
    tool: S::Quad,
) -> f64 {
    let mut velocity = S::Quad::constant(0.0);
    for &NodeWeight { place, weight } in touch.nodes(reached) {
        let v = S::Quad::load(&nodes[place as usize].velocity);
        velocity = S::Quad::splat(weight).mul_add(v, velocity);
    }
    let (normal, old) = (padded::<S>(touch.normal), padded::<S>(touch.impulse));
    let missing = S::Quad::splat(touch.leaving).mul_add(normal, tool - velocity);
    let mut wanted = [0.0; 4];
    missing.mul_add(S::Quad::splat(touch.inertia), old).store(&mut wanted);
    let impulse = in_cone([wanted[0], wanted[1], wanted[2]], touch.normal, touch.friction);
    if impulse == touch.impulse {
        return 0.0;
    }
    let change = padded::<S>(impulse) - old;
    touch.impulse = impulse;
    for &NodeWeight { place, weight } in touch.nodes(reached) {
        let Node { velocity, inverse_mass } = &mut nodes[place as usize];
        let carried = S::Quad::splat(weight) * S::Quad::load(inverse_mass);
        carried.mul_add(change, S::Quad::load(velocity)).store(velocity);
    }
    let mut size = [0.0; 4];
    change.abs().store(&mut size);
    touch.compliance * size[0].max(size[1]).max(size[2])
}

impl ContactPoint {
    /// Its nodes in the list of all.
    #[inline(always)]
    pub(super) fn nodes<'a>(&self, reached: &'a [NodeWeight]) -> &'a [NodeWeight] {
        &reached[self.first as usize..self.end as usize]
    }

    /// Normal impulse (N s).
    #[inline(always)]
    pub(super) fn push_along_normal(&self) -> f64 {
        (0..3).map(|k| self.impulse[k] * self.normal[k]).sum()
    }

    /// Size of the impulse along the surface (N s).
    pub(super) fn drag(&self) -> f64 {
        let push = self.push_along_normal();
        (0..3).map(|k| (self.impulse[k] - push * self.normal[k]).powi(2)).sum::<f64>().sqrt()
    }

    /// Velocity at the tool's surface (m/s) from the nodes' velocities, which `of` gives by place.
    pub(super) fn velocity<D: Dimension>(
        &self,
        reached: &[NodeWeight],
        of: impl Fn(usize) -> [f64; 3],
    ) -> [f64; 3] {
        let mut velocity = [0.0; 3];
        for &NodeWeight { place, weight } in self.nodes(reached) {
            let v = of(place as usize);
            for axis in 0..D::AXES {
                velocity[axis] += weight * v[axis];
            }
        }
        velocity
    }

    /// Adds to the point's impulse (N s).
    #[inline(always)]
    pub(super) fn push<D: Dimension>(
        &mut self,
        change: [f64; 3],
        reached: &[NodeWeight],
        nodes: &mut [Node],
    ) {
        for axis in 0..D::AXES {
            self.impulse[axis] += change[axis];
        }
        for &NodeWeight { place, weight } in self.nodes(reached) {
            let node = &mut nodes[place as usize];
            for axis in 0..D::AXES {
                node.velocity[axis] += weight * change[axis] * node.inverse_mass[axis];
            }
        }
    }
}

/// The impulse nearest to `wanted` that pushes along `normal` and keeps Coulomb's law.
#[inline(always)]
fn in_cone(wanted: [f64; 3], normal: [f64; 3], friction: f64) -> [f64; 3] {
    let push = wanted[0] * normal[0] + wanted[1] * normal[1] + wanted[2] * normal[2];
    let drag = [wanted[0] - push * normal[0], wanted[1] - push * normal[1], wanted[2] - push * normal[2]];
    let push = push.max(0.0);
    let size = (drag[0] * drag[0] + drag[1] * drag[1] + drag[2] * drag[2]).sqrt();
    let kept = if size > friction * push { friction * push / size } else { 1.0 };
    [push * normal[0] + kept * drag[0], push * normal[1] + kept * drag[1], push * normal[2] + kept * drag[2]]
}

/// The impulse to begin with: the last substep's force, if it still lies in the cone's directions.
pub(super) fn warm_start(force: [f64; 3], normal: [f64; 3], friction: f64, dt: f64) -> [f64; 3] {
    let impulse = in_cone(force.map(|f| f * dt), normal, friction);
    if impulse.iter().all(|j| j.is_finite()) { impulse } else { [0.0; 3] }
}
