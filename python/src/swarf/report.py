"""Pages of cuts and studies: one HTML file each, which needs nothing beside it.

Figures are plotly's, whose script is put into the page; the chip is drawn on a canvas by the page's own
script.
"""

from __future__ import annotations

import base64
import html
import json
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError, needs
from swarf._fmu import Description, Variable
from swarf.pictures import limits, shown, shown_values

if TYPE_CHECKING:
    from swarf.result import Result
    from swarf.studies import Study

_CARDS = (
    "cutting_force",
    "thrust_force",
    "chip_temperature",
    "chip_thickness",
    "contact_length",
    "shear_angle",
    "specific_cutting_energy",
)
_FIELDS = ("temperature", "plastic_strain", "von_mises")
_MOST_POINTS = 400_000  # of all frames in a page; beyond that frames are left out
_INK = ["#12679b", "#c2571a", "#3a7d44", "#7b4fa3", "#8c6d1f"]


def cut_report(result: Result, path: str | Path) -> Path:
    """Writes a page of a cut.

    Parameters
    ----------
    result
        Of `swarf.Cut.run`; with frames the chip can be played.
    path
        File to write.

    Returns
    -------
    Path
        Of the file.
    """
    description = result.cut.description
    body = [f"<h1>Cut of {_text(result.cut.material)}</h1>", f"<p class=lead>{_text(_asked(result))}</p>"]
    if result.failure:
        body.append(f"<p class=note>The run ended early: {_text(result.failure)}</p>")
    body += [f"<p class=note>{_text(warning)}</p>" for warning in result.warnings]
    figures: dict[str, Any] = {}
    chip = None
    if len(result.history):
        if not result.steady.reached:
            body.append(
                "<p class=note>The force is not steady: its standard error is above "
                f"{100 * result.steady.tolerance:g} %.</p>"
            )
        body.append(_cards(result, description))
        chip = _chip(result)
        if chip:
            body.append(_chip_place(chip))
        figures = _cut_figures(result, description)
        titles = {
            "forces": "Forces",
            "heat": "Temperatures",
            "rake": "Along the rake face",
            "ledger": "Energy",
        }
        body += [f'<h2>{titles[name]}</h2><div class=figure id="{name}"></div>' for name in figures]
        body.append("<h2>Steady values</h2>" + _steady_table(result, description))
    body.append(_parameters(result, description))
    body.append(_provenance({**result.versions, **{k: f"{v:.3g} s" for k, v in result.cost.items()}}))
    return _write(path, f"Cut of {result.cut.material}", body, figures, chip)


def study_report(study: Study, path: str | Path) -> Path:
    """Writes a page of a study.

    Parameters
    ----------
    study
        With at least one cut that was run.
    path
        File to write.

    Returns
    -------
    Path
        Of the file.
    """
    rows = study.frame
    if not len(rows):
        raise SwarfError("the study has no rows yet: run it first")
    description = study.description
    good, varied = study.good, [name for name in study.varied if name in rows]
    failed = rows[rows["failure"] != ""]
    cost = float(rows["cpu_seconds"].sum()) if "cpu_seconds" in rows else float("nan")
    body = [
        f"<h1>Study of {len(rows)} cuts</h1>",
        f"<p class=lead>{_text(study.told.get('cut', ''))}</p>",
        f"<p>{len(good)} cuts succeeded, {len(failed)} failed; {cost:.3g} s of CPU time.</p>",
    ]
    figures = _study_figures(good, varied, description)
    for name in figures:
        kind, _, rest = name.partition(" ")
        title = _text(_TITLES[kind] + rest.replace("_", " "))
        body.append(f'<h2>{title}</h2><div class=figure id="{_text(name)}"></div>')
    body.append("<h2>Cuts</h2>" + _study_table(rows, varied, description))
    first = rows.iloc[0]
    versions = {name.removeprefix("version "): first[name] for name in rows if name.startswith("version ")}
    told = {**versions, **{k: v for k, v in study.told.items() if k not in ("cut", "varied")}}
    body.append(_provenance(told))
    return _write(path, f"Study of {len(rows)} cuts", body, figures, None)


_TITLES = {"over": "Force over ", "map": "Map of the force", "kienzle": "Kienzle's law", "cost": "Price"}


def _write(path: str | Path, title: str, body: list[str], figures: dict[str, Any], chip: Any) -> Path:
    script = needs("plotly.offline", "report").get_plotlyjs() if figures else ""
    pages = files("swarf") / "pages"
    data = json.dumps({"figures": figures, "chip": chip}, allow_nan=False).replace("</", "<\\/")
    text = f"""<!doctype html>
<html lang=en>
<head>
<meta charset=utf-8>
<meta name=viewport content="width=device-width, initial-scale=1">
<title>{_text(title)}</title>
<link rel=icon href="data:,">
<style>
{(pages / "report.css").read_text(encoding="utf-8")}</style>
</head>
<body>
{chr(10).join(body)}
<script>{script}</script>
<script id=data type="application/json">{data}</script>
<script>
{(pages / "report.js").read_text(encoding="utf-8")}</script>
</body>
</html>
"""
    path = Path(path)
    path.write_text(text, encoding="utf-8")
    return path


def _figure(traces: list[Any], x: str, y: str, **layout: Any) -> dict[str, Any]:
    """A figure as plain data, in the page's looks."""
    graph = needs("plotly.graph_objects", "report")
    drawn = graph.Figure(traces)
    drawn.update_layout(
        template="plotly_white",
        margin={"l": 60, "r": 15, "t": 10, "b": 45},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        font={"size": 13},
        colorway=_INK,
        hovermode="closest",
        xaxis_title=x,
        yaxis_title=y,
    )
    drawn.update_layout(**layout)
    return json.loads(drawn.to_json())


def _shown(variable: Variable, values: Any) -> Any:
    _, factor, offset = variable.display
    return np.asarray(values, float) * factor + offset


def _unit(variable: Variable) -> str:
    unit = variable.display[0].replace("degC", "°C")
    return "" if unit == "1" else unit


def _axis(variable: Variable) -> str:
    unit = _unit(variable)
    return variable.name.replace("_", " ") + (f" ({unit})" if unit else "")


def _cut_figures(result: Result, description: Description) -> dict[str, Any]:
    graph = needs("plotly.graph_objects", "report")
    history, variables = result.history, description.variables
    travel = history["travel"].tolist()
    figures = {}

    def lines(names: list[str]) -> list[Any]:
        return [
            graph.Scatter(
                x=travel, y=_shown(variables[n], history[n]).tolist(), name=n.replace("_", " "), mode="lines"
            )
            for n in names
            if n in history
        ]

    forces = lines(["cutting_force", "thrust_force"])
    steady = {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": result.steady.start,
        "x1": travel[-1],
        "y0": 0,
        "y1": 1,
        "fillcolor": "#12679b",
        "opacity": 0.07,
        "line": {"width": 0},
    }
    figures["forces"] = _figure(forces, "travel (feeds)", "force (N)", shapes=[steady])
    names = ["chip_temperature", "chip_temperature_peak", "tool_temperature_peak"]
    heat = lines([name for name in names if history.get(name, pd.Series([0.0])).nunique() > 1])
    if heat:
        figures["heat"] = _figure(
            heat, "travel (feeds)", f"temperature ({_unit(variables['chip_temperature'])})"
        )
    if result._folder is not None and result.profiles["rake"]:
        figures["rake"] = _rake_figure(result.profile("rake"))
    names = [
        n
        for n in description.outputs
        if n.startswith("energy.")
        and variables[n].unit == "J"
        and n != "energy.tool_work"
        and abs(history[n].iloc[-1]) > 0
    ]
    if names:
        work = float(history["energy.tool_work"].iloc[-1]) or 1.0
        shares = [100 * float(history[n].iloc[-1]) / work for n in names]
        bars = graph.Bar(
            x=shares, y=[n.removeprefix("energy.").replace("_", " ") for n in names], orientation="h"
        )
        figures["ledger"] = _figure(
            [bars], "share of the tool's work (%)", "", margin={"l": 120, "r": 15, "t": 10, "b": 45}
        )
    return figures


def _rake_figure(profile: pd.DataFrame) -> dict[str, Any]:
    graph = needs("plotly.graph_objects", "report")
    place = (profile["distance from edge (m)"] * 1e3).tolist()
    traces = [
        graph.Scatter(
            x=place, y=(profile[f"{n} (Pa)"] * 1e-6).tolist(), name=n.replace("_", " "), mode="lines+markers"
        )
        for n in ("contact_pressure", "shear_stress")
        if f"{n} (Pa)" in profile
    ]
    traces.append(
        graph.Scatter(
            x=place,
            y=(profile["temperature (K)"] - 273.15).tolist(),
            name="temperature",
            mode="lines+markers",
            yaxis="y2",
            line={"dash": "dot"},
        )
    )
    second = {
        "title": {"text": "temperature (°C)"},
        "overlaying": "y",
        "side": "right",
        "showgrid": False,
        "tickmode": "auto",
    }
    return _figure(
        traces,
        "distance from the edge (mm)",
        "stress (MPa)",
        yaxis2=second,
        margin={"l": 60, "r": 60, "t": 10, "b": 45},
    )


def _study_figures(good: pd.DataFrame, varied: list[str], description: Description) -> dict[str, Any]:
    graph = needs("plotly.graph_objects", "report")
    figures: dict[str, Any] = {}
    if not len(good):
        return figures
    variables = description.variables
    numeric = [n for n in varied if variables[n].kind == "Real" and good[n].nunique() > 1]
    force = good["cutting_force"].tolist()
    hover = [f"cut {number}" for number in good["cut"]]
    for name in numeric:
        other = next((n for n in numeric if n != name), None)
        marker: dict[str, Any] = {"size": 9, "color": _INK[0]}
        if other:
            bar = {"title": {"text": _axis(variables[other]), "side": "right"}, "thickness": 12}
            marker.update(
                color=_shown(variables[other], good[other]).tolist(), colorscale="Viridis", colorbar=bar
            )
        errors = {
            "type": "data",
            "array": good["cutting_force scatter"].fillna(0).tolist(),
            "thickness": 1,
            "color": "#aab3bc",
        }
        x = _shown(variables[name], good[name]).tolist()
        traces = [
            graph.Scatter(
                x=x, y=force, mode="markers", marker=marker, error_y=errors, text=hover, showlegend=False
            )
        ]
        figures[f"over {name}"] = _figure(traces, _axis(variables[name]), "cutting force (N)")
    if len(numeric) == 2 and len(good) >= 6:
        x, y = (_shown(variables[n], good[n]).tolist() for n in numeric)
        contour = graph.Contour(
            x=x,
            y=y,
            z=force,
            colorscale="Viridis",
            connectgaps=True,
            colorbar={"title": {"text": "N"}, "thickness": 12},
        )
        dots = graph.Scatter(
            x=x,
            y=y,
            mode="markers",
            marker={"color": "#fff", "line": {"width": 1, "color": "#333"}},
            text=hover,
            showlegend=False,
        )
        if _is_lattice(good, numeric):
            figures["map"] = _figure(
                [contour, dots], _axis(variables[numeric[0]]), _axis(variables[numeric[1]])
            )
    if "feed" in numeric and numeric == ["feed"]:
        figures["kienzle"] = _kienzle_figure(good)
    if "cpu_seconds" in good:
        bars = graph.Histogram(x=good["cpu_seconds"].tolist(), marker={"color": _INK[0]})
        figures["cost"] = _figure([bars], "CPU time of a cut (s)", "cuts")
    return figures


def _is_lattice(good: pd.DataFrame, names: list[str]) -> bool:
    return len(good) == good[names[0]].nunique() * good[names[1]].nunique()


def _kienzle_figure(good: pd.DataFrame) -> dict[str, Any]:
    from swarf.forces import kienzle

    graph = needs("plotly.graph_objects", "report")
    law = kienzle(good)
    feeds = np.geomspace(good["feed"].min(), good["feed"].max(), 40)
    width = float(good["workpiece.width"].iloc[0])
    dots = graph.Scatter(
        x=(good["feed"] * 1e3).tolist(), y=good["cutting_force"].tolist(), mode="markers", name="cuts"
    )
    line = graph.Scatter(
        x=(feeds * 1e3).tolist(),
        y=law.force(feeds, width).tolist(),
        mode="lines",
        name=f"k_c1.1 = {law.kc11.value:.4g} N/mm², m_c = {law.mc.value:.3g}",
    )
    axes = {"type": "log"}
    return _figure(
        [dots, line], "feed (mm)", "cutting force (N)", xaxis_type=axes["type"], yaxis_type=axes["type"]
    )


def _chip(result: Result) -> dict[str, Any] | None:
    """Frames as whole numbers: positions by 65535 steps of the box, values by 255 of their range."""
    frames = list(result.frames)
    if not frames:
        return None
    count = len(frames[-1].points)
    most = max(_MOST_POINTS // max(count, 1), 1)
    if len(frames) > most:
        frames = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, most).astype(int))]
    colors = needs("plotly.colors", "report")
    box = limits(frames)
    left, right, lower, upper = box
    spans = {}
    for field in _FIELDS:
        values = np.concatenate([shown_values(frame, field) for frame in frames])
        low, high = (float(v) for v in np.percentile(values, [1, 99.5]))
        spans[field] = (low, max(high, low + 1e-9))
    packed = []
    for frame in frames:
        points = frame.points[:, :2].astype(float) * 1e3
        share = (points - [left, lower]) / [right - left, upper - lower]
        places = np.clip(np.round(share * 65535), 0, 65535).astype("<u2")
        packed_values = {}
        for field, (low, high) in spans.items():
            steps = np.round(255 * (shown_values(frame, field) - low) / (high - low))
            packed_values[field] = _base64(np.clip(steps, 0, 255).astype("u1"))
        tool = np.clip(frame.tool[:, :2].astype(float) * 1e3, [left, lower], [right, upper])
        packed.append(
            {
                "places": _base64(places),
                "values": packed_values,
                "tool": tool.round(5).tolist(),
                "time": f"{1e6 * frame.time:.4g} µs",
            }
        )
    fields = {}
    for field, (low, high) in spans.items():
        unit = shown(field)[0]
        fields[field] = {"low": f"{low:.4g} {unit}".strip(), "high": f"{high:.4g} {unit}".strip()}
    ramp = colors.sample_colorscale("Viridis", np.linspace(0, 1, 256).tolist())
    spacing = float(result.parameters.get("numerics.point_spacing", 0.0)) * 1e3
    return {
        "frames": packed,
        "box": list(box),
        "fields": fields,
        "spacing": spacing,
        "colours": ramp,
        "ramp": ramp[::32] + [ramp[-1]],
    }


def _chip_place(chip: dict[str, Any]) -> str:
    options = "".join(f'<option value="{n}">{n.replace("_", " ")}</option>' for n in chip["fields"])
    return (
        '<h2>Chip</h2><div class=chip><canvas role=img aria-label="material points of the chip"></canvas>'
        "<div class=controls><button type=button>Play</button>"
        "<input type=range min=0 value=0 aria-label=frame><output></output>"
        f"<select aria-label=field>{options}</select></div><div class=legend></div></div>"
    )


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(values.tobytes()).decode()


def _cards(result: Result, description: Description) -> str:
    cards = []
    for name in _CARDS:
        figure = result.steady.get(name)
        if figure is None:
            continue
        variable = description.variables[name]
        _, factor, offset = variable.display
        unit = _unit(variable)
        band = "" if figure.band is None else f", band ±{figure.band * factor:.2g}"
        scatter = "" if np.isnan(figure.scatter) else f"scatter {figure.scatter * factor:.2g}{band} {unit}"
        cards.append(
            f"<div class=card><span>{name.replace('_', ' ')}</span>"
            f"<b>{figure.mean * factor + offset:.4g} {unit}</b><span>{scatter}</span></div>"
        )
    return f"<div class=cards>{''.join(cards)}</div>"


def _steady_table(result: Result, description: Description) -> str:
    rows = []
    for name, figure in result.steady.items():
        variable = description.variables[name]
        _, factor, offset = variable.display
        numbers = [figure.mean * factor + offset, figure.scatter * factor, figure.standard_error * factor]
        band = "" if figure.band is None else f"{figure.band * factor:.3g}"
        cells = [f"{value:.4g}" for value in numbers] + [band, _unit(variable)]
        rows.append([name, *cells])
    heads = ["output", "mean", "scatter of blocks", "standard error", "band", "unit"]
    return _table(heads, rows, numbers=(1, 2, 3, 4))


def _parameters(result: Result, description: Description) -> str:
    rows = []
    for name, value in result.parameters.items():
        variable = description.variables[name]
        shown_value, unit = str(value), ""
        if variable.kind == "Real":
            shown_value, unit = f"{float(_shown(variable, value)):.6g}", _unit(variable)
        elif variable.kind == "Enumeration":
            shown_value = next(
                (item for item, number in variable.items.items() if number == value), str(value)
            )
        rows.append([name, shown_value, unit, variable.description])
    table = _table(["name", "value", "unit", "meaning"], rows, numbers=(1,))
    return f"<details><summary>All parameters in use</summary>{table}</details>"


def _study_table(rows: pd.DataFrame, varied: list[str], description: Description) -> str:
    outputs = [
        n for n in ("cutting_force", "thrust_force", "chip_temperature", "chip_thickness") if n in rows
    ]
    variables = description.variables
    columns = [*varied, *outputs]
    heads = ["cut", *(_axis(variables[n]) for n in columns), "scatter (N)", "band (N)", "CPU (s)", "failure"]
    cells = []
    for _, row in rows.iterrows():
        line = [str(int(row["cut"]))]
        for name in columns:
            variable, value = variables[name], row[name]
            if variable.kind == "Real":
                line.append("" if pd.isna(value) else f"{float(_shown(variable, value)):.4g}")
            else:
                items = {number: item for item, number in variable.items.items()}
                line.append(str(items.get(value, value)))
        for name in ("cutting_force scatter", "cutting_force band", "cpu_seconds"):
            value = row.get(name, np.nan)
            line.append("" if pd.isna(value) else f"{value:.3g}")
        cells.append([*line, str(row["failure"])])
    return _table(heads, cells, numbers=tuple(range(len(heads) - 1)))


def _table(heads: list[str], rows: list[list[str]], numbers: tuple[int, ...] = ()) -> str:
    def cell(tag: str, index: int, text: str) -> str:
        kind = " class=number" if index in numbers else ""
        return f"<{tag}{kind}>{_text(text)}</{tag}>"

    head = "".join(cell("th", i, text) for i, text in enumerate(heads))
    lines = ("".join(cell("td", i, text) for i, text in enumerate(row)) for row in rows)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<div class=scroll><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"


def _provenance(told: dict[str, Any]) -> str:
    items = "; ".join(
        f"{_text(name)} <code>{_text(value)}</code>" for name, value in told.items() if value is not None
    )
    return f"<footer>Made by {items}</footer>"


def _asked(result: Result) -> str:
    def told(name: str, unit: str, factor: float) -> str:
        return f"{float(result.parameters[name]) * factor:.4g} {unit}"

    if not result.parameters:
        return repr(result.cut)
    travel = float(result.history["travel"].iloc[-1]) if len(result.history) else 0.0
    degrees = 180.0 / np.pi
    return (
        f"speed {told('tool_velocity', 'm/min', 60)}, feed {told('feed', 'mm', 1e3)}, "
        f"rake {told('tool.rake_angle', '°', degrees)}, edge radius {told('tool.edge_radius', 'µm', 1e6)}, "
        f"friction {told('friction', '', 1).strip()}, width {told('workpiece.width', 'mm', 1e3)}; "
        f"{travel:g} feeds of travel, {result.cut.points_per_feed:g} points per feed"
    )


def _text(value: Any) -> str:
    return html.escape(str(value))
