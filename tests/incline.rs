//! Bodies on an inclined plane with friction, turned against the grid (`study::verification::incline`).

use swarf::study::body_setup::Contact::{self, Distance, NodesInside, Surface, Velocity};
use swarf::study::verification::incline::{Body, GRID_ANGLES, Incline};

/// Laws that act where the bodies meet or on nodes: all of them obey Coulomb's law.
const LAWS: [Contact; 4] = [Surface, NodesInside, Distance, Velocity];

fn incline(body: Body, friction: f64, degrees: f64, contact: Contact) -> Incline {
    let (slope, grid_angle) = (30_f64.to_radians(), degrees.to_radians());
    Incline { body, slope, friction, grid_angle, cell: 0.05, contact }
}

/// Coulomb's law and rigid-body mechanics give the way; 0.5 % for the block and 1 % for the disk are the
/// issue's acceptance.
#[test]
fn bodies_slide_as_coulomb_says_at_any_angle_to_the_grid() {
    for (body, friction, bound) in
        [(Body::Block, 0.0, 5e-3), (Body::Block, 0.3, 5e-3), (Body::Disk, 0.1, 1e-2)]
    {
        for degrees in GRID_ANGLES {
            for contact in LAWS {
                let outcome = incline(body, friction, degrees, contact).run();
                let error = outcome.travel / outcome.exact - 1.0;
                println!("{body:?}, μ = {friction}, grid at {degrees}°, {contact:?}: {error:+.2e}");
                assert!(
                    error.abs() < bound,
                    "{body:?}, μ = {friction}, grid at {degrees}°, {contact:?}: way off by {error:e}"
                );
            }
        }
    }
}

/// A rigid disk rolls with 2/3 g sin θ. Where points touch it does so within 1 % (the bound) with 16
/// cells along the radius: it goes as if thinner by an eighth of a cell.
#[test]
fn a_disk_rolls_where_points_touch() {
    for degrees in [0.0, 17.0] {
        let rolling = Incline { cell: 0.025, ..incline(Body::Disk, 0.6, degrees, Surface) };
        let outcome = rolling.run();
        let error = outcome.travel / outcome.exact - 1.0;
        println!("disk rolls, grid at {degrees}°: {error:+.2e}");
        assert!(error.abs() < 1e-2, "disk rolls, grid at {degrees}°: way off by {error:e}");
    }
}

/// Friction above tan θ holds the block: it creeps less than 1e-4 (the bound) of the way it would
/// slide without.
#[test]
fn a_sticking_block_does_not_creep() {
    for degrees in GRID_ANGLES {
        for contact in LAWS {
            let outcome = incline(Body::Block, 0.7, degrees, contact).run();
            let free = incline(Body::Block, 0.0, degrees, contact);
            // Gravity grows over a fifth of the time: 0.406 instead of 1/2 of the acceleration.
            let creep = outcome.creep / (0.406 * free.exact_acceleration());
            println!("grid at {degrees}°, {contact:?}: creep {creep:.1e}");
            assert!(creep.abs() < 1e-4, "grid at {degrees}°, {contact:?}: creep {creep:e}");
        }
    }
}

/// A point is as wide as it is, so contact begins when the gap closes: within 0.1 cell, the bound,
/// where the points touch, and within a step of 0.004 cells under the distance law, whose half cell is a
/// quarter for each body. Where nodes touch it begins as soon as a node behind the face has mass, up to 1.25
/// cells early.
#[test]
fn contact_begins_at_the_surface_where_points_touch() {
    for degrees in GRID_ANGLES {
        let gap = |contact| incline(Body::Block, 0.0, degrees, contact).first_contact();
        let (points, nodes, distance) = (gap(Surface), gap(NodesInside), gap(Distance));
        println!(
            "grid at {degrees}°: gap {points:.4} cells where points touch, {nodes:.2} where nodes do, \
             {distance:.4} under the distance law"
        );
        assert!(points.abs() < 0.1, "grid at {degrees}°: points touch at a gap of {points} cells");
        assert!((0.2..1.3).contains(&nodes), "grid at {degrees}°: nodes touch at a gap of {nodes} cells");
        assert!(
            distance.abs() < 0.02,
            "grid at {degrees}°: the distance law acts at a gap of {distance} cells"
        );
    }
}

/// Under the velocity law contact begins as soon as a point of each body reaches the same node, from a cell
/// ahead of its surface (a point's 1.25 less a quarter). At no angle to the grid nodes stand 0.37, 1.37, …
/// cells before the plane: the tool reaches the first of them, and the block does at a gap of 1.37 cells, but
/// for steps of 0.004. At an angle some node is as far as the corners of two squares away, 2 · 1.25 (cos +
/// sin) − 0.5 at most.
#[test]
fn the_velocity_law_acts_when_a_node_is_shared() {
    for degrees in GRID_ANGLES {
        let gap = incline(Body::Block, 0.0, degrees, Velocity).first_contact();
        println!("grid at {degrees}°: the velocity law acts at a gap of {gap:.3} cells");
        let (sin, cos) = degrees.to_radians().sin_cos();
        let most = 2.5 * (sin + cos) - 0.5;
        assert!((1.0..most).contains(&gap), "grid at {degrees}°: a gap of {gap} cells, at most {most}");
        if degrees == 0.0 {
            assert!((gap - 1.37).abs() < 0.02, "a gap of {gap} cells");
        }
    }
}
