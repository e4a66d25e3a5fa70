//! What an affine velocity field (`transfer::apic`) adds to a pass: first moments of the velocity, in the
//! plane.
//!
//! Moments about a point follow from those about its nearest node, and go back the same way; with k = −1, 0,
//! 1 along an axis
//!
//! Σ w_k (k − d) v_k = Σ w_k k v_k − d Σ w_k v_k,
//! m (v + B D⁻¹ (k − d)) = m (v − B D⁻¹ d) + k m B D⁻¹.
//!
//! Both sums have the form of a gradient with w k in the place of slopes. Gradients and forces in the plane
//! fill half of a record; moments take the other half, and their coefficients stand beside the slopes:
//!
//! ```text
//!  stage 2   [  slope    slope     w k      w k   ] × [ vx  vy  vx  vy ]  →  [ ∂vx  ∂vy  Mx  My ]
//!  stage 4   [   w k      w k     slope    slope  ] × [  m B D⁻¹   |   force  ]  →  [ momentum | force ]
//! ```
//!
//! So stages 2 and 4 add up as much as without.

use super::to_grid::ToGrid;
use super::to_points::ToPoints;
use crate::dimension::Dimension;
use crate::grid::shape_function::ShapeFunction;
use crate::points::{Block, PointState};
use crate::simd::{Kernel, Real, Simd, Vector};

/// Stages 1 and 2, or stage 4, for points with an affine field.
pub(super) struct Affine<T>(pub T);

impl<R: Real, D: Dimension, F: ShapeFunction<R>> Kernel<R> for Affine<ToPoints<'_, R, D, F>> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        self.0.gather_block::<S, true>();
    }
}

impl<R: Real, D: Dimension, F: ShapeFunction<R>> Kernel<R> for Affine<ToGrid<'_, R, D, F>> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd<Scalar = R>>(self) {
        self.0.scatter_block::<S, true>();
    }
}

/// Keeps the moments of points `lane..` along one axis, from those about their nearest nodes.
///
/// * `from_node`: d before the points moved
/// * `velocity`: the grid's at the points
#[inline(always)]
pub(super) fn keep<V: Vector, D: Dimension, T: PointState<V::Scalar>>(
    block: &mut Block<V::Scalar, D, T>,
    lane: usize,
    axis: usize,
    from_node: V,
    velocity: [V; 4],
    about_node: [V; 2],
) {
    for row in 0..2 {
        let about_point = (-from_node).mul_add(velocity[row], about_node[row]);
        about_point.store(&mut block.state.moments_mut()[2 * row + axis][lane..]);
    }
}

/// What points `lane..` with a mass give to the nodes around their new places: m B D⁻¹ by axis, and the
/// momentum m (v − B D⁻¹ d).
#[inline(always)]
pub(super) fn give<V: Vector, D: Dimension, F: ShapeFunction<V::Scalar>, T: PointState<V::Scalar>>(
    shape: &F,
    block: &Block<V::Scalar, D, T>,
    lane: usize,
    mass: V,
) -> ([[V; 2]; 2], [V; 4]) {
    let zero = V::constant(0.0);
    let mut rates = [[zero; 2]; 2];
    let mut momentum = [zero; 4];
    for row in 0..2 {
        momentum[row] = mass * V::load(&block.velocity[row][lane..]);
    }
    for axis in 0..2 {
        let d = V::load(&block.offset[axis][lane..]);
        let [left, _, right] = shape.stencil(d).weights;
        // D = Σ w_k (k − d)² = w₋ + w₊ − d², since Σ w_k k = d. With GIMP it lies between a/2 and 1/4.
        let scale = mass / (-d).mul_add(d, left + right);
        for row in 0..2 {
            rates[axis][row] = scale * V::load(&block.state.moments()[2 * row + axis][lane..]);
            momentum[row] = (-d).mul_add(rates[axis][row], momentum[row]);
        }
    }
    (rates, momentum)
}
