//! Rows of points at the edge's path: those that it would cut are laid anew so that they end at it.
//!
//! ```text
//!   before           after, more than half above   after, less than half above
//!   ┌────┐ c         ┌────┐ c   thinner            ┌────┐ d   thicker
//!   ├────┤ b         ├────┤ b                      │    │
//!   │    │           │    │                        ├────┤ c
//!   ├────┤ a         ├────┤ a                      ├────┤ b
//! ──│────│── path    ══════════                    ══════════
//!   ├────┤ w         │    │ w   thicker            └────┘ a   thinner
//!   └────┘           └────┘
//! ```
//!
//! The chip's lowest rows are full points then, and the rest is taken by the third. What a new row consists
//! of is averaged by volume: mass, momentum and heat are kept, and what averages lose of the energy is
//! counted.

use crate::dimension::Dimension;
use crate::material::ConstitutiveModel;
use crate::partition::Partition;
use crate::points::{Block, Side};
use crate::simd::Real;

/// Rows of the chip that are laid anew.
const LAID: usize = 3;
/// Rows looked at on either side of the path.
const BAND: f64 = 6.0;
/// Part of a row that may stand beyond the path (-).
const SLIVER: f64 = 0.02;
/// How far from its middle a row counts as cut there (-).
const TIE: f64 = 1e-3;
/// How far points of a column may stand apart across it (spacings).
const ACROSS: f64 = 0.7;
/// Points near the path that are listed without asking for memory.
const USUAL_ROWS: usize = 1024;

/// A point near the path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Chunk, block and lane.
    pub(super) at: [usize; 3],
    /// Position (m).
    pub(super) place: [f64; 3],
    /// Height as part of a row (m).
    pub(super) height: f64,
    /// Height of the path where it passes the point (m).
    pub(super) path: f64,
    /// Its side so far.
    pub(super) side: Side,
}

/// Points near the path, in the order of memory; working memory that is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    spacing: f64,
    /// Points behind it get a side (m).
    line: f64,
    rows: Vec<Row>,
}

/// A column of rows, from the one that stays on the workpiece up.
#[derive(Clone, Copy, Debug)]
struct Stack {
    /// Their places in the list, of which the first `count` are there.
    points: [usize; LAID + 1],
    count: usize,
}

impl Stack {
    /// The places that are there.
    fn points(&self) -> &[usize] {
        &self.points[..self.count]
    }

    fn push(&mut self, point: usize) {
        self.points[self.count] = point;
        self.count += 1;
    }

    fn last(&self) -> usize {
        self.points[self.count - 1]
    }
}

/// Borders of a column's rows, from the lowest row's lower one up (m).
type Borders = [f64; LAID + 2];

impl Rows {
    /// Forgets all, for points that are `spacing` apart (m); those behind `line` (m) will get a side.
    pub(super) fn begin(&mut self, spacing: f64, line: f64) {
        (self.spacing, self.line) = (spacing, line);
        self.rows.clear();
        self.rows.reserve(USUAL_ROWS);
    }

    /// Takes a point if it is near the path.
    pub(super) fn takes(&mut self, row: &Row) -> bool {
        let is_near = (row.place[1] - row.path).abs() < BAND * self.spacing;
        if is_near {
            self.rows.push(*row);
        }
        is_near
    }

    /// Gives the points behind the line their sides, and lays rows anew; returns the energy (J) lost.
    pub(super) fn part<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &mut self,
        partition: &mut Partition<R, D, M::State>,
        model: &M,
    ) -> f64 {
        let mut lost = 0.0;
        for k in 0..self.rows.len() {
            let Row { place: [x, y, _], height, path, side, .. } = self.rows[k];
            if side != Side::Uncut || x < self.line {
                continue;
            }
            let above = (y + 0.5 * height - path) / height;
            let is_cut = above > SLIVER && above < 1.0 - SLIVER;
            // A row cut in its middle goes up, whatever rounding says.
            self.rows[k].side = if above >= 0.5 - TIE { Side::Chip } else { Side::Work };
            if is_cut {
                lost += self.lay(k, partition, model);
            }
        }
        for row in &self.rows {
            let [chunk, block, lane] = row.at;
            let second = &partition.layout.second;
            let block = &mut partition.chunks[chunk].blocks[block];
            block.side[lane] = row.side;
            block.node[0][lane] = second.moved_to(block.node[0][lane], row.side == Side::Chip);
        }
        lost
    }

    /// The point next to point `k` above (1) or below (−1) it.
    fn next(&self, k: usize, direction: f64) -> Option<usize> {
        let from = self.rows[k];
        let mut best = None;
        for (other, row) in self.rows.iter().enumerate() {
            let apart = |axis: usize| row.place[axis] - from.place[axis];
            let along = direction * apart(1);
            let expected = 0.5 * (from.height + row.height);
            let is_beside = (apart(0).abs()).max(apart(2).abs()) < ACROSS * self.spacing;
            if other == k || !is_beside || along < 0.3 * expected || along > 1.8 * expected {
                continue;
            }
            let miss = apart(0).powi(2) + apart(2).powi(2) + (along - expected).powi(2);
            if best.is_none_or(|(_, least)| miss < least) {
                best = Some((other, miss));
            }
        }
        best.map(|(other, _)| other)
    }

    /// Lays the rows around cut point `k` anew.
    fn lay<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &mut self,
        k: usize,
        partition: &mut Partition<R, D, M::State>,
        model: &M,
    ) -> f64 {
        // The column, from the row that stays on the workpiece up.
        let goes_up = self.rows[k].side == Side::Chip;
        let mut column = Stack { points: [0; LAID + 1], count: 0 };
        if goes_up {
            // Nothing stays below it where there is nothing.
            let Some(below) = self.next(k, -1.0) else { return 0.0 };
            column.push(below);
        }
        column.push(k);
        while column.count <= LAID
            && let Some(above) = self.next(column.last(), 1.0)
        {
            column.push(above);
        }
        if column.count < 2 {
            return 0.0;
        }
        let Row { place, height, path, .. } = self.rows[k];
        let (mut old, mut new): (Borders, Borders) = ([0.0; LAID + 2], [0.0; LAID + 2]);
        let rows = column.count;
        for (row, &point) in column.points().iter().enumerate() {
            old[row + 1] = old[row] + self.rows[point].height;
        }
        let at = if goes_up { old[1] } else { 0.0 } + path - (place[1] - 0.5 * height);
        for row in 1..rows {
            new[row] = at + self.spacing * (row - 1) as f64;
        }
        new[rows] = old[rows];
        // Too little may be left for the uppermost.
        if new[rows] - new[rows - 1] < 0.3 * self.spacing {
            return 0.0;
        }
        self.average(column.points(), (&old, &new), partition, model)
    }

    /// Gives the rows of a column new borders; each becomes the average of what it consists of.
    fn average<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &mut self,
        column: &[usize],
        (old, new): (&Borders, &Borders),
        partition: &mut Partition<R, D, M::State>,
        model: &M,
    ) -> f64 {
        let count = column.len();
        let overlap =
            |row: usize, from: usize| (new[row + 1].min(old[from + 1]) - new[row].max(old[from])).max(0.0);
        let before = self.energy(column, partition, model);
        let axes = D::AXES;
        for k in axes..Block::<R, D, M::State>::columns() {
            let mut values = [0.0; LAID + 1];
            for (value, &point) in values.iter_mut().zip(column) {
                let [chunk, block, lane] = self.rows[point].at;
                *value = partition.chunks[chunk].blocks[block].column(k)[lane].to_f64();
            }
            for (row, &point) in column.iter().enumerate() {
                let height = new[row + 1] - new[row];
                let value = if k == 2 * axes {
                    values[row] * height / (old[row + 1] - old[row])
                } else {
                    (0..count).map(|from| overlap(row, from) * values[from]).sum::<f64>() / height
                };
                let [chunk, block, lane] = self.rows[point].at;
                partition.chunks[chunk].blocks[block].column_mut(k)[lane] = R::from_f64(value);
            }
        }
        for (row, &point) in column.iter().enumerate() {
            let shift = 0.5 * (new[row] + new[row + 1] - old[row] - old[row + 1]);
            let Row { at: [chunk, block, lane], .. } = self.rows[point];
            let layout = &partition.layout;
            let block = &mut partition.chunks[chunk].blocks[block];
            let mut cells = layout.cells_of(block, lane);
            cells[1] += shift / layout.cell;
            layout.put(block, lane, cells);
            let entry = &mut self.rows[point];
            entry.place[1] += shift;
            entry.height = new[row + 1] - new[row];
            entry.side = if row == 0 { Side::Work } else { Side::Chip };
        }
        before - self.energy(column, partition, model)
    }

    /// Kinetic and elastic energy of a column's points (J).
    fn energy<R: Real, D: Dimension, M: ConstitutiveModel<R, D>>(
        &self,
        column: &[usize],
        partition: &Partition<R, D, M::State>,
        model: &M,
    ) -> f64 {
        let of_point = |&row: &usize| {
            let [chunk, block, lane] = self.rows[row].at;
            let block = &partition.chunks[chunk].blocks[block];
            let square: f64 = (0..D::AXES).map(|axis| block.velocity[axis][lane].to_f64().powi(2)).sum();
            let elastic = model.report(&block.state, lane).elastic_energy;
            block.volume[lane].to_f64() * (0.5 * model.density() * square + elastic)
        };
        column.iter().map(of_point).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::PlaneStrain;
    use crate::grid::Layout;
    use crate::material::effects::Adiabatic;
    use crate::material::hardening::PowerLaw;
    use crate::material::j2_plasticity::J2Plasticity;
    use crate::material::multiplicative::{Multiplicative, WithRateAndHeat};
    use crate::material::rate::RateDependent;
    use crate::points::BLOCK;
    use crate::scene::Scene;

    type Law = WithRateAndHeat<f64, PowerLaw<f64>>;
    type Model = J2Plasticity<f64, Law>;

    /// A column of eight rows, 1 high and wide, whose velocity grows evenly, cut at `path`: volumes, momentum
    /// and the velocity's profile stay, the chip's lowest row is whole and ends at the path, and what the rows
    /// lose of the energy is not negative.
    #[test]
    fn rows_laid_anew_end_at_the_path_and_keep_what_they_hold() {
        let constants = Scene::default().material.constants;
        let law: Law =
            Multiplicative::new(&constants, RateDependent::of(&constants), Adiabatic::of(&constants, 300.0));
        let model: Model = J2Plasticity::new(&constants, law);
        for path in [10.05, 10.3, 10.7, 10.95] {
            let mut block = Block::<f64, PlaneStrain, _>::empty();
            for lane in 0..8 {
                block.set_grid_position(lane, [10.0, (7.5 + lane as f64) / 2.0]);
                block.volume[lane] = 1.0;
                block.velocity[0][lane] = 3.0 - 0.1 * (7.5 + lane as f64);
                model.place(&mut block.state, lane, 300.0);
            }
            let mut partition = Partition::new(Layout::new([40, 30, 1], 2.0, [0.0; 3]), vec![], vec![block]);
            partition.follow_edge([24.0, path]);
            let mut rows = Rows::default();
            rows.begin(1.0, 19.0);
            for lane in 0..BLOCK {
                let block = &partition.chunks[0].blocks[0];
                if block.is_point(lane) {
                    let [x, y] = partition.layout.place(block, lane);
                    let at = [0, 0, lane];
                    rows.takes(&Row { at, place: [x, y, 0.0], height: 1.0, path, side: Side::Uncut });
                }
            }
            let lost = rows.part::<f64, PlaneStrain, Model>(&mut partition, &model);
            assert!(lost >= 0.0, "rows gained {lost} J");
            let mut points: Vec<(f64, f64, f64, Side)> = partition
                .points()
                .map(|(block, lane)| {
                    let y = partition.layout.place(block, lane)[1];
                    (y, block.volume[lane], block.velocity[0][lane], block.side[lane])
                })
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            // A few roundings of sums of eight.
            assert!((points.iter().map(|p| p.1).sum::<f64>() - 8.0).abs() < 1e-13, "path {path}: {points:?}");
            let momentum: f64 = (0..8).map(|k| 3.0 - 0.1 * (7.5 + f64::from(k))).sum();
            assert!(
                (points.iter().map(|p| p.1 * p.2).sum::<f64>() - momentum).abs() < 1e-13,
                "path {path}: {points:?}"
            );
            let lowest = points.iter().find(|p| p.3 == Side::Chip).expect("a chip");
            assert!(
                (lowest.1 - 1.0).abs() < 1e-13 && (lowest.0 - 0.5 - path).abs() < 1e-13,
                "{lowest:?}, path {path}"
            );
            // Averages of an even profile are its values; the uppermost row laid anew, of several, bends it.
            assert!((lowest.2 - (3.0 - 0.1 * lowest.0)).abs() < 1e-13, "{lowest:?}");
            let work = points.iter().rfind(|p| p.3 == Side::Work).expect("work");
            assert!((work.0 + 0.5 * work.1 - path).abs() < 1e-13, "the work ends at {work:?}, path {path}");
        }
    }
}
