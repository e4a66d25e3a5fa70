//! Orthogonal cutting: a block held at its bottom and, if the scene says so, at its left, and a tool that
//! comes from the right.
//!
//! A tool must not reach a held side: what is left of the workpiece would be pressed between two rigid walls.
//! One feed before it the tool stops (`FEEDS_TO_STOP`), and the run goes on with a tool at rest: not every
//! master that a step is refused or cut short to keeps what it has computed (book, Limits).

use crate::error::Error;
use crate::grid::{FixedNodes, MARGIN};
use crate::output::results::CutBlock;
use crate::scene::lattice::StartLattice;
use crate::scene::{DimensionChoice, Inputs, Scene};
use crate::setup::process::{Bodies, FEEDS_TO_STOP, InputsNow, IntegratedArea, PlacedLattice, Process};
use crate::simulation::ToolMotion;
use crate::speedups::{active_window, rigid_chip};
use crate::tool::RigidTool;
use crate::tool::profile::ToolShape;

/// The process.
pub struct Cut;

impl Process for Cut {
    fn check(&self, scene: &Scene) -> Result<(), Error> {
        let workpiece = &scene.workpiece;
        let missing: [(bool, &str, &str, &str); 2] = [
            (workpiece.endless, "workpiece.endless", "true", "false"),
            (workpiece.revolution_length > 0.0, "workpiece.revolution_length", "above 0", "0"),
        ];
        match missing.into_iter().find(|entry| entry.0) {
            Some((_, name, asked, allowed)) => {
                Err(Error::NotAvailable { name: name.into(), asked: asked.into(), allowed: allowed.into() })
            }
            None => Ok(()),
        }
    }

    /// At least two cells must be left below the tool, and it is lifted by no more than the workpiece height.
    fn check_inputs(&self, scene: &Scene, inputs: &Inputs) -> Result<(), Error> {
        let (feed, height) = (inputs.feed, scene.workpiece.height);
        let (min, max) = (-height, height - 2.0 * scene.numerics.cell());
        if (min..=max).contains(&feed) {
            Ok(())
        } else {
            Err(Error::OutOfRange { name: "feed".into(), asked: feed, min, max, unit: "m" })
        }
    }

    /// The workpiece as a lattice of points, its bottom nodes fixed, and its left ones if that side is held.
    ///
    /// A wall is only as long as the workpiece: a chip flies past it. It goes on behind its surface as far as
    /// points reach: free nodes there would take the stress off points that press on it (test
    /// `the_period_converges`).
    fn bodies(&self, scene: &Scene, axes: usize) -> Bodies {
        let cell = scene.numerics.cell();
        let workpiece = &scene.workpiece;
        let size = [workpiece.length, workpiece.height, workpiece.width];
        // Room for the chip: a workpiece length to each side, three heights above; memory is used only where
        // points are.
        let before = [workpiece.length, 0.25 * workpiece.height + 8.0 * cell, workpiece.width];
        let behind = [workpiece.length, 3.0 * workpiece.height, workpiece.width];
        let mut counts = [1; 3];
        let mut first = [0; 3];
        let mut origin = [0.0; 3];
        for axis in 0..axes {
            first[axis] = (before[axis] / cell).ceil() as i32 + 4;
            origin[axis] = -cell * f64::from(first[axis]);
            counts[axis] = first[axis] + ((size[axis] + behind[axis]) / cell).ceil() as i32 + 4;
        }
        let last = |axis: usize| first[axis] + (size[axis] / cell + 1e-9).floor() as i32;
        let everything = i32::MAX / 2;
        let left = FixedNodes {
            low: [first[0] - MARGIN, first[1] - MARGIN, -everything],
            high: [first[0], last(1), everything],
            axes: [true; 3],
        };
        let bottom = FixedNodes {
            low: [first[0] - MARGIN, first[1] - MARGIN, -everything],
            high: [last(0), first[1], everything],
            axes: [true; 3],
        };
        let lattice = StartLattice::new(size, scene.numerics.point_spacing, axes);
        let fixed = if workpiece.held_side { vec![left, bottom] } else { vec![bottom] };
        Bodies { counts, origin, fixed, lattices: vec![PlacedLattice { lattice, first }] }
    }

    /// The tool at its feed, its foremost part within the feed `tool.initial_gap` ahead of the workpiece's
    /// right side; with a negative feed it stands above the workpiece's surface.
    fn tool(&self, scene: &Scene) -> Result<RigidTool, Error> {
        let tool = &scene.tool;
        let shape = ToolShape::new(
            tool.rake_angle,
            tool.clearance_angle,
            tool.edge_radius,
            tool.length,
            tool.height,
        )?;
        let feed = scene.inputs.feed;
        let (start, direction) = (shape.rake_start(), shape.rake_direction());
        // A face that leans forward is foremost at the workpiece's top, otherwise the edge is.
        let on_rake = start[0] + direction[0] / direction[1] * (feed.min(tool.height) - start[1]).max(0.0);
        let edge = shape.outline(64).into_iter().filter(|point| point[1] <= feed);
        let foremost = edge.map(|point| point[0]).fold(on_rake, f64::min);
        let position = [scene.workpiece.length + tool.initial_gap - foremost, scene.workpiece.height - feed];
        Ok(RigidTool { shape, position, velocity: [0.0; 2], friction: scene.inputs.friction })
    }

    /// Vertically the tool follows the slope of the feed exactly, and makes up a jump no faster than
    /// `tool.feed_rate_limit`. Before a held side it goes neither further nor deeper.
    fn tool_motion(
        &self,
        scene: &Scene,
        now: &InputsNow,
        tool: &RigidTool,
        time_step: &dyn Fn(&ToolMotion) -> f64,
    ) -> ToolMotion {
        let Inputs { tool_velocity, feed, friction } = now.inputs;
        let limit = scene.tool.feed_rate_limit;
        let deviation = scene.workpiece.height - feed - tool.position[1];
        let trial = ToolMotion { velocity: [-tool_velocity, limit], friction };
        let catch_up = (deviation / time_step(&trial)).clamp(-limit, limit);
        let mut velocity = [-tool_velocity, catch_up - now.feed_slope];
        if self.feeds_left(scene, tool) < FEEDS_TO_STOP {
            velocity = velocity.map(|component| component.max(0.0));
        }
        ToolMotion { velocity, friction }
    }

    fn feeds_left(&self, scene: &Scene, tool: &RigidTool) -> f64 {
        let [x, y] = tool.position;
        let depth = scene.workpiece.height - y;
        if !scene.workpiece.held_side || depth <= 0.0 {
            return f64::INFINITY;
        }
        (x + tool.shape.foremost(depth)) / depth
    }

    fn cut_block(&self, scene: &Scene) -> Option<CutBlock> {
        let workpiece = &scene.workpiece;
        Some(CutBlock {
            size: [workpiece.length, workpiece.height, workpiece.width],
            spacing: scene.numerics.point_spacing,
            axes: if scene.numerics.dimension == DimensionChoice::ThreeDimensional { 3 } else { 2 },
        })
    }

    fn integrated_area(&self, scene: &Scene, inputs: &Inputs, distance: f64) -> IntegratedArea {
        // A tool that is lifted clear cuts nothing.
        let feed = inputs.feed.max(0.0);
        IntegratedArea {
            all: active_window::integrated_area(scene, feed, distance),
            yielding: rigid_chip::integrated_chip(scene, feed, distance),
        }
    }
}
