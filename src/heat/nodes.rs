//! What heat conduction knows of a node, and the plane fitted to the temperatures around it.

use crate::dimension::Dimension;

/// Least spread of the points around a node that a slope is fitted to, as a variance (cells²); fewer have
/// their mean.
const LEAST_SPREAD: f64 = 1e-6;
/// Furthest that a plane is trusted at its node, from the mean in standard deviations of the points'
/// temperatures: a linear field in a corner of a lattice needs 2.5, and few points close together would give
/// any value.
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
