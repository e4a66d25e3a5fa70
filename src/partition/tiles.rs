//! Order of the cells in which averaged points stand: by strips of some columns, along each row by row.
//!
//! ```text
//!   cells of a block, one column:       in strips of two:
//!     │■│ 17 nodes high, 2 wide           │■■│ 9 nodes high, 3 wide
//!     │■│                                 │■■│
//!     │⋮│ 34 nodes                        │⋮⋮│ 27 nodes
//! ```
//!
//! A block's points then stand around fewer nodes, each of which costs as much as some points.

use crate::dimension::Dimension;
use crate::grid::Layout;

/// Columns of a strip.
const COLUMNS: i32 = 4;

/// First places of the strips of a layout.
#[derive(Debug, Default)]
pub(super) struct Tiles {
    /// By strip and, in space, row of pencils: place of its first cell.
    start: Vec<u32>,
    /// Lowest node of its pencils.
    low: Vec<i32>,
    /// All places.
    total: usize,
}

impl Tiles {
    /// Counts the cells of a layout's strips.
    pub(super) fn arrange<D: Dimension>(&mut self, layout: &Layout) {
        let plane = layout.pencils_per_plane::<D>();
        let strips = (layout.counts[0] + COLUMNS - 1) / COLUMNS;
        self.start.clear();
        self.low.clear();
        let mut total = 0;
        for strip in 0..strips {
            for row in 0..plane {
                let columns = strip * COLUMNS..((strip + 1) * COLUMNS).min(layout.counts[0]);
                let ranges = columns.filter_map(|column| {
                    let pencil = (column * plane + row) as usize;
                    let count = (layout.start[pencil + 1] - layout.start[pencil]) as i32;
                    (count > 0).then_some((layout.low[pencil], layout.low[pencil] + count))
                });
                let (low, high) =
                    ranges.fold((i32::MAX, i32::MIN), |all, own| (all.0.min(own.0), all.1.max(own.1)));
                self.start.push(total);
                self.low.push(low);
                total += (COLUMNS * (high.max(low) - low)) as u32;
            }
        }
        self.total = total as usize;
    }

    /// Number of places.
    pub(super) fn places(&self) -> usize {
        self.total
    }

    /// Place of a cell by its lowest corner.
    #[inline]
    pub(super) fn place<D: Dimension>(&self, layout: &Layout, cell: D::Vector<i32>) -> u32 {
        let row = if D::AXES == 3 { cell[1] } else { 0 };
        let strip = (cell[0] / COLUMNS * layout.pencils_per_plane::<D>() + row) as usize;
        let along = cell[D::AXES - 1] - self.low[strip];
        self.start[strip] + (along * COLUMNS + cell[0] % COLUMNS) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::{PlaneStrain, ThreeDimensional};
    use crate::grid::PencilRanges;
    use std::collections::BTreeSet;

    /// Every cell around points has a place of its own.
    fn check<D: Dimension>(counts: [i32; 3], nodes: &[D::Vector<i32>]) {
        let mut layout = Layout::new(counts, 1.0, [0.0; 3]);
        layout.arrange::<D>(nodes.iter().copied(), &mut PencilRanges::default());
        let mut tiles = Tiles::default();
        tiles.arrange::<D>(&layout);
        let mut cells = BTreeSet::new();
        for node in nodes {
            for corner in 0..2_i32.pow(D::AXES as u32) {
                cells.insert(D::vector(|axis| node[axis] - (corner >> axis & 1)).as_ref().to_vec());
            }
        }
        let place = |cell: &Vec<i32>| tiles.place::<D>(&layout, D::vector(|axis| cell[axis]));
        let places: BTreeSet<u32> = cells.iter().map(place).collect();
        assert_eq!(places.len(), cells.len(), "two cells share a place");
        assert!(places.last().is_some_and(|&last| (last as usize) < tiles.places()));
    }

    /// See `check`; a chip beside the workpiece makes ragged strips.
    #[test]
    fn cells_have_places_of_their_own() {
        check::<PlaneStrain>([30, 40, 1], &[[5, 5], [5, 6], [6, 30], [7, 4], [8, 12], [24, 36]]);
        check::<ThreeDimensional>([20, 18, 16], &[[4, 4, 4], [5, 12, 9], [15, 3, 12], [15, 4, 3]]);
    }
}
