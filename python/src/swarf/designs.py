"""Designs of experiments: which cuts a study makes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from swarf._errors import SwarfError, needs

DESIGNS = ("grid", "sobol", "lhs")


@dataclass(frozen=True)
class Varied:
    """What is varied, and over what.

    Attributes
    ----------
    name
        A keyword of `swarf.Cut` or a variable of the FMU.
    levels
        The values themselves, or None for a range.
    low, high
        Ends of a range.
    unit
        Unit of the ends, or empty.
    """

    name: str
    levels: tuple[Any, ...] | None
    low: float = math.nan
    high: float = math.nan
    unit: str = ""

    def at(self, share: float) -> Any:
        """The value at a share from 0 to 1 (exclusive) of the range or of the levels."""
        if self.levels is not None:
            return self.levels[min(int(share * len(self.levels)), len(self.levels) - 1)]
        value = self.low + share * (self.high - self.low)
        return f"{value!r} {self.unit}" if self.unit else value


def read_varied(name: str, told: Any) -> Varied:
    """What a user has told of one varied quantity.

    Parameters
    ----------
    name
        Of the quantity.
    told
        A list of levels; a range ``(low, high)`` or ``(low, high, unit)``; or a mapping with ``from``, ``to``
        and perhaps ``unit``.
    """
    if isinstance(told, Mapping):
        unknown = set(told) - {"from", "to", "unit"}
        if unknown or not {"from", "to"} <= set(told):
            raise SwarfError(
                f"{name}: a range has the keys from, to and unit, not {', '.join(map(str, told))}"
            )
        told = (told["from"], told["to"], *([told["unit"]] if "unit" in told else []))
    if isinstance(told, tuple):
        unit = told[2] if len(told) == 3 else ""
        if len(told) not in (2, 3) or not isinstance(unit, str):
            raise SwarfError(f"{name} = {told!r} is no range; write (low, high) or (low, high, unit)")
        try:
            low, high = float(told[0]), float(told[1])
        except (TypeError, ValueError) as error:
            raise SwarfError(
                f"{name} = {told!r}: ends of a range are numbers, with one unit for both"
            ) from error
        if not low < high:
            raise SwarfError(f"{name} = {told!r}: the first end must be below the second")
        return Varied(name, None, low, high, unit)
    if isinstance(told, str) or not isinstance(told, (Sequence, np.ndarray)) or len(told) == 0:
        raise SwarfError(f"{name} = {told!r} must be a list of levels or a range (low, high, unit)")
    levels = tuple(value.item() if isinstance(value, np.generic) else value for value in told)
    return Varied(name, levels)


def make(varied: Sequence[Varied], n: int | None, design: str | None, seed: int) -> list[dict[str, Any]]:
    """The settings of each cut of a design.

    Parameters
    ----------
    varied
        What is varied.
    n
        Number of cuts; in a grid the number of levels that a range is given (5 without).
    design
        ``grid``, ``sobol`` or ``lhs`` (Latin hypercube); without one a grid if there are only levels, else
        Sobol's sequence.
    seed
        Of the scrambling or the permutations: the same seed gives the same design.

    Returns
    -------
    list of dict
        Values by name, one for each cut.
    """
    if not varied:
        return [{}]
    only_levels = all(one.levels is not None for one in varied)
    design = design or ("grid" if only_levels and n is None else "sobol")
    if design == "grid":
        count = 5 if n is None else n
        steps = [
            one.levels
            if one.levels is not None
            else [
                Varied(one.name, None, one.low, one.high, one.unit).at(s)
                for s in np.linspace(0, 1, count).tolist()
            ]
            for one in varied
        ]
        return [dict(zip((one.name for one in varied), values)) for values in itertools.product(*steps)]
    if design not in DESIGNS:
        raise SwarfError(f"design = {design!r} is none of {', '.join(DESIGNS)}")
    if n is None or n < 1:
        raise SwarfError(f"design = {design} needs n, the number of cuts, not {n}")
    shares = _shares(design, len(varied), n, seed)
    return [{one.name: one.at(share) for one, share in zip(varied, row)} for row in shares.tolist()]


def _shares(design: str, dimensions: int, n: int, seed: int) -> np.ndarray:
    qmc = needs("scipy.stats.qmc", "study")
    kind = qmc.Sobol if design == "sobol" else qmc.LatinHypercube
    rng = np.random.default_rng(seed)
    try:
        sampler = kind(dimensions, rng=rng)
    except TypeError:  # scipy before 1.15
        sampler = kind(dimensions, seed=rng)
    if design == "sobol":
        # A power of two keeps the sequence's balance; what is beyond n is left out.
        return sampler.random_base2(math.ceil(math.log2(n)) if n > 1 else 0)[:n]
    return sampler.random(n)
