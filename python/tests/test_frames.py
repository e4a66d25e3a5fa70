"""Frames hold what the FMU wrote, and can be drawn."""

import re

import numpy as np
import pytest

from swarf import SwarfError
from swarf.frames import Frame


def test_frames_are_in_order_of_time(result):
    """Two a feed over five feeds, and the first."""
    times = [frame.time for frame in result.frames]
    assert len(times) == 11 and times == sorted(times) and times[0] == 0
    assert result.frame(-1).time == pytest.approx(result.history.index[-1], rel=0.01)


def test_a_frame_is_the_material(result):
    """Its points have the (scaled) mass of the block, and the temperatures that the history tells."""
    frame = result.frame(-1)
    p = result.parameters
    volume = p["workpiece.length"] * p["workpiece.height"] * p["workpiece.width"]
    mass = p["material.density"] * volume * result.history["numerics.mass_factor"].iloc[-1]
    # The lattice fills the block, whose sides are whole cells; the file has single precision.
    assert frame.field("mass").sum() == pytest.approx(mass, rel=1e-5)
    peak = result.history["chip_temperature_peak"].iloc[-1]
    assert frame.field("temperature").max() == pytest.approx(peak, rel=0.05)
    assert frame.tool.shape[0] > 3 and frame.field("velocity").shape == (len(frame.points), 3)


def test_von_mises_is_that_of_known_stresses(result, monkeypatch):
    """Tension gives the tension, pure shear √3 of it, a pressure nothing; a file's own field rules."""
    frame = Frame(result.frame(0).path)
    stress = np.zeros((3, 6))
    stress[0, 0], stress[1, 3], stress[2, :3] = 100.0, 100.0, -50.0
    arrays = {"Points": np.zeros((3, 3)), "stress": stress}
    monkeypatch.setitem(frame.__dict__, "_read", (0.0, arrays))
    assert frame.field("von_mises") == pytest.approx([100, 100 * np.sqrt(3), 0], abs=1e-9)
    assert frame.field("pressure") == pytest.approx([-100 / 3, 0, 50])
    arrays["von_mises"] = np.array([1.0, 2.0, 3.0])
    assert frame.field("von_mises").tolist() == [1.0, 2.0, 3.0] and frame.names.count("von_mises") == 1


def test_an_unknown_field_is_answered_with_those_there_are(result):
    with pytest.raises(SwarfError, match="plastic_strain"):
        result.frame(-1).field("strain")
    with pytest.raises(SwarfError, match="no frame 99"):
        result.frame(99)


def test_profiles_carry_units(result):
    rake = result.profile("rake")
    assert len(rake) > 2 and all(re.search(r"\(.+\)|points", column) for column in rake)
    assert result.profiles["rake"] >= 10


def test_pictures_and_animation(result, tmp_path):
    """The picture shows every point; the animation has a picture for each frame."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = result.plot("von_mises")
    assert len(axes.collections[0].get_offsets()) == len(result.frame(-1).points)
    assert result.plot("cutting_force").get_ylabel() == "cutting_force (N)"
    path = result.animate(tmp_path / "chip.gif", "temperature")
    image = pytest.importorskip("PIL.Image").open(path)
    assert image.n_frames == len(result.frames)
