//! Cases 10, 11 and 13, and what other processes do: the tool's ways, long runs, many instances, killed
//! processes.

use super::hold;

#[test]
fn inputs_may_jump() {
    hold("10");
}

#[test]
fn the_tool_comes_and_goes() {
    hold("11");
}

#[test]
fn a_long_run_is_replayed_to_the_bit_from_any_saved_state() {
    hold("13");
}

#[test]
fn many_instances_share_the_machine_and_give_it_back() {
    hold("many instances");
}

/// A reader trusts every file whose name does not end in `.part`.
#[test]
fn a_killed_process_leaves_whole_files() {
    hold("killed processes");
}
