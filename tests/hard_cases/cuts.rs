//! Cases 1 to 4: cuts of every speed, friction, feed and tool.

use super::{hold, hold_but};

/// The paper met negative volumes in this cut at its own speed.
#[test]
fn the_papers_cut_keeps_its_volumes_and_its_ledger() {
    hold("1");
}

/// The 99.9th percentile of strain grows by 30 to 55 % from 40 to 20 µm, where 20 % are allowed.
#[test]
fn any_tool_speed_keeps_volumes_and_ledger() {
    hold_but("2", &["change of the 99.9th percentile"]);
}

#[test]
fn friction_and_feed_may_be_anything() {
    hold("3");
}

/// One shape lets a point store 142 m/s between two looks of the guard on stray velocities, where 134 are
/// allowed.
#[test]
fn no_edge_throws_points_or_lets_them_in() {
    hold_but("4", &["edge radius 50.0 µm: largest velocity stored"]);
}
