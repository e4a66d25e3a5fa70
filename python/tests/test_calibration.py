"""Calibration finds again what is known."""

import numpy as np
import pandas as pd
import pytest
from conftest import CHEAP

import swarf
from swarf import SwarfError, calibration
from swarf.calibration import calibrate

pytest.importorskip("scipy")
FREE = {"friction": (0.1, 0.6), "edge_radius": (10, 60, "um")}
CUTS = pd.DataFrame({"feed": [0.8e-4, 1.2e-4, 1.6e-4, 2.4e-4], "speed": [3.0, 3.0, 4.0, 2.0]})
TRUTH = {"friction": 0.3, "edge_radius": 30e-6}


def law(feed, speed, friction, radius):
    """Forces of a made-up tool, curved in both unknowns."""
    force = 2e9 * feed**0.9 * 1e-3 * (1 + 0.8 * friction - 0.2 * friction**2) * speed**-0.05 + 4e5 * radius
    return force, 0.35 * force * friction**0.5 + 2e6 * radius


def measured(noise=0.0, seed=0):
    forces = np.array([law(f, v, TRUTH["friction"], TRUTH["edge_radius"]) for f, v in CUTS.to_numpy()])
    forces *= 1 + noise * np.random.default_rng(seed).standard_normal(forces.shape)
    return CUTS.assign(cutting_force=forces[:, 0], thrust_force=forces[:, 1])


@pytest.fixture
def made_up(monkeypatch):
    """The made-up law in place of the simulation; with a scatter, if ``noise`` is set on it."""
    chance = np.random.default_rng(1)

    def at(self, points):
        self.count += len(points) * len(self._asked)
        cuts = [[(c.feed, c.speed) for c in self._asked] for _ in points]
        found = [
            [law(f, v, 0.1 + 0.5 * p[0], 1e-5 + 5e-5 * p[1]) for f, v in row] for row, p in zip(cuts, points)
        ]
        return np.array(found) * (1 + at.noise * chance.standard_normal((len(points), len(self._asked), 2)))

    at.noise = 0.0
    monkeypatch.setattr(calibration._Runs, "at", at)
    return at


def test_a_law_without_scatter_is_found(made_up, cut, tmp_path):
    """What remains is what a quadratic over two fifths of the box misses of a root."""
    found = calibrate(cut, measured(), FREE, folder=tmp_path)
    assert found.values["friction"].value == pytest.approx(0.3, rel=2e-3)
    assert found.values["edge_radius"].value == pytest.approx(3e-5, rel=2e-3)
    assert found.values["edge_radius"].unit == "m" and found.cuts_run == 2 * 18 * 4 + 4
    assert found.table["error"].abs().max() < 1e-3 and found.table["left out"].abs().max() < 1e-3
    assert found.cut.value_of("friction") == pytest.approx(found.values["friction"].value)
    assert "friction = 0.3" in str(found) or "friction = 0.2" in str(found)


def test_intervals_hold_the_truth_as_often_as_they_say(made_up, cut, tmp_path):
    """Both forces with 2 % of scatter, measured and simulated: 90 % intervals of 24 calibrations.

    21.6 of 24 are expected for each unknown; three standard deviations of a binomial are 4.4. Wider ones
    would be honest too, so more is allowed.
    """
    made_up.noise, inside = 0.02, np.zeros(2)
    for seed in range(24):
        found = calibrate(cut, measured(0.02, seed), FREE, folder=tmp_path, confidence=0.9)
        inside += [v.low <= TRUTH[name] <= v.high for name, v in found.values.items()]
    assert inside.min() >= 17, inside


def test_errors_that_are_told_decide_the_weights(made_up, cut, tmp_path):
    """The thrust is wrong by a third and is said to be: both unknowns come from the cutting force."""
    wrong = measured()
    wrong["thrust_force"] *= 4 / 3
    wrong["thrust_force error"], wrong["cutting_force error"] = 1e4, 0.1
    found = calibrate(cut, wrong, FREE, folder=tmp_path)
    assert found.values["edge_radius"].value == pytest.approx(3e-5, rel=0.03)
    wrong["thrust_force error"] = 0.1
    misled = calibrate(cut, wrong, FREE, folder=tmp_path)
    assert abs(misled.values["edge_radius"].value - 3e-5) > 3e-6


@pytest.mark.parametrize(
    "free, rows, part",
    [({"friction": [0.1, 0.2]}, 4, "ranges"), (FREE, 1, "do not decide"), ({}, 4, "ranges")],
)
def test_what_cannot_be_calibrated_is_refused(cut, tmp_path, free, rows, part):
    with pytest.raises(SwarfError, match=part):
        calibrate(cut, measured().iloc[:rows], free, folder=tmp_path)


def test_real_cuts_are_run_and_kept(cut, tmp_path):
    """Through the FMU: the second call runs nothing and finds the same."""
    rows = CUTS.iloc[:1].assign(cutting_force=180.0, thrust_force=90.0)
    keywords = {"n": 4, "travel": 1, "folder": tmp_path, "scheduler": "serial", "progress": False}
    one = calibrate(cut, rows, {"friction": (0.1, 0.6)}, **keywords)
    kept = swarf.open_study(tmp_path).frame
    other = calibrate(cut, rows, {"friction": (0.1, 0.6)}, **keywords)
    assert one.values == other.values and len(kept) >= 9
    assert swarf.open_study(tmp_path).frame["key"].tolist() == kept["key"].tolist()


@pytest.mark.slow
def test_friction_and_radius_of_simulated_cuts_are_found(tmp_path):
    """Known friction and radius come back within 5 % from the forces of six feeds.

    A draft's force scatters by a percent with friction and radius, which moves the friction found by a
    twentieth for a single cut; six of them leave less than half of that.
    """
    cut = swarf.Cut(
        "AISI 1045",
        speed="180 m/min",
        feed="0.1 mm",
        rake="5 deg",
        heat="conduction",
        settings=CHEAP["settings"],
    )
    feeds = [0.8e-4, 1e-4, 1.2e-4, 1.45e-4, 1.7e-4, 2e-4]
    keywords = {"travel": "12 feeds", "workers": 2, "progress": False}
    real = swarf.study(cut.replace(**TRUTH), feed=feeds, folder=tmp_path / "measured", **keywords).good
    rows = real[["feed", "cutting_force", "thrust_force"]]
    found = calibrate(cut, rows, FREE, n=14, folder=tmp_path / "calibration", **keywords)
    for name, truth in TRUTH.items():
        assert found.values[name].value == pytest.approx(truth, rel=0.05), str(found)
