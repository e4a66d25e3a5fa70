//! Three dimensions with both z faces held is plane strain: the same code must give the same physics.

mod common;

use common::{Lattice, ROOM, SteelBlock, SteelState, points};
use swarf::contact::NodesInside;
use swarf::dimension::{Dimension, PlaneStrain, ThreeDimensional};
use swarf::grid::FixedNodes;
use swarf::grid::shape_function::Gimp;
use swarf::simulation::{PointView, Solver, ToolMotion};
use swarf::tool::RigidTool;
use swarf::tool::profile::ToolShape;

const CELL: f64 = 4e-5;
/// Cells along x, y and z.
const CELLS: [i32; 3] = [14, 9, 3];
const CORNER: [i32; 3] = [20, 8, 6];

/// A small block on a wall, held in z on its faces in space, and a tool of 10 degrees rake before it.
fn cut<D: Dimension>() -> SteelBlock<D, Gimp<f64>> {
    let everything = 1 << 20;
    let (left, below) = (CORNER[0] - 2, CORNER[1] - 2);
    let hold = |low: [i32; 3], high: [i32; 3], axes| FixedNodes { low, high, axes };
    let mut fixed = vec![
        hold([left, below, -everything], [CORNER[0], CORNER[1] + CELLS[1], everything], [true; 3]),
        hold([left, below, -everything], [CORNER[0] + CELLS[0], CORNER[1], everything], [true; 3]),
    ];
    let mut lattice = Lattice {
        domain: [CORNER[0] + CELLS[0] + 20, CORNER[1] + CELLS[1] + 20, 1],
        corner: [CORNER[0], CORNER[1], 0],
        cells: CELLS,
        per_edge: 2,
        cell: CELL,
        fixed: vec![],
        courant: 0.5,
    };
    if D::AXES == 3 {
        lattice.domain[2] = 20;
        lattice.corner[2] = CORNER[2];
        for face in [CORNER[2], CORNER[2] + CELLS[2]] {
            let (low, high) = ([-everything, -everything, face], [everything, everything, face]);
            fixed.push(hold(low, high, [false, false, true]));
        }
    }
    lattice.fixed = fixed;
    let shape = ToolShape::new(10_f64.to_radians(), 0.0873, 0.0, 5e-4, 1e-3).expect("a plain wedge");
    // The tip 1 µm before the right side, 3.5 cells below the top; the rake face leans away.
    let (width, height) = (f64::from(CELLS[0]) * CELL, f64::from(CELLS[1]) * CELL);
    let tool =
        RigidTool { shape, position: [width + 1e-6, height - 3.5 * CELL], velocity: [0.0; 2], friction: 0.2 };
    let mut block =
        lattice.build(&common::steel_4340(), Gimp::new(2), tool, |_, _: &mut SteelState<D>, _| [0.0; 3]);
    // Sweeps of the contact at the points end at a bound (1e-3 of the speed), in the plane at another state
    // than in space.
    block.contact = Box::new(NodesInside::default());
    block
}

/// Runs both for the same number of substeps of the same length and compares the tool's impulse on the way
/// and every point's state at the end.
///
/// The weights across z sum to one on every layer and its forces cancel, so both solve the same equations;
/// rounding is spread by the chip's own sensitivity. The bounds, 1e-6 for sums and 1e-4 for single points,
/// lie above what was seen (printed: 3e-8 and 7e-6) and far below what a wrong term would change.
#[test]
fn a_cut_with_held_faces_is_the_plane_strain_cut() {
    let (mut plane, mut space) = (cut::<PlaneStrain>(), cut::<ThreeDimensional>());
    let motion = ToolMotion { velocity: [-50.0, 0.0], friction: 0.2 };
    // 0.2 mm of travel: five cells, with a chip of two.
    while plane.progress().clock < 4e-6 {
        plane.step(&motion, false).expect("a stable step");
        space.step(&motion, false).expect("a stable step");
        let (a, b) = (plane.progress(), space.progress());
        assert!((a.clock / b.clock - 1.0).abs() < 1e-9, "clocks {} and {} s", a.clock, b.clock);
    }
    // In the plane everything is per metre of width.
    let width = f64::from(CELLS[2]) * CELL;
    let (a, b) = (&plane.progress().ledger, &space.progress().ledger);
    let pairs = [
        ("impulse along the cut", a.tool_impulse[0], b.tool_impulse[0] / width),
        ("tool work", a.tool_work, b.tool_work / width),
        ("plastic work", a.plastic_work, b.plastic_work / width),
        ("friction work", a.friction_work, b.friction_work / width),
        ("damping", a.damping, b.damping / width),
    ];
    for (name, flat, deep) in pairs {
        println!("{name}: {flat:.8e} per m in the plane, {:+.1e} of it in space", deep / flat - 1.0);
        assert!(
            flat != 0.0 && (deep / flat - 1.0).abs() < 1e-6,
            "{name}: {flat} per m in the plane, {deep} in space"
        );
    }
    compare_layers(&points(&plane), &points(&space));
    let yielded = points(&plane).iter().filter(|p| p.report.plastic_strain > 0.5).count();
    assert!(yielded > 20, "only {yielded} points have been cut");
}

/// Points are numbered along z first: every layer of the deep block is the flat one.
fn compare_layers(flat: &[PointView], deep: &[PointView]) {
    let layers = (2 * CELLS[2]) as usize;
    assert_eq!(flat.len() * layers, deep.len());
    let mut worst = [0.0_f64; 5];
    for (number, b) in deep.iter().enumerate() {
        let a = &flat[number / layers];
        let z = (0.5 + (number % layers) as f64) * CELL / 2.0;
        let distance =
            (0..2).map(|k| (a.position[k] - b.position[k]).abs()).fold((b.position[2] - z).abs(), f64::max);
        let stress = (0..6).map(|k| (a.report.stress[k] - b.report.stress[k]).abs()).fold(0.0, f64::max);
        let differences = [
            distance / CELL,
            stress / 1e9,
            (a.report.plastic_strain - b.report.plastic_strain).abs(),
            (a.report.temperature - b.report.temperature).abs() / ROOM,
            (a.report.jacobian - b.report.jacobian).abs(),
        ];
        for (worst, difference) in worst.iter_mut().zip(differences) {
            *worst = worst.max(difference);
        }
    }
    println!(
        "largest differences of position (cells), stress (GPa), strain, temperature (of room's), J: {worst:?}"
    );
    assert!(worst.iter().all(|&difference| difference < 1e-4), "layers differ from plane strain: {worst:?}");
}
