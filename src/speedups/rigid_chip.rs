//! The chip's tail: chip that the cut has left behind moves on as a rigid body and is no longer integrated.
//!
//! ```text
//!        ╭────╮  tail: moves as one body, nothing acts on it
//!        │ ─ ─│─ ─ ─ ─ ─ reach above the tool's lowest point
//!        │band│          the tail moves as these points do on the whole
//!        │    ││
//!  ──────┴┐  ┌┤█ tool
//!         └──┘└────────
//! ```
//!
//! A chip that has left the tool's face yields no more: it bends a little, it carries its momentum away, and
//! each of its points costs as much as one in the shear zone. When the points are sorted, those that have
//! come higher than the reach join the tail as they are, with stress, temperature and velocity. The tail then
//! follows the chip below it: translation and spin are those that the momentum and the moment of momentum of
//! a band below the reach have (`TailMotion::of`).
//!
//! What is lost: what the tail's inertia does to the chip (one that swings no tail around curls a little
//! tighter), waves and heat through the cut across the chip, and what the tail would run into. What this
//! costs in accuracy is measured in book/src/evidence/performance.md. The reach is never below `MARGIN` feeds
//! beyond the contact on the tool's face, so friction acts on all of the chip that it would act on.
//!
//! Form of the effect: an optional pass when points are sorted; without it nothing is kept or done.

use crate::dimension::Dimension;
use crate::grid::Layout;
use crate::partition::Partition;
use crate::points::inactive::InactivePoints;
use crate::points::{BLOCK, Block, PointState};
use crate::scene::Scene;
use crate::simd::Real;
use serde::{Deserialize, Serialize};

/// Least reach that may be asked for (feeds): the workpiece bulges by a third of the feed before the tool.
pub const LEAST_REACH: f64 = 2.0;
/// Least reach (cells).
const SMALLEST: f64 = 12.0;
/// Reach beyond the contact on the tool's face (feeds).
const MARGIN: f64 = 0.5;
/// Height of the band that the tail follows (cells): with the least reaches it ends above the bulge, so that
/// it holds chip only.
const BAND: f64 = 4.0;
/// Points of the band below which the tail keeps its motion: fewer are splinters.
const LEAST_POINTS: usize = 16;
/// Thickness of a chip over its feed (-), for what a run will cost: that of the reference cut.
const THICKENING: f64 = 1.6;

/// Area (m2) of the chip after the tool has cut a way `travel` (m) at `feed` (m).
pub fn chip(scene: &Scene, feed: f64, travel: f64) -> f64 {
    feed * (travel - scene.tool.initial_gap).clamp(0.0, scene.workpiece.length)
}

/// The part of it (m2) that substeps integrate.
pub fn integrated_chip(scene: &Scene, feed: f64, travel: f64) -> f64 {
    let chip = chip(scene, feed, travel);
    if scene.numerics.active_chip == 0.0 {
        return chip;
    }
    let cell = scene.numerics.cell();
    let reach = (scene.numerics.active_chip * feed).max(SMALLEST * cell);
    chip.min(THICKENING * feed * reach)
}

/// Where the tail begins.
#[derive(Clone, Debug)]
pub struct ChipTail {
    /// Reach above the tool's lowest point in feeds (-).
    pub above: f64,
    /// Height of the workpiece (m).
    pub height: f64,
}

/// Where the chip touches the tool's face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceContact {
    /// Height of the tool's lowest point (m).
    pub lowest: f64,
    /// Furthest contact along the face (m).
    pub reach: f64,
}

/// Motion of a rigid body in the plane from a time on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TailMotion {
    /// Time at which its points stood where they are kept (s).
    since: f64,
    /// Point that moves with `velocity`, at that time (m).
    centre: [f64; 2],
    /// m/s
    velocity: [f64; 2],
    /// Angular velocity, anticlockwise (1/s).
    spin: f64,
}

impl TailMotion {
    /// A body at rest.
    pub fn at_rest(since: f64) -> Self {
        TailMotion { since, centre: [0.0; 2], velocity: [0.0; 2], spin: 0.0 }
    }

    /// The rigid motion with the momentum of points and the moment of momentum about their centre of mass.
    ///
    /// * `points`: mass (kg), position (m) and velocity (m/s), gone through twice
    fn of(points: impl Iterator<Item = (f64, [f64; 2], [f64; 2])> + Clone, since: f64) -> Self {
        let mut mass = 0.0;
        let (mut centre, mut velocity) = ([0.0; 2], [0.0; 2]);
        for (m, x, v) in points.clone() {
            mass += m;
            for axis in 0..2 {
                centre[axis] += m * x[axis];
                velocity[axis] += m * v[axis];
            }
        }
        let (centre, velocity) = (centre.map(|sum| sum / mass), velocity.map(|sum| sum / mass));
        let (mut inertia, mut moment) = (0.0, 0.0);
        for (m, x, v) in points {
            let arm = [x[0] - centre[0], x[1] - centre[1]];
            inertia += m * (arm[0] * arm[0] + arm[1] * arm[1]);
            moment += m * (arm[0] * v[1] - arm[1] * v[0]);
        }
        // Points on one spot turn about nothing.
        let spin = if inertia > 0.0 { moment / inertia } else { 0.0 };
        TailMotion { since, centre, velocity, spin }
    }

    /// Where a point of the body that is kept at `position` (m) stands at `time` (s).
    pub fn carry(&self, position: [f64; 2], time: f64) -> [f64; 2] {
        let span = time - self.since;
        let (sin, cos) = (self.spin * span).sin_cos();
        let arm = [position[0] - self.centre[0], position[1] - self.centre[1]];
        [
            self.centre[0] + self.velocity[0] * span + cos * arm[0] - sin * arm[1],
            self.centre[1] + self.velocity[1] * span + sin * arm[0] + cos * arm[1],
        ]
    }

    /// The same motion, its points kept where they stand at `time` (s).
    fn from(self, time: f64) -> Self {
        TailMotion { since: time, centre: self.carry(self.centre, time), ..self }
    }
}

impl ChipTail {
    /// Height (m) above which chip is tail.
    ///
    /// * `cell`: cell length (m)
    fn top(&self, contact: FaceContact, cell: f64) -> f64 {
        let FaceContact { lowest, reach } = contact;
        let feed = (self.height - lowest).max(0.0);
        lowest + (self.above * feed).max(reach + MARGIN * feed).max(SMALLEST * cell)
    }

    /// Moves the tail to where it stands at `time` (s), lets points join it that have come high enough, and
    /// gives its motion from there on. Points of the tail that have reached the domain's rim are shown to
    /// `retire` and are gone. The points must be sorted anew afterwards.
    ///
    /// * `motion`: that of the tail so far
    pub fn follow<R: Real, D: Dimension, S: PointState<R>>(
        &self,
        partition: &mut Partition<R, D, S>,
        contact: FaceContact,
        motion: TailMotion,
        time: f64,
        mut retire: impl FnMut(&Block<R, D, S>, usize),
    ) -> TailMotion {
        let Partition { layout, chunks, tail, .. } = partition;
        let top = self.top(contact, layout.cell);
        let mut heap = InactivePoints::of(std::mem::take(tail));
        let mut k = 0;
        while k < heap.count {
            let (block, lane) = (&mut heap.blocks[k / BLOCK], k % BLOCK);
            carry(block, lane, layout, &motion, time);
            // Kept from the grid's home, which is the grid's place to half a cell.
            if layout.contains::<D>(D::vector(|axis| block.node[axis][lane])) {
                k += 1;
            } else {
                retire(block, lane);
                heap.remove(k);
            }
        }
        for block in chunks.iter_mut().flat_map(|chunk| &mut chunk.blocks) {
            for lane in 0..BLOCK {
                if block.is_point(lane) && position(block, lane, layout)[1] > top {
                    let (kept, place) = heap.push(block, lane);
                    layout.count_from((&layout.origin, &layout.home), kept, place);
                    block.volume[lane] = R::ZERO;
                }
            }
        }
        *tail = heap.blocks;

        let bottom = top - BAND * layout.cell;
        let band = chunks.iter().flat_map(|chunk| &chunk.blocks).flat_map(|block| {
            let lanes = (0..BLOCK).filter(move |&lane| block.is_point(lane));
            lanes.map(move |lane| (block, lane))
        });
        let band = band.filter_map(|(block, lane)| {
            let position = position(block, lane, layout);
            let velocity = [0, 1].map(|axis| block.velocity[axis][lane].to_f64());
            // All have the same density at the start.
            (position[1] > bottom).then(|| (block.volume[lane].to_f64(), position, velocity))
        });
        if band.clone().take(LEAST_POINTS).count() == LEAST_POINTS {
            TailMotion::of(band, time)
        } else {
            motion.from(time)
        }
    }
}

/// Position of a point in the plane (m).
fn position<R: Real, D: Dimension, S: PointState<R>>(
    block: &Block<R, D, S>,
    lane: usize,
    layout: &Layout,
) -> [f64; 2] {
    layout.place(block, lane)
}

/// Moves a point of the tail to where it stands at `time` (s).
fn carry<R: Real, D: Dimension, S: PointState<R>>(
    block: &mut Block<R, D, S>,
    lane: usize,
    layout: &Layout,
    motion: &TailMotion,
    time: f64,
) {
    let mut cells = layout.cells_of(block, lane);
    let place = [0, 1].map(|axis| layout.home[axis] + layout.cell * cells[axis]);
    let carried = motion.carry(place, time);
    for axis in 0..2 {
        cells[axis] = (carried[axis] - layout.home[axis]) / layout.cell;
    }
    layout.put(block, lane, cells);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::PlaneStrain;

    /// Points of a body that turns and moves are found to do just that, and carried along the circle on which
    /// they turn.
    #[test]
    fn a_rigid_motion_is_found_and_followed() {
        let (centre, velocity, spin) = ([2e-3, 1e-3], [-12.0, 40.0], 3e4);
        let points: Vec<_> = (0..12)
            .map(|k| {
                let angle = f64::from(k) * std::f64::consts::TAU / 12.0;
                let arm = [3e-4 * angle.cos(), 1e-4 * angle.sin()];
                let position = [centre[0] + arm[0], centre[1] + arm[1]];
                (2e-9, position, [velocity[0] - spin * arm[1], velocity[1] + spin * arm[0]])
            })
            .collect();
        let motion = TailMotion::of(points.iter().copied(), 5e-6);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
        assert!(close(motion.spin, spin), "{motion:?}");
        for axis in 0..2 {
            assert!(close(motion.centre[axis], centre[axis]), "{motion:?}");
            assert!(close(motion.velocity[axis], velocity[axis]), "{motion:?}");
        }
        // A quarter of a turn.
        let span = 0.25 * std::f64::consts::TAU / spin;
        let at = motion.carry([centre[0] + 3e-4, centre[1]], 5e-6 + span);
        let expected = [centre[0] + velocity[0] * span, centre[1] + velocity[1] * span + 3e-4];
        assert!(close(at[0], expected[0]) && close(at[1], expected[1]), "{at:?} instead of {expected:?}");
        // In two parts it goes as far as in one.
        let half = motion.carry([centre[0] + 3e-4, centre[1]], 5e-6 + 0.5 * span);
        let rest = motion.from(5e-6 + 0.5 * span).carry(half, 5e-6 + span);
        assert!(close(rest[0], at[0]) && close(rest[1], at[1]), "{rest:?} instead of {at:?}");
    }

    /// Points on one spot have no spin that could be told.
    #[test]
    fn points_on_one_spot_do_not_turn() {
        let points = [(1.0, [0.5, 0.5], [1.0, 2.0]); 3];
        let motion = TailMotion::of(points.into_iter(), 0.0);
        assert_eq!((motion.velocity, motion.spin), ([1.0, 2.0], 0.0));
    }

    /// A column of points that rises at 30 m/s: what is above the reach joins the tail, goes on with what is
    /// below it, and is shown to `retire` at the domain's rim.
    #[test]
    fn points_join_the_tail_and_leave_at_the_rim() {
        let mut blocks = vec![Block::<f64, PlaneStrain, ()>::empty(); 2];
        for number in 0..2 * BLOCK {
            let (block, lane) = (&mut blocks[number / BLOCK], number % BLOCK);
            block
                .set_grid_position(lane, [10.0 + 0.5 * (number % 4) as f64, 5.0 + 0.5 * (number / 4) as f64]);
            block.velocity[1][lane] = 30.0;
            block.volume[lane] = 1e-12;
            block.id[lane] = number as u32;
        }
        // Cells of 10 µm, points at heights of 50 to 205 µm, the rim from 470 µm on.
        let mut partition = Partition::new(Layout::new([30, 50, 1], 1e-5, [0.0; 3]), vec![], blocks);
        let tail = ChipTail { above: 2.0, height: 1.4e-4 };
        // Above an edge at 40 µm, with a feed of 100 µm: two feeds, contact and half a feed, 12 cells.
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(close(tail.top(FaceContact { lowest: 4e-5, reach: 6e-5 }, 1e-5), 2.4e-4));
        assert!(close(tail.top(FaceContact { lowest: 4e-5, reach: 6e-4 }, 1e-5), 6.9e-4));
        assert!(close(tail.top(FaceContact { lowest: 4e-5, reach: 6e-5 }, 2e-5), 2.8e-4));
        // Above an edge at 22.5 µm, without a feed: 142.5 µm, above the rows 0 to 18 of 32.
        let tail = ChipTail { height: 0.0, ..tail };
        let tool = FaceContact { lowest: 2.25e-5, reach: 0.0 };
        let at_rest = TailMotion::at_rest(0.0);
        let motion =
            tail.follow(&mut partition, tool, at_rest, 1e-6, |_, _| panic!("no point has moved yet"));
        assert_eq!([partition.tail_points().count(), partition.points().count()], [4 * 13, 4 * 19]);
        assert!((motion.velocity[1] - 30.0).abs() < 1e-9 && motion.spin.abs() < 1e-6, "{motion:?}");
        // After 10 µs the tail is 30 cells further up.
        let mut retired = Vec::new();
        tail.follow(&mut partition, tool, motion, 1.1e-5, |block, lane| retired.push(block.id[lane]));
        let height = |id: u32| 35.0 + 0.5 * f64::from(id / 4);
        assert!(!retired.is_empty() && retired.iter().all(|&id| height(id) > 46.0), "{retired:?}");
        for (block, lane) in partition.tail_points() {
            let (id, [x, y]) = (block.id[lane], block.grid_position(lane));
            assert!((y - height(id)).abs() < 1e-6 && y < 46.6, "point {id} at a height of {y}");
            assert!((x - 10.0 - 0.5 * f64::from(id % 4)).abs() < 1e-6, "point {id} at {x}");
        }
        assert_eq!(partition.tail_points().count() + retired.len(), 4 * 13);
    }
}
