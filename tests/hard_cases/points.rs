//! Cases 6 to 8: points and bars on the grid, without a tool.

use super::hold;

#[test]
fn points_with_few_neighbours_stay_slow() {
    hold("6");
}

#[test]
fn a_stressed_bar_slides_through_the_grid() {
    hold("7");
}

#[test]
fn a_long_vibration_keeps_its_energy() {
    hold("8");
}
