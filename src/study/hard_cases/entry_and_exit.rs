//! The tool where a cut begins and ends: to the held end, out at a free one, inside material at the start,
//! never touching it.
//!
//! Where the workpiece's left side is held, a tool that went on would press what is left against that wall,
//! and no run of a chip between two rigid walls can end well: it stops one feed before (`setup::process`),
//! with a closed ledger.

use super::Setting;
use super::monitor::{NO_SLOPE, Watched, cut, soundness};
use super::sheet::Sheet;
use crate::dimension::PlaneStrain;
use crate::grid::shape_function::Gimp;
use crate::scene::Inputs;
use crate::simulation::Solver;
use crate::study::body_setup::{
    BodySetup, NO_MOTION, elastic, kinetic, lattice, points, steel, steel_4340, total, upright_block,
};
use crate::tool::RigidTool;

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    through_the_end(setting, sheet);
    through_a_free_end(setting, sheet);
    out_over_the_end(setting, sheet);
    for depth in [0.25, 1.0, 3.0] {
        inside_at_the_start(sheet, depth);
    }
    never_touching(setting, sheet);
}

/// On and on, as far as the tool is let, and as long again.
fn through_the_end(setting: &Setting, sheet: &mut Sheet) {
    let mut scene = cut(setting.pick(4e-5, 2e-5));
    scene.workpiece.length = 1e-3;
    let mut run = Watched::new(&scene);
    run.run(1.2e-3 / 50.0, 24);
    let name = "driven towards the held end";
    soundness(sheet, name, &run);
    let (o, feed) = (run.outputs(), scene.inputs.feed);
    let beyond = run.figure((feed - o.tool_position_x) / scene.numerics.point_spacing);
    // The substep that passes the place is the last that moves, and goes less than half a cell.
    let figure = sheet.at_most(format!("{name}: way beyond one feed before it, spacings"), beyond, "", 1.0);
    figure.retried(o.retries).remarked(run.remark());
}

/// The same with that side free: the tool leaves there, and no force is left.
fn through_a_free_end(setting: &Setting, sheet: &mut Sheet) {
    let mut scene = cut(setting.pick(4e-5, 2e-5));
    scene.workpiece.length = 1e-3;
    scene.workpiece.held_side = false;
    let mut run = Watched::new(&scene);
    run.run(3e-3 / 50.0, 60);
    let name = "out at a free end";
    soundness(sheet, name, &run);
    let o = run.outputs();
    let force = run.figure(o.cutting_force.hypot(o.thrust_force));
    let figure = sheet.at_most(format!("{name}: force two lengths on"), force, "N", 0.0);
    figure.retried(o.retries).remarked(run.remark());
}

/// The tool is lifted out shortly before the held end: the cut's regular end.
fn out_over_the_end(setting: &Setting, sheet: &mut Sheet) {
    let mut scene = cut(setting.pick(4e-5, 2e-5));
    scene.workpiece.length = 1e-3;
    scene.tool.feed_rate_limit = 100.0;
    let mut run = Watched::new(&scene);
    run.run(12e-6, 12);
    run.steer(Inputs { feed: 0.0, ..scene.inputs }, NO_SLOPE).run(10e-6, 10);
    soundness(sheet, "lifted out before the held end", &run);
}

/// A block that the tool overlaps by `depth` (cells) when the run begins: contact lets it out, whatever the
/// depth.
fn inside_at_the_start(sheet: &mut Sheet, depth: f64) {
    const CELL: f64 = 2e-5;
    let size = [16.0 * CELL, 12.0 * CELL];
    let setup =
        BodySetup::around([-10.0 * CELL, -10.0 * CELL], [size[0] + 10.0 * CELL, size[1] + 10.0 * CELL], CELL);
    let tool = RigidTool {
        shape: upright_block(10.0 * CELL, 40.0 * CELL),
        position: [size[0] - depth * CELL, -14.0 * CELL],
        velocity: [0.0; 2],
        friction: 0.2,
    };
    let shape = tool.shape.clone();
    let seeds = lattice([0.0; 3], [32, 24, 1], CELL / 2.0, 2);
    let model = steel(&steel_4340());
    let mut block = setup.simulation::<PlaneStrain, _, _>((Gimp::new(2), model), tool, &seeds, |_, _, _| {});
    let name = format!("starts {depth} cells inside");
    let (mut open, mut through, mut fastest, mut error) = (0.0_f64, 0.0_f64, 0.0_f64, String::new());
    let corner = block.tool().position;
    for _ in 0..1500 {
        if let Err(e) = block.step(&NO_MOTION, false) {
            error = e.to_string();
            break;
        }
        let now = points(&block);
        let ledger = &block.progress().ledger;
        let [moving, strained] = [total(&now, |p| kinetic(p, [0.0; 3])), total(&now, elastic)];
        // The tool is at rest and does no work: against the energy that contact puts into the block.
        open = open.max(ledger.imbalance(moving, strained).abs());
        through = through.max(moving + strained + ledger.plastic_work);
        fastest = fastest.max(block.progress().fastest);
    }
    let retries = i32::try_from(block.progress().retries).unwrap_or(i32::MAX);
    let none_if_ended = |value: f64| if error.is_empty() { value } else { f64::NAN };
    let figure = sheet.at_most(
        format!("{name}: ledger"),
        none_if_ended(if through > 0.0 { 100.0 * open / through } else { 0.0 }),
        "%",
        1.0,
    );
    figure.retried(retries).remarked(error.clone());
    let deepest = points(&block).iter().fold(f64::MIN, |most, p| {
        let relative = [p.position[0] - corner[0], p.position[1] - corner[1]];
        most.max(-shape.closest(relative).distance / CELL)
    });
    let figure =
        sheet.at_most(format!("{name}: depth left, cells"), none_if_ended(deepest.max(0.0)), "", 0.1);
    figure.retried(retries);
    sheet.show(format!("{name}: fastest point"), none_if_ended(fastest), "m/s");
}

/// At rest before the workpiece, going away from it, and passing above it.
fn never_touching(setting: &Setting, sheet: &mut Sheet) {
    for (name, velocity, feed) in
        [("at rest", 0.0, 3e-4), ("going away", -50.0, 3e-4), ("passing at feed 0", 50.0, 0.0)]
    {
        let mut scene = cut(setting.pick(4e-5, 2e-5));
        scene.inputs = Inputs { tool_velocity: velocity, feed, ..scene.inputs };
        let mut run = Watched::new(&scene);
        run.run(10e-6, 10);
        let o = run.outputs();
        let felt = [o.cutting_force, o.thrust_force, o.tool_work, o.kinetic_energy, o.plastic_work];
        let felt = felt.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let figure = sheet.at_most(
            format!("never touching, {name}: largest of forces (N) and energies (J)"),
            run.figure(felt),
            "",
            0.0,
        );
        figure.retried(o.retries).remarked(run.remark());
        let state = f64::from(o.chip_state);
        sheet.at_most(format!("never touching, {name}: chip.state"), run.figure(state), "", 1.0);
    }
}
