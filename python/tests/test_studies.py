"""Studies: the same bits everywhere, nothing lost and nothing run twice, whatever is killed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

import swarf
from swarf import SwarfError
from swarf.__main__ import main, read_study
from swarf.studies import MACHINE

pytest.importorskip("distributed")
TRAVEL = "3 feeds"


def same(one: pd.DataFrame, other: pd.DataFrame) -> bool:
    """Every bit but the times of the machine; columns in any order."""
    columns = sorted(set(one) - set(MACHINE))
    assert set(columns) == set(other) - set(MACHINE)
    return one[columns].equals(other[columns])


@pytest.fixture(scope="module")
def serial(cut, tmp_path_factory):
    """A study of this process: two feeds, four speeds."""
    folder = tmp_path_factory.mktemp("serial")
    return swarf.study(
        cut,
        feed=["0.1 mm", "0.15 mm"],
        speed=(100, 300, "m/min"),
        n=4,
        design="grid",
        travel=TRAVEL,
        folder=folder,
        scheduler="serial",
        progress=False,
    )


def test_a_row_says_everything(serial):
    """Parameters, means, scatter and bands, versions, cost, failure."""
    rows = serial.frame
    assert len(rows) == 8 and (rows["failure"] == "").all() and (rows["cutting_force"] > 0).all()
    for column in (
        "cutting_force scatter",
        "cutting_force band",
        "tool.rake_angle",
        "material.yield_stress",
        "version guid",
        "version digest",
        "version package",
        "cpu_seconds",
        "warnings",
        "travel",
    ):
        assert column in rows, column
    assert serial.varied == ["tool_velocity", "feed"] or set(serial.varied) == {"tool_velocity", "feed"}
    # More feed, more force, in each pair of cuts at one speed.
    for _, pair in rows.groupby("tool_velocity"):
        assert pair.sort_values("feed")["cutting_force"].is_monotonic_increasing


def test_what_has_a_row_is_not_run_again(serial, cut, monkeypatch):
    """The same call finds all rows; one level more runs two cuts."""
    monkeypatch.setattr(swarf.Cut, "run", lambda *_, **__: pytest.fail("a cut was run again"))
    again = swarf.study(
        cut,
        feed=["0.1 mm", "0.15 mm"],
        speed=(100, 300, "m/min"),
        n=4,
        design="grid",
        travel=TRAVEL,
        folder=serial.folder,
        scheduler="serial",
        progress=False,
    )
    assert same(again.frame, serial.frame)
    more = swarf.study(
        cut, feed=["0.1 mm", "0.15 mm"], speed=[5 / 3, 2.0], travel=TRAVEL, folder=serial.folder, run=False
    )
    assert [more.cuts[i].speed for i in more.missing()] == [2.0, 2.0]
    assert more.estimate() > 0


def test_an_opened_study_has_its_rows(serial):
    opened = swarf.open_study(serial.folder)
    assert same(opened.frame, serial.frame) and set(opened.varied) == set(serial.varied)
    with pytest.raises(SwarfError, match="no study"):
        swarf.open_study(serial.folder / "rows")


def test_a_travel_told_otherwise_is_the_same_travel(serial, cut):
    """As a number of feeds, or as a length where there is one feed."""
    keywords = {"feed": ["0.1 mm"], "speed": (100, 300, "m/min"), "n": 4, "design": "grid", "run": False}
    for travel in ("3 feeds", 3, "0.3 mm"):
        assert not swarf.study(cut, travel=travel, folder=serial.folder, **keywords).missing(), travel
    assert len(swarf.study(cut, travel=4, folder=serial.folder, **keywords).missing()) == 4


def test_varied_points_per_feed_are_seen(cut, tmp_path):
    """They are no variable of the FMU; the distance of the points is."""
    made = swarf.study(cut, points_per_feed=[4, 5], travel=1, folder=tmp_path, run=False)
    assert made.varied == ["numerics.point_spacing"]


def test_a_map_has_a_dot_for_each_cut(serial):
    """In the units that people use."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = serial.map("chip_temperature")
    assert axes.get_xlabel() == "feed (mm)" and len(axes.lines[0].get_xdata()) == 8
    assert max(axes.lines[0].get_xdata()) == pytest.approx(0.15)
    with pytest.raises(SwarfError, match="no column"):
        serial.map("force")
    with pytest.raises(SwarfError, match="two values"):
        serial.map(y="friction")


def test_a_failure_is_a_row_with_its_reason(cut, tmp_path):
    """One of two cuts asks for a time step that is refused; the other goes on, and only it is good."""
    found = swarf.study(
        cut.replace(**{"numerics.speed": "exact"}),
        **{"numerics.courant": [0.5, 1.24]},
        travel=1,
        folder=tmp_path,
        scheduler="serial",
        progress=False,
    )
    assert len(found.frame) == 2 and len(found.good) == 1
    assert "courant" in found.frame["failure"].iloc[1] and not found.missing()
    assert found.missing(again=True) == [1]


def test_functions_of_the_result_become_columns(cut, tmp_path):
    """One of them fails: its reason is told, the others keep their values."""
    also = {"bins": lambda result: len(result.profile("rake")), "wrong": lambda result: 1 / 0}
    row = swarf.study(
        cut, feed=["0.1 mm"], travel=1, folder=tmp_path, scheduler="serial", also=also, progress=False
    ).frame.iloc[0]
    assert row["bins"] > 0 and "wrong: division by zero" in row["failure"]


FILE = """
[cut]
material = "AISI 1045"
rake = "5 deg"
edge_radius = "30 um"
friction = 0.3
heat = "conduction"
speed = "180 m/min"
feed = "0.1 mm"
points_per_feed = 5
settings = { "numerics.speed" = "fast", "numerics.threads" = 1 }

[vary]
feed = ["0.1 mm", "0.15 mm"]
speed = { from = 100, to = 300, unit = "m/min" }

[study]
n = 4
design = "grid"
travel = "3 feeds"
"""


def test_a_file_describes_the_same_study(serial, tmp_path, capsys):
    path = tmp_path / "steel.toml"
    path.write_text(FILE)
    cut, keywords = read_study(path)
    assert swarf.study(cut, run=False, **keywords).keys == serial.keys
    assert main(["study", str(path), "--price"]) == 0 and "8 of 8 cuts" in capsys.readouterr().out
    path.write_text(FILE.replace("[vary]", "[varied]"))
    assert main(["study", str(path)]) == 1 and "varied" in capsys.readouterr().err
    path.write_text(FILE.replace("rake =", "rakes ="))
    assert main(["study", str(path)]) == 1 and "rakes" in capsys.readouterr().err


# Every finished run leaves a line, whoever ran it. A cut takes longer than here the killing does.
CLIENT = """
import os, sys, time
import swarf
from swarf.__main__ import read_study

def note(result):
    time.sleep(0.5)
    with open({log!r}, "a") as file:
        file.write(f"{{os.getpid()}} {{result.cut.feed!r}} {{result.cut.speed!r}}\\n")
    return 0.0

cut, keywords = read_study(__import__("pathlib").Path({file!r}))
keywords["speed"] = {{"from": 100, "to": 300, "unit": "m/min"}}
swarf.study(cut, **{{**keywords, "n": 8}}, folder={folder!r}, scheduler={scheduler!r}, also={{"noted": note}},
            frames=0, progress=False)
print("done")
"""


def wait_for(condition, what, seconds=120):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds} s for {what}"
        time.sleep(0.05)


def test_nothing_is_lost_and_nothing_run_twice(cut, tmp_path):
    """Client killed and restarted, one of two workers killed: the rows are those of a serial study.

    Each cut is finished once: what runs when its client dies is fetched by the next one. Only what the killed
    worker had in hand is begun again.
    """
    log, folder, file = tmp_path / "log", tmp_path / "study", tmp_path / "study.toml"
    log.touch()
    file.write_text(FILE)
    contact = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    environment = {**os.environ, "SWARF_FMU": "/nowhere"}  # workers have the FMU from the client alone
    living = [
        subprocess.Popen(
            [
                *dask,
                "scheduler",
                "--host",
                "127.0.0.1",
                "--port",
                "0",
                "--dashboard-address",
                ":0",
                "--scheduler-file",
                str(contact),
            ],
            env=environment,
            stderr=subprocess.DEVNULL,
        )
    ]
    try:
        wait_for(contact.is_file, "the scheduler")
        address = json.loads(contact.read_text())["address"]
        workers = [
            subprocess.Popen(
                [
                    *dask,
                    "worker",
                    address,
                    "--host",
                    "127.0.0.1",
                    "--nthreads",
                    "1",
                    "--no-nanny",
                    "--no-dashboard",
                    "--local-directory",
                    str(tmp_path / f"worker{i}"),
                ],
                env=environment,
                stderr=subprocess.DEVNULL,
            )
            for i in range(2)
        ]
        living += workers
        script = CLIENT.format(log=str(log), file=str(file), folder=str(folder), scheduler=address)

        def client():
            living.append(subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True))
            return living[-1]

        def rows():
            return len(list(Path(folder).glob("rows/*.parquet")))

        first = client()
        wait_for(lambda: rows() >= 3, "three rows")
        first.send_signal(signal.SIGKILL)
        first.wait()
        before = len(log.read_text().splitlines())
        wait_for(lambda: len(log.read_text().splitlines()) >= before + 2, "two cuts without a client")
        second = client()
        wait_for(lambda: rows() >= 9, "nine rows")
        workers[0].send_signal(signal.SIGKILL)
        assert second.communicate(timeout=300)[0] == "done\n"
    finally:
        for process in living:
            process.kill()
            process.wait()
    finished = [tuple(line.split()[1:]) for line in log.read_text().splitlines()]
    assert len(finished) == len(set(finished)) == 16, "each cut is finished once"
    assert len({line.split()[0] for line in log.read_text().splitlines()}) == 2, "both workers took part"
    keywords = {"feed": ["0.1 mm", "0.15 mm"], "speed": (100, 300, "m/min"), "n": 8, "design": "grid"}
    serial = swarf.study(
        cut,
        **keywords,
        travel=TRAVEL,
        folder=tmp_path / "serial",
        scheduler="serial",
        also={"noted": lambda _: 0.0},
        frames=0,
        progress=False,
    )
    found = pd.read_parquet(folder / "results.parquet").sort_values("cut", ignore_index=True)
    assert same(found, serial.frame)
    assert not swarf.study(
        cut, **keywords, travel=TRAVEL, folder=folder, also={"noted": lambda _: 0.0}, frames=0, run=False
    ).missing()


def test_workers_of_this_machine_give_the_serial_rows(cut, serial, tmp_path):
    """The default: a cluster of this machine's cores, which ends with the call."""
    found = swarf.study(
        cut,
        feed=["0.1 mm", "0.15 mm"],
        speed=(100, 300, "m/min"),
        n=4,
        design="grid",
        travel=TRAVEL,
        folder=tmp_path,
        workers=2,
        progress=False,
    )
    assert same(found.frame, serial.frame)
