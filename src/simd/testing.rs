//! Vectors as the unit tests of kernels need them: the plainest ones, and what is in their first lane.

use super::{Portable, Real, Simd, Vector};

/// Double precision on any processor.
pub(crate) type Double = <Portable<f64> as Simd>::Lanes;

/// Single precision on any processor.
pub(crate) type Single = <Portable<f32> as Simd>::Lanes;

/// The number in the first lane.
pub(crate) fn first<V: Vector>(v: V) -> f64 {
    let mut lanes = [V::Scalar::ZERO; 8];
    v.store(&mut lanes);
    lanes[0].to_f64()
}
