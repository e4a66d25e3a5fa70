//! Cuts: the paper's own, from walking pace to 500 m/s, from no friction to sticking, from half a cell to the
//! whole block.

use super::monitor::{Watched, cell, cut, cut_all, soundness};
use super::{Figure, Setting, Sheet};
use crate::scene::{Inputs, Scene};

/// The paper's cut at feeds 0.3 and 0.5 mm and friction 0 and 0.2, and the same twice finer.
pub fn paper(setting: &Setting, sheet: &mut Sheet) {
    let spacings: [f64; 2] = setting.pick([4e-5, 2e-5], [1e-5, 5e-6]);
    let travel = setting.pick(0.6e-3, 1e-3);
    let mut scenes = Vec::new();
    for spacing in spacings {
        for feed in [3e-4, 5e-4] {
            for friction in [0.0, 0.2] {
                let mut scene = cut(spacing);
                scene.inputs = Inputs { tool_velocity: 50.0, feed, friction };
                scenes.push(scene);
            }
        }
    }
    for (scene, run) in scenes.iter().zip(cut_all(&scenes, travel, 20)) {
        let Inputs { feed, friction, .. } = scene.inputs;
        let spacing = 1e6 * scene.numerics.point_spacing;
        let name = format!("spacing {spacing:.0} µm, feed {} mm, friction {friction}", 1e3 * feed);
        soundness(sheet, &name, &run);
        few_points(sheet, &format!("{name}: volume ratios outside 0.7–1.3"), &run, run.worst.outside);
    }
}

/// A count of points that may be 0.01 % of all, rounded up to a whole one.
fn few_points<'a>(sheet: &'a mut Sheet, name: &str, run: &Watched, found: usize) -> &'a mut Figure {
    let allowed = (1e-4 * run.count as f64).ceil();
    let figure =
        sheet.at_most(format!("{name}, of {} points", run.count), run.figure(found as f64), "", allowed);
    figure.retried(run.outputs().retries)
}

/// Tool speeds from 1 to 500 m/s, each at two spacings.
///
/// At 1 and 5 m/s mass is scaled automatically (`numerics.mass_scaling` = 0): a share of 0.5 % of the force,
/// and the run takes a hundredth of the substeps.
pub fn speeds(setting: &Setting, sheet: &mut Sheet) {
    let spacings: [f64; 2] = setting.pick([4e-5, 2e-5], [2e-5, 1e-5]);
    let travel = setting.pick(0.5e-3, 1e-3);
    for velocity in [1.0, 5.0, 100.0, 200.0, 500.0] {
        let scenes = spacings.map(|spacing| {
            let mut scene = cut(spacing);
            scene.inputs.tool_velocity = velocity;
            if velocity < 50.0 {
                scene.numerics.mass_scaling = 0.0;
            }
            scene
        });
        let runs = cut_all(&scenes, travel, 20);
        let name = format!("{velocity} m/s");
        for (run, spacing) in runs.iter().zip(spacings) {
            let name = format!("{name}, spacing {:.0} µm", 1e6 * spacing);
            soundness(sheet, &name, run);
            few_points(sheet, &format!("{name}: points above strain 10"), run, run.worst.strained)
                .failing_because(
                    "single points that the tool drags along; those at 1 m/s come from one row, at the edge",
                );
        }
        let strains = [0, 1].map(|k| runs[k].figure(runs[k].outputs().peak_strain_p999));
        let change = 100.0 * (strains[1] / strains[0] - 1.0);
        let figure =
            sheet.at_most(format!("{name}: change of the 99.9th percentile of strain"), change, "%", 20.0);
        figure
            .remarked(format!("{:.2} and {:.2}", strains[0], strains[1]))
            .failing_because("what it measures is a layer at the tool as thin as the grid");
    }
}

/// Friction from 0 to what sticks, and feeds from half a cell to the height of the block less the two cells
/// that must stay.
pub fn friction_and_feed(setting: &Setting, sheet: &mut Sheet) {
    let spacing = setting.pick(4e-5, 1e-5);
    let travel = setting.pick(0.6e-3, 1e-3);
    let mut scenes: Vec<(String, Scene)> = Vec::new();
    for friction in [0.0, 0.5, 1.0, 2.0, 10.0] {
        let mut scene = cut(spacing);
        scene.inputs.friction = friction;
        scenes.push((format!("friction {friction}"), scene));
    }
    let mut scene = cut(spacing);
    scene.effects.sticking = true;
    scene.inputs.friction = 2.0;
    scenes.push(("sticking (effects.sticking), friction 2".into(), scene));
    let two_cells = 2.0 * cell(&cut(spacing));
    for feed in [0.5e-3, 0.8e-3, 1e-3 - two_cells] {
        let mut scene = cut(spacing);
        scene.inputs.feed = feed;
        scenes.push((format!("feed {:.2} mm of 1 mm", 1e3 * feed), scene));
    }
    let (names, scenes): (Vec<String>, Vec<Scene>) = scenes.into_iter().unzip();
    for (name, run) in names.iter().zip(cut_all(&scenes, travel, 20)) {
        soundness(sheet, name, &run);
    }
    // Half a cell: points 5 µm apart on a small block, where this is cheap.
    let mut shallow = cut(5e-6);
    (shallow.workpiece.length, shallow.workpiece.height) = (3e-4, 1e-4);
    (shallow.inputs.feed, shallow.tool.length, shallow.tool.height) = (5e-6, 1e-4, 1e-4);
    let mut run = Watched::new(&shallow);
    run.run(1.5e-4 / 50.0, 20);
    soundness(sheet, "feed 5 µm, half a cell", &run);
    // The whole height is not on offer, and says so.
    let mut whole = cut(spacing);
    whole.inputs.feed = whole.workpiece.height;
    let text = Watched::new(&whole).remark();
    let is_named = f64::from(u8::from(text.starts_with("feed = ")));
    sheet.at_least("feed of the whole height: refused by name", is_named, "", 1.0).remarked(text);
}
