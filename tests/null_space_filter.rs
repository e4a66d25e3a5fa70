//! Velocities that the grid cannot see are brought back (`stabilization::null_space_filter`): momentum stays,
//! energy is accounted for, and smooth motion is not touched.

mod common;

use common::{
    Lattice, NO_MOTION, SteelBlock, distant_tool, elastic, kinetic, never_yielding, points, steel_4340, total,
};
use swarf::dimension::PlaneStrain;
use swarf::grid::shape_function::Gimp;
use swarf::scene::Constants;
use swarf::simulation::{PointView, Solver};

/// A free block of 18 by 14 cells with a velocity (m/s) at each place (m).
fn block(
    constants: &Constants,
    mut velocity: impl FnMut([f64; 3]) -> [f64; 3],
) -> SteelBlock<PlaneStrain, Gimp<f64>> {
    let lattice = Lattice {
        domain: [60, 50, 1],
        corner: [10, 10, 0],
        cells: [18, 14, 1],
        per_edge: 2,
        cell: 2e-5,
        fixed: vec![],
        courant: 0.5,
    };
    lattice.build(constants, Gimp::new(2), distant_tool(), |x, _, _| velocity(x))
}

/// A block at 40 m/s in which neighbours of two along the left side store 400 m/s up and down: next to
/// nothing on any node.
fn with_strays(constants: &Constants) -> SteelBlock<PlaneStrain, Gimp<f64>> {
    block(constants, |[x, y, _]| {
        let is_pair = x < 1e-5 && (y - 1.4e-4).abs() < 1e-5;
        let sign = if y > 1.4e-4 { 1.0 } else { -1.0 };
        [40.0, if is_pair { 400.0 * sign } else { 0.0 }, 0.0]
    })
}

fn fastest(points: &[PointView]) -> f64 {
    points.iter().map(|point| point.velocity[0].hypot(point.velocity[1])).fold(0.0, f64::max)
}

/// Momentum (kg m/s) and the scale that its rounding is held against.
fn momentum(points: &[PointView]) -> ([f64; 2], f64) {
    let along = |axis: usize| total(points, |point| point.mass * point.velocity[axis]);
    ([along(0), along(1)], total(points, |point| point.mass * point.velocity[0].hypot(point.velocity[1])))
}

/// Two points that store 400 m/s against each other are brought back; where nothing ever yields, and no look
/// is taken, they keep most of it. Momentum stays to the last digits, and the ledger closes on what was
/// taken.
#[test]
fn stored_velocities_are_brought_back() {
    let mut steel = with_strays(&steel_4340());
    let mut elastic_only = with_strays(&never_yielding(steel_4340()));
    let (before, scale) = momentum(&points(&steel));
    let start = steel.progress().ledger.initial_energy;
    for _ in 0..60 {
        steel.step(&NO_MOTION, false).expect("a stable step");
        elastic_only.step(&NO_MOTION, false).expect("a stable step");
    }
    let now = points(&steel);
    assert!(steel.progress().null_space_velocities >= 2, "{} strays", steel.progress().null_space_velocities);
    assert_eq!(elastic_only.progress().null_space_velocities, 0);
    let (kept, left) = (fastest(&points(&elastic_only)), fastest(&now));
    assert!(kept > 200.0, "without the pass {kept} m/s are left: this scene shows nothing");
    assert!(left < 100.0, "{left} m/s are left");
    let (after, _) = momentum(&now);
    for axis in 0..2 {
        let drift = (after[axis] - before[axis]).abs() / scale;
        assert!(drift < 1e-13, "momentum along axis {axis} drifts by {drift:e}");
    }
    let ledger = &steel.progress().ledger;
    let open = ledger.imbalance(total(&now, kinetic), total(&now, elastic)) / start;
    assert!(open.abs() < 1e-3, "{open:e} of the energy is unaccounted for");
    assert!(ledger.damping > 0.0, "{} J of damping", ledger.damping);
}

/// A block that flies at 500 m/s, turns and stretches keeps its velocities: not one is foreign to the nodes
/// around it.
#[test]
fn smooth_motion_is_not_touched() {
    let mut block = block(&steel_4340(), |[x, y, _]| [500.0 - 3e5 * y + 1e5 * x, 3e5 * x - 1e5 * y, 0.0]);
    for _ in 0..40 {
        block.step(&NO_MOTION, false).expect("a stable step");
    }
    let cells = 500.0 * block.progress().clock / 2e-5;
    assert!(cells > 1.0, "it moved by {cells} cells only: too few looks");
    assert_eq!(block.progress().null_space_velocities, 0);
}
