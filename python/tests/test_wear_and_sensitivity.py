"""Wear and sensitivity against known numbers."""

import numpy as np
import pandas as pd
import pytest

from swarf import SwarfError
from swarf.sensitivity import sensitivity
from swarf.wear import rake_wear, usui


def test_usuis_law():
    """σ = 1 GPa, v = 1 m/s, T = B: A · 1e9/e; in tension nothing."""
    rates = usui([1e9, -1e9], 1.0, [2000.0, 2000.0], a=1e-16, b=2000.0)
    assert rates == pytest.approx([1e-7 / np.e, 0.0])


def test_wear_of_a_profile_is_usuis(result):
    """With B = 0 the rate is A v times the pressure, averaged over the same frames."""
    found = rake_wear(result, a=1e-16, b=0.0)
    hotter = rake_wear(result, a=1e-16, b=3000.0)
    speed = result.cut.speed * result.cut.feed / result.steady.chip_thickness.mean
    always = found[found["scatter"].notna() & (found["pressure"] > 0)]
    assert len(always) >= 3 and (found["wear_rate"] >= 0).all()
    # Never above the mean of the pressures' positive part in the frames where the chip touches.
    assert found["wear_rate"].max() < 1e-16 * speed * 1e10
    assert (hotter["wear_rate"] <= found["wear_rate"]).all() and hotter["wear_rate"].max() > 0
    count = result.profiles["rake"]
    first = max(int(result.steady.start / 5.0 * count), 1)
    last = [result.profile("rake", index) for index in range(first, count)]
    nearest = last[-1]["distance from edge (m)"].iloc[0]
    pressures = [p["contact_pressure (Pa)"].iloc[0] for p in last if np.isclose(p.iloc[0, 0], nearest)]
    expected = 1e-16 * speed * np.mean(np.maximum(pressures, 0)) * len(pressures) / len(last)
    assert found["wear_rate"].iloc[0] == pytest.approx(expected, rel=1e-9)


def test_sensitivity_of_ishigamis_function():
    """y = sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1 on ±π: S1 = 0.3139, 0.4424, 0 (Ishigami and Homma 1990)."""
    x = np.random.default_rng(1).uniform(-np.pi, np.pi, (2000, 3))
    y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    data = pd.DataFrame(x, columns=["a", "b", "c"]).assign(cutting_force=y)
    found = sensitivity(data, names=["a", "b", "c"])["S1"]
    # The method's own error with 2000 points is a few hundredths.
    assert found.to_numpy() == pytest.approx([0.3139, 0.4424, 0.0], abs=0.05)


def test_sensitivity_refuses_too_few_cuts():
    data = pd.DataFrame({"a": [1.0, 2], "cutting_force": [1.0, 2]})
    with pytest.raises(SwarfError, match="20 cuts"):
        sensitivity(data, names=["a"])
