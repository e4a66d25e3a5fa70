"""The run-in is found, and steadiness is judged, by the scatter of blocks."""

import numpy as np
import pandas as pd
import pytest

from swarf.steady import block_means, is_steady, run_in, steady_values


def test_a_step_is_cut_off():
    """Four blocks of run-in, then noise: the rule finds the step, and not the quietest tail."""
    noise = np.random.default_rng(1).normal(0, 0.01, 12)
    blocks = np.concatenate([[0.1, 0.4, 0.7, 0.9], 1 + noise])
    assert run_in(blocks) == 4


def test_the_entry_always_counts_as_run_in():
    """Whatever the blocks say, the tool enters in the first one; a single block is all there is."""
    counts = {n: run_in(np.ones(n)) for n in range(7)}
    assert counts == {0: 0, 1: 0, 2: 1, 3: 1, 4: 1, 5: 1, 6: 1}


def test_steadiness_is_a_standard_error():
    """Alternating blocks 1 ± 0.1 behind the entry: s = 0.1 √(n/(n−1)), so s/√n = 0.0577 for n = 4."""
    blocks = 1 + 0.1 * (-1.0) ** np.arange(13)
    assert not is_steady(blocks[:5], 0.057) and is_steady(blocks[:5], 0.058)
    assert not is_steady(blocks, 0.030) and is_steady(blocks, 0.031)
    assert not is_steady(np.ones(4), 0.5)


def test_block_means_use_whole_blocks():
    assert block_means(np.arange(7.0), 3).tolist() == [1.0, 4.0]


def test_figures_of_a_known_history():
    """Blocks 0, 10, 12, 11, 11 N: the first is run-in; a temperature's band is a share of the heating."""
    force = np.repeat([0.0, 10, 12, 11, 11], 10)
    history = pd.DataFrame({"cutting_force": force, "chip_temperature": 400.0})
    units = {"cutting_force": "N", "chip_temperature": "K"}
    found = steady_values(history, 10, units, {"cutting_force": 0.5, "chip_temperature": 0.1}, 300.0, 0.05)
    assert found.start == 1 and found.cutting_force.mean == 11 and found.cutting_force.blocks == 4
    assert found.cutting_force.scatter == pytest.approx(np.sqrt(2 / 3))
    assert found.cutting_force.band == 5.5 and found.chip_temperature.band == pytest.approx(10.0)
    assert found.reached and found.table().loc["cutting_force", "unit"] == "N"
    with pytest.raises(AttributeError, match="thrust"):
        _ = found.thrust_force
