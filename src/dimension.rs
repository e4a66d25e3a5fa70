//! Plane strain and three dimensions: small arrays and the kinematics of one substep, written once for both.
//!
//! A symmetric tensor is stored as its diagonal xx, yy, zz and then its shear components: xy in plane strain;
//! yz, xz, xy in three dimensions. A deviator leaves out zz = −xx − yy.
//!
//! The kinematics are those of Hughes and Winget (1980): with the increment h = Δt ∇v of the displacement
//! gradient, the gradient with respect to the midpoint configuration is g = h (I + h/2)⁻¹; its symmetric part
//! is the strain increment and its skew part ω gives the rotation Q = (I − ω/2)⁻¹ (I + ω/2). A pure rotation
//! h = R − I of any size gives no strain and Q = R exactly, so stress turns with the material without drift.

use crate::simd::{Vector as Lanes, inlined};
use std::fmt::Debug;
use std::ops::IndexMut;

/// A short array whose length depends on the dimension.
pub trait Short<T>:
    IndexMut<usize, Output = T> + AsRef<[T]> + AsMut<[T]> + Copy + Send + Sync + Debug
{
}
impl<T: Copy + Send + Sync + Debug, const N: usize> Short<T> for [T; N] {}

/// What a value must be to stand in a `Short`.
pub trait Item: Copy + Send + Sync + Debug {}
impl<T: Copy + Send + Sync + Debug> Item for T {}

/// Strain and rotation of one substep.
#[derive(Clone, Copy, Debug)]
pub struct Increment<D: Dimension, V: Item> {
    /// det(I + h), the factor on the volume (-).
    pub volume_ratio: V,
    /// Deviator of the strain increment (-), without zz.
    pub deviatoric_strain: D::Deviator<V>,
    /// The rotation, as `Dimension::rotate` takes it.
    pub rotation: D::Rotation<V>,
}

/// Plane strain or three dimensions.
pub trait Dimension: Copy + Send + Sync + Debug + 'static {
    /// Number of axes.
    const AXES: usize;
    /// Independent components of a symmetric tensor.
    const COMPONENTS: usize;
    /// Components of a stored deviator.
    const DEVIATOR: usize;
    /// Pencils (lines of nodes along the last axis) that a point touches: three per other axis.
    const PENCILS: usize;
    /// Groups of four numbers in a node's record (velocity and its increment).
    const QUADS: usize;

    /// One entry per axis.
    type Vector<T: Item>: Short<T>;
    /// One entry per pair of axes, row by row.
    type Matrix<T: Item>: Short<Self::Vector<T>>;
    /// A symmetric tensor.
    type Symmetric<T: Item>: Short<T>;
    /// A deviatoric symmetric tensor without zz.
    type Deviator<T: Item>: Short<T>;
    /// One entry per pencil that a point touches.
    type Pencils<T: Item>: Short<T>;
    /// One entry per group of four numbers in a node's record.
    type Quads<T: Item>: Short<T>;
    /// A rotation, in the form that turns a deviator at the least cost.
    type Rotation<T: Item>: Copy + Debug;

    /// The vector with entries f(axis).
    fn vector<T: Item>(f: impl FnMut(usize) -> T) -> Self::Vector<T>;
    /// The matrix with entries f(row, column).
    fn matrix<T: Item>(f: impl FnMut(usize, usize) -> T) -> Self::Matrix<T>;
    /// The symmetric tensor with components f(index).
    fn symmetric<T: Item>(f: impl FnMut(usize) -> T) -> Self::Symmetric<T>;
    /// The deviator with components f(index).
    fn deviator<T: Item>(f: impl FnMut(usize) -> T) -> Self::Deviator<T>;

    /// `Pencils` of equal entries.
    fn pencils<T: Item>(entry: T) -> Self::Pencils<T>;
    /// `Quads` of equal entries.
    fn quads<T: Item>(entry: T) -> Self::Quads<T>;

    /// Strain and rotation of a substep from h = Δt ∇v, h\[row\]\[column\] = Δt ∂v_row/∂x_column (-).
    ///
    /// Source: Hughes and Winget (1980), doi:10.1002/nme.1620151210.
    fn increment<V: Lanes>(h: &Self::Matrix<V>) -> Increment<Self, V>;

    /// Q s Qᵀ of a deviator s.
    fn rotate<V: Lanes>(rotation: &Self::Rotation<V>, s: Self::Deviator<V>) -> Self::Deviator<V>;

    /// s : s of a deviator, zz included.
    fn double_contraction<V: Lanes>(s: &Self::Deviator<V>) -> V;

    /// The full tensor s + mean I.
    fn with_mean<V: Lanes>(s: &Self::Deviator<V>, mean: V) -> Self::Symmetric<V>;

    /// Component of a symmetric tensor at (row, column), both below `AXES`.
    fn component<T: Item>(tensor: &Self::Symmetric<T>, row: usize, column: usize) -> T;
}

/// Two axes; nothing moves across the plane.
#[derive(Clone, Copy, Debug)]
pub struct PlaneStrain;

/// Three axes.
#[derive(Clone, Copy, Debug)]
pub struct ThreeDimensional;

impl Dimension for PlaneStrain {
    const AXES: usize = 2;
    const COMPONENTS: usize = 4;
    const DEVIATOR: usize = 3;
    const PENCILS: usize = 3;
    const QUADS: usize = 1;

    type Vector<T: Item> = [T; 2];
    type Matrix<T: Item> = [[T; 2]; 2];
    type Symmetric<T: Item> = [T; 4];
    type Deviator<T: Item> = [T; 3];
    type Pencils<T: Item> = [T; 3];
    type Quads<T: Item> = [T; 1];
    /// Cosine and sine of twice the angle, because a plane deviator turns by it.
    type Rotation<T: Item> = [T; 2];

    #[inline(always)]
    fn vector<T: Item>(mut f: impl FnMut(usize) -> T) -> [T; 2] {
        [f(0), f(1)]
    }

    #[inline(always)]
    fn matrix<T: Item>(mut f: impl FnMut(usize, usize) -> T) -> [[T; 2]; 2] {
        [[f(0, 0), f(0, 1)], [f(1, 0), f(1, 1)]]
    }

    #[inline(always)]
    fn symmetric<T: Item>(mut f: impl FnMut(usize) -> T) -> [T; 4] {
        [f(0), f(1), f(2), f(3)]
    }

    #[inline(always)]
    fn deviator<T: Item>(mut f: impl FnMut(usize) -> T) -> [T; 3] {
        [f(0), f(1), f(2)]
    }

    #[inline(always)]
    fn pencils<T: Item>(entry: T) -> [T; 3] {
        [entry; 3]
    }

    #[inline(always)]
    fn quads<T: Item>(entry: T) -> [T; 1] {
        [entry; 1]
    }

    #[inline(always)]
    fn increment<V: Lanes>(h: &[[V; 2]; 2]) -> Increment<Self, V> {
        let one = V::constant(1.0);
        let half = V::constant(0.5);
        let [[xx, xy], [yx, yy]] = *h;
        let trace = xx + yy;
        let det_h = xx * yy - xy * yx;
        // det(I + h/2), and g = h (I + h/2)⁻¹ = (h + det(h)/2 I) / det(I + h/2) in two dimensions.
        let quarter_det = V::constant(0.25) * det_h;
        let det = half.mul_add(trace, one) + quarter_det;
        let inverse = one / det;
        let g_xx = (xx + half * det_h) * inverse;
        let g_yy = (yy + half * det_h) * inverse;
        let shear = half * (xy + yx) * inverse;
        let mean = (g_xx + g_yy) * V::constant(1.0 / 3.0);
        // tan(θ/2) = spin/2 = t/det; cos 2θ and sin 2θ from it without trigonometry, and without waiting for
        // the other division.
        let t = V::constant(0.25) * (yx - xy);
        let (t_square, det_square) = (t * t, det * det);
        let norm = one / (det_square + t_square);
        let cos = (det_square - t_square) * norm;
        let sin = (t + t) * det * norm;
        let cos2 = cos * cos - sin * sin;
        let sin2 = (sin + sin) * cos;
        Increment {
            volume_ratio: one + trace + det_h,
            deviatoric_strain: [g_xx - mean, g_yy - mean, shear],
            rotation: [cos2, sin2],
        }
    }

    #[inline(always)]
    fn rotate<V: Lanes>(rotation: &[V; 2], s: [V; 3]) -> [V; 3] {
        let [cos2, sin2] = *rotation;
        let half = V::constant(0.5);
        let middle = half * (s[0] + s[1]);
        let difference = half * (s[0] - s[1]);
        let turned = difference * cos2 - s[2] * sin2;
        [middle + turned, middle - turned, difference * sin2 + s[2] * cos2]
    }

    #[inline(always)]
    fn double_contraction<V: Lanes>(s: &[V; 3]) -> V {
        // xx² + yy² + (xx + yy)² + 2 xy²
        let two = V::constant(2.0);
        two * s[0].mul_add(s[0], s[1].mul_add(s[1], s[0].mul_add(s[1], s[2] * s[2])))
    }

    #[inline(always)]
    fn with_mean<V: Lanes>(s: &[V; 3], mean: V) -> [V; 4] {
        [s[0] + mean, s[1] + mean, mean - s[0] - s[1], s[2]]
    }

    #[inline(always)]
    fn component<T: Item>(tensor: &[T; 4], row: usize, column: usize) -> T {
        if row == column { tensor[row] } else { tensor[3] }
    }
}

impl Dimension for ThreeDimensional {
    const AXES: usize = 3;
    const COMPONENTS: usize = 6;
    const DEVIATOR: usize = 5;
    const PENCILS: usize = 9;
    const QUADS: usize = 2;

    type Vector<T: Item> = [T; 3];
    type Matrix<T: Item> = [[T; 3]; 3];
    type Symmetric<T: Item> = [T; 6];
    type Deviator<T: Item> = [T; 5];
    type Pencils<T: Item> = [T; 9];
    type Quads<T: Item> = [T; 2];
    /// The rotation matrix.
    type Rotation<T: Item> = [[T; 3]; 3];

    #[inline(always)]
    fn vector<T: Item>(mut f: impl FnMut(usize) -> T) -> [T; 3] {
        [f(0), f(1), f(2)]
    }

    #[inline(always)]
    fn matrix<T: Item>(mut f: impl FnMut(usize, usize) -> T) -> [[T; 3]; 3] {
        [[f(0, 0), f(0, 1), f(0, 2)], [f(1, 0), f(1, 1), f(1, 2)], [f(2, 0), f(2, 1), f(2, 2)]]
    }

    #[inline(always)]
    fn symmetric<T: Item>(mut f: impl FnMut(usize) -> T) -> [T; 6] {
        [f(0), f(1), f(2), f(3), f(4), f(5)]
    }

    #[inline(always)]
    fn deviator<T: Item>(mut f: impl FnMut(usize) -> T) -> [T; 5] {
        [f(0), f(1), f(2), f(3), f(4)]
    }

    #[inline(always)]
    fn pencils<T: Item>(entry: T) -> [T; 9] {
        [entry; 9]
    }

    #[inline(always)]
    fn quads<T: Item>(entry: T) -> [T; 2] {
        [entry; 2]
    }

    #[inline(always)]
    fn increment<V: Lanes>(h: &[[V; 3]; 3]) -> Increment<Self, V> {
        let one = V::constant(1.0);
        let half = V::constant(0.5);
        let a =
            inlined!(Self::matrix, |i, j| if i == j { half.mul_add(h[i][j], one) } else { half * h[i][j] });
        let adjugate = adjugate(&a);
        let det_a = a[0][0] * adjugate[0][0] + a[0][1] * adjugate[1][0] + a[0][2] * adjugate[2][0];
        let inverse = one / det_a;
        let g = inlined!(Self::matrix, |i, j| {
            (h[i][0] * adjugate[0][j] + h[i][1] * adjugate[1][j] + h[i][2] * adjugate[2][j]) * inverse
        });
        let mean = (g[0][0] + g[1][1] + g[2][2]) * V::constant(1.0 / 3.0);
        // Cayley transform: Q = I + (W + W²/2) / (1 + |w|²/4), W the skew matrix of the vector w.
        let w = [half * (g[2][1] - g[1][2]), half * (g[0][2] - g[2][0]), half * (g[1][0] - g[0][1])];
        let square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        let scale = one / V::constant(0.25).mul_add(square, one);
        let skew = [
            [V::constant(0.0), -w[2], w[1]],
            [w[2], V::constant(0.0), -w[0]],
            [-w[1], w[0], V::constant(0.0)],
        ];
        let rotation = inlined!(Self::matrix, |i, j| {
            let product = half * (w[i] * w[j] - if i == j { square } else { V::constant(0.0) });
            let unit = if i == j { one } else { V::constant(0.0) };
            (skew[i][j] + product).mul_add(scale, unit)
        });
        let b = inlined!(Self::matrix, |i, j| if i == j { h[i][j] + one } else { h[i][j] });
        let volume_ratio = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1])
            - b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0])
            + b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
        Increment {
            volume_ratio,
            deviatoric_strain: [
                g[0][0] - mean,
                g[1][1] - mean,
                half * (g[1][2] + g[2][1]),
                half * (g[0][2] + g[2][0]),
                half * (g[0][1] + g[1][0]),
            ],
            rotation,
        }
    }

    #[inline(always)]
    fn rotate<V: Lanes>(q: &[[V; 3]; 3], s: [V; 5]) -> [V; 5] {
        let full = [[s[0], s[4], s[3]], [s[4], s[1], s[2]], [s[3], s[2], -s[0] - s[1]]];
        let qs =
            inlined!(Self::matrix, |i, j| q[i][0] * full[0][j] + q[i][1] * full[1][j] + q[i][2] * full[2][j]);
        let entry = |i: usize, j: usize| qs[i][0] * q[j][0] + qs[i][1] * q[j][1] + qs[i][2] * q[j][2];
        [entry(0, 0), entry(1, 1), entry(1, 2), entry(0, 2), entry(0, 1)]
    }

    #[inline(always)]
    fn double_contraction<V: Lanes>(s: &[V; 5]) -> V {
        let two = V::constant(2.0);
        let diagonal = s[0].mul_add(s[0], s[1].mul_add(s[1], s[0] * s[1]));
        two * (diagonal + s[2].mul_add(s[2], s[3].mul_add(s[3], s[4] * s[4])))
    }

    #[inline(always)]
    fn with_mean<V: Lanes>(s: &[V; 5], mean: V) -> [V; 6] {
        [s[0] + mean, s[1] + mean, mean - s[0] - s[1], s[2], s[3], s[4]]
    }

    #[inline(always)]
    fn component<T: Item>(tensor: &[T; 6], row: usize, column: usize) -> T {
        if row == column { tensor[row] } else { tensor[6 - row - column] }
    }
}

/// Adjugate of a 3 × 3 matrix: a⁻¹ det a.
#[inline(always)]
fn adjugate<V: Lanes>(a: &[[V; 3]; 3]) -> [[V; 3]; 3] {
    let minor = |i: usize, j: usize, k: usize, l: usize| a[i][k] * a[j][l] - a[i][l] * a[j][k];
    [
        [minor(1, 2, 1, 2), minor(0, 2, 2, 1), minor(0, 1, 1, 2)],
        [minor(1, 2, 2, 0), minor(0, 2, 0, 2), minor(0, 1, 2, 0)],
        [minor(1, 2, 0, 1), minor(0, 2, 1, 0), minor(0, 1, 0, 1)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::testing::{Double as V, first};
    use nalgebra::{Matrix3, Rotation3, Vector3};

    /// An oblique displacement gradient of some size; without its z entries for the plane.
    fn gradient(size: f64, axes: usize) -> Matrix3<f64> {
        let full = Matrix3::new(0.3, -0.7, 0.2, 0.5, -0.4, 0.6, -0.1, 0.8, 0.25) * size;
        Matrix3::from_fn(|i, j| if i < axes && j < axes { full[(i, j)] } else { 0.0 })
    }

    /// Strain and rotation of Hughes and Winget as the paper writes them, with general matrix inverses.
    fn written_out(h: &Matrix3<f64>) -> (f64, Matrix3<f64>, Matrix3<f64>) {
        let unit = Matrix3::identity();
        let g = h * (unit + h * 0.5).try_inverse().expect("a moderate increment");
        let strain = (g + g.transpose()) * 0.5;
        let spin = (g - g.transpose()) * 0.5;
        let rotation = (unit - spin * 0.5).try_inverse().expect("skew") * (unit + spin * 0.5);
        ((unit + h).determinant(), strain - unit * (strain.trace() / 3.0), rotation)
    }

    fn compare<D: Dimension>(size: f64) {
        let h = gradient(size, D::AXES);
        let increment = D::increment(&D::matrix(|i, j| V::splat(h[(i, j)])));
        let (ratio, strain, rotation) = written_out(&h);
        // Some dozen roundings of numbers up to one.
        let bound = 64.0 * f64::EPSILON;
        assert!((first(increment.volume_ratio) - ratio).abs() < bound, "det = {ratio} at {size}");
        let deviator = D::with_mean(&increment.deviatoric_strain, V::constant(0.0));
        let s = D::deviator(|k| V::splat([0.3, -0.8, 0.5, 0.2, -0.6][k]));
        let turned = D::with_mean(&D::rotate(&increment.rotation, s), V::constant(0.0));
        let s = D::with_mean(&s, V::constant(0.0));
        let full = |tensor: &D::Symmetric<V>| {
            Matrix3::from_fn(|i, j| {
                let inside = i < D::AXES && j < D::AXES;
                let zz = tensor[2];
                if inside {
                    first(D::component(tensor, i, j))
                } else if i == j {
                    first(zz)
                } else {
                    0.0
                }
            })
        };
        let error = (full(&deviator) - strain).abs().max();
        assert!(error < bound, "strain is off by {error} at {size}");
        let error = (full(&turned) - rotation * full(&s) * rotation.transpose()).abs().max();
        assert!(error < bound, "the turned deviator is off by {error} at {size}");
        let square = first(D::double_contraction(&D::deviator(|k| V::splat([0.3, -0.8, 0.5, 0.2, -0.6][k]))));
        let exact = full(&s).norm_squared();
        assert!((square - exact).abs() < bound, "s : s = {square}, written out {exact}");
    }

    /// The forms without matrix inverses are the paper's formulas, in the plane and in space, for any size of
    /// substep.
    #[test]
    fn kinematics_are_those_of_hughes_and_winget() {
        for size in [0.0, 1e-9, 1e-4, 1e-2, 0.3, 1.0] {
            compare::<PlaneStrain>(size);
            compare::<ThreeDimensional>(size);
        }
    }

    /// A rotation of any size is neither strain nor change of volume, and turns a deviator by itself.
    #[test]
    fn a_pure_rotation_strains_nothing() {
        for degrees in [1.0_f64, 30.0, 90.0, 150.0] {
            let r = Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians()).into_inner();
            let h = r - Matrix3::identity();
            let flat = PlaneStrain::increment(&PlaneStrain::matrix(|i, j| V::splat(h[(i, j)])));
            let deep = ThreeDimensional::increment(&ThreeDimensional::matrix(|i, j| V::splat(h[(i, j)])));
            let strains = flat.deviatoric_strain.iter().chain(&deep.deviatoric_strain);
            let largest = strains.map(|&e| first(e).abs()).fold(0.0, f64::max);
            // I + R is nearly singular near half a turn: 1/cos² of half the angle times ε.
            let bound = 8.0 * f64::EPSILON / (0.5 * degrees.to_radians()).cos().powi(2);
            assert!(largest < bound, "strain {largest} of a rotation by {degrees} degrees, bound {bound}");
            assert!(
                (first(flat.volume_ratio) - 1.0).abs() < bound
                    && (first(deep.volume_ratio) - 1.0).abs() < bound
            );
            let turned = first(PlaneStrain::rotate(&flat.rotation, [1.0, -1.0, 0.0].map(V::constant))[0]);
            let exact = (2.0 * degrees.to_radians()).cos();
            assert!((turned - exact).abs() < 4.0 * bound, "xx = {turned}, exact {exact}");
        }
    }
}
