"""Studies: many cuts, each kept as one row as it arrives, and resumed where they were.

A study lies in a folder: ``study.json`` says what it is, ``results.parquet`` holds the rows of finished runs
and ``rows/`` one small file for each cut that has arrived since. A row's key is made from everything that
decides on its numbers: every value that is set, how far the tool goes, and the FMU's file. What has a row is
never run again.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from tqdm.auto import tqdm

from swarf import designs
from swarf._errors import SwarfError, needs
from swarf._fmu import Description, describe
from swarf._tasks import make_plugin, run_on_worker, run_task
from swarf._units import in_feeds
from swarf.cut import DEFAULT_TRAVEL, Cut

# Columns that tell of the machine; all others are the same bits wherever a cut is run.
MACHINE = ("cpu_seconds", "wall_seconds")
_SAMPLES = 6  # cuts whose price is asked for, to tell that of all


class Study:
    """A study and what has come of it; made by `study` or `open_study`.

    Attributes
    ----------
    folder
        Where it lies.
    cuts
        Its cuts; empty for one that was only opened.
    keys
        A key for each cut.
    varied
        Names of the FMU's variables that differ between its cuts.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        cuts: list[Cut] | None = None,
        run: Mapping[str, Any] | None = None,
        also: Mapping[str, Callable[[Any], Any]] | None = None,
        told: Mapping[str, Any] | None = None,
    ) -> None:
        self.folder = Path(folder)
        self.cuts = cuts or []
        self._run = dict(run or {})
        self._also = dict(also or {})
        self.told = dict(told or {})
        self.keys = [_key(cut, self._run, self._also) for cut in self.cuts]

    @property
    def frame(self) -> pd.DataFrame:
        """A row for each cut that has been run: parameters, outputs, versions, bands, cost, failure.

        Steady means stand under the outputs' names in SI units, with `` scatter`` and `` band`` behind the
        name for theirs; ``cut`` is the number of the cut in the design.
        """
        rows = _read(self.folder)
        if self.keys:
            numbers = {key: number for number, key in reversed(list(enumerate(self.keys)))}
            rows = rows[rows["key"].isin(list(numbers))] if len(rows) else rows
            if len(rows):
                rows = rows.assign(cut=rows["key"].map(numbers))
        return rows.sort_values("cut", ignore_index=True) if len(rows) else rows

    @property
    def good(self) -> pd.DataFrame:
        """The rows of cuts that did not fail."""
        rows = self.frame
        return rows[rows["failure"] == ""].reset_index(drop=True) if len(rows) else rows

    @cached_property
    def varied(self) -> list[str]:
        """Names of the FMU's variables that differ between the cuts, as far as they were asked for."""
        if self.cuts:
            every = [cut._values for cut in self.cuts]
            names = dict.fromkeys(name for values in every for name in values)
            found = [n for n in names if any(values.get(n) != every[0].get(n) for values in every)]
            # Points per feed have no variable of their own.
            if "numerics.point_spacing" not in found and len({cut.points_per_feed for cut in self.cuts}) > 1:
                found.append("numerics.point_spacing")
            return found
        return list(self.told.get("varied", []))

    def missing(self, again: bool = False) -> list[int]:
        """Numbers of the cuts that have no row yet.

        Parameters
        ----------
        again
            Count those that failed, too.
        """
        rows = _read(self.folder)
        done: set[str] = set()
        if len(rows):
            done = set(rows["key"][rows["failure"] == ""] if again else rows["key"])
        first: dict[str, int] = {}
        for number, key in enumerate(self.keys):
            if key not in done:
                first.setdefault(key, number)
        return list(first.values())

    def estimate(self) -> float:
        """Processor time (s) that the missing cuts take where every tool goes as far as it may.

        From the prices of a few of them, as the FMU estimates them.
        """
        missing = self.missing()
        if not missing:
            return 0.0
        chosen = np.unique(np.linspace(0, len(missing) - 1, min(_SAMPLES, len(missing))).astype(int))
        prices = [
            self.cuts[missing[i]].estimate(self._longest(self.cuts[missing[i]])).cpu_seconds for i in chosen
        ]
        return float(np.mean(prices)) * len(missing)

    def _longest(self, cut: Cut) -> Any:
        return self._run.get("travel") or self._run.get("max_travel") or DEFAULT_TRAVEL

    def run(
        self,
        scheduler: str | None = None,
        workers: int | None = None,
        *,
        again: bool = False,
        progress: bool = True,
    ) -> Study:
        """Runs the cuts that have no row yet.

        Parameters
        ----------
        scheduler
            ``"tcp://…"`` for a Dask cluster, whose workers have this package and one thread each;
            ``"serial"`` for this process; None for workers on this machine.
        workers
            Number of those; one for each core without.
        again
            Run cuts that failed once more.
        progress
            Tell the price and show a bar.
        """
        if scheduler != "serial":
            needs("distributed", "study")
        missing = self.missing(again)
        self._write_description()
        if missing:
            count = workers or os.cpu_count() or 1
            if progress:
                price = self.estimate()
                there = len(set(self.keys)) - len(missing)
                print(
                    f"{len(missing)} cuts to run ({there} are there): about {_time(price)} of CPU time"
                    + (f", {_time(price / count)} on {count} workers" if scheduler is None else ""),
                    file=sys.stderr,
                )
            bar = tqdm(total=len(missing), unit="cut", disable=not progress)
            with bar:
                if scheduler == "serial":
                    for number in missing:
                        self._store(
                            number, run_task(self._task(number), str(self.cuts[number].description.path))
                        )
                        bar.update()
                else:
                    self._run_on_dask(missing, scheduler, count, bar)
        _compact(self.folder)
        return self

    def _task(self, number: int) -> dict[str, Any]:
        cut = self.cuts[number]
        return {"cut": cut.resolved(), "run": self._run, "also": self._also, "digest": cut.description.digest}

    def _run_on_dask(self, missing: list[int], scheduler: str | None, count: int, bar: Any) -> None:
        distributed = needs("distributed", "study")
        with ExitStack() as stack:
            if scheduler is None:
                scheduler = stack.enter_context(
                    distributed.LocalCluster(
                        n_workers=min(count, len(missing)),
                        threads_per_worker=1,
                        processes=True,
                        dashboard_address=":0",
                        silence_logs=logging.ERROR,
                    )
                )
                shared = False
            else:
                shared = True
            client = stack.enter_context(distributed.Client(scheduler, set_as_default=False))
            for description in {id(c.description): c.description for c in self.cuts}.values():
                client.register_plugin(make_plugin(description.path.read_bytes(), description.digest))
            bar.set_postfix_str(f"dashboard {client.dashboard_link}")
            _Queue(self, client, distributed, missing, shared, bar).run()

    def _store(self, number: int, row: Mapping[str, Any]) -> None:
        values = {name: _plain(value) for name, value in row.items()}
        values = {"key": self.keys[number], "cut": number, **values}
        folder = self.folder / "rows"
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{self.keys[number]}.parquet"
        part = path.with_suffix(".part")
        pd.DataFrame([values]).to_parquet(part, index=False)
        os.replace(part, path)

    def _write_description(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / "study.json"
        told = {**self.told, "cuts": len(self.cuts), "varied": self.varied}
        part = path.with_suffix(".part")
        part.write_text(json.dumps(told, indent=1, default=str) + "\n", encoding="utf-8")
        os.replace(part, path)

    @property
    def description(self) -> Description:
        """Of the FMU of its cuts; for a study that was only opened, of the package's own."""
        return self.cuts[0].description if self.cuts else describe()

    def map(
        self, output: str = "cutting_force", x: str = "feed", y: str = "tool_velocity", **options: Any
    ) -> Any:
        """Draws an output over two varied quantities; see `swarf.pictures.draw_map`."""
        from swarf.pictures import draw_map

        return draw_map(self, output, x, y, **options)

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Writes a page of this study; see `swarf.report.study_report`."""
        from swarf.report import study_report

        return study_report(self, Path(path))

    def surrogate(self, path: str | os.PathLike[str], **options: Any) -> Any:
        """Writes a small FMU with a law fitted to this study; see `swarf.surrogate.make`."""
        from swarf.surrogate import make

        return make(self, Path(path), **options)

    def __len__(self) -> int:
        return len(set(self.keys)) if self.keys else len(self.frame)

    def __repr__(self) -> str:
        rows = self.frame
        failed = int((rows["failure"] != "").sum()) if len(rows) else 0
        return f"<study '{self.folder}': {len(rows)} of {len(self)} cuts, {failed} failed>"


def study(
    cut: Cut,
    *,
    n: int | None = None,
    design: str | None = None,
    travel: Any = None,
    max_travel: Any = DEFAULT_TRAVEL,
    tolerance: float = 0.03,
    folder: str | os.PathLike[str] = "study",
    seed: int = 0,
    also: Mapping[str, Callable[[Any], Any]] | None = None,
    frames: int | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    again: bool = False,
    progress: bool = True,
    run: bool = True,
    **varied: Any,
) -> Study:
    """Runs a cut many times, with some of its quantities varied.

    Its price is told before it starts. Each cut's row is written as it arrives; a study that was ended goes
    on where it was when it is called again. In a script the call must stand under
    ``if __name__ == "__main__":``, as workers on this machine are new processes.

    Parameters
    ----------
    cut
        What the cuts have in common.
    n
        Number of cuts of a Sobol or Latin hypercube design; levels of a range in a grid.
    design
        ``grid``, ``sobol`` or ``lhs``; see `swarf.designs.make`.
    travel, max_travel, tolerance
        How far the tool goes; see `Cut.run`.
    folder
        Where the study is kept.
    seed
        Of the design.
    also
        Functions of the `Result`, whose values become columns by these names.
    frames
        Pictures in a feed of travel, for those functions; none without functions.
    scheduler, workers, again, progress
        See `Study.run`.
    run
        Run it now; otherwise by `Study.run`.
    **varied
        Keywords of `Cut` or names of the FMU's variables (``**{"tool.rake_angle": ...}``): a list of
        levels, or a range ``(low, high)`` or ``(low, high, unit)``.

    Returns
    -------
    Study
        With its rows in ``frame``.

    Examples
    --------
    >>> s = study(cut, feed=["0.1 mm", "0.2 mm"], speed=(100, 300, "m/min"), n=200)  # doctest: +SKIP
    """
    settings = designs.make([designs.read_varied(k, v) for k, v in varied.items()], n, design, seed)
    cuts = [cut.replace(**values) for values in settings]
    cuts = [c if "numerics.threads" in c._values else c.replace(**{"numerics.threads": 1}) for c in cuts]
    in_feeds(travel if travel is not None else max_travel, cut.feed, "travel")
    how = {
        "travel": travel,
        "max_travel": max_travel,
        "tolerance": tolerance,
        "frames": (2 if also else 0) if frames is None else frames,
    }
    told = {
        "cut": repr(cut),
        "design": design,
        "n": n,
        "seed": seed,
        "travel": travel,
        "max_travel": max_travel,
        "ranges": {k: v if isinstance(v, (list, dict)) else list(v) for k, v in varied.items()},
    }
    made = Study(folder, cuts, how, also, told)
    return made.run(scheduler, workers, again=again, progress=progress) if run else made


def open_study(folder: str | os.PathLike[str]) -> Study:
    """A study that was kept, with its rows but without its cuts.

    Parameters
    ----------
    folder
        Where it lies.
    """
    path = Path(folder) / "study.json"
    if not path.is_file():
        raise SwarfError(f"'{folder}' holds no study: there is no study.json in it")
    return Study(folder, told=json.loads(path.read_text(encoding="utf-8")))


class _Queue:
    """Hands cuts to a Dask cluster and stores their rows as they arrive.

    On a cluster that outlives its client every cut on its way is published, which keeps it there when the
    client is killed; the next client finds it by its name, whether it still runs or waits to be fetched.
    """

    def __init__(
        self, study: Study, client: Any, distributed: Any, missing: list[int], shared: bool, bar: Any
    ) -> None:
        self._study, self._client, self._distributed = study, client, distributed
        self._waiting: Iterator[int] = iter(missing)
        self._shared, self._bar = shared, bar
        self._published = set(client.list_datasets()) if shared else set()
        self._living: dict[str, tuple[int, Any]] = {}

    def run(self) -> None:
        """Until every row is stored."""
        # Those that a killed client has left behind come first.
        order = list(self._waiting)
        order.sort(key=lambda number: self._name(number) not in self._published)
        self._waiting = iter(order)
        window = max(8, 4 * len(self._client.scheduler_info()["workers"]))
        arriving = self._distributed.as_completed(loop=self._client.loop)
        with _interruptible():
            try:
                for _ in range(window):
                    self._submit_next(arriving)
                for future in arriving:
                    number, _ = self._living.pop(future.key)
                    self._study._store(number, self._row(number, future))
                    self._forget(number, future)
                    self._bar.update()
                    self._submit_next(arriving)
            except KeyboardInterrupt:
                for number, future in self._living.values():
                    future.cancel()
                    self._forget(number, future)
                raise

    def _name(self, number: int) -> str:
        return f"swarf-{self._study.keys[number]}"

    def _submit_next(self, arriving: Any) -> None:
        number = next(self._waiting, None)
        if number is None:
            return
        name = self._name(number)
        if name in self._published:
            future = self._client.get_dataset(name)
        else:
            task = self._study._task(number)
            future = self._client.submit(run_on_worker, task, name, key=name, pure=False)
            if self._shared:
                self._client.publish_dataset(future, name=name, override=True)
                self._published.add(name)
        self._living[future.key] = (number, future)
        arriving.add(future)

    def _forget(self, number: int, future: Any) -> None:
        name = self._name(number)
        self._client.set_metadata(["swarf", name], None)
        if name in self._published:
            self._client.unpublish_dataset(name)
            self._published.discard(name)
        future.release()

    def _row(self, number: int, future: Any) -> dict[str, Any]:
        if future.status == "finished":
            return future.result()
        error = future.exception()
        cut = self._study.cuts[number]
        text = f"{type(error).__name__}: {error}"
        return {**cut.values(), "failure": text or "no reason told", "warnings": ""}


@contextmanager
def _interruptible() -> Iterator[None]:
    """Lets SIGTERM end a study like Ctrl-C, where this is the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_number: int, _frame: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _key(cut: Cut, run: Mapping[str, Any], also: Mapping[str, Any]) -> str:
    values = {name: value for name, value in cut.resolved_values().items() if name != "numerics.threads"}
    lengths = {
        name: in_feeds(run[name], cut.feed, name)
        for name in ("travel", "max_travel")
        if run.get(name) is not None
    }
    told = {
        "values": values,
        "run": {**run, **lengths},
        "also": sorted(also),
        "fmu": cut.description.digest,
    }
    return hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode()).hexdigest()[:32]


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _read(folder: Path) -> pd.DataFrame:
    """All rows of a folder, each key once."""
    parts = [pd.read_parquet(folder / "results.parquet")] if (folder / "results.parquet").is_file() else []
    parts += [pd.read_parquet(path) for path in sorted((folder / "rows").glob("*.parquet"))]
    if not parts:
        return pd.DataFrame({"key": [], "cut": [], "failure": []})
    rows = pd.concat(parts, ignore_index=True) if len(parts) > 1 else parts[0]
    return rows.drop_duplicates("key", keep="last", ignore_index=True)


def _compact(folder: Path) -> None:
    """Joins the rows that have arrived into one file; the small files go once it is in its place."""
    small = sorted((folder / "rows").glob("*.parquet"))
    if not small:
        return
    part = folder / "results.part"
    _read(folder).to_parquet(part, index=False)
    os.replace(part, folder / "results.parquet")
    for path in small:
        path.unlink()


def _time(seconds: float) -> str:
    return (
        f"{seconds:.0f} s"
        if seconds < 120
        else f"{seconds / 60:.0f} min"
        if seconds < 7200
        else f"{seconds / 3600:.1f} h"
    )
