"""Steady values of a cut, from the scatter of blocks of its force.

The history is cut into blocks of one feed of travel each. How many of the first n belong to the run-in is
chosen by the marginal standard error rule: among the d up to n/2 the one that makes s²(d)/(n − d) smallest,
where s is the standard deviation of the remaining block means (White 1997, "An effective truncation heuristic
for bias reduction in simulation output", Simulation 69:323–334). With so few blocks chance makes some late d
the best; so the first d is taken that is no worse than twice the best. The first block, in which the tool
enters, always counts as run-in. The cut counts as steady when the
standard error falls below a share of the mean.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from swarf._units import REGISTRY, pint_unit

FEWEST_BLOCKS = 3  # that are never taken for run-in
STEADY_BLOCKS = 4  # that a steady cut must have after its run-in


@dataclass(frozen=True)
class Figure:
    """A steady value with what is known of its error.

    Attributes
    ----------
    name
        Of the output.
    mean
        Mean over the steady blocks.
    scatter
        Standard deviation of the block means; nan with fewer than two.
    blocks
        Number of steady blocks.
    band
        How far the discretisation may be off, in the value's unit; None where no measurement tells.
    unit
        As in the model description.
    """

    name: str
    mean: float
    scatter: float
    blocks: int
    band: float | None
    unit: str

    @property
    def standard_error(self) -> float:
        """Standard error of the mean: scatter over the root of the number of blocks."""
        return self.scatter / np.sqrt(self.blocks) if self.blocks else float("nan")

    @property
    def quantity(self):
        """The mean as a pint quantity."""
        return REGISTRY.Quantity(self.mean, pint_unit(self.unit))

    def to(self, unit: str) -> float:
        """The mean in another unit, such as ``"kN"``."""
        return float(self.quantity.to(unit).magnitude)

    def __float__(self) -> float:
        return self.mean

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        band = "" if self.band is None else f", band ±{self.band:.3g}{unit}"
        return f"{self.mean:.5g}{unit}, scatter of {self.blocks} blocks {self.scatter:.2g}{unit}{band}"


class Steady(Mapping[str, Figure]):
    """Steady values by the outputs' names; also as attributes, with ``_`` for the dots of a name.

    Attributes
    ----------
    reached
        Whether the force has become steady: standard error below the tolerance.
    tolerance
        That tolerance, a share of the mean.
    start
        Travel (feeds) at which the steady part starts.
    """

    def __init__(self, figures: Mapping[str, Figure], reached: bool, tolerance: float, start: float) -> None:
        self._figures = dict(figures)
        self.reached = reached
        self.tolerance = tolerance
        self.start = start

    def __getitem__(self, name: str) -> Figure:
        return self._figures[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._figures)

    def __len__(self) -> int:
        return len(self._figures)

    def __getattr__(self, name: str) -> Figure:
        if not name.startswith("_"):
            for own, figure in self._figures.items():
                if own.replace(".", "_") == name:
                    return figure
        raise AttributeError(f"there is no steady value '{name}'")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name.replace(".", "_") for name in self._figures)]

    def table(self) -> pd.DataFrame:
        """A row for each output: mean, scatter, standard error, band, unit, blocks."""
        rows = {
            name: (f.mean, f.scatter, f.standard_error, f.band, f.unit, f.blocks)
            for name, f in self._figures.items()
        }
        columns = ["mean", "scatter", "standard error", "band", "unit", "blocks"]
        return pd.DataFrame.from_dict(rows, orient="index", columns=columns)

    def __repr__(self) -> str:
        lines = [
            str(self._figures[name]) for name in ("cutting_force", "thrust_force") if name in self._figures
        ]
        state = "steady" if self.reached else "not yet steady"
        return f"<{state} from {self.start:g} feeds of travel: force {'; thrust '.join(lines)}>"


def run_in(blocks: np.ndarray) -> int:
    """Number of first blocks that belong to the run-in, by the marginal standard error rule.

    Parameters
    ----------
    blocks
        Block means, in order.

    Returns
    -------
    int
        At least 1 where there are two blocks, at most half of them, and such that `FEWEST_BLOCKS` are left
        where there are more than that.
    """
    count = len(blocks)
    if count <= FEWEST_BLOCKS:
        return min(1, count - 1) if count else 0
    last = max(min(count // 2, count - FEWEST_BLOCKS), 1)
    errors = [float(np.var(blocks[d:])) / (count - d) for d in range(1, last + 1)]
    return 1 + next(d for d, error in enumerate(errors) if error <= 2.0 * min(errors))


def is_steady(blocks: np.ndarray, tolerance: float) -> bool:
    """Whether block means have a standard error below a share of their mean, after their run-in.

    Parameters
    ----------
    blocks
        Block means of the force, in order.
    tolerance
        The share (-), above 0.
    """
    kept = blocks[run_in(blocks) :]
    if len(kept) < STEADY_BLOCKS:
        return False
    error = float(np.std(kept, ddof=1)) / np.sqrt(len(kept))
    return bool(error <= tolerance * abs(float(np.mean(kept))))


def block_means(values: np.ndarray, block: int) -> np.ndarray:
    """Means of whole blocks of ``block`` rows each; what is left at the end is not used.

    Parameters
    ----------
    values
        An array whose first axis is time.
    block
        Rows in a block, at least 1.
    """
    whole = len(values) // block
    return values[: whole * block].reshape(whole, block, *values.shape[1:]).mean(axis=1)


def steady_values(
    history: pd.DataFrame,
    block: int,
    units: Mapping[str, str],
    bands: Mapping[str, float],
    initial_temperature: float,
    tolerance: float,
    ruling: str = "cutting_force",
) -> Steady:
    """Steady values of all outputs of a history.

    Parameters
    ----------
    history
        A row for each communication step, all of one length.
    block
        Rows for a feed of travel.
    units
        Unit of each output that gets a value.
    bands
        Band of outputs as a share; of temperatures as a share of the heating.
    initial_temperature
        From which heating counts (K).
    tolerance
        For `is_steady`.
    ruling
        Output whose scatter decides on the run-in.

    Returns
    -------
    Steady
        With a figure for each name in ``units``.
    """
    names = [name for name in units if name in history]
    means = block_means(history[names].to_numpy(float), block)
    ruled = means[:, names.index(ruling)] if ruling in names else np.zeros(len(means))
    first = run_in(ruled)
    kept = means[first:]
    figures = {}
    for column, name in enumerate(names):
        values = kept[:, column]
        mean = float(np.mean(values)) if len(values) else float("nan")
        scatter = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
        share = bands.get(name)
        base = initial_temperature if name == "chip_temperature" else 0.0
        band = None if share is None else abs(share * (mean - base))
        figures[name] = Figure(name, mean, scatter, len(values), band, units[name])
    return Steady(figures, is_steady(ruled, tolerance), tolerance, float(first))
