//! Impulses at touching points: pushing only, and Coulomb's cone, by projected Gauss–Seidel sweeps.
//!
//! Point p sees the nodes' velocities with its weights, v_p = Σ_i w_ip v_i, and its impulse j_p moves them by
//! Δv_i = w_ip j_p/m_i. A correction brings the point by itself to rest against the tool (or to the speed at which it is to
//! leave), as far as its impulse stays in the cone |j_t| ≤ μ j_n, j_n ≥ 0. Sweeps go over the points in the order of memory
//! and back, so that the result depends on nothing else.
//!
//! Source: Moreau (1999) and Jean (1999), Computer Methods in Applied Mechanics and Engineering 177.

use crate::dimension::Dimension;

/// Most sweeps of a substep, there and back counted as two.
const MOST_SWEEPS: u32 = 400;
/// Sweeps end when none changes a point's velocity by more than this part of the fastest speed (-); what is left is made
/// good in the next substep, which starts from here (figures in docs/contact.md).
const TOLERANCE: f64 = 1e-5;

/// A node that a touching point reaches, as the sweeps need it.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Velocity (m/s).
    pub velocity: [f64; 3],
    /// One over the mass (1/kg), 0 along fixed axes.
    pub inverse_mass: [f64; 3],
}

/// Place of a node in the list, and a point's weight there.
#[derive(Clone, Copy, Debug)]
pub struct Reached {
    /// Place of the node in the list.
    pub place: u32,
    /// Weight there (-), carried on to the surface.
    pub weight: f64,
}

/// A touching point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Touch {
    /// Its place among those near.
    pub near: u32,
    /// Its nodes, in the list of all points' nodes.
    pub first: u32,
    /// Where they end.
    pub end: u32,
    /// Unit normal out of the tool.
    pub normal: [f64; 3],
    /// Impulse of the tool on the point (N s).
    pub impulse: [f64; 3],
    /// Speed at which it is to leave the tool (m/s).
    pub leaving: f64,
    /// Velocity per impulse (1/kg).
    pub compliance: f64,
    /// Its inverse (kg).
    pub inertia: f64,
    /// Coordinate along the rake face (m), 0 elsewhere.
    pub rake_coordinate: f64,
    /// Coefficient of friction (-): the scene's, or less where `sticking` caps it.
    pub friction: f64,
}

/// Sweeps over the touching points until their velocities settle; returns how many it took.
///
/// * `reached`, `nodes`: what the points' `first`, `end` and `place` refer to
/// * `tool`: velocity (m/s)
/// * `prepare`: called before each sweep
pub fn sweep<D: Dimension>(
    touches: &mut [Touch],
    reached: &[Reached],
    nodes: &mut [Node],
    tool: [f64; 3],
    mut prepare: impl FnMut(&mut [Touch]),
) -> u32 {
    let fastest = nodes
        .iter()
        .flat_map(|node| node.velocity)
        .chain(tool)
        .fold(1e-300, |most: f64, v| most.max(v.abs()));
    for count in 1..=MOST_SWEEPS {
        prepare(touches);
        let mut largest = 0.0_f64;
        let mut correct = |touch: &mut Touch| {
            largest = largest.max(touch.correct::<D>(reached, nodes, tool));
        };
        if count % 2 == 1 {
            touches.iter_mut().for_each(&mut correct);
        } else {
            touches.iter_mut().rev().for_each(&mut correct);
        }
        if largest <= TOLERANCE * fastest {
            return count;
        }
    }
    MOST_SWEEPS
}

impl Touch {
    /// Its nodes in the list of all.
    pub fn nodes<'a>(&self, reached: &'a [Reached]) -> &'a [Reached] {
        &reached[self.first as usize..self.end as usize]
    }

    /// Normal impulse (N s).
    #[inline(always)]
    pub fn push_along_normal(&self) -> f64 {
        (0..3).map(|k| self.impulse[k] * self.normal[k]).sum()
    }

    /// Size of the impulse along the surface (N s).
    pub fn drag(&self) -> f64 {
        let push = self.push_along_normal();
        (0..3).map(|k| (self.impulse[k] - push * self.normal[k]).powi(2)).sum::<f64>().sqrt()
    }

    /// Velocity at the tool's surface (m/s) from the nodes' velocities, which `of` gives by place.
    #[inline(always)]
    pub fn velocity<D: Dimension>(&self, reached: &[Reached], of: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let mut velocity = [0.0; 3];
        for &Reached { place, weight } in self.nodes(reached) {
            let v = of(place as usize);
            for axis in 0..D::AXES {
                velocity[axis] += weight * v[axis];
            }
        }
        velocity
    }

    /// Adds to the point's impulse (N s).
    #[inline(always)]
    pub fn push<D: Dimension>(&mut self, change: [f64; 3], reached: &[Reached], nodes: &mut [Node]) {
        for axis in 0..D::AXES {
            self.impulse[axis] += change[axis];
        }
        for &Reached { place, weight } in self.nodes(reached) {
            let node = &mut nodes[place as usize];
            for axis in 0..D::AXES {
                node.velocity[axis] += weight * change[axis] * node.inverse_mass[axis];
            }
        }
    }

    /// Corrects the point's impulse; returns by how much that changed its velocity (m/s).
    #[inline(always)]
    fn correct<D: Dimension>(&mut self, reached: &[Reached], nodes: &mut [Node], tool: [f64; 3]) -> f64 {
        let velocity = self.velocity::<D>(reached, |place| nodes[place].velocity);
        let wanted: [f64; 3] = std::array::from_fn(|axis| {
            let missing = self.leaving * self.normal[axis] + tool[axis] - velocity[axis];
            self.impulse[axis] + missing * self.inertia
        });
        let impulse = in_cone(wanted, self.normal, self.friction);
        let change: [f64; 3] = std::array::from_fn(|axis| impulse[axis] - self.impulse[axis]);
        if change == [0.0; 3] {
            return 0.0;
        }
        self.push::<D>(change, reached, nodes);
        self.impulse = impulse;
        self.compliance * change.iter().fold(0.0_f64, |most, j| most.max(j.abs()))
    }
}

/// The impulse nearest to `wanted` that pushes along `normal` and keeps Coulomb's law.
#[inline(always)]
fn in_cone(wanted: [f64; 3], normal: [f64; 3], friction: f64) -> [f64; 3] {
    let push = (0..3).map(|k| wanted[k] * normal[k]).sum::<f64>();
    let drag: [f64; 3] = std::array::from_fn(|k| wanted[k] - push * normal[k]);
    let push = push.max(0.0);
    let size = drag.iter().map(|j| j * j).sum::<f64>().sqrt();
    let kept = if size > friction * push { friction * push / size } else { 1.0 };
    std::array::from_fn(|k| push * normal[k] + kept * drag[k])
}

/// The impulse to begin with: the last substep's force, if it still lies in the cone's directions.
pub fn warm_start(force: [f64; 3], normal: [f64; 3], friction: f64, dt: f64) -> [f64; 3] {
    let impulse = in_cone(force.map(|f| f * dt), normal, friction);
    if impulse.iter().all(|j| j.is_finite()) { impulse } else { [0.0; 3] }
}
