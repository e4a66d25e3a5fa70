"""What the tests share: the packaged FMU, instances of it, and short runs at draft size.

`test_examples.py` shows the FMU in plain FMPy; the other tests use `Cut` below, which adds names and messages to it.
"""

from __future__ import annotations

import ctypes
import itertools
import os
import shutil
from contextlib import ExitStack
from pathlib import Path

import fmpy
import numpy as np
import pytest
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

# Another one, for instance the portable build of a release, can be named in the environment.
FMU = Path(os.environ.get("SWARF_FMU") or Path(__file__).resolve().parents[1] / "target" / "swarf.fmu")
DRAFT = {"numerics.point_spacing": 4e-5}  # about 1,900 points: a whole cut in a second
STOP, STEP = 4e-5, 1e-6
NUMBERS = itertools.count(1)


@pytest.fixture(scope="session")
def fmu() -> str:
    """Path of the packaged FMU."""
    if not FMU.is_file():
        pytest.exit(f"'{FMU}' is missing: run `cargo xtask package` first", returncode=2)
    return str(FMU)


@pytest.fixture(scope="session")
def description(fmu):
    """The model description as FMPy reads it, without its own checks (those are a test)."""
    return fmpy.read_model_description(fmu, validate=False)


@pytest.fixture(scope="session")
def unpacked(fmu):
    """The FMU unpacked into a folder, removed at the end."""
    folder = fmpy.extract(fmu)
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


MESSAGES: dict[str, list[str]] = {}  # what each instance logged, by its name


def _log(_environment, name, status, category, message):
    name = (name or b"").decode()
    MESSAGES.setdefault(name, []).append(f"{status} {(category or b'').decode()}: {message.decode()}")


def _callbacks():
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(_log)
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    addLoggerProxy(ctypes.byref(callbacks))  # puts the message's arguments in, which ctypes cannot
    return callbacks


# One for all instances and for good: FMPy's proxy remembers a single logger in the whole process.
CALLBACKS = _callbacks()


class Refused(Exception):
    """A call that did not return fmi2OK; the text is what the FMU logged during it."""


class Cut:
    """One instance, its variables by name, and every message it logged."""

    def __init__(self, description, folder, name="cut"):
        self.name = f"{name} {next(NUMBERS)}"
        self.messages = MESSAGES.setdefault(self.name, [])
        self.variables = {v.name: v for v in description.modelVariables}
        self.outputs = [v.name for v in description.modelVariables if v.causality == "output"]
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=self.name,
        )
        self.slave.instantiate(loggingOn=True, callbacks=CALLBACKS)
        self.time = 0.0

    def call(self, function, *arguments):
        """Calls an FMI function of FMPy; a refusal raises with the messages logged meanwhile."""
        before = len(self.messages)
        try:
            return function(*arguments)
        except Exception as error:
            raise Refused("\n".join(self.messages[before:]) or f"(nothing logged) {error}") from error

    def set_values(self, values):
        for name, value in values.items():
            variable = self.variables[name]
            reference = [variable.valueReference]
            if variable.type == "Real":
                self.call(self.slave.setReal, reference, [value])
            elif variable.type == "Boolean":
                self.call(self.slave.setBoolean, reference, [value])
            elif variable.type == "String":
                self.call(self.slave.setString, reference, [value])
            else:
                if isinstance(value, str):
                    items = variable.declaredType.items
                    value = next(int(item.value) for item in items if item.name == value)
                self.call(self.slave.setInteger, reference, [value])
        return self

    def get(self, name):
        variable = self.variables[name]
        reference = [variable.valueReference]
        if variable.type == "Real":
            return self.call(self.slave.getReal, reference)[0]
        if variable.type == "Boolean":
            return self.call(self.slave.getBoolean, reference)[0]
        if variable.type == "String":
            return self.call(self.slave.getString, reference)[0]
        return self.call(self.slave.getInteger, reference)[0]

    def state(self):
        """All outputs but those over the last step only, which depend on its length."""
        return [self.get(name) for name in self.outputs if name not in STEP_MEANS]

    def all_outputs(self):
        return [self.get(name) for name in self.outputs]

    def begin(self, start=0.0, stop=STOP):
        self.call(self.slave.setupExperiment, None, start, stop)
        self.call(self.slave.enterInitializationMode)
        self.call(self.slave.exitInitializationMode)
        self.time = start
        return self

    def step_to(self, time):
        self.call(self.slave.doStep, self.time, time - self.time)
        self.time = time
        return self

    def run(self, stop, step=STEP):
        """Steps to `stop`; a table of time and all outputs after each step."""
        begin, rows = self.time, []
        for k in range(1, int(np.ceil((stop - begin) / step - 1e-9)) + 1):
            self.step_to(min(begin + k * step, stop))
            rows.append([self.time, *self.all_outputs()])
        return np.array(rows)

    def column(self, table, name):
        return table[:, 1 + self.outputs.index(name)]

    def free(self):
        self.slave.freeInstance()


# Means, extremes and counts over the last communication step.
STEP_MEANS = {
    "cutting_force",
    "thrust_force",
    "cutting_force_min",
    "cutting_force_max",
    "cutting_power",
    "specific_cutting_energy",
    "numerics.substeps",
}


@pytest.fixture
def cut(description, unpacked):
    """Makes instances at draft size, not yet initialized; all are freed at the end."""
    with ExitStack() as stack:

        def make(values=None, name="cut"):
            instance = Cut(description, unpacked, name)
            stack.callback(instance.free)
            return instance.set_values({**DRAFT, **(values or {})})

        yield make
