"""Quantities reach the FMU in its units, and slips are told with name, value and unit."""

import math

import pytest

from swarf import SwarfError
from swarf._units import REGISTRY, in_feeds, pint_unit, to_unit


@pytest.mark.parametrize(
    "value, unit, expected",
    [
        ("180 m/min", "m/s", 3.0),
        ("0.1 mm", "m", 1e-4),
        ("30 um", "m", 3e-5),
        ("30 µm", "m", 3e-5),
        ("5 deg", "rad", math.radians(5.0)),
        ("-6 deg", "rad", math.radians(-6.0)),
        ("20 degC", "K", 293.15),
        ("30 %", "1", 0.3),
        ("1.5", "1", 1.5),
        (7, "Pa", 7.0),
        ("2 GPa", "Pa", 2e9),
        ("480 J/(kg K)", "J/(kg.K)", 480.0),
        ("7.83 g/cm^3", "kg/m3", 7830.0),
        (REGISTRY.Quantity(2.0, "kN"), "N", 2000.0),
    ],
)
def test_a_quantity_is_converted(value, unit, expected):
    """Two roundings of a conversion at most."""
    assert to_unit(value, unit, "x") == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    "value, part",
    [
        ("3 s", "unit"),
        ("fast", "no quantity"),
        (True, "no quantity"),
        ("3 furlingtons", "furlingtons"),
        (None, "no quantity"),
    ],
)
def test_a_slip_names_variable_and_unit(value, part):
    """Who wrote it must see where."""
    with pytest.raises(SwarfError, match="speed") as caught:
        to_unit(value, "m/s", "speed")
    assert part in str(caught.value) and "m/s" in str(caught.value)


def test_units_of_the_description_are_known_to_pint(cut):
    """A new unit of the FMU that pint cannot read would break every string of it."""
    for variable in cut.description.variables.values():
        REGISTRY.Quantity(1.0, pint_unit(variable.unit))


@pytest.mark.parametrize("value, feeds", [("5 feeds", 5.0), ("1 feed", 1.0), (4, 4.0), ("0.5 mm", 5.0)])
def test_travel_is_told_in_feeds_or_lengths(value, feeds):
    assert in_feeds(value, 1e-4, "travel") == pytest.approx(feeds, rel=1e-12)


@pytest.mark.parametrize("value", ["0 feeds", -1, "-2 mm", float("nan")])
def test_no_travel_is_refused(value):
    with pytest.raises(SwarfError, match="above 0"):
        in_feeds(value, 1e-4, "travel")
