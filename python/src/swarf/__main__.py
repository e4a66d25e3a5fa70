"""Commands: `python -m swarf study study.toml`, `report`, `variables`."""

from __future__ import annotations

import argparse
import sys
import tomllib
from pathlib import Path

import swarf
from swarf._errors import SwarfError


def main(words: list[str] | None = None) -> int:
    """Runs a command; gives the exit code."""
    arguments = _parser().parse_args(words)
    try:
        return arguments.command(arguments)
    except SwarfError as error:
        print(f"swarf: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # as of `| head`
        sys.stderr.close()
        return 0
    except KeyboardInterrupt:
        print("swarf: interrupted; the same command goes on", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swarf", description="Orthogonal metal cutting: studies and reports"
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    study = commands.add_parser("study", help="run a study that a TOML file describes, or go on with it")
    study.add_argument("file", type=Path)
    study.add_argument("--folder", help="where it is kept; the file's name without its ending otherwise")
    study.add_argument("--scheduler", help="tcp://… of a Dask cluster, or serial")
    study.add_argument("--workers", type=int, help="on this machine; one for each core otherwise")
    study.add_argument("--price", action="store_true", help="tell what it will cost, and end")
    study.add_argument("--again", action="store_true", help="run cuts that failed once more")
    study.set_defaults(command=_study)
    report = commands.add_parser("report", help="write a page of a study that was run")
    report.add_argument("folder", type=Path)
    report.add_argument("page", type=Path)
    report.set_defaults(command=_report)
    variables = commands.add_parser("variables", help="list the variables of the FMU")
    variables.set_defaults(command=_variables)
    return parser


def read_study(path: Path) -> tuple[swarf.Cut, dict]:
    """The cut and the keywords of `swarf.study` that a TOML file describes.

    Parameters
    ----------
    path
        A file with the tables ``cut`` (keywords of `swarf.Cut`), ``vary`` (lists of levels, or ``{from, to,
        unit}``) and, if wanted, ``study`` (further keywords of `swarf.study`).
    """
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise SwarfError(f"cannot read '{path}': {error}") from error
    unknown = set(told) - {"cut", "vary", "study"}
    if unknown:
        raise SwarfError(f"'{path}': [{', '.join(sorted(unknown))}] is none of cut, vary, study")
    try:
        cut = swarf.Cut(**told.get("cut", {}))
    except TypeError as error:
        raise SwarfError(f"'{path}', [cut]: {error}") from error
    allowed = {"n", "design", "travel", "max_travel", "tolerance", "seed", "folder", "scheduler", "workers"}
    further = told.get("study", {})
    if set(further) - allowed:
        raise SwarfError(
            f"'{path}', [study]: {', '.join(sorted(set(further) - allowed))} is none of "
            f"{', '.join(sorted(allowed))}"
        )
    return cut, {**further, **told.get("vary", {})}


def _study(arguments: argparse.Namespace) -> int:
    cut, keywords = read_study(arguments.file)
    keywords.setdefault("folder", str(arguments.file.with_suffix("")))
    for name in ("folder", "scheduler", "workers"):
        if getattr(arguments, name) is not None:
            keywords[name] = getattr(arguments, name)
    if arguments.price:
        made = swarf.study(cut, run=False, **keywords)
        print(f"{len(made.missing())} of {len(made)} cuts to run: about {made.estimate():.0f} s of CPU time")
        return 0
    made = swarf.study(cut, again=arguments.again, **keywords)
    print(made)
    return 0


def _report(arguments: argparse.Namespace) -> int:
    print(swarf.open_study(arguments.folder).report(arguments.page))
    return 0


def _variables(_arguments: argparse.Namespace) -> int:
    print(swarf.variables().to_string(max_colwidth=70))
    return 0


if __name__ == "__main__":
    sys.exit(main())
