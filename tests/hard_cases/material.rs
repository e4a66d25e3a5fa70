//! Cases 5, 9 and 12: what the material may be asked to bear.

use super::hold;

#[test]
fn molten_and_frozen_metal_is_cut_with_a_closed_ledger() {
    hold("5");
}

#[test]
fn a_stretched_bar_stays_one_piece() {
    hold("9");
}

#[test]
fn nonsense_is_refused_stopped_or_computed() {
    hold("12");
}
