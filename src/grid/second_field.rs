//! A second velocity field: behind the edge, chip and work stand on nodes of their own.
//!
//! Nodes of the second field are further columns of the same layout, `shift` columns on. Those before the
//! edge stand for the first field's, so that a point of the second field needs no rule of its own: it stands
//! at a node of the second field wherever it is, and its stencil is found there.
//!
//! ```text
//!   first field      0  1  2  3  4  5  6  7           nodes of uncut material and, from the edge on, of the work
//!                             │edge
//!   second field     8  9 10 11 12 13 14 15
//!                    =0 =1 =2 own … of the chip
//! ```
//!
//! Source: Nairn (2003), CMES 4:649 (several velocity fields on one grid, there at cracks).

/// Which columns belong to the second field; none to begin with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SecondField {
    /// Columns of each field; `i32::MAX` where there is one field only.
    shift: i32,
    /// First column whose nodes the second field has to itself.
    pub edge: i32,
}

impl Default for SecondField {
    fn default() -> Self {
        SecondField { shift: i32::MAX, edge: 0 }
    }
}

impl SecondField {
    /// A second field for a grid of so many columns.
    pub fn new(columns: i32) -> Self {
        SecondField { shift: columns, edge: columns }
    }

    /// Whether there is one.
    pub fn exists(&self) -> bool {
        self.shift != i32::MAX
    }

    /// Columns of a field, of `count` in the layout.
    pub fn columns(&self, count: i32) -> i32 {
        self.shift.min(count)
    }

    /// Where a column stands in space, whichever field it belongs to.
    #[inline(always)]
    pub fn column(&self, first: i32) -> i32 {
        if first >= self.shift { first - self.shift } else { first }
    }

    /// The column whose nodes a column stands for: itself, or the first field's.
    pub fn own_column(&self, first: i32) -> i32 {
        if self.holds(first) && self.column(first) < self.edge { self.column(first) } else { first }
    }

    /// Whether a column belongs to the second field.
    #[inline(always)]
    pub fn holds(&self, first: i32) -> bool {
        first >= self.shift
    }

    /// The same column in the second field, or in the first.
    pub fn moved_to(&self, first: i32, second: bool) -> i32 {
        self.column(first) + if second { self.shift } else { 0 }
    }

    /// Pairs of columns of the first field with those of the second that stand for them.
    pub fn shared_columns(&self) -> impl Iterator<Item = (i32, i32)> + Clone + use<> {
        let shift = self.shift;
        let shared = if self.exists() { self.edge.clamp(0, shift) } else { 0 };
        (0..shared).map(move |column| (column, column + shift))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{Dimension, PlaneStrain, ThreeDimensional};
    use crate::grid::{Layout, MARGIN, PencilRanges};

    /// Nodes around points of either field exist until the next sort; those of the chip are the work's before
    /// the edge and its own from there on.
    fn check<D: Dimension>(counts: [i32; 3], points: &[(D::Vector<i32>, bool)]) {
        let mut layout = Layout::new(counts, 1.0, [0.0; 3]);
        layout.second = SecondField { shift: counts[0], edge: 12 };
        layout.counts[0] *= 2;
        let node = |(at, is_chip): &(D::Vector<i32>, bool)| {
            D::vector(|axis| if axis == 0 { layout.second.moved_to(at[0], *is_chip) } else { at[axis] })
        };
        let nodes: Vec<D::Vector<i32>> = points.iter().map(node).collect();
        let mut arranged = layout.clone();
        arranged.arrange::<D>(nodes.iter().copied(), &mut PencilRanges::default());
        let place = |node: D::Vector<i32>| {
            arranged.offset[arranged.pencil::<D>(node) as usize] + Layout::along::<D>(node)
        };
        for node in &nodes {
            assert!(arranged.contains::<D>(*node), "{node:?} is too near the rim for this test");
            for shift in 0..5_i32.pow(D::AXES as u32) {
                let around = D::vector(|axis| node[axis] + shift / 5_i32.pow(axis as u32) % 5 - MARGIN);
                let own =
                    D::vector(
                        |axis| if axis == 0 { layout.second.own_column(around[0]) } else { around[axis] },
                    );
                let pencil = arranged.pencil::<D>(own) as usize;
                let range = arranged.start[pencil] as i32..arranged.start[pencil + 1] as i32;
                assert!(range.contains(&place(around)), "node {around:?} is not one of pencil {own:?}");
                let is_own = layout.second.holds(around[0]) && layout.second.column(around[0]) >= 12;
                assert_eq!(layout.second.holds(own[0]), is_own, "{around:?} stands for {own:?}");
            }
        }
        assert_eq!(
            arranged.position::<D>(arranged.pencil::<D>(nodes[0]) as usize, 0)[0],
            f64::from(points[0].0[0])
        );
    }

    /// See `check`.
    #[test]
    fn the_chip_has_its_own_nodes_from_the_edge_on() {
        check::<PlaneStrain>(
            [30, 40, 1],
            &[([13, 20], true), ([11, 8], true), ([10, 9], false), ([14, 6], false), ([20, 30], true)],
        );
        check::<ThreeDimensional>(
            [24, 18, 16],
            &[([12, 9, 8], true), ([9, 9, 8], true), ([13, 5, 4], false)],
        );
    }
}
