//! Bodies on an inclined plane with friction, turned against the grid (`study::verification::incline`).

use swarf::study::verification::incline::{Body, GRID_ANGLES, Incline};

fn incline(body: Body, friction: f64, degrees: f64, points_touch: bool) -> Incline {
    let (slope, grid_angle) = (30_f64.to_radians(), degrees.to_radians());
    Incline { body, slope, friction, grid_angle, cell: 0.05, points_touch }
}

/// Coulomb's law and rigid-body mechanics give the way; 0.5 % for the block and 1 % for the disk are the acceptance.
#[test]
fn bodies_slide_as_coulomb_says_at_any_angle_to_the_grid() {
    for (body, friction, bound) in
        [(Body::Block, 0.0, 5e-3), (Body::Block, 0.3, 5e-3), (Body::Disk, 0.1, 1e-2)]
    {
        for degrees in GRID_ANGLES {
            for points_touch in [true, false] {
                let outcome = incline(body, friction, degrees, points_touch).run();
                let error = outcome.travel / outcome.exact - 1.0;
                println!(
                    "{body:?}, μ = {friction}, grid at {degrees}°, points touch {points_touch}: {error:+.2e}"
                );
                assert!(
                    error.abs() < bound,
                    "{body:?}, μ = {friction}, grid at {degrees}°, points touch {points_touch}: way off by {error:e}"
                );
            }
        }
    }
}

/// A rigid disk rolls with 2/3 g sin θ. Where points touch it does so within 1 % (the bound) with 16 cells along the
/// radius: it goes as if thinner by an eighth of a cell.
#[test]
fn a_disk_rolls_where_points_touch() {
    for degrees in [0.0, 17.0] {
        let rolling = Incline { cell: 0.025, ..incline(Body::Disk, 0.6, degrees, true) };
        let outcome = rolling.run();
        let error = outcome.travel / outcome.exact - 1.0;
        println!("disk rolls, grid at {degrees}°: {error:+.2e}");
        assert!(error.abs() < 1e-2, "disk rolls, grid at {degrees}°: way off by {error:e}");
    }
}

/// Friction above tan θ holds the block: it creeps less than 1e-4 (the bound) of the way it would slide without.
#[test]
fn a_sticking_block_does_not_creep() {
    for degrees in GRID_ANGLES {
        for points_touch in [true, false] {
            let outcome = incline(Body::Block, 0.7, degrees, points_touch).run();
            let free = incline(Body::Block, 0.0, degrees, points_touch);
            // Gravity grows over a fifth of the time: 0.406 instead of 1/2 of the acceleration.
            let creep = outcome.creep / (0.406 * free.exact_acceleration());
            println!("grid at {degrees}°, points touch {points_touch}: creep {creep:.1e}");
            assert!(creep.abs() < 1e-4, "grid at {degrees}°, points touch {points_touch}: creep {creep:e}");
        }
    }
}

/// A point is as wide as it is, so contact begins when the gap closes: within 0.1 cell, the bound, where the points
/// touch. Where nodes touch it begins as soon as a node behind the face has mass, up to 1.25 cells early: the criterion is
/// not met there, and the test holds the reason.
#[test]
fn contact_begins_at_the_surface_where_points_touch() {
    for degrees in GRID_ANGLES {
        let gap = |points_touch| incline(Body::Block, 0.0, degrees, points_touch).first_contact();
        let (points, nodes) = (gap(true), gap(false));
        println!("grid at {degrees}°: gap {points:.4} cells where points touch, {nodes:.2} where nodes do");
        assert!(points.abs() < 0.1, "grid at {degrees}°: points touch at a gap of {points} cells");
        assert!((0.2..1.3).contains(&nodes), "grid at {degrees}°: nodes touch at a gap of {nodes} cells");
    }
}
