//! The reference cut, as the tests that run it set it up.

use swarf::scene::{Inputs, Scene};
use swarf::session::{Advance, Session};

/// Speed of the tool (m/s).
pub const SPEED: f64 = 50.0;
/// Communication step (s): 0.05 mm of travel.
pub const STEP: f64 = 1e-6;

/// The reference cut at another spacing (m).
pub fn scene(spacing: f64, friction: f64, rake_degrees: f64, feed: f64) -> Scene {
    let mut scene = Scene::default();
    scene.numerics.point_spacing = spacing;
    scene.numerics.threads = 1;
    scene.inputs = Inputs { tool_velocity: SPEED, feed, friction };
    scene.tool.rake_angle = rake_degrees.to_radians();
    scene
}

/// Runs to a time (s).
pub fn advance(session: &mut Session, time: f64) {
    let advance = session.advance_to(time, &mut |_| true).expect("a stable run");
    assert_eq!(advance, Advance::Reached);
}
