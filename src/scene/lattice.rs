//! The lattice of points that a block starts as.

/// Where a point stood before the cut: points fill the workpiece as equal boxes, numbered along z, then y,
/// then x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartLattice {
    /// Points along each axis.
    pub count: [usize; 3],
    /// Their distances (m).
    pub step: [f64; 3],
}

impl StartLattice {
    /// The lattice that fills a block.
    ///
    /// * `size`: of the block (m)
    /// * `spacing`: wanted distance of the points (m); the real one fills the block exactly
    /// * `axes`: 2 in plane strain, where the third has one point; 3
    pub fn new(size: [f64; 3], spacing: f64, axes: usize) -> Self {
        let count: [usize; 3] =
            std::array::from_fn(|axis| if axis < axes { (size[axis] / spacing).round() as usize } else { 1 });
        StartLattice { count, step: std::array::from_fn(|axis| size[axis] / count[axis] as f64) }
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.count.iter().product()
    }

    /// A point's place along each axis, counted from 0.
    pub fn index(&self, number: usize) -> [usize; 3] {
        let [_, y, z] = self.count;
        [number / (y * z), number / z % y, number % z]
    }
}
