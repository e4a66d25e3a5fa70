"""The surrogate: the fitted law to the last digits, honest about its range, with the old surface in mind."""

import shutil
import zipfile

import fmpy
import numpy as np
import pandas as pd
import pytest
from fmpy.validation import validate_fmu

import swarf
from swarf import SwarfError
from swarf._fmu import Description, Instance, Refused
from swarf.surrogate import _fit

pytest.importorskip("sklearn")
pytestmark = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler here"
)


@pytest.fixture(scope="module")
def study(cut, tmp_path_factory):
    """Feed, speed, friction and rake over a Sobol design."""
    return swarf.study(
        cut,
        feed=(0.08, 0.2, "mm"),
        speed=(100, 300, "m/min"),
        friction=(0.1, 0.5),
        rake=(0, 10, "deg"),
        n=32,
        travel="4 feeds",
        folder=tmp_path_factory.mktemp("study"),
        scheduler="serial",
        progress=False,
    )


@pytest.fixture(scope="module")
def made(study, tmp_path_factory):
    return study.surrogate(tmp_path_factory.mktemp("surrogate") / "swarf-surrogate.fmu")


@pytest.fixture(scope="module")
def description(made):
    return Description(made.path)


def run(description, values, steps, step=1e-4):
    """One instance; ``steps`` are settings before each step. Gives the outputs after each."""
    rows = []
    with Instance(description, values) as unit:
        unit.initialize(1.0)
        for number, settings in enumerate(steps):
            unit.set(settings)
            unit.step_to((number + 1) * step)
            rows.append(unit.get(description.outputs))
        return pd.DataFrame(rows), unit.warnings


def test_the_description_is_valid(made, fmu):
    """FMPy's checks; inputs and outputs have the big unit's names, references and units."""
    assert validate_fmu(str(made.path)) == []
    big, small = swarf._fmu.describe().variables, Description(made.path).variables
    for name in ("tool_velocity", "feed", "friction", "cutting_force", "thrust_force", "tool.rake_angle"):
        for trait in ("reference", "unit", "causality", "kind"):
            assert getattr(small[name], trait) == getattr(big[name], trait), name
    with zipfile.ZipFile(made.path) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
    assert "sources/surrogate.c" in names and "held back" in page and "tool.rake_angle" in page


def test_the_unit_is_the_fitted_law(made, description):
    """C against numpy at random points of the box: sums of a few dozen products, in another order."""
    rng = np.random.default_rng(2)
    for _ in range(10):
        x = made.ranges["low"] + rng.random(len(made.ranges)) * (made.ranges["high"] - made.ranges["low"])
        rows, warnings = run(description, x.to_dict(), [{}])
        expected = made.predict([x.to_dict()]).iloc[0]
        assert rows[expected.index].iloc[0].to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-9)
        assert rows["surrogate.in_range"].iloc[0] and warnings == []
        assert rows["cutting_power"].iloc[0] == pytest.approx(expected["cutting_force"] * x["tool_velocity"])


def test_the_slope_is_the_law_s(made, description):
    """Central difference over a millionth of the feed, by the unit itself."""
    middle = made.ranges.mean(axis=1).to_dict()
    feed, small = middle["feed"], 1e-6 * middle["feed"]
    rows, _ = run(description, middle, [{"feed": feed}, {"feed": feed + small}, {"feed": feed - small}])
    for name in ("cutting_force", "thrust_force"):
        difference = (rows[name][1] - rows[name][2]) / (2 * small)
        # Rounding of a force of 100 N over 2e-10 m leaves six digits.
        assert rows[f"{name}_feed_slope"][0] == pytest.approx(difference, rel=1e-4)


def test_held_back_cuts_are_met_within_twice_the_band(made):
    """The band of the force is the study's own; the error of the mean must not be larger than twice it."""
    force = made.errors.loc["cutting_force"]
    assert force["rms"] <= 2 * force["band"]
    # More than that: the law explains far more than the mean of all cuts would (a fifth of the spread at
    # most).
    assert force["relative"] < 0.1


def test_outside_of_the_range_the_unit_says_so(made, description):
    """Held at the end, flagged, one warning for each excursion."""
    middle = made.ranges.mean(axis=1).to_dict()
    most = made.ranges.loc["friction", "high"]
    steps = [{}, {"friction": most}, {"friction": most + 0.2}, {"friction": most + 0.3}, {"friction": most}]
    rows, warnings = run(description, middle, steps)
    assert rows["surrogate.in_range"].tolist() == [True, True, False, False, True]
    assert rows["cutting_force"][2] == rows["cutting_force"][3] == rows["cutting_force"][1]
    assert len(warnings) == 1 and "friction" in warnings[0]


def test_forces_go_straight_to_zero_below_the_smallest_feed(made, description):
    middle = made.ranges.mean(axis=1).to_dict()
    least = made.ranges.loc["feed", "low"]
    rows, _ = run(description, middle, [{"feed": least}, {"feed": least / 2}, {"feed": 0.0}, {"feed": -1e-4}])
    force = rows["cutting_force"]
    assert force[1] == pytest.approx(force[0] / 2, rel=1e-12) and force[2] == force[3] == 0.0
    assert rows["cutting_force_feed_slope"][1] == pytest.approx(force[0] / least, rel=1e-9)
    assert rows["surrogate.in_range"].tolist() == [True, False, False, False]


def test_width_scales_forces_only(made, description):
    middle = made.ranges.mean(axis=1).to_dict()
    one, two = (run(description, {**middle, "workpiece.width": w}, [{}])[0].iloc[0] for w in (1e-3, 3e-3))
    assert two["cutting_force"] == pytest.approx(3 * one["cutting_force"], rel=1e-12)
    assert two["chip_thickness"] == one["chip_thickness"]


def test_the_surface_left_one_revolution_ago_is_met(made, description):
    """A wave of the feed: h = feed(s) − feed(s − L) + feed at the start, once a revolution has gone.

    Steps end on the places of the ring, and the wave is so long that the mean over a step is that of its
    ends.
    """
    middle = made.ranges.mean(axis=1).to_dict()
    speed, start = 2.0, middle["feed"]
    length, count = 0.0512, 256  # 256 steps in a revolution, each of four places
    step = length / count / speed
    places = np.arange(4 * count + 1) * speed * step
    wave = start + 1e-5 * np.sin(2 * np.pi * places / length * 1.25)
    slopes = np.diff(wave) / step
    thickness = []
    values = {**middle, "tool_velocity": speed, "workpiece.revolution_length": length}
    with Instance(description, values) as unit:
        unit.initialize(1.0)
        feed = description.variables["feed"].reference
        for number, slope in enumerate(slopes):
            unit.set({"feed": wave[number]})
            unit._slave.setRealInputDerivatives([feed], [1], [slope])
            unit.step_to((number + 1) * step)
            thickness.append(unit.get(["uncut_chip_thickness"])["uncut_chip_thickness"])
    middles = (wave[:-1] + wave[1:]) / 2
    expected = middles.copy()
    expected[count:] = middles[count:] - middles[:-count] + start
    # Straight lines between places and between ends of steps are the same lines.
    assert np.array(thickness) == pytest.approx(expected, abs=1e-12)


def test_a_tool_that_is_lifted_leaves_more_for_the_next_turn(made, description):
    """Lifted clear for the second revolution, it meets two feeds in the third."""
    middle = made.ranges.mean(axis=1).to_dict()
    least, most = made.ranges.loc["feed", ["low", "high"]]
    feed, length, speed, count = (least + most) / 2, 0.0512, 2.0, 64
    step = length / count / speed
    values = {**middle, "feed": feed, "tool_velocity": speed, "workpiece.revolution_length": length}
    steps = [{"feed": feed}] * count + [{"feed": -1e-4}] * count + [{"feed": feed}] * count
    chip = run(description, values, steps, step)[0]["uncut_chip_thickness"].to_numpy()
    assert chip[: count - 1] == pytest.approx(feed) and np.all(chip[count + 1 : 2 * count - 1] == 0.0)
    assert chip[2 * count + 1 : -1] == pytest.approx(2 * feed)


def test_a_saved_state_goes_on_to_the_bit(made, description):
    """By memory and by bytes; damaged bytes are refused."""
    middle = made.ranges.mean(axis=1).to_dict()
    values = {**middle, "workpiece.revolution_length": 0.01}
    with Instance(description, values) as unit:
        unit.initialize(1.0)
        rng = np.random.default_rng(3)
        feeds = middle["feed"] * (1 + 0.2 * rng.standard_normal(60))

        def go(first, last):
            found = []
            for number in range(first, last):
                unit.set({"feed": feeds[number]})
                unit._slave.doStep(number * 1e-4, 1e-4)
                found.append(tuple(unit.get(description.outputs).values()))
            return found

        go(0, 30)
        state = unit._slave.getFMUstate()
        data = unit._slave.serializeFMUstate(state)
        first = go(30, 60)
        unit._slave.setFMUstate(state)
        assert go(30, 60) == first
        other = unit._slave.deSerializeFMUstate(data)
        unit._slave.setFMUstate(other)
        assert go(30, 60) == first
        with pytest.raises(Refused, match="no bytes"):
            unit._call(unit._slave.deSerializeFMUstate, b"x" + bytes(data)[1:])


def test_bad_use_is_refused_and_changes_nothing(made, description):
    with Instance(description, {}) as unit:
        with pytest.raises(Refused, match="initialized"):
            unit._call(unit._slave.doStep, 0.0, 1e-4)
        unit.initialize(1.0)
        before = unit.get(description.outputs)
        for values in ({"tool.rake_angle": 0.0}, {"feed": float("nan")}, {"workpiece.width": 1e-3}):
            with pytest.raises(Refused, match="set so"):
                unit.set(values)
        with pytest.raises(Refused, match="longer than 0"):
            unit._call(unit._slave.doStep, 0.0, 0.0)
        assert unit.get(description.outputs) == before


def test_fmpy_simulates_it(made):
    """A master that knows nothing of it."""
    table = fmpy.simulate_fmu(str(made.path), stop_time=1e-3, output=["cutting_force"], output_interval=1e-4)
    assert np.all(table["cutting_force"] > 0)


def test_a_known_law_is_met():
    """A power of the feed and a straight line of friction, from 64 points: within half a percent."""

    def truth(x):
        return np.column_stack([1e6 * x[:, 0] ** 0.75 * (1 + x[:, 1]), 5e5 * x[:, 0] * x[:, 1]])

    x = np.random.default_rng(4).random((64, 2)) * [1.5e-4, 0.4] + [5e-5, 0.1]
    law = _fit(["feed", "friction"], ["cutting_force", "thrust_force"], x, truth(x), 0)
    test = np.random.default_rng(5).random((50, 2)) * 0.9 + 0.05
    points = law.low + test * (law.high - law.low)
    assert law(test) == pytest.approx(truth(points), rel=5e-3)


def test_a_study_of_names_or_of_too_few_cuts_is_refused(study, cut, tmp_path):
    few = swarf.study(
        cut, feed=["0.1 mm", "0.15 mm"], travel=1, folder=tmp_path / "few", scheduler="serial", progress=False
    )
    with pytest.raises(SwarfError, match="needs 6 cuts"):
        few.surrogate(tmp_path / "few.fmu")
    names = swarf.study(
        cut,
        heat=["adiabatic", "conduction"],
        travel=1,
        folder=tmp_path / "names",
        scheduler="serial",
        progress=False,
    )
    with pytest.raises(SwarfError, match="effects.heat"):
        names.surrogate(tmp_path / "names.fmu")
