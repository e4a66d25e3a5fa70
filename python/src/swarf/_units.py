"""Quantities with units: strings, pint quantities and plain numbers, to the unit that the FMU wants."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

import pint

from swarf._errors import SwarfError

REGISTRY: pint.UnitRegistry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)$", re.DOTALL)


@lru_cache(maxsize=256)
def pint_unit(unit: str) -> str:
    """A unit of the model description in pint's spelling.

    Parameters
    ----------
    unit
        For instance ``J/(kg.K)``, ``kg/m3`` or ``1``.

    Returns
    -------
    str
        For instance ``J/(kg*K)``, ``kg/m**3`` or ``dimensionless``.
    """
    if unit in ("", "1"):
        return "dimensionless"
    return re.sub(r"([A-Za-z])(\d)", r"\1**\2", unit.replace(".", "*"))


def to_unit(value: Any, unit: str, name: str) -> float:
    """The number that a quantity has in a unit.

    Parameters
    ----------
    value
        A number, already in ``unit``; a string such as ``"0.1 mm"``; or a pint quantity.
    unit
        The unit wanted, as the model description spells it.
    name
        What the quantity is called, for errors.

    Returns
    -------
    float
        The number.
    """
    if isinstance(value, bool):
        raise SwarfError(
            f"{name} = {value} is no quantity; a number or a string such as '1 {unit}' is needed"
        )
    if isinstance(value, str):
        found = _NUMBER.match(value)
        if not found:
            raise SwarfError(f"{name} = {value!r} is no quantity; write it as a number and a unit of {unit}")
        number, words = float(found[1]), found[2].strip()
        if not words:
            return number
        try:
            value = REGISTRY.Quantity(number, words)
        except Exception as error:
            raise SwarfError(f"{name} = {number} {words!r}: {error}; a unit like {unit} is needed") from error
    if hasattr(value, "to") and hasattr(value, "magnitude"):
        try:
            return float(value.to(pint_unit(unit)).magnitude)
        except pint.errors.DimensionalityError as error:
            raise SwarfError(f"{name} = {value} has the wrong unit; one like {unit} is needed") from error
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise SwarfError(f"{name} = {value!r} is no quantity; a unit like {unit} is needed") from error


def in_feeds(value: Any, feed: float, name: str) -> float:
    """A length, which may be told in feeds.

    Parameters
    ----------
    value
        ``"5 feeds"``, a length as for `to_unit`, or a number of feeds.
    feed
        The feed (m).
    name
        What the length is called, for errors.

    Returns
    -------
    float
        The length over the feed (-), above 0.
    """
    if isinstance(value, str):
        found = _NUMBER.match(value)
        if found and found[2].strip() in ("", "feed", "feeds"):
            value = float(found[1])
        else:
            value = to_unit(value, "m", name) / feed
    elif hasattr(value, "magnitude"):
        value = to_unit(value, "m", name) / feed
    # A length of three feeds is three feeds, whatever its division rounds to.
    value = float(f"{float(value):.12g}")
    if not 0.0 < value < float("inf"):
        raise SwarfError(f"{name} = {value} feeds must be above 0")
    return value
