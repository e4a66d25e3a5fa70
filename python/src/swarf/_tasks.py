"""What a worker does: one cut of a study, from plain values to one flat row."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from swarf.cut import Cut


def run_task(task: Mapping[str, Any], fmu: str | None = None) -> dict[str, Any]:
    """Runs one cut.

    Parameters
    ----------
    task
        ``cut``: keywords of `Cut`; ``run``: keywords of `Cut.run`; ``also``: functions of the result by name;
        ``digest``: of the FMU's file.
    fmu
        Path of the FMU; on a worker the file that was shipped.

    Returns
    -------
    dict
        The row of `Result.row`, with the values of the functions.
    """
    path = fmu or str(shipped_path(task["digest"]))
    result = Cut(**task["cut"], fmu=path).run(progress=False, **task["run"])
    row = result.row()
    also: Mapping[str, Callable[[Any], Any]] = task["also"]
    for name, function in also.items():
        try:
            row[name] = function(result)
        except Exception as error:
            row[name] = float("nan")
            row["failure"] = row["failure"] or f"{name}: {error}"
    return row


def run_on_worker(task: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Runs one cut on a Dask worker, and leaves its row with the scheduler before it ends.

    A row that only its worker holds dies with the worker, and Dask would run the cut again; so the row is
    looked for first.

    Parameters
    ----------
    task
        As for `run_task`.
    name
        Of the cut on the cluster.
    """
    from distributed import get_client

    client = get_client()
    kept = client.get_metadata(["swarf", name], default=None)
    if kept is not None:
        return kept
    row = {
        column: value.item() if hasattr(value, "item") else value for column, value in run_task(task).items()
    }
    client.set_metadata(["swarf", name], row)
    return row


def shipped_path(digest: str) -> Path:
    """Where a worker keeps the FMU that was shipped to it."""
    from distributed import get_worker

    return Path(get_worker().local_directory) / f"swarf-{digest[:16]}.fmu"


def make_plugin(data: bytes, digest: str) -> Any:
    """A worker plugin that writes the FMU beside the worker's other files, on new workers too."""
    from distributed.diagnostics.plugin import WorkerPlugin

    class ShipFmu(WorkerPlugin):
        name = f"swarf-fmu-{digest[:16]}"

        def setup(self, worker: Any) -> None:
            path = Path(worker.local_directory) / f"swarf-{digest[:16]}.fmu"
            if not path.is_file():
                handle, part = tempfile.mkstemp(dir=worker.local_directory)
                with os.fdopen(handle, "wb") as file:
                    file.write(data)
                os.replace(part, path)

    return ShipFmu()
