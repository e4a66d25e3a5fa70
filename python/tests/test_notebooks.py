"""The notebooks run from top to bottom in a short form, and stand as jupytext writes them."""

import re
from pathlib import Path

import pytest

jupytext = pytest.importorskip("jupytext")
nbclient = pytest.importorskip("nbclient")
NOTEBOOKS = sorted(Path(__file__).resolve().parents[1].joinpath("notebooks").glob("*.py"))
# What is made shorter in each, by patterns that must be found.
SHORT = {
    "first_cut": {r"\*\*DRAFT,": "**DRAFT, points_per_feed=5,", r'"6 feeds"': '"3 feeds"'},
    "kienzle": {
        r'"6 feeds"': '"2 feeds"',
        r"settings=": "points_per_feed=5, settings=",
        r"swarf\.study\(cut,": "swarf.study(cut, scheduler='serial',",
    },
    "machine_tool": {
        r"CUTS = 16": "CUTS = 10",
        r'"5 feeds"': '"3 feeds"',
        r"    settings=": "    points_per_feed=5,\n    settings=",
        r"cut, feed=": "cut, scheduler='serial', feed=",
        r"\Z": "\n# %%\nassert last.iloc[0] < 0.2 * waves.abs().max().iloc[0]  # dies away\n"
        "assert last.iloc[1] > 2 * last.iloc[0]\n",
    },
    "titanium": {r'15, "8 feeds"': '6, "3 feeds"', r'"exact"': '"fast"'},
    "calibration": {
        r'"6 feeds", 12': '"1 feeds", 8',
        r"    settings=": "    points_per_feed=5, settings=",
        r"n=POINTS,": "n=POINTS, scheduler='serial',",
    },
}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_stands_as_jupytext_writes_it(path):
    text = path.read_text(encoding="utf-8")
    again = jupytext.writes(jupytext.reads(text, fmt="py:percent"), fmt="py:percent")

    def body(words):  # without the header, where jupytext adds its version
        return words.split("# ---\n", 2)[2].strip()

    assert body(again) == body(text)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    text = path.read_text(encoding="utf-8")
    for pattern, short in SHORT[path.stem].items():
        text, found = re.subn(pattern, short, text)
        assert found, f"{path.name} no longer has {pattern}"
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = jupytext.reads(text, fmt="py:percent")
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert outputs and not [output for output in outputs if output.output_type == "error"]
