"""A cut: what is asked of the FMU, in a machinist's words, and its run."""

from __future__ import annotations

import csv
import io
import math
import tempfile
import time
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from tqdm.auto import tqdm

from swarf import materials
from swarf._errors import SwarfError
from swarf._fmu import Description, Instance, Refused, describe
from swarf._units import in_feeds
from swarf.result import Result
from swarf.steady import block_means, is_steady

STEPS_PER_FEED = 10  # communication steps in a feed of travel
AHEAD = 4.0  # feeds of material left before the tool at the end; the FMU warns below 2
BELOW = 3.0  # feeds, or edge radii where those are larger, of material below the tool
_GAP = 0.01  # feeds between edge and material at the start
DEFAULT_TRAVEL = 12.0  # feeds after which a cut that does not become steady ends

# What a keyword of `Cut` sets, where one variable takes it as it is.
_VARIABLES = {
    "speed": "tool_velocity",
    "feed": "feed",
    "friction": "friction",
    "rake": "tool.rake_angle",
    "clearance": "tool.clearance_angle",
    "edge_radius": "tool.edge_radius",
    "width": "workpiece.width",
    "temperature": "workpiece.initial_temperature",
    "heat": "effects.heat",
    "accuracy": "numerics.accuracy",
}


@dataclass(frozen=True)
class Estimate:
    """What is known of a cut before its price is paid.

    Attributes
    ----------
    cpu_seconds
        Processor time of the longest run that was asked for (s).
    bands
        How far the discretisation may be off, by output, as a share; of the chip's temperature as a share of
        its heating. The force's is the FMU's own, the others are of the preset's price list.
    warnings
        What the FMU warns of.
    points
        Material points.
    travel
        Of that run (feeds).
    """

    cpu_seconds: float
    bands: Mapping[str, float]
    warnings: list[str]
    points: int
    travel: float

    def __str__(self) -> str:
        bands = ", ".join(f"{name} ±{100 * band:.0f} %" for name, band in self.bands.items())
        lines = [
            f"{self.cpu_seconds:.2g} s of CPU time for {self.travel:g} feeds of travel, "
            f"{self.points} points; bands: {bands}"
        ]
        return "\n".join(lines + [f"warning: {text}" for text in self.warnings])


class Cut:
    """An orthogonal cut.

    Lengths follow from the feed: the distance of material points, the workpiece's height and length, and how
    far the tool goes. Every quantity is a number in SI units, a string with a unit, or a pint quantity.

    Parameters
    ----------
    material
        A name of the materials that the FMU carries, ``custom`` (constants by ``settings``), or the path of a
        TOML file in the format of the library, ``file.toml`` or ``file.toml#NAME``.
    speed
        Cutting speed.
    feed
        Uncut chip thickness.
    rake, clearance
        Angles of the tool.
    edge_radius
        Of the cutting edge; 0 for a sharp one.
    friction
        Coulomb's coefficient between tool and workpiece.
    width
        Of the workpiece; in plane strain it scales forces only.
    temperature
        Of the workpiece at the start.
    heat
        ``none``, ``adiabatic`` or ``conduction``.
    accuracy
        A preset of the FMU; sets points per feed and the scheme.
    points_per_feed
        Material points over the feed, instead of the preset's.
    settings
        Any further variable of the FMU by its name; goes before what this class would set.
    fmu
        Path of the FMU, if not the package's own.

    Examples
    --------
    >>> cut = Cut("AISI 1045", speed="180 m/min", feed="0.1 mm", rake="5 deg", friction=0.3)
    >>> result = cut.run(travel="5 feeds")  # doctest: +SKIP
    """

    def __init__(
        self,
        material: str = "AISI 4340",
        *,
        speed: Any,
        feed: Any,
        rake: Any = None,
        clearance: Any = None,
        edge_radius: Any = None,
        friction: Any = None,
        width: Any = None,
        temperature: Any = None,
        heat: str | None = None,
        accuracy: str = "draft",
        points_per_feed: float | None = None,
        settings: Mapping[str, Any] | None = None,
        fmu: Any = None,
    ) -> None:
        self._asked = {key: value for key, value in locals().items() if key not in ("self", "__class__")}
        self._asked["settings"] = dict(settings or {})
        self.material = str(material)
        asked = self._asked
        named = {variable: asked[key] for key, variable in _VARIABLES.items() if asked[key] is not None}
        description = self.description
        own = description.read({**named, **_material(self.material, description)})
        further = description.read(self._asked["settings"])
        for name in set(own) & set(further):
            if own[name] != further[name] and name != "material.name":
                raise SwarfError(f"{name} is told twice: {own[name]} and, in settings, {further[name]}")
        self._values = {**own, **further}
        self.feed = float(self._get("feed"))
        self.speed = float(self._get("tool_velocity"))
        if not (self.feed > 0.0 and self.speed > 0.0):
            raise SwarfError(f"feed = {self.feed} m and speed = {self.speed} m/s must both be above 0")
        if points_per_feed is not None and not 2.0 <= float(points_per_feed) <= 1000.0:
            raise SwarfError(f"points_per_feed = {points_per_feed} is outside 2 to 1000")

    @cached_property
    def description(self) -> Description:
        """Of the FMU that this cut runs on."""
        return describe(self._asked["fmu"])

    def replace(self, **changes: Any) -> Cut:
        """The same cut with some keywords changed.

        Parameters
        ----------
        **changes
            Keywords of `Cut`, or names of the FMU's variables, which are added to ``settings``.
        """
        asked = {**self._asked, "settings": dict(self._asked["settings"])}
        for name, value in changes.items():
            if name == "settings":
                asked["settings"].update(value)
            elif name in asked:
                asked[name] = value
            else:
                self.description.variable(name)
                asked["settings"][name] = value
        return Cut(**asked)

    def variable_of(self, name: str) -> str:
        """The FMU's name of a keyword that sets one variable; such a name itself is given back."""
        found = _VARIABLES.get(name, name)
        self.description.variable(found)
        return found

    def value_of(self, name: str) -> Any:
        """What a keyword or a variable is set to, or its start, in the FMU's unit."""
        return self._get(self.variable_of(name))

    def resolved_values(self) -> dict[str, Any]:
        """What decides on the numbers of a run, as the FMU takes it; without what follows from the travel."""
        return {**self._values, "points_per_feed": self.points_per_feed}

    def resolved(self) -> dict[str, Any]:
        """Keywords of a cut that is the same, in plain numbers and without files: for another process."""
        further = {name: value for name, value in self._values.items() if name != "material.name"}
        named = {"speed": further.pop("tool_velocity"), "feed": further.pop("feed")}
        points = None if "numerics.point_spacing" in further else self.points_per_feed
        name = self._values["material.name"]
        return {
            "material": name,
            **named,
            "accuracy": self._accuracy,
            "points_per_feed": points,
            "settings": further,
        }

    @property
    def points_per_feed(self) -> float:
        """Material points over the feed."""
        if "numerics.point_spacing" in self._values:
            return self.feed / self._values["numerics.point_spacing"]
        if self._asked["points_per_feed"] is not None:
            return float(self._asked["points_per_feed"])
        found = _preset(self.description, self._accuracy, self._conducts)
        if found is None:
            raise SwarfError(f"accuracy = {self._accuracy} sets no spacing: tell points_per_feed")
        return found.points_per_feed

    @cached_property
    def bands(self) -> dict[str, float]:
        """Bands of outputs but the force's, as shares, by the price list of the FMU.

        They are those of the finest preset that is no finer than this cut.
        """
        finest = None
        for name in self.description.variable("numerics.accuracy").items:
            found = _preset(self.description, name, self._conducts)
            if found is not None and found.points_per_feed <= self.points_per_feed * (1 + 1e-9):
                if finest is None or found.points_per_feed > finest.points_per_feed:
                    finest = found
        return dict(finest.bands) if finest else {}

    def values(self, travel: float = DEFAULT_TRAVEL) -> dict[str, Any]:
        """Every value that is set before initialization, by the FMU's names, in its units.

        Parameters
        ----------
        travel
            Longest travel (feeds) that must fit into the workpiece.
        """
        feed, edge = self.feed, float(self._get("tool.edge_radius"))
        spacing = feed / self.points_per_feed
        if spacing == self.description.variable("numerics.point_spacing").start:
            spacing = math.nextafter(spacing, 0.0)  # a preset takes a start value for nothing asked
        cell = spacing * int(self._get("numerics.points_per_cell_edge"))
        sizes = {
            "numerics.point_spacing": spacing,
            "numerics.mass_scaling": 0.0,
            "workpiece.height": _up(feed + BELOW * max(feed, edge), cell),
            "workpiece.length": _up((travel + AHEAD) * feed, cell),
            "tool.length": 3.0 * feed,
            "tool.height": max(6.0, 0.6 * travel) * feed,
            "tool.initial_gap": _GAP * feed,
        }
        known = {name: value for name, value in sizes.items() if name in self.description.variables}
        return {**known, **self._values}

    def estimate(self, travel: Any = None) -> Estimate:
        """Price, bands and warnings, without a run.

        Parameters
        ----------
        travel
            ``"5 feeds"``, a length, or None for the longest travel of `run`.
        """
        feeds = DEFAULT_TRAVEL if travel is None else in_feeds(travel, self.feed, "travel")
        with Instance(self.description, self.values(feeds)) as instance:
            instance.initialize(self._time(feeds))
            found = instance.get(_present(self.description, [_COST, _BAND, "numerics.active_points"]))
            bands = {**self.bands, "cutting_force": found.get(_BAND, math.nan)}
            points = int(found.get("numerics.active_points", 0))
            cost = found.get(_COST, math.nan)
            return Estimate(cost, dict(sorted(bands.items())), instance.warnings, points, feeds)

    def run(
        self,
        travel: Any = None,
        *,
        tolerance: float = 0.03,
        max_travel: Any = DEFAULT_TRAVEL,
        frames: int = 2,
        folder: Any = None,
        progress: bool = True,
    ) -> Result:
        """Runs the cut.

        A run that fails or is interrupted (Ctrl-C) gives what there is until then, and says so in
        ``failure``.

        Parameters
        ----------
        travel
            ``"5 feeds"`` or a length. Without one the tool goes on until the force is steady.
        tolerance
            The force is steady when the standard error of its block means is below this share of it.
        max_travel
            Where a cut ends that does not become steady.
        frames
            Pictures in a feed of travel; 0 for none.
        folder
            Where the FMU's files go, to be kept; without one they live as long as the result.
        progress
            Show a bar.

        Returns
        -------
        Result
            History, steady values and frames.
        """
        fixed = travel is not None
        feeds = (
            in_feeds(travel, self.feed, "travel") if fixed else in_feeds(max_travel, self.feed, "max_travel")
        )
        steps = max(1, round(feeds * STEPS_PER_FEED))
        values, stop = self.values(feeds), self._time(feeds)
        kept = None
        if frames:
            if folder is None:
                kept = tempfile.TemporaryDirectory(prefix="swarf-")
                folder = kept.name
            Path(folder).mkdir(parents=True, exist_ok=True)
            interval = self.feed / self.speed / frames
            values = {**values, "results.directory": str(folder), "results.interval": interval}
        clock, failure, rows, warnings = _Clock(), None, [], []
        with Instance(self.description, values) as instance:
            bar = tqdm(
                total=steps / STEPS_PER_FEED,
                unit="feed",
                disable=not progress,
                leave=False,
                bar_format="{l_bar}{bar}| {n:.1f}/{total:.0f} feeds [{elapsed}<{remaining}{postfix}]",
            )
            try:
                instance.initialize(stop)
                start = values["tool.initial_gap"] / self.speed  # until the edge meets the material
                for step in range(1, steps + 1):
                    instance.step_to(start + (stop - start) * step / steps)
                    outputs = instance.get(self.description.outputs)
                    rows.append((instance.time, step / STEPS_PER_FEED, *outputs.values()))
                    bar.update(1 / STEPS_PER_FEED)
                    if step % STEPS_PER_FEED == 0:
                        force = np.array([row[2 + self._force] for row in rows])
                        bar.set_postfix_str(f"{force[-STEPS_PER_FEED:].mean():.4g} N", refresh=False)
                        if not fixed and is_steady(block_means(force, STEPS_PER_FEED), tolerance):
                            break
            except KeyboardInterrupt:
                failure = "interrupted"
            except Refused as error:
                failure = str(error)
            finally:
                bar.close()
            warnings = instance.warnings
            in_use = _in_use(instance)
        history = pd.DataFrame(rows, columns=["time", "travel", *self.description.outputs]).set_index("time")
        history.attrs["units"] = self._units()
        return Result(self, history, failure, warnings, in_use, clock.read(), tolerance, folder, kept)

    @property
    def _accuracy(self) -> str:
        number = self._get("numerics.accuracy")
        items = self.description.variable("numerics.accuracy").items
        return next((name for name, value in items.items() if value == number), str(number))

    @property
    def _conducts(self) -> bool:
        items = self.description.variable("effects.heat").items
        return self._get("effects.heat") == items.get("conduction")

    @cached_property
    def _force(self) -> int:
        return self.description.outputs.index("cutting_force")

    def _get(self, name: str) -> Any:
        """What a variable is set to, or its start, as the FMU takes it."""
        if name in self._values:
            return self._values[name]
        variable = self.description.variable(name)
        return variable.read(variable.start)

    def _time(self, feeds: float) -> float:
        """Time (s) until the tool has gone so many feeds into the material."""
        return (feeds * self.feed + self.values(feeds)["tool.initial_gap"]) / self.speed

    def _units(self) -> dict[str, str]:
        units = {name: self.description.variables[name].unit for name in self.description.outputs}
        return {"time": "s", "travel": "feeds", **units}

    def __repr__(self) -> str:
        shown = {k: v for k, v in self._asked.items() if v not in (None, {}) and k != "material"}
        return f"Cut({self.material!r}, {', '.join(f'{k}={v!r}' for k, v in shown.items())})"


_COST, _BAND = "numerics.estimated_cpu_time", "numerics.force_error_band"


@dataclass(frozen=True)
class _Preset:
    points_per_feed: float
    bands: dict[str, float]


def _preset(description: Description, name: str, conducts: bool) -> _Preset | None:
    """A preset's line of the price list that the FMU carries."""
    table = _price_list(description)
    for kind in ["preset with conduction", "preset"] if conducts else ["preset"]:
        for row in table:
            if row["kind"] == kind and row["name"] == name:
                feed = description.variable("feed").start
                known = [n for n in row if n in description.variables and row[n]]
                return _Preset(feed / float(row["point_spacing"]), {n: float(row[n]) for n in known})
    return None


def _price_list(description: Description) -> list[dict[str, str]]:
    found = description.__dict__.get("_price_list")
    if found is None:
        with zipfile.ZipFile(description.path) as archive:
            text = archive.read("resources/price_list.csv").decode()
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        found = description.__dict__["_price_list"] = list(csv.DictReader(io.StringIO("\n".join(lines))))
    return found


def _material(material: str, description: Description) -> dict[str, Any]:
    path, _, name = material.partition("#")
    if path.endswith(".toml"):
        return materials.read_file(path, description, name or None)
    known = [*materials.library(description), "custom"]
    if material not in known:
        raise SwarfError(
            f"material = {material!r} is none of {', '.join(known)}, and no path of a .toml file"
        )
    return {"material.name": material} if material == "custom" else materials.find(material, description)


def _present(description: Description, names: list[str]) -> list[str]:
    return [name for name in names if name in description.variables]


def _in_use(instance: Instance) -> dict[str, Any]:
    """Inputs and parameters as the FMU holds them at the end."""
    return instance.get(instance.description.parameters)


def _up(length: float, cell: float) -> float:
    """The length rounded up to whole cells."""
    return math.ceil(length / cell - 1e-6) * cell


class _Clock:
    """Processor and wall time of this process since it was made."""

    def __init__(self) -> None:
        self._start = time.process_time(), time.perf_counter()

    def read(self) -> dict[str, float]:
        cpu, wall = self._start
        return {"cpu_seconds": time.process_time() - cpu, "wall_seconds": time.perf_counter() - wall}
