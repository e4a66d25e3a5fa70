//! Bounds on a substep, checked before a point moves.
//!
//! The bounds are taken from the nodes' new velocities, between the momentum equation and the points, so a
//! substep that breaks one has changed nothing yet: it is solved again at half its length, at most
//! `MOST_RETRIES` times, and each time is counted. With the node's velocity v, a point's weight w there and
//! its slope g (times the cell length h),
//!
//! * travel: |Σ w v| Δt/h along each axis;
//! * volume: |tr ∇v| Δt = |Σ g·v| Δt/h.
//!
//! A node near which no point stands may be fast (force falls with the first power of a point's reach, mass
//! with the second) without any point feeling it. A point of mass m gives the node at least w m, so w ≤ M/m
//! of the node's mass M, and g² ≤ `ShapeFunction::steepness` w: velocities and their differences between
//! neighbours count with the root of min(1, steepness M/m). This makes the bounds estimates of what the
//! fastest point can do, up to a small factor for several such nodes side by side; travel is checked once
//! more, exactly, when the points have moved.
//!
//! Form of the effect: one short loop over the nodes; that over their differences runs only where speeds
//! could add up to the bound.

use crate::dimension::Dimension;
use crate::error::Error;
use crate::grid::{Layout, Record};
use crate::simd::{Kernel, Real, Simd};
use crate::transfer::{NodeRun, TRAVEL_LIMIT};
use crate::variables::time_text;
use std::ops::Range;

/// Most by which a point's volume may change in one substep (-).
pub const VOLUME_LIMIT: f64 = 0.1;
/// Halvings of one substep before the run gives up.
pub const MOST_RETRIES: u32 = 8;
/// Speed over that of sound beyond which a point is lost to an instability (-).
const FASTEST: f64 = 5.0;

/// What a substep would do to the points at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Motion along an axis (cells).
    pub travel: f64,
    /// Change of volume over volume (-).
    pub volume: f64,
}

impl Bounds {
    /// The larger of each.
    #[must_use]
    pub fn max(self, other: Bounds) -> Bounds {
        Bounds { travel: self.travel.max(other.travel), volume: self.volume.max(other.volume) }
    }

    /// Whether points may move so.
    pub fn hold(&self) -> bool {
        self.travel <= TRAVEL_LIMIT && self.volume <= VOLUME_LIMIT
    }

    /// The error of a run whose substep broke a bound at each of its lengths.
    ///
    /// * `clock`: time at its start (s); `dt`: the shortest length tried (s)
    pub fn given_up(&self, clock: f64, dt: f64) -> Error {
        Error::Unstable(format!(
            "the run became unstable at t = {}: even in a substep of {}, halved {MOST_RETRIES} times, a \
             point would move {:.3} cells (at most {TRAVEL_LIMIT}) or change its volume by {:.1} % (at most {:.0} %); lower \
             numerics.courant or tool_velocity, and check the material's constants",
            time_text(clock),
            time_text(dt),
            self.travel,
            100.0 * self.volume,
            100.0 * VOLUME_LIMIT
        ))
    }
}

/// Bounds of a substep on the nodes of one chunk.
pub struct BoundsPass<'a, R, D> {
    /// New velocities and masses.
    pub nodes: &'a NodeRun<R>,
    /// Arrangement of the nodes.
    pub layout: &'a Layout,
    /// Pencils of the nodes.
    pub pencils: Range<usize>,
    /// Steepness of the shape function over the mass of the lightest point (1/kg).
    pub share_per_mass: f64,
    /// Substep over cell length (s/m).
    pub per_cell: f64,
    /// The dimension.
    pub dimension: std::marker::PhantomData<D>,
}

impl<R: Real, D: Dimension> Kernel<R> for BoundsPass<'_, R, D> {
    type Output = Bounds;

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) -> Bounds {
        let share = R::from_f64(self.share_per_mass);
        let speeds = fastest::<R, D>(&self.nodes.records, &self.nodes.mass[..self.nodes.count::<D>()], share);
        let speeds: [f64; 3] =
            std::array::from_fn(|axis| if axis < D::AXES { speeds[axis].to_f64().sqrt() } else { 0.0 });
        let travel = self.per_cell * speeds.into_iter().fold(0.0, f64::max);
        // Neighbours differ by at most twice the largest speed.
        let crude = 2.0 * self.per_cell * speeds.iter().sum::<f64>();
        let volume = if crude > VOLUME_LIMIT { self.per_cell * self.divergence() } else { crude };
        Bounds { travel, volume }
    }
}

/// By component: largest square of a node's velocity times its share (m2/s2).
#[inline(always)]
fn fastest<R: Real, D: Dimension>(records: &[Record<R>], mass: &[R], share_per_mass: R) -> [R; 4] {
    let mut most = [R::ZERO; 4];
    for (node, &m) in records.chunks_exact(D::QUADS).zip(mass) {
        let share = smaller(m * share_per_mass, R::ONE);
        for (most, v) in most.iter_mut().zip(node[0].0) {
            let square = share * v * v;
            *most = if square > *most { square } else { *most };
        }
    }
    most
}

#[inline(always)]
fn smaller<R: Real>(a: R, b: R) -> R {
    if a < b { a } else { b }
}

impl<R: Real, D: Dimension> BoundsPass<'_, R, D> {
    /// Sum over the axes of the largest difference, between neighbours along an axis, of the velocity along
    /// it (m/s).
    #[inline(always)]
    fn divergence(&self) -> f64 {
        let BoundsPass { nodes, layout, pencils, .. } = self;
        let share = R::from_f64(self.share_per_mass);
        let mut most = [R::ZERO; 3];
        for pencil in pencils.clone() {
            let count = layout.start[pencil + 1] - layout.start[pencil];
            let begin = layout.start[pencil] - nodes.first;
            for axis in 0..D::AXES {
                let stride = match D::AXES - 1 - axis {
                    0 => {
                        let pairs = count.saturating_sub(1);
                        most[axis] =
                            larger(most[axis], self.difference(axis, begin, begin + 1, pairs, share));
                        continue;
                    }
                    1 => 1,
                    _ => layout.pencils_per_plane::<D>() as usize,
                };
                let other = pencil + stride;
                if other >= pencils.end {
                    continue;
                }
                // Nodes that both pencils have.
                let range = |pencil: usize| {
                    let low = layout.low[pencil];
                    (low, low + (layout.start[pencil + 1] - layout.start[pencil]) as i32)
                };
                let (own, next) = (range(pencil), range(other));
                let (low, high) = (own.0.max(next.0), own.1.min(next.1));
                if low < high {
                    let at = |pencil: usize| (layout.offset[pencil] + low) as usize - nodes.first;
                    let pairs = (high - low) as usize;
                    most[axis] =
                        larger(most[axis], self.difference(axis, at(pencil), at(other), pairs, share));
                }
            }
        }
        most[..D::AXES].iter().map(|square| square.to_f64().sqrt()).sum()
    }

    /// Largest square of the difference of a velocity component over `pairs` nodes from `a` and from `b` on,
    /// times their smaller share (m2/s2).
    #[inline(always)]
    fn difference(&self, component: usize, a: usize, b: usize, pairs: usize, share_per_mass: R) -> R {
        let (records, mass) = (&self.nodes.records, &self.nodes.mass);
        let mut most = R::ZERO;
        for k in 0..pairs {
            let change = records[(b + k) * D::QUADS].0[component] - records[(a + k) * D::QUADS].0[component];
            let share = smaller(smaller(mass[a + k], mass[b + k]) * share_per_mass, R::ONE);
            most = larger(most, share * change * change);
        }
        most
    }
}

#[inline(always)]
fn larger<R: Real>(a: R, b: R) -> R {
    if b > a { b } else { a }
}

/// How far points moved in a substep.
#[derive(Clone, Copy, Debug)]
pub struct StepMotion {
    /// Time at the substep's start (s).
    pub clock: f64,
    /// Its length (s).
    pub dt: f64,
    /// Largest motion along an axis (cells).
    pub travel: f64,
    /// Cell length (m).
    pub cell: f64,
}

/// Checks what the points did in a substep of `dt` (s) that began at `clock` (s).
///
/// * `sound`: speed of sound (m/s)
/// * `is_finite`: whether all sums are
///
/// # Errors
/// `Error::Unstable` when a point moved too far, flies far faster than sound, or a value is not finite.
pub fn check_motion(motion: &StepMotion, sound: f64, is_finite: bool) -> Result<(), Error> {
    let StepMotion { clock, dt, travel, cell } = *motion;
    if travel > TRAVEL_LIMIT || !is_finite {
        return Err(Error::Unstable(format!(
            "the run became unstable at t = {}: a point moved {travel:.3} cells in one substep of {} (at most \
             {TRAVEL_LIMIT} is allowed), or a value is no finite number; lower numerics.courant or tool_velocity",
            time_text(clock),
            time_text(dt)
        )));
    }
    let fastest = travel * cell / dt;
    if fastest > FASTEST * sound {
        // Substeps would shrink with its speed and never come to an end.
        return Err(Error::Unstable(format!(
            "the run became unstable at t = {}: a point flies at {fastest:.3e} m/s, more than {FASTEST} times \
             the speed of sound ({sound:.3e} m/s)",
            time_text(clock)
        )));
    }
    Ok(())
}
