"""A cut reaches the FMU as asked, is priced before it is run, and gives what it has when it ends early."""

import math
import shutil
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
from conftest import CHEAP

import swarf
from swarf import SwarfError
from swarf.cut import STEPS_PER_FEED


def test_keywords_and_settings_reach_the_fmu(result):
    """Read back from the instance that ran, in SI units."""
    p = result.parameters
    assert p["tool_velocity"] == pytest.approx(3.0) and p["feed"] == pytest.approx(1e-4)
    assert p["tool.rake_angle"] == pytest.approx(math.radians(5)) and p["friction"] == 0.3
    assert p["tool.edge_radius"] == pytest.approx(3e-5) and p["material.name"] == "AISI 1045"
    items = result.cut.description.variable("effects.heat").items
    assert p["effects.heat"] == items["conduction"]
    assert p["numerics.threads"] == 1


def test_sizes_follow_from_the_feed():
    """Twice the feed is the same cut twice as large: every length doubles, nothing else changes."""
    one, two = (swarf.Cut(speed=3, feed=f, edge_radius=0.3 * f).values(5) for f in (1e-4, 2e-4))
    lengths = {n for n in one if one[n] != two[n]}
    assert {"numerics.point_spacing", "workpiece.height", "workpiece.length", "tool.height"} <= lengths
    for name in lengths:
        assert two[name] == pytest.approx(2 * one[name], rel=1e-12), name


def test_points_per_feed_are_those_of_the_preset(cut):
    """They are read from the price list that the FMU carries."""
    with zipfile.ZipFile(swarf.find_fmu()) as archive:
        lines = archive.read("resources/price_list.csv").decode().splitlines()
    spacing = {line.split(",")[1]: float(line.split(",")[2]) for line in lines if line.startswith("preset,")}
    feed = cut.description.variable("feed").start
    for accuracy in ("draft", "fine"):
        points = cut.replace(accuracy=accuracy, points_per_feed=None).points_per_feed
        assert points == pytest.approx(feed / spacing[accuracy])


def test_the_estimate_comes_without_a_run(cut):
    """Price and bands; a longer run costs more, a coarser one has a wider band."""
    short, long = cut.estimate("5 feeds"), cut.estimate("10 feeds")
    assert 0 < short.cpu_seconds < long.cpu_seconds and short.points > 100
    finer = cut.replace(points_per_feed=10).estimate("5 feeds")
    assert 0 < finer.bands["cutting_force"] < short.bands["cutting_force"] <= 1
    assert "CPU time" in str(short)


def test_the_bands_of_all_outputs_are_told():
    """At a preset's own spacing they stand in the price list."""
    bands = swarf.Cut(speed=3, feed=1e-4, heat="conduction").estimate("1 feed").bands
    assert {"cutting_force", "thrust_force", "chip_thickness", "chip_temperature"} <= set(bands)


def test_a_run_gives_history_and_steady_values(result):
    """Fixed travel: ten steps a feed; forces positive, thrust below the force, chip thicker than the feed."""
    assert result.failure is None and len(result.history) == 5 * STEPS_PER_FEED
    assert result.history["travel"].iloc[-1] == pytest.approx(5.0)
    steady = result.steady
    assert 0 < steady.thrust_force.mean < steady.cutting_force.mean
    assert steady.chip_thickness.mean > 1e-4
    assert result.history["cut_length"].iloc[-1] == pytest.approx(5e-4, rel=0.05)
    force = steady.cutting_force
    assert force.unit == "N" and force.to("kN") == pytest.approx(force.mean / 1000)
    assert force.band == pytest.approx(result.bands["cutting_force"] * force.mean)
    for text in ("N", "scatter", "band"):
        assert text in str(force)
    assert set(result.history.columns) - {"travel"} == set(result.cut.description.outputs)


def test_the_mean_is_that_of_the_history(result):
    """Steady figures come from whole blocks after the run-in."""
    rows = result.history["cutting_force"].to_numpy()[int(result.steady.start) * STEPS_PER_FEED :]
    assert result.steady.cutting_force.mean == pytest.approx(rows.mean(), rel=1e-12)


def test_without_a_travel_the_cut_ends_when_it_is_steady(cut):
    """It is shorter than the longest travel, and its standard error is below the tolerance."""
    found = cut.run(tolerance=0.2, progress=False, frames=0)
    force = found.steady.cutting_force
    assert found.steady.reached and found.history["travel"].iloc[-1] < 12
    assert force.standard_error <= 0.2 * force.mean
    with pytest.raises(SwarfError, match="kept no files"):
        _ = found.folder


def test_two_runs_are_the_same_in_every_bit(cut):
    """Nothing of the package may add chance; only the estimate of the price is the machine's."""
    one, other = (cut.run(travel=1, progress=False, frames=0).history for _ in range(2))
    machine = "numerics.estimated_cpu_time"
    assert np.array_equal(one.drop(columns=machine).to_numpy(), other.drop(columns=machine).to_numpy())


def test_an_interrupted_run_gives_what_there_is(cut, monkeypatch):
    """Ctrl-C in the middle: the history until then, and a reason."""
    from swarf._fmu import Instance

    step = Instance.step_to

    def interrupted(self, time):
        if self.time > 0 and time > 5e-5:
            raise KeyboardInterrupt
        step(self, time)

    monkeypatch.setattr(Instance, "step_to", interrupted)
    found = cut.run(travel=5, progress=False)
    assert found.failure == "interrupted" and 0 < len(found.history) < 5 * STEPS_PER_FEED
    assert found.frames and "ended early" in repr(found)


def test_a_refused_model_says_why(cut):
    """What the FMU logs becomes the failure, and the history is empty."""
    found = cut.replace(**{"numerics.courant": 1.24, "numerics.speed": "exact"}).run(travel=1, progress=False)
    assert "courant" in found.failure and len(found.history) == 0
    assert found.row()["failure"] == found.failure


@pytest.mark.parametrize(
    "keywords, part",
    [
        ({"heat": "some"}, "conduction"),
        ({"material": "cheese"}, "AISI 1045"),
        ({"settings": {"numerics.treads": 1}}, "numerics.threads"),
        ({"settings": {"cutting_force": 1}}, "output"),
        ({"settings": {"numerics.threads": 1.5}}, "whole number"),
        ({"settings": {"effects.damage": "maybe"}}, "true or false"),
        ({"feed": "0 mm"}, "above 0"),
        ({"friction": 0.1, "settings": {"friction": 0.2}}, "twice"),
        ({"points_per_feed": 1}, "outside"),
    ],
)
def test_a_slip_is_answered_with_what_is_allowed(keywords, part):
    with pytest.raises(SwarfError, match=part):
        swarf.Cut(**{"speed": 3, "feed": 1e-4, **keywords})


def test_replace_changes_keywords_and_variables(cut):
    other = cut.replace(feed="0.2 mm", **{"tool.clearance_angle": "7 deg"})
    assert other.feed == pytest.approx(2e-4) and cut.feed == pytest.approx(1e-4)
    assert other.values(5)["tool.clearance_angle"] == pytest.approx(math.radians(7))


def test_variables_are_a_table(fmu):
    table = swarf.variables()
    assert table.loc["cutting_force", "causality"] == "output" and table.loc["feed", "unit"] == "m"


MATERIAL = """
[[material]]
name = "mine"
[material.elastic]
density = 7850.0
youngs_modulus = 205e9
poissons_ratio = 0.29
source = "a test"
[material.flow]
yield_stress = {yield_stress}
hardening_modulus = 600.8e6
hardening_exponent = 0.234
rate_coefficient = 0.0134
reference_rate = 1.0
thermal_exponent = 1.0
melting_temperature = 1733.15
reference_temperature = 298.15
source = "a test"
[material.thermal]
specific_heat = 486.0
conductivity = 50.7
thermal_expansion = 1.12e-5
taylor_quinney = 0.9
source = "a test"
"""


def test_a_material_file_gives_the_library_s_result(cut, tmp_path):
    """The constants of AISI 1045 from a file are AISI 1045, to the bit; a harder one needs more force."""
    forces = []
    for name, value in (("soft", 553.1e6), ("hard", 800e6)):
        path = tmp_path / f"{name}.toml"
        path.write_text(MATERIAL.format(yield_stress=value))
        forces.append(cut.replace(material=str(path)).run(travel=1, progress=False, frames=0).history)
    library = cut.run(travel=1, progress=False, frames=0).history
    assert np.array_equal(library["cutting_force"], forces[0]["cutting_force"])
    assert forces[1]["cutting_force"].iloc[-1] > forces[0]["cutting_force"].iloc[-1]


def test_further_materials_of_the_fmu_are_known_by_name(fmu, tmp_path):
    """The repository's own file, in a copy of the FMU: its constants are set, in the ranges of the FMU."""
    further = Path(__file__).resolve().parents[2] / "resources" / "materials_further.toml"
    if not further.is_file():
        pytest.skip("not in a clone of the repository")
    copy = tmp_path / "swarf.fmu"
    shutil.copy(fmu, copy)
    with zipfile.ZipFile(copy, "a") as archive:
        if "resources/materials_further.toml" not in archive.namelist():
            archive.write(further, "resources/materials_further.toml")
    for record in tomllib.loads(further.read_text())["material"]:
        made = swarf.Cut(record["name"], speed=3, feed=1e-4, fmu=copy, **CHEAP)
        assert made.value_of("material.name") == "custom"
        assert made.value_of("material.yield_stress") == record["flow"]["yield_stress"]
        found = made.run(travel=1, progress=False, frames=0)
        assert found.failure is None and found.history["cutting_force"].iloc[-1] > 0, record["name"]


@pytest.mark.parametrize(
    "old, new, part",
    [
        ("youngs_modulus = 205e9\n", "", "youngs_modulus"),
        ("poissons_ratio", "poisson_ratio", "poissons_ratio"),
        ('source = "a test"\n[material.flow]', "[material.flow]", "no source"),
        ("[material.thermal]", "[material.termal]", "specific_heat"),
        ("density = 7850.0", "density = 7850.0\nhardness = 3", "hardness"),
    ],
)
def test_a_damaged_material_file_is_refused(tmp_path, old, new, part):
    """A misspelt key would silently lose a value."""
    path = tmp_path / "mine.toml"
    text = MATERIAL.format(yield_stress=5e8)
    assert old in text and tomllib.loads(text)
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(SwarfError, match=part):
        swarf.Cut(str(path), speed=3, feed=1e-4)


def test_settings_of_the_tests_are_cheap(cut):
    assert cut.points_per_feed == CHEAP["points_per_feed"]
