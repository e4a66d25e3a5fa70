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
