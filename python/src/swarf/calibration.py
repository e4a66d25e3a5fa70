"""Calibration: what friction, edge radius or constants make simulated forces those that were measured.

A simulated force has a scatter of its own, so the simulation is not handed to the optimizer. A design of
points in the box of the free quantities is run for each measured cut, each output is fitted by a quadratic
there, and least squares on these surfaces give a first answer. The same is done once more in a box around it,
of a share of the first one's sides: there a quadratic is nearer to the truth, and its fit averages the
scatter. At last the cuts are run at the answer itself, a few times, and the surfaces are shifted by what they
gave on the mean: the answer then rests on the simulation next to it, and the surfaces tell the slopes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError, needs
from swarf.cut import Cut
from swarf.designs import Varied, _shares, read_varied
from swarf.forces import Value
from swarf.studies import Study

_SMALLER = 0.4  # sides of the second box over those of the first
_ROUNDS = 6  # of shifts at most
_STILL = 0.002  # move in the box below which they end
_UNTOLD = 0.02  # standard error of a measured force that tells none, as a share of the mean


@dataclass(frozen=True)
class Calibration:
    """What a calibration found.

    Attributes
    ----------
    values
        The free quantities with their intervals, in SI units.
    table
        A row for each measured cut and output: measured, fitted, relative error, and that of a fit which left
        the cut out.
    correlation
        Of the estimates.
    surface_error
        Standard deviation of the simulation around its surfaces, as a share of the mean measured value, by
        output.
    cut
        The cut with the values found.
    cuts_run
        How many cuts it took.
    """

    values: dict[str, Value]
    table: pd.DataFrame
    correlation: pd.DataFrame
    surface_error: dict[str, float]
    cut: Cut
    cuts_run: int

    def __str__(self) -> str:
        found = ", ".join(f"{name} = {value}" for name, value in self.values.items())
        worst = self.table["left out"].abs().max()
        return f"{found}; a cut that was left out is met within {100 * worst:.1f} %"


@dataclass
class _Problem:
    """Measured values, their scales, and surfaces over a part of the unit box."""

    free: list[Varied]
    outputs: list[str]
    measured: np.ndarray  # cuts by outputs
    scale: np.ndarray
    low: np.ndarray  # ends of that part
    high: np.ndarray
    coefficients: np.ndarray  # terms by cuts by outputs
    noise: np.ndarray  # of the simulation around its surfaces
    shift: np.ndarray  # of the surfaces, cuts by outputs

    def simulated(self, x: np.ndarray) -> np.ndarray:
        inside = (x - self.low) / (self.high - self.low)
        return np.tensordot(_terms(inside[None])[0], self.coefficients, 1) + self.shift

    def solve(self, rows: np.ndarray) -> np.ndarray:
        optimize = needs("scipy.optimize", "fit")

        def residuals(x: np.ndarray) -> np.ndarray:
            return ((self.simulated(x) - self.measured) / self.scale)[rows].ravel()

        starts = [self.low + share * (self.high - self.low) for share in (0.5, 0.2, 0.8)]
        found = [optimize.least_squares(residuals, x, bounds=(self.low, self.high)) for x in starts]
        return min(found, key=lambda one: one.cost).x


def calibrate(
    cut: Cut,
    measured: pd.DataFrame,
    free: Mapping[str, Any],
    *,
    n: int | None = None,
    travel: Any = "6 feeds",
    folder: str | os.PathLike[str] = "calibration",
    seed: int = 0,
    confidence: float = 0.95,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> Calibration:
    """Finds the values of free quantities for which simulated cuts meet measured ones.

    Parameters
    ----------
    cut
        What all measured cuts have in common.
    measured
        A row for each cut: columns named like keywords of `Cut` (feed, speed …) say what was cut, columns
        named like outputs what was measured, in SI units and for the cut's width. A column ``cutting_force
        error`` gives a standard error; without, two percent of the mean are taken.
    free
        Ranges ``(low, high)`` or ``(low, high, unit)`` by keyword or variable.
    n
        Points of each of the two designs; three for each coefficient of a quadratic without.
    travel
        Of each simulated cut; see `Cut.run`.
    folder
        Where the study behind it is kept and resumed.
    seed
        Of the design.
    confidence
        Level of the intervals.
    scheduler, workers, progress
        See `swarf.Study.run`.

    Returns
    -------
    Calibration
        Intervals are those of the standard errors told, or of the residuals where those are larger.
    """
    box = [read_varied(name, told) for name, told in free.items()]
    if not box or any(one.levels is not None for one in box):
        raise SwarfError("what is free needs ranges: {'friction': (0.1, 0.6)}")
    outputs = [name for name in measured.columns if name in cut.description.outputs]
    keywords = [name for name in measured.columns if name not in outputs and not name.endswith(" error")]
    if not outputs or len(measured) * len(outputs) <= len(box):
        raise SwarfError(
            f"{len(measured)} cuts with the outputs {outputs} do not decide on {len(box)} free quantities"
        )
    target = measured[outputs].to_numpy(float)
    scale = np.tile(_UNTOLD * np.abs(target).mean(axis=0), (len(target), 1))
    for column, name in enumerate(outputs):
        if f"{name} error" in measured:
            scale[:, column] = measured[f"{name} error"].to_numpy(float)
    terms = _terms(np.zeros((1, len(box)))).shape[1]
    points = _shares("sobol", len(box), 3 * terms if n is None else n, seed)
    if len(points) <= terms:
        raise SwarfError(f"n = {len(points)} points do not determine the {terms} coefficients of a quadratic")
    asked = [cut.replace(**dict(zip(keywords, row))) for row in measured[keywords].itertuples(index=False)]
    how = {"travel": travel, "tolerance": 0.03, "frames": 0}
    runs = _Runs(asked, outputs, box, how, Path(folder), scheduler, workers, progress)

    every = np.ones(len(target), bool)
    low, high = np.zeros(len(box)), np.ones(len(box))
    for _ in range(2):
        values = runs.at(low + points * (high - low))  # points by cuts by outputs
        flat, design = values.reshape(len(points), -1), _terms(points)
        coefficients, *_ = np.linalg.lstsq(design, flat, rcond=None)
        misfit = ((flat - design @ coefficients) ** 2).sum(axis=0) / (len(points) - terms)
        noise = np.sqrt(misfit).reshape(target.shape)
        # The surface's own error at a point of the design, on average.
        weights = np.hypot(scale, noise * np.sqrt(terms / len(points)))
        shape = (terms, *target.shape)
        still = np.zeros_like(target)
        problem = _Problem(
            box, outputs, target, weights, low, high, coefficients.reshape(shape), noise, still
        )
        x = problem.solve(every)
        middle = np.clip(x, _SMALLER / 2, 1.0 - _SMALLER / 2)
        low, high = middle - _SMALLER / 2, middle + _SMALLER / 2
    x = _settle(problem, x, runs)
    return _conclude(cut, problem, x, measured[keywords], confidence, runs.count)


def _settle(problem: _Problem, x: np.ndarray, runs: _Runs) -> np.ndarray:
    """Shifts the surfaces by what the simulation gives at each answer, on the mean; gives the last answer.

    Each round is one more sample of the simulation's scatter near the answer, so their mean is taken.
    """
    shifts: list[np.ndarray] = []
    for _ in range(_ROUNDS):
        shifts.append(runs.at(x[None])[0] - problem.simulated(x) + problem.shift)
        problem.shift = np.mean(shifts, axis=0)
        before, x = x, problem.solve(np.ones(len(shifts[0]), bool))
        if np.max(np.abs(x - before)) < _STILL:
            break
    return x


def _conclude(
    cut: Cut,
    problem: _Problem,
    x: np.ndarray,
    told: pd.DataFrame,
    confidence: float,
    count: int,
) -> Calibration:
    stats = needs("scipy.stats", "fit")
    fitted, target, scale = problem.simulated(x), problem.measured, problem.scale
    residual = ((fitted - target) / scale).ravel()
    step = 1e-4
    moves = np.eye(len(x)) * step
    jacobian = np.column_stack(
        [((problem.simulated(x + m) - problem.simulated(x - m)) / (2 * step) / scale).ravel() for m in moves]
    )
    degrees = max(len(residual) - len(x), 1)
    # Never less than what the scales say; more where the residuals do.
    variance = max(float(residual @ residual) / degrees, 1.0)
    covariance = variance * np.linalg.pinv(jacobian.T @ jacobian)
    errors = np.sqrt(np.diag(covariance))
    quantile = float(stats.t.ppf(0.5 + confidence / 2, degrees))
    values, changes = {}, {}
    for one, share, error in zip(problem.free, x, errors):
        changes[one.name] = one.at(float(share))
        low, high, here = (_si(cut, one, s) for s in (0.0, 1.0, float(share)))
        spread = float(error) * (high - low)
        values[one.name] = Value(
            here, spread, here - quantile * spread, here + quantile * spread, _unit(cut, one)
        )
    rows = []
    for index in range(len(target)):
        left = np.arange(len(target)) != index
        guess = None
        if left.sum() * target.shape[1] > len(x):
            guess = problem.simulated(problem.solve(left))
        for column, name in enumerate(problem.outputs):
            mean = target[index, column]
            rows.append(
                {
                    **told.iloc[index].to_dict(),
                    "output": name,
                    "measured": mean,
                    "fitted": fitted[index, column],
                    "error": fitted[index, column] / mean - 1.0,
                    "left out": np.nan if guess is None else guess[index, column] / mean - 1.0,
                }
            )
    names = [one.name for one in problem.free]
    correlation = pd.DataFrame(covariance / np.outer(errors, errors), index=names, columns=names)
    share = dict(zip(problem.outputs, (problem.noise.mean(axis=0) / np.abs(target).mean(axis=0)).tolist()))
    return Calibration(values, pd.DataFrame(rows), correlation, share, cut.replace(**changes), count)


class _Runs:
    """Simulated outputs of all measured cuts at points of the box."""

    def __init__(
        self,
        asked: list[Cut],
        outputs: list[str],
        box: list[Varied],
        how: Mapping[str, Any],
        folder: Path,
        scheduler: str | None,
        workers: int | None,
        progress: bool,
    ) -> None:
        self._asked, self._outputs, self._box = asked, outputs, box
        self._how, self._folder = how, folder
        self._scheduler, self._workers, self._progress = scheduler, workers, progress
        self.count = 0

    def at(self, points: np.ndarray) -> np.ndarray:
        """Outputs by point, cut and output."""
        cuts = []
        for point in points.tolist():
            changes = {one.name: one.at(share) for one, share in zip(self._box, point)}
            changes["numerics.threads"] = 1
            cuts += [cut.replace(**changes) for cut in self._asked]
        made = Study(self._folder, cuts, self._how, told={"cut": "calibration"})
        # A few cuts are not worth a cluster of their own.
        few = self._scheduler is None and len(made.missing()) <= 8
        made.run("serial" if few else self._scheduler, self._workers, progress=self._progress)
        self.count += len(cuts)
        rows = made.frame.set_index("key").loc[made.keys]
        if (rows["failure"] != "").any():
            failed = rows[rows["failure"] != ""].iloc[0]
            raise SwarfError(f"a cut of the calibration failed: {failed['failure']}")
        return rows[self._outputs].to_numpy(float).reshape(len(points), len(self._asked), -1)


def _terms(x: np.ndarray) -> np.ndarray:
    """Terms of a full quadratic in coordinates from −1 to 1; rows of ``x`` lie in the unit box."""
    y = 2.0 * x - 1.0
    count = y.shape[1]
    products = [y[:, i] * y[:, j] for i in range(count) for j in range(i, count)]
    return np.column_stack([np.ones(len(y)), y, *products])


def _si(cut: Cut, one: Varied, share: float) -> float:
    return float(cut.replace(**{one.name: one.at(share)}).value_of(one.name))


def _unit(cut: Cut, one: Varied) -> str:
    return cut.description.variable(cut.variable_of(one.name)).unit
