//! Shape functions between points and grid nodes, along one axis.
//!
//! A point touches the three nodes around its nearest one. Weights and slopes depend only on the offset d of
//! the point from that node, in cells, −½ ≤ d ≤ ½:
//!
//! ```text
//!        w₋        w₀        w₊            d = 0.2
//!    ────●─────────●──x──────●────
//!       −1         0         1
//! ```
//!
//! Both shape functions come in this form, because the linear one simply gives the far node no weight.

use crate::simd::{Real, Vector as Lanes};

/// Weights and slopes of the three nodes along one axis.
#[derive(Clone, Copy, Debug)]
pub struct Stencil<V> {
    /// Weights of the nodes at −1, 0 and 1 (-).
    pub weights: [V; 3],
    /// Their derivatives with respect to d (-), that is, times the cell length.
    pub slopes: [V; 3],
}

/// A shape function.
pub trait ShapeFunction<R: Real>: Copy + Send + Sync + 'static {
    /// Weights and slopes at the offset `d` (-) from the nearest node, in [−½, ½].
    fn stencil<V: Lanes<Scalar = R>>(&self, d: V) -> Stencil<V>;

    /// Square of the slope over the weight where a point only just reaches a node (-): how much a node that
    /// has next to no mass can matter to a point's velocity gradient (`partition::step_bounds`).
    fn steepness(&self) -> f64;

    /// How far along each axis a point reaches (cells): a node that is closer has weight.
    fn reach(&self) -> f64;
}

/// Bilinear or trilinear: the paper's eq. 4 in the cell's own coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

impl<R: Real> ShapeFunction<R> for Linear {
    #[inline(always)]
    fn stencil<V: Lanes<Scalar = R>>(&self, d: V) -> Stencil<V> {
        let zero = V::constant(0.0);
        let one = V::constant(1.0);
        let right = d.max(zero);
        let left = (-d).max(zero);
        let slope_right = V::select(d.ge(zero), one, zero);
        let slope_left = slope_right - one;
        Stencil {
            weights: [left, one - left - right, right],
            slopes: [slope_left, -slope_left - slope_right, slope_right],
        }
    }

    /// The slope is 1 at any weight: without bound, as far as any mass can tell.
    fn steepness(&self) -> f64 {
        1e30
    }

    fn reach(&self) -> f64 {
        1.0
    }
}

/// Uniform GIMP: each point is a square of fixed size, the paper's eqs. 13 and 14 for two points per cell
/// edge.
///
/// With a the half width of a point over the cell length and t = clamp(d, −a, a), the node at +1 has
/// w₊ = (a + t)²/(4a) + max(d − a, 0), the node at −1 the same of −d, and the nearest node the rest. For a =
/// ¼ this is the paper's Φ(1 − d): (5 − 4r)²/16 at r = 1 − d is (¼ + d)².
///
/// Source: Bardenhagen and Kober (2004), eq. 40.
#[derive(Clone, Copy, Debug)]
pub struct Gimp<R> {
    half_width: R,
    inverse_four_a: R,
}

impl<R: Real> Gimp<R> {
    /// For `points_per_cell_edge` points along a cell's edge at the start.
    pub fn new(points_per_cell_edge: i32) -> Self {
        let half_width = 0.5 / f64::from(points_per_cell_edge);
        Gimp { half_width: R::from_f64(half_width), inverse_four_a: R::from_f64(0.25 / half_width) }
    }
}

impl<R: Real> ShapeFunction<R> for Gimp<R> {
    #[inline(always)]
    fn stencil<V: Lanes<Scalar = R>>(&self, d: V) -> Stencil<V> {
        let zero = V::constant(0.0);
        let a = V::splat(self.half_width);
        let scale = V::splat(self.inverse_four_a);
        let t = d.max(-a).min(a);
        let plus = a + t;
        let minus = a - t;
        let right = (plus * plus).mul_add(scale, (d - a).max(zero));
        let left = (minus * minus).mul_add(scale, (-a - d).max(zero));
        let slope_right = (plus + plus) * scale;
        let slope_left = -(minus + minus) * scale;
        Stencil {
            weights: [left, V::constant(1.0) - left - right, right],
            slopes: [slope_left, -slope_left - slope_right, slope_right],
        }
    }

    /// ((a + t)/(2a))² over (a + t)²/(4a) is 1/a.
    fn steepness(&self) -> f64 {
        4.0 * self.inverse_four_a.to_f64()
    }

    fn reach(&self) -> f64 {
        1.0 + self.half_width.to_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::testing::{Double as V, first};

    fn at<S: ShapeFunction<f64>>(shape: &S, d: f64) -> ([f64; 3], [f64; 3]) {
        let stencil = shape.stencil(V::splat(d));
        (stencil.weights.map(first), stencil.slopes.map(first))
    }

    /// The paper's Φ(r), eq. 14, written as it is printed.
    fn printed_phi(r: f64) -> f64 {
        let r = r.abs();
        if r <= 0.25 {
            (7.0 - 16.0 * r * r) / 8.0
        } else if r <= 0.75 {
            1.0 - r
        } else if r <= 1.25 {
            (5.0 - 4.0 * r).powi(2) / 16.0
        } else {
            0.0
        }
    }

    /// The branch-free form must be the paper's function everywhere in a cell.
    #[test]
    fn gimp_equals_the_printed_formula() {
        let gimp = Gimp::<f64>::new(2);
        for step in -500..=500 {
            let d = f64::from(step) / 1000.0;
            let (weights, _) = at(&gimp, d);
            for (k, node) in [-1.0, 0.0, 1.0].into_iter().enumerate() {
                let printed = printed_phi(d - node);
                // A few roundings of numbers below one.
                assert!(
                    (weights[k] - printed).abs() <= 4.0 * f64::EPSILON,
                    "{} != {printed} at d = {d}",
                    weights[k]
                );
            }
        }
    }

    /// Mass and position are carried over exactly: weights sum to one, slopes to zero, Σ w x = x.
    #[test]
    fn weights_reproduce_constants_and_positions() {
        fn check<S: ShapeFunction<f64>>(shape: &S) {
            for step in -500..=500 {
                let d = f64::from(step) / 1000.0;
                let (w, g) = at(shape, d);
                assert!((w.iter().sum::<f64>() - 1.0).abs() <= 4.0 * f64::EPSILON, "weights {w:?} at {d}");
                assert!(g.iter().sum::<f64>().abs() <= 4.0 * f64::EPSILON, "slopes {g:?} at {d}");
                assert!((w[2] - w[0] - d).abs() <= 4.0 * f64::EPSILON, "first moment {} at {d}", w[2] - w[0]);
                assert!(
                    (g[2] - g[0] - 1.0).abs() <= 4.0 * f64::EPSILON,
                    "slope of position {} at {d}",
                    g[2] - g[0]
                );
            }
        }
        check(&Linear);
        for edge in 1..=4 {
            check(&Gimp::<f64>::new(edge));
        }
    }

    /// Slopes are the derivatives of the weights; the linear function is excluded at its kink d = 0.
    #[test]
    fn slopes_match_central_differences() {
        let gimp = Gimp::<f64>::new(2);
        let eps = 1e-6;
        for step in -499..=499 {
            let d = f64::from(step) / 1000.0 + 3e-4;
            for shape_is_gimp in [true, false] {
                let f = |x: f64| if shape_is_gimp { at(&gimp, x) } else { at(&Linear, x) };
                let (right, left, slopes) = (f(d + eps).0, f(d - eps).0, f(d).1);
                for k in 0..3 {
                    let difference = (right[k] - left[k]) / (2.0 * eps);
                    // Second derivative 2 over a step of 1e-6 across the kink at a, plus rounding.
                    assert!((difference - slopes[k]).abs() < 3e-6, "{difference} != {} at {d}", slopes[k]);
                }
            }
        }
    }
}
