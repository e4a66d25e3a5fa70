"""Pictures of frames by matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from swarf._errors import SwarfError, needs
from swarf.frames import UNITS, Frame

# Unit and factor for display, by the field's SI unit.
_SHOWN = {"Pa": ("MPa", 1e-6), "1": ("", 1.0)}
_OFFSETS = {"temperature": ("°C", 1.0, -273.15)}


def shown(field: str) -> tuple[str, float, float]:
    """Unit, factor and offset by which a field is shown."""
    if field in _OFFSETS:
        return _OFFSETS[field]
    unit = UNITS.get(field, "1")
    name, factor = _SHOWN.get(unit, (unit, 1.0))
    return name, factor, 0.0


def shown_values(frame: Frame, field: str) -> np.ndarray:
    """A scalar field of a frame in the unit it is shown by."""
    _, factor, offset = shown(field)
    values = frame.field(field)
    if values.ndim != 1:
        raise SwarfError(f"'{field}' has {values.shape[1]} components; only a scalar can be shown")
    return values * factor + offset


def limits(frames: list[Frame]) -> tuple[float, float, float, float]:
    """Left, right, lower and upper limit (mm) of the points of all frames."""
    points = np.concatenate([frame.points[:, :2] for frame in frames]).astype(float) * 1e3
    (left, lower), (right, upper) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    margin = 0.03 * max(right - left, upper - lower)
    return left - margin, right + margin, lower - margin, upper + margin


def plot(frame: Frame, field: str, axes: Any = None, colours: str = "viridis") -> Any:
    """Draws a field over the points of a frame.

    Parameters
    ----------
    frame
        What to draw.
    field
        A scalar field of `Frame.names`.
    axes
        Matplotlib axes; new ones without.
    colours
        Name of a colour map.

    Returns
    -------
    matplotlib.axes.Axes
        With the picture.
    """
    pyplot = needs("matplotlib.pyplot", "plot")
    if axes is None:
        axes = pyplot.figure(figsize=(9, 5), layout="constrained").add_subplot()
    drawn = _draw(axes, frame, field, colours)
    unit = shown(field)[0]
    label = field.replace("_", " ") + (f" ({unit})" if unit else "")
    axes.figure.colorbar(drawn, ax=axes, label=label, shrink=0.8)
    axes.set(xlabel="x (mm)", ylabel="y (mm)", title=f"{1e6 * frame.time:.4g} µs")
    return axes


def animate(
    frames: list[Frame], path: str | Path, field: str, colours: str = "viridis", rate: float = 8.0
) -> Path:
    """Writes an animation of a field.

    Parameters
    ----------
    frames
        In order of time.
    path
        File to write, by pillow: ``.gif`` or ``.webp``.
    field
        A scalar field of `Frame.names`.
    colours
        Name of a colour map.
    rate
        Frames in a second.

    Returns
    -------
    Path
        Of the file.
    """
    if not frames:
        raise SwarfError("there are no frames to animate; run with frames of 1 or more in a feed")
    pyplot, animation = needs("matplotlib.pyplot", "plot"), needs("matplotlib.animation", "plot")
    figure = pyplot.figure(figsize=(9, 5), layout="constrained")
    axes = figure.add_subplot()
    values = np.concatenate([shown_values(frame, field) for frame in frames])
    low, high = np.percentile(values, [0.5, 99.5])
    box = limits(frames)
    plot(frames[-1], field, axes, colours)

    def draw(frame: Frame) -> None:
        axes.clear()
        _draw(axes, frame, field, colours, (low, high), box)
        axes.set(xlabel="x (mm)", ylabel="y (mm)", title=f"{1e6 * frame.time:.4g} µs")

    axes.collections[0].set_clim(low, high)
    animation.FuncAnimation(figure, draw, frames=frames).save(str(path), writer="pillow", fps=rate)
    pyplot.close(figure)
    return Path(path)


def draw_map(study: Any, output: str, x: str, y: str, axes: Any = None, colours: str = "viridis") -> Any:
    """Draws an output of a study over two varied quantities, as contours between its cuts.

    Parameters
    ----------
    study
        With four cuts or more that did not fail.
    output
        A Real output.
    x, y
        Two varied variables of the FMU.
    axes
        Matplotlib axes; new ones without.
    colours
        Name of a colour map.

    Returns
    -------
    matplotlib.axes.Axes
        With the contours and a dot for each cut.
    """
    pyplot = needs("matplotlib.pyplot", "plot")
    rows, description = study.good, study.description
    for name in (output, x, y):
        if name not in rows:
            raise SwarfError(f"the study has no column '{name}'")
    if len(rows) < 4 or rows[x].nunique() < 2 or rows[y].nunique() < 2:
        raise SwarfError(f"a map needs four cuts over two values of {x} and {y} each; there are {len(rows)}")
    if axes is None:
        axes = pyplot.figure(figsize=(7, 5), layout="constrained").add_subplot()

    def values(name: str) -> tuple[np.ndarray, str]:
        unit, factor, offset = description.variable(name).display
        return rows[name].to_numpy(float) * factor + offset, f"{name.replace('_', ' ')} ({unit})"

    (across, label_x), (up, label_y), (colour, label) = values(x), values(y), values(output)
    drawn = axes.tricontourf(across, up, colour, levels=12, cmap=colours)
    axes.plot(across, up, "o", color="white", markeredgecolor="0.3", markersize=4)
    axes.figure.colorbar(drawn, ax=axes, label=label)
    axes.set(xlabel=label_x, ylabel=label_y)
    return axes


def _draw(axes: Any, frame: Frame, field: str, colours: str, span=None, box=None) -> Any:
    values = shown_values(frame, field)
    low, high = span or np.percentile(values, [0.5, 99.5])
    left, right, lower, upper = box or limits([frame])
    points = frame.points * 1e3
    # A point is drawn as large as its share of the area, by the width that the axes have on paper.
    inches = axes.get_position().width * axes.figure.get_figwidth()
    spacing = np.sqrt(np.median(_areas(frame)))
    size = (72.0 * inches * spacing * 1e3 / (right - left)) ** 2
    drawn = axes.scatter(
        points[:, 0],
        points[:, 1],
        c=values,
        s=1.3 * size,
        cmap=colours,
        vmin=low,
        vmax=high,
        linewidths=0,
        marker="s",
    )
    if len(frame.tool):
        axes.fill(1e3 * frame.tool[:, 0], 1e3 * frame.tool[:, 1], facecolor="0.8", edgecolor="0.3", zorder=0)
    axes.set(aspect="equal", xlim=(left, right), ylim=(lower, upper))
    return drawn


def _areas(frame: Frame) -> np.ndarray:
    """Area (m²) that each point stands for, from the distances of the lattice at the start."""
    points = frame.points[:, :2].astype(float)
    span = np.ptp(points, axis=0)
    return np.full(len(points), max(float(np.prod(span)) * 0.7, 1e-18) / max(len(points), 1))
