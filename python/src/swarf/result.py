"""What a run gives."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError
from swarf.frames import Frame, frames_in
from swarf.steady import Steady, steady_values

if TYPE_CHECKING:
    from swarf.cut import Cut

# Sums since the start, places and what the solver did: their last value tells something, their mean does not.
_SUMS = ("energy.", "numerics.", "tool_position", "cut_length")
_MACHINE = "numerics.estimated_cpu_time"  # a time of the machine, no value of the cut
_BAND = "numerics.force_error_band"


class Result:
    """History, steady values and frames of a cut.

    Attributes
    ----------
    cut
        What was run.
    history
        A row for each communication step: ``travel`` in feeds and every output of the FMU, over the time (s).
        Units stand in ``history.attrs["units"]``.
    failure
        Why the run ended early, or None.
    warnings
        Texts of the FMU.
    parameters
        Every input and parameter of the FMU at the end, in SI units.
    cost
        ``cpu_seconds`` and ``wall_seconds`` of the run.
    """

    def __init__(
        self,
        cut: Cut,
        history: pd.DataFrame,
        failure: str | None,
        warnings: list[str],
        parameters: Mapping[str, Any],
        cost: Mapping[str, float],
        tolerance: float,
        folder: Any = None,
        kept: tempfile.TemporaryDirectory | None = None,
    ) -> None:
        self.cut = cut
        self.history = history
        self.failure = failure
        self.warnings = warnings
        self.parameters = dict(parameters)
        self.cost = dict(cost)
        self._tolerance = tolerance
        self._folder = None if folder is None else Path(folder)
        self._kept = kept  # removes a temporary folder together with the result

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column of the history."""
        return self.history.attrs["units"]

    @property
    def versions(self) -> dict[str, str]:
        """What made the numbers: FMU, its file's digest, this package."""
        import swarf

        description = self.cut.description
        return {
            "fmu": description.version,
            "guid": description.guid,
            "digest": description.digest,
            "package": swarf.__version__,
        }

    @cached_property
    def bands(self) -> dict[str, float]:
        """How far the discretisation may be off, by output, as a share."""
        own = self.history.get(_BAND)
        force = {} if own is None or not len(own) else {"cutting_force": float(own.iloc[-1])}
        return {**self.cut.bands, **force}

    @cached_property
    def steady(self) -> Steady:
        """Means over the steady part of the history, with scatter and band."""
        from swarf.cut import STEPS_PER_FEED

        variables = self.cut.description.variables
        outputs = [name for name in self.cut.description.outputs if not name.startswith(_SUMS)]
        real = {name: variables[name].unit for name in outputs if variables[name].kind == "Real"}
        heat = float(self.parameters.get("workpiece.initial_temperature", 0.0))
        return steady_values(self.history, STEPS_PER_FEED, real, self.bands, heat, self._tolerance)

    @property
    def folder(self) -> Path:
        """Where the FMU's files lie."""
        if self._folder is None:
            raise SwarfError("this run kept no files: run with frames of 1 or more in a feed")
        return self._folder

    @cached_property
    def frames(self) -> list[Frame]:
        """All frames, in order of time; empty for a run without."""
        return [] if self._folder is None else frames_in(self._folder)

    def frame(self, index: int = -1) -> Frame:
        """One frame.

        Parameters
        ----------
        index
            Place in `frames`; -1 for the last.
        """
        try:
            return self.frames[index]
        except IndexError as error:
            raise SwarfError(f"there is no frame {index}: the run kept {len(self.frames)}") from error

    def profile(self, place: str = "rake", index: int = -1) -> pd.DataFrame:
        """A profile that the FMU has written beside its frames.

        Parameters
        ----------
        place
            ``rake`` or ``surface``.
        index
            Which one, in order of time; -1 for the last.

        Returns
        -------
        pandas.DataFrame
            A row for each bin; column names carry the units.
        """
        paths = sorted(self.folder.glob(f"{place}_*.csv"))
        if not paths:
            raise SwarfError(
                f"the run wrote no profile '{place}'; there are rake and surface, once there is a chip"
            )
        return pd.read_csv(paths[index], comment="#")

    @property
    def profiles(self) -> dict[str, int]:
        """How many profiles there are of each place."""
        return {place: len(list(self.folder.glob(f"{place}_*.csv"))) for place in ("rake", "surface")}

    @cached_property
    def segmentation(self) -> pd.DataFrame:
        """The FMU's count of shear bands, a row for each frame with a chip; empty without one."""
        path = self.folder / "segmentation.csv"
        return pd.read_csv(path, comment="#") if path.is_file() else pd.DataFrame()

    def plot(self, field: str = "von_mises", index: int = -1, **options: Any) -> Any:
        """Draws a field of a frame, or an output over the travel.

        Parameters
        ----------
        field
            A scalar field of the frame (``von_mises``, ``temperature``, ``plastic_strain`` ...) or a column
            of the history.
        index
            Which frame.
        **options
            For `swarf.pictures.plot`.
        """
        from swarf import pictures

        if field in self.history:
            axes = self.history.plot(x="travel", y=field, legend=False, **options)
            axes.set(xlabel="travel (feeds)", ylabel=f"{field} ({self.units[field]})")
            return axes
        return pictures.plot(self.frame(index), field, **options)

    def animate(self, path: str | Path, field: str = "temperature", **options: Any) -> Path:
        """Writes the frames as an animation; see `swarf.pictures.animate`."""
        from swarf import pictures

        return pictures.animate(self.frames, path, field, **options)

    def report(self, path: str | Path) -> Path:
        """Writes a page of this cut; see `swarf.report.cut_report`."""
        from swarf.report import cut_report

        return cut_report(self, path)

    def row(self) -> dict[str, Any]:
        """One flat row: what was asked, what came out, and at what price; as studies keep it.

        Parameters and inputs by the FMU's names; each Real output's steady mean by its name, and its scatter
        and band with `` scatter`` and `` band`` behind the name; sums since the start and counts by their
        last value.
        """
        row: dict[str, Any] = dict(self.parameters)
        for name, figure in self.steady.items():
            row[name] = figure.mean
            row[f"{name} scatter"] = figure.scatter
            if figure.band is not None:
                row[f"{name} band"] = figure.band
        row["steady"] = self.steady.reached
        row["blocks"] = self.steady.cutting_force.blocks
        row["travel"] = float(self.history["travel"].iloc[-1]) if len(self.history) else 0.0
        for name in self.cut.description.outputs:
            if name not in row and name != _MACHINE:
                row[name] = self._last(name)
        row["failure"] = self.failure or ""
        row["warnings"] = "; ".join(self.warnings)
        return {**row, **{f"version {name}": value for name, value in self.versions.items()}, **self.cost}

    def _last(self, name: str) -> float:
        column = self.history.get(name)
        return float("nan") if column is None or not len(column) else float(column.iloc[-1])

    def __repr__(self) -> str:
        travel = float(self.history["travel"].iloc[-1]) if len(self.history) else 0.0
        failed = f"; ended early: {self.failure}" if self.failure else ""
        force = self.steady.cutting_force if len(self.history) else np.nan
        return f"<result after {travel:g} feeds: cutting force {force}{failed}>"
