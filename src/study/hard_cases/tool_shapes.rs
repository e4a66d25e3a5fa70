//! WindowBounds from sharp to 50 µm, rake angles from -30 to 30 degrees, no clearance.
//!
//! No point may come further into the tool than a tenth of a cell, and none may fly off faster than 2 V + 2
//! σ_y/(ρ c): twice the tool's speed is what an elastic body leaves a wall with, and σ_y/(ρ c), on each side
//! of a free surface, what stress at yield lets go. σ_y is A, the yield stress before hardening. A point
//! moves with the grid's velocity at its place; the velocity that it keeps (FLIP) has a part besides that the
//! grid does not see, which `stabilization::null_space_filter` limits. Both are held against the bound.
//!
//! The force follows the radius without a jump: an edge of a hundredth of a cell is a sharp one to the grid,
//! and between neighbouring radii, 10 µm apart, the force changes by a small part of itself.

use super::monitor::{Watched, cut, cut_all, wave_speed};
use super::{Setting, Sheet};
use crate::scene::Scene;

/// Edge radii (m); the second is small against any cell.
const RADII: [f64; 7] = [0.0, 2e-7, 1e-5, 2e-5, 3e-5, 4e-5, 5e-5];

/// Fills the sheet.
pub fn fill(setting: &Setting, sheet: &mut Sheet) {
    let spacing = setting.pick(2e-5, 1e-5);
    let travel = setting.pick(0.6e-3, 1e-3);
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = cut(spacing);
        scene.workpiece.length = 2e-3;
        change(&mut scene);
        scene
    };
    let mut names = Vec::new();
    let mut scenes = Vec::new();
    for radius in RADII {
        names.push(format!("edge radius {:.1} µm", 1e6 * radius));
        scenes.push(with(&|scene| scene.tool.edge_radius = radius));
    }
    for rake in [-30.0, -15.0, 15.0, 30.0_f64] {
        names.push(format!("rake {rake}°"));
        scenes.push(with(&|scene| scene.tool.rake_angle = rake.to_radians()));
    }
    names.push("clearance 0°".into());
    scenes.push(with(&|scene| scene.tool.clearance_angle = 0.0));
    names.push("rake -30°, edge radius 50 µm, clearance 0°".into());
    scenes.push(with(&|scene| {
        scene.tool.rake_angle = (-30.0_f64).to_radians();
        (scene.tool.edge_radius, scene.tool.clearance_angle) = (5e-5, 0.0);
    }));
    let runs = cut_all(&scenes, travel, 20);
    for ((name, scene), run) in names.iter().zip(&scenes).zip(&runs) {
        let retries = run.outputs().retries;
        let depth = run.figure(run.worst.depth.max(0.0));
        let figure = sheet.at_most(format!("{name}: deepest point, cells"), depth, "", 0.1);
        figure.retried(retries).remarked(run.remark());
        let c = &scene.material.constants;
        let limit = 2.0 * scene.inputs.tool_velocity + 2.0 * c.yield_stress / (c.density * wave_speed(c));
        let motion = run.figure(run.worst.motion);
        sheet.at_most(format!("{name}: fastest motion of a point"), motion, "m/s", limit).retried(retries);
        let stored = run.figure(run.worst.speed);
        let figure = sheet.at_most(format!("{name}: largest velocity stored"), stored, "m/s", limit);
        figure
            .retried(retries)
            .remarked("of a point at the tool, between two looks (src/strays.rs)")
            .failing_because("the grid does not see it and the point does not move with it");
        sheet.at_most(format!("{name}: ledger"), run.figure(100.0 * run.worst.ledger), "%", 1.0);
    }
    let forces: Vec<f64> = runs[..RADII.len()].iter().map(mean_force).collect();
    let text: Vec<String> = forces.iter().map(|force| format!("{force:.0}")).collect();
    let changes: Vec<f64> = forces.windows(2).map(|pair| 100.0 * (pair[1] / pair[0] - 1.0)).collect();
    // Two runs that differ by rounding alone differ by 1 % (book/src/theory/contact.md).
    sheet.at_most("force at a radius of 0.2 µm against a sharp edge", changes[0], "%", 2.0);
    let most = changes[1..].iter().fold(0.0, |most: f64, change| most.max(change.abs()));
    let most = if changes.iter().all(|change| change.is_finite()) { most } else { f64::NAN };
    let figure = sheet.at_most("force from radius to radius, largest change", most, "%", 10.0);
    figure.remarked(format!("{} N at 0, 0.2, 10, 20, 30, 40 and 50 µm", text.join(", ")));
}

/// Cutting force (N) as work over way: the mean over the whole cut.
fn mean_force(run: &Watched) -> f64 {
    let o = run.outputs();
    run.figure(o.tool_work / o.cut_length)
}
