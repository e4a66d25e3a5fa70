//! Nodes whose velocity is zero along some axes: walls.

use crate::dimension::Dimension;
use crate::grid::Layout;

/// Nodes whose velocity is zero along some axes.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedNodes {
    /// Lowest node index along each axis, inclusive.
    pub low: [i32; 3],
    /// Highest node index along each axis, inclusive.
    pub high: [i32; 3],
    /// Which velocity components are zero.
    pub axes: [bool; 3],
}

impl FixedNodes {
    /// The part of a pencil that is fixed, as a range of indices along the last axis.
    pub fn on_pencil<D: Dimension>(&self, layout: &Layout, pencil: usize) -> Option<(i32, i32)> {
        let plane = layout.pencils_per_plane::<D>();
        let (first, second) = (pencil as i32 / plane, pencil as i32 % plane);
        let inside = |axis: usize, index: i32| self.low[axis] <= index && index <= self.high[axis];
        (!layout.second.holds(first) && inside(0, first) && (D::AXES == 2 || inside(1, second)))
            .then(|| (self.low[D::AXES - 1], self.high[D::AXES - 1]))
    }

    /// Whether a node is one of them.
    pub fn holds<D: Dimension>(&self, layout: &Layout, at: &[i32; 3]) -> bool {
        let first = layout.second.own_column(at[0]);
        let inside = |axis: usize, index: i32| self.low[axis] <= index && index <= self.high[axis];
        !layout.second.holds(first) && inside(0, first) && (1..D::AXES).all(|axis| inside(axis, at[axis]))
    }

    /// The same box on a grid that stands `shift` (cells) from where it was given: nodes up to its faces.
    pub fn seen_from(&self, shift: [f64; 3]) -> FixedNodes {
        // A face that lies on a node lies there in spite of rounding.
        let index = |index: i32, shift: f64| (f64::from(index) - shift + 1e-6).floor() as i32;
        FixedNodes {
            low: std::array::from_fn(|axis| index(self.low[axis], shift[axis])),
            high: std::array::from_fn(|axis| index(self.high[axis], shift[axis])),
            axes: self.axes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::PlaneStrain;

    /// Fixed nodes are a box: outside it a pencil has none.
    #[test]
    fn fixed_nodes_end_at_their_box() {
        let layout = Layout::new([10, 10, 1], 1.0, [0.0; 3]);
        let fixed = FixedNodes { low: [2, 3, 0], high: [4, 6, 0], axes: [true; 3] };
        for pencil in 0..10 {
            let expected = (2..=4).contains(&pencil).then_some((3, 6));
            assert_eq!(fixed.on_pencil::<PlaneStrain>(&layout, pencil), expected, "pencil {pencil}");
        }
    }

    /// A wall keeps its place while the grid moves: its face is the last node within it.
    #[test]
    fn walls_stand_still_while_the_grid_moves() {
        let wall = FixedNodes { low: [2, 3, 0], high: [4, 6, 0], axes: [true; 3] };
        assert_eq!(wall.seen_from([0.0; 3]), wall);
        for (shift, high) in [(0.25, 3), (-0.25, 4), (1.0, 3), (-1.5, 5)] {
            assert_eq!(wall.seen_from([shift, 0.0, 0.0]).high, [high, 6, 0], "grid moved by {shift} cells");
        }
    }
}
