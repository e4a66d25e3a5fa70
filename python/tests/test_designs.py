"""Designs hold what they promise, and slips are told."""

import numpy as np
import pytest

from swarf import SwarfError
from swarf.designs import make, read_varied


def varied(**told):
    return [read_varied(name, value) for name, value in told.items()]


def test_levels_alone_make_a_grid():
    found = make(varied(feed=[1, 2, 3], rake=["0 deg", "5 deg"]), None, None, 0)
    assert len(found) == 6 and {(s["feed"], s["rake"]) for s in found} == {
        (f, r) for f in (1, 2, 3) for r in ("0 deg", "5 deg")
    }


def test_a_range_in_a_grid_has_its_ends():
    found = [s["speed"] for s in make(varied(speed=(1.0, 2.0)), 5, "grid", 0)]
    assert found == [1.0, 1.25, 1.5, 1.75, 2.0]


def test_a_latin_hypercube_has_one_cut_in_each_row_and_column():
    """Eight cuts: each eighth of each range is hit once."""
    found = make(varied(speed=(0.0, 8.0), feed=(0.0, 8.0)), 8, "lhs", 3)
    for name in ("speed", "feed"):
        assert sorted(int(s[name]) for s in found) == list(range(8))


def test_sobols_sequence_is_balanced_and_ranges_keep_their_unit():
    """A scrambled sequence of a power of two hits each half equally often; levels share it."""
    found = make(varied(speed=(100, 300, "m/min"), feed=["a", "b"]), 16, None, 0)
    speeds = np.array([float(s["speed"].removesuffix(" m/min")) for s in found])
    assert (speeds < 200).sum() == 8 and speeds.min() >= 100 and speeds.max() <= 300
    assert [s["feed"] for s in found].count("a") == 8


def test_the_same_seed_gives_the_same_design():
    one, two, other = (make(varied(speed=(0.0, 1.0)), 5, "sobol", seed) for seed in (1, 1, 2))
    assert one == two and one != other and len(one) == 5


@pytest.mark.parametrize(
    "told, part",
    [
        ((2, 1), "below"),
        ((1, 2, 3), "no range"),
        ("fast", "list of levels"),
        ([], "list of levels"),
        ({"from": 1}, "from, to"),
        (("1 mm", "2 mm"), "numbers"),
    ],
)
def test_a_slip_is_answered(told, part):
    with pytest.raises(SwarfError, match=part):
        read_varied("feed", told)


def test_a_sample_needs_its_number():
    with pytest.raises(SwarfError, match="needs n"):
        make(varied(speed=(1.0, 2.0)), None, None, 0)
    with pytest.raises(SwarfError, match="none of"):
        make(varied(speed=(1.0, 2.0)), 3, "random", 0)
