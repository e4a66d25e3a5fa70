"""The FMU: where it lies, what it describes, and one instance of it with variables by name.

Names, units, choices and start values all come from the model description; nothing of it is repeated here.
"""

from __future__ import annotations

import atexit
import ctypes
import difflib
import hashlib
import itertools
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import fmpy
import pandas as pd
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)
from fmpy.logging import addLoggerProxy

from swarf._errors import SwarfError
from swarf._units import to_unit

_NUMBERS = itertools.count(1)
_MESSAGES: dict[str, list[tuple[int, str, str]]] = {}  # of each living instance: status, category, text


def find_fmu(fmu: str | os.PathLike[str] | None = None) -> Path:
    """Path of the FMU that the package runs.

    Parameters
    ----------
    fmu
        A path; without one the environment variable ``SWARF_FMU``, then the FMU inside the package, then, in
        a clone of the repository, ``target/swarf.fmu``.

    Returns
    -------
    Path
        A file that exists.
    """
    here = Path(__file__).resolve().parent
    named = fmu or os.environ.get("SWARF_FMU")
    places = [Path(named)] if named else [here / "swarf.fmu", here.parents[2] / "target" / "swarf.fmu"]
    for place in places:
        if place.is_file():
            return place.resolve()
    looked = " and ".join(f"'{place}'" for place in places)
    raise SwarfError(f"no swarf.fmu: looked for {looked}; name one in the environment variable SWARF_FMU")


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU.

    Attributes
    ----------
    name, unit, causality, description
        As in the model description; the unit is empty where there is none.
    kind
        ``Real``, ``Integer``, ``Boolean``, ``String`` or ``Enumeration``.
    reference
        Value reference.
    start
        Start value, or None.
    items
        Numbers of an enumeration's items by name.
    display
        Unit by which people know it, with the factor and offset from SI.
    """

    name: str
    kind: str
    unit: str
    causality: str
    reference: int
    start: Any
    description: str
    items: Mapping[str, int]
    display: tuple[str, float, float] = ("", 1.0, 0.0)

    def read(self, value: Any) -> float | int | bool | str:
        """A value as the FMU takes it: units converted, choices by their number."""
        if self.kind == "Real":
            return to_unit(value, self.unit, self.name)
        if self.kind == "Boolean":
            if isinstance(value, str) and value in ("true", "false"):
                return value == "true"
            if value in (True, False):
                return bool(value)
            raise SwarfError(f"{self.name} = {value!r} must be true or false")
        if self.kind == "Enumeration":
            if isinstance(value, str) and value in self.items:
                return self.items[value]
            if not isinstance(value, bool) and value in self.items.values():
                return int(value)
            raise SwarfError(f"{self.name} = {value!r} is none of {', '.join(self.items)}")
        if self.kind == "Integer":
            try:
                number = int(value)
            except (TypeError, ValueError) as error:
                raise SwarfError(f"{self.name} = {value!r} is no whole number") from error
            if isinstance(value, float) and number != value:
                raise SwarfError(f"{self.name} = {value!r} is no whole number")
            return number
        return str(value)


class Description:
    """What the FMU says of itself, unpacked into a temporary folder that is removed at exit."""

    def __init__(self, fmu: Path) -> None:
        self.path = fmu
        self._description = fmpy.read_model_description(str(fmu), validate=False)
        self.guid: str = self._description.guid
        self.version: str = self._description.generationTool or "swarf"
        self.identifier: str = self._description.coSimulation.modelIdentifier
        units = {u.name: u.displayUnits for u in self._description.unitDefinitions or []}
        self.variables = {v.name: _variable(v, units) for v in self._description.modelVariables}
        self.outputs = [v.name for v in self.variables.values() if v.causality == "output"]
        self.parameters = [v.name for v in self.variables.values() if v.causality in ("input", "parameter")]

    @cached_property
    def folder(self) -> str:
        """The folder with the unpacked FMU."""
        folder = tempfile.mkdtemp(prefix="swarf-fmu-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        fmpy.extract(str(self.path), unzipdir=folder)
        return folder

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file, in hexadecimal."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    def variable(self, name: str) -> Variable:
        """A variable by its name; an unknown name is answered with those that look alike."""
        if name in self.variables:
            return self.variables[name]
        alike = difflib.get_close_matches(name, self.variables, n=3, cutoff=0.5)
        hint = f"; do you mean {' or '.join(alike)}?" if alike else ""
        raise SwarfError(f"the FMU has no variable '{name}'{hint}")

    def read(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values by name as the FMU takes them; outputs are refused."""
        read = {}
        for name, value in values.items():
            variable = self.variable(name)
            if variable.causality not in ("input", "parameter"):
                raise SwarfError(f"{name} is an output; only inputs and parameters can be set")
            read[name] = variable.read(value)
        return read


@lru_cache(maxsize=8)
def _describe(path: str, _changed: int, _size: int) -> Description:
    return Description(Path(path))


def describe(fmu: str | os.PathLike[str] | None = None) -> Description:
    """The description of an FMU, read once for each file."""
    path = find_fmu(fmu)
    state = path.stat()
    return _describe(str(path), state.st_mtime_ns, state.st_size)


def variables(fmu: str | os.PathLike[str] | None = None) -> pd.DataFrame:
    """All variables of the FMU.

    Parameters
    ----------
    fmu
        A path, as for `find_fmu`.

    Returns
    -------
    pandas.DataFrame
        A row for each name: kind, unit, causality, start, choices, description.
    """
    rows = [
        (v.name, v.kind, v.unit, v.causality, v.start, ", ".join(v.items), v.description)
        for v in describe(fmu).variables.values()
    ]
    columns = ["name", "kind", "unit", "causality", "start", "choices", "description"]
    return pd.DataFrame(rows, columns=columns).set_index("name")


class Refused(SwarfError):
    """A call that the FMU refused; the text is what it logged."""


class Instance:
    """One instance of the FMU; a context manager that frees it.

    Parameters
    ----------
    description
        What to instantiate.
    values
        Values by name, set before initialization.
    """

    def __init__(self, description: Description, values: Mapping[str, Any]) -> None:
        self.description = description
        self.name = f"swarf {os.getpid()} {next(_NUMBERS)}"
        self.messages = _MESSAGES.setdefault(self.name, [])
        self.time = 0.0
        self._slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=description.folder,
            modelIdentifier=description.identifier,
            instanceName=self.name,
        )
        self._living = False
        try:
            self._slave.instantiate(loggingOn=True, callbacks=_callbacks())
            self._living = True
            self.set(values)
        except BaseException:
            self.free()
            raise

    def __enter__(self) -> Instance:
        return self

    def __exit__(self, *_: object) -> None:
        self.free()

    def free(self) -> None:
        """Frees the instance; its messages stay with whoever holds them."""
        if self._living:
            self._living = False
            self._slave.freeInstance()
        _MESSAGES.pop(self.name, None)

    def initialize(self, stop: float) -> None:
        """Builds the model, for a run from 0 to ``stop`` (s)."""
        self._call(self._slave.setupExperiment, None, 0.0, stop)
        self._call(self._slave.enterInitializationMode)
        self._call(self._slave.exitInitializationMode)

    def set(self, values: Mapping[str, Any]) -> None:
        """Sets variables by name."""
        for name, value in self.description.read(values).items():
            variable = self.description.variables[name]
            self._call(_setter(self._slave, variable.kind), [variable.reference], [value])

    def get(self, names: Iterable[str]) -> dict[str, Any]:
        """Values of variables by name, with one call for each kind."""
        wanted = [self.description.variable(name) for name in names]
        found: dict[str, Any] = {}
        for kind in ("Real", "Integer", "Boolean", "String"):
            of_kind = [
                v for v in wanted if (v.kind == kind or (kind == "Integer" and v.kind == "Enumeration"))
            ]
            if of_kind:
                values = self._call(_getter(self._slave, kind), [v.reference for v in of_kind])
                found.update(zip((v.name for v in of_kind), values))
        for variable in wanted:
            if variable.kind == "Boolean":
                found[variable.name] = bool(found[variable.name])
            elif variable.kind == "String" and isinstance(found[variable.name], bytes):
                found[variable.name] = found[variable.name].decode()
        return {v.name: found[v.name] for v in wanted}

    def step_to(self, time: float) -> None:
        """Advances to a time (s)."""
        self._call(self._slave.doStep, self.time, time - self.time)
        self.time = time

    @property
    def warnings(self) -> list[str]:
        """Texts of the warnings so far."""
        return [text for status, _, text in self.messages if status == 1]

    def _call(self, function: Any, *arguments: Any) -> Any:
        before = len(self.messages)
        try:
            return function(*arguments)
        except KeyboardInterrupt:
            raise
        except Exception as error:
            texts = [text for status, _, text in self.messages[before:] if status >= 2]
            raise Refused("; ".join(texts) or str(error)) from error


def _variable(raw: Any, units: Mapping[str, Any]) -> Variable:
    items = {}
    if raw.type == "Enumeration" and raw.declaredType is not None:
        items = {item.name: int(item.value) for item in raw.declaredType.items}
    start: Any = raw.start
    if start is not None:
        if raw.type == "Real":
            start = float(start)
        elif raw.type == "Boolean":
            start = start in ("true", "1", True)
        elif raw.type == "Integer":
            start = int(start)
        elif raw.type == "Enumeration":
            start = next((name for name, number in items.items() if number == int(start)), int(start))
    unit = raw.unit or (raw.declaredType.unit if raw.declaredType is not None else None) or ""
    display = (unit, 1.0, 0.0)
    for known in units.get(unit, []):
        if known.name == raw.displayUnit:
            display = (known.name, float(known.factor), float(known.offset))
    text = raw.description or ""
    return Variable(raw.name, raw.type, unit, raw.causality, raw.valueReference, start, text, items, display)


def _setter(slave: FMU2Slave, kind: str) -> Any:
    setters = {"Real": slave.setReal, "Boolean": slave.setBoolean, "String": slave.setString}
    return setters.get(kind, slave.setInteger)


def _getter(slave: FMU2Slave, kind: str) -> Any:
    getters = {"Real": slave.getReal, "Boolean": slave.getBoolean, "String": slave.getString}
    return getters.get(kind, slave.getInteger)


def _log(_environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
    texts = _MESSAGES.get((name or b"").decode(errors="replace"))
    if texts is not None:
        text = (message or b"").decode(errors="replace")
        texts.append((status, (category or b"").decode(errors="replace"), text))


@lru_cache(maxsize=1)
def _callbacks() -> Any:
    # One for all instances and for good: FMPy's proxy remembers a single logger in the whole process.
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(_log)
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    addLoggerProxy(ctypes.byref(callbacks))  # puts the message's arguments in, which ctypes cannot
    return callbacks
