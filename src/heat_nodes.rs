//! What heat conduction knows of a node, the plane fitted to the temperatures around it, and weights exact enough to
//! conserve.

use crate::dimension::Dimension;
use crate::locking;
use crate::points::{BLOCK, Column, Places};
use crate::shape::ShapeFunction;
use crate::simd::{Array, Real, Vector};

/// Least spread of the points around a node that a slope is fitted to, as a variance (cells²); fewer have their mean.
const LEAST_SPREAD: f64 = 1e-6;
/// Furthest that a plane is trusted at its node, from the mean in standard deviations of the points' temperatures: a
/// linear field in a corner of a lattice needs 2.5, and few points close together would give any value.
const FURTHEST: f64 = 3.0;

/// What is known of the heat around a node; lengths in cells, temperatures from the reference (K).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HeatNode {
    /// Σ w C (J/K).
    pub(crate) capacity: f64,
    /// Σ w C T, T², x, xx and xT; fitting turns the last into slopes (K per cell).
    pub(crate) heat: f64,
    pub(crate) square: f64,
    pub(crate) first: [f64; 3],
    pub(crate) second: [[f64; 3]; 3],
    pub(crate) mixed: [f64; 3],
    /// Temperature of the plane at the node.
    pub(crate) value: f64,
    /// Temperature that conducts: the value where it can be trusted, or a wall's.
    pub(crate) driving: f64,
    /// Q over the pass (J), then the rise of temperature (K).
    pub(crate) flow: f64,
}

impl HeatNode {
    /// From moments to the plane: least squares with weights w C.
    pub(crate) fn fit<D: Dimension>(&mut self) {
        let scale = 1.0 / self.capacity;
        let mean = self.heat * scale;
        let centre = self.first.map(|moment| moment * scale);
        let mut slope: [f64; 3] =
            std::array::from_fn(|a| if a < D::AXES { self.mixed[a] * scale - centre[a] * mean } else { 0.0 });
        // Cholesky factors of the covariance, in place; the diagonal is at least the least spread.
        let mut factor = [[0.0_f64; 3]; 3];
        for a in 0..D::AXES {
            for b in 0..=a {
                let inner: f64 = (0..b).map(|k| factor[a][k] * factor[b][k]).sum();
                let entry = self.second[a][b] * scale - centre[a] * centre[b] - inner;
                factor[a][b] =
                    if a == b { (entry.max(0.0) + LEAST_SPREAD).sqrt() } else { entry / factor[b][b] };
            }
        }
        for a in 0..D::AXES {
            let inner: f64 = (0..a).map(|k| factor[a][k] * slope[k]).sum();
            slope[a] = (slope[a] - inner) / factor[a][a];
        }
        for a in (0..D::AXES).rev() {
            let inner: f64 = (a + 1..D::AXES).map(|k| factor[k][a] * slope[k]).sum();
            slope[a] = (slope[a] - inner) / factor[a][a];
        }
        self.value = mean - (0..D::AXES).map(|a| slope[a] * centre[a]).sum::<f64>();
        let deviation = (self.square * scale - mean * mean).max(0.0).sqrt();
        self.driving = mean + (self.value - mean).clamp(-FURTHEST * deviation, FURTHEST * deviation);
        self.mixed = slope;
    }
}

/// Weights and slopes of a block's points in double precision, by axis and place in the stencil.
///
/// The middle weight is what the others leave, so that weights sum to one and slopes to zero in single precision too: on
/// these sums conservation rests.
pub(crate) struct Stencils {
    weights: [[Column<f64>; 3]; 3],
    slopes: [[Column<f64>; 3]; 3],
}

impl Stencils {
    /// Those of a block.
    #[inline(never)]
    pub(crate) fn of<R: Real, D: Dimension, F: ShapeFunction<R>>(
        points: &Places<'_, R, D>,
        shape: &F,
    ) -> Self {
        let exact = |columns: &[[Column<R>; 3]; 3], sum: f64| {
            columns.each_ref().map(|of_axis| {
                let mut wide = of_axis.each_ref().map(|column| column.map(Real::to_f64));
                for lane in 0..BLOCK {
                    wide[1][lane] = sum - wide[0][lane] - wide[2][lane];
                }
                wide
            })
        };
        let own = locking::Stencils::of(points, shape);
        Stencils { weights: exact(&own.weights, 1.0), slopes: exact(&own.slopes, 0.0) }
    }

    /// Weight of a node for a point (-).
    pub(crate) fn weight<D: Dimension>(&self, lane: usize, places: &[usize; 3]) -> f64 {
        (0..D::AXES).map(|axis| self.weights[axis][places[axis]][lane]).product()
    }

    /// Slope of that weight along an axis (1/cell).
    pub(crate) fn slope<D: Dimension>(&self, lane: usize, places: &[usize; 3], along: usize) -> f64 {
        let factor = |axis: usize| {
            let columns = if axis == along { &self.slopes } else { &self.weights };
            columns[axis][places[axis]][lane]
        };
        (0..D::AXES).map(factor).product()
    }
}

/// The weights of one point alone, the same numbers as in `Stencils`: where few points of a block are asked for.
pub(crate) struct PointWeights([[f64; 3]; 3]);

impl PointWeights {
    /// Those of the point at `lane`.
    #[inline(always)]
    pub(crate) fn of<R: Real, D: Dimension, F: ShapeFunction<R>>(
        points: &Places<'_, R, D>,
        lane: usize,
        shape: &F,
    ) -> Self {
        let mut weights = [[0.0; 3]; 3];
        for (of_axis, offset) in weights.iter_mut().zip(points.offset.as_ref()) {
            let stencil = shape.stencil(Array::<R, 1>::splat(offset[lane]));
            let [low, _, high] = stencil.weights.map(|weight| weight.sum().to_f64());
            *of_axis = [low, 1.0 - low - high, high];
        }
        PointWeights(weights)
    }

    /// Weight of a node (-).
    #[inline(always)]
    pub(crate) fn weight<D: Dimension>(&self, places: &[usize; 3]) -> f64 {
        (0..D::AXES).map(|axis| self.0[axis][places[axis]]).product()
    }
}
