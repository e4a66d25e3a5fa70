"""Whether two packaged FMUs compute the same bits: python fmpy_tests/compare_fmus.py OLD.fmu NEW.fmu

Runs scenes that between them use every transfer, contact law, dimension, precision, flow law and effect, and
compares the outputs that both have, at every communication point, and the fields of every frame. For changes
that must change nothing; a change of one bit shows.
"""

import hashlib
import json
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

COARSE = {"numerics.point_spacing": 2e-5}
# Name: parameters, communication steps, length of each (s).
SCENES = {
    "reference cut": ({}, 8, 1e-6),
    "three dimensions": (
        COARSE
        | {"numerics.dimension": 2, "workpiece.length": 6e-4, "workpiece.height": 4e-4, "workpiece.width": 1.6e-4}
        | {"feed": 1e-4},
        6,
        5e-7,
    ),
    "every effect": (
        COARSE
        | {"effects.heat": 3, "effects.tool_heat": True, "effects.thermal_expansion": True}
        | {"effects.sticking": True, "effects.artificial_viscosity": True, "tool.edge_radius": 3e-5}
        | {"numerics.active_window": 1.5, "numerics.active_chip": 3.0},
        8,
        1e-6,
    ),
    "titanium, tanh law, damage, fast": (
        COARSE
        | {"material.name": "Ti-6Al-4V", "material.law": 2, "effects.damage": True}
        | {"numerics.speed": 3, "numerics.courant": 0.5},
        8,
        1e-6,
    ),
    "APIC": (COARSE | {"numerics.transfer": 2}, 6, 1e-6),
    "the paper's contact": (COARSE | {"numerics.contact": 2}, 6, 1e-6),
    "linear shape functions": (COARSE | {"numerics.shape_function": 1}, 3, 1e-6),
}


def bits(fmu, title):
    """Hashes by name: of each output over the communication points, and of all frames."""
    description, folder = read_model_description(fmu), extract(fmu)
    variables = {v.name: v for v in description.modelVariables}
    outputs = [v for v in description.modelVariables if v.causality == "output"]
    parameters, steps, length = SCENES[title]
    slave = FMU2Slave(
        guid=description.guid, unzipDirectory=folder, modelIdentifier="swarf", instanceName="compared"
    )
    with tempfile.TemporaryDirectory() as frames:
        values = parameters | {"results.directory": frames, "results.interval": length * steps / 2}
        slave.instantiate()
        for name, value in values.items():
            variable = variables[name]
            kind = "Integer" if variable.type == "Enumeration" else variable.type
            getattr(slave, f"set{kind}")([variable.valueReference], [value])
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        found = {v.name: hashlib.sha256() for v in outputs}
        for k in range(steps):
            slave.doStep(k * length, length)
            for v in outputs:
                read = slave.getReal if v.type == "Real" else slave.getInteger
                found[v.name].update(struct.pack("<d", read([v.valueReference])[0]))
        found["frames"] = hashlib.sha256()
        for path in sorted(Path(frames).rglob("*.vtu")):
            for array in re.findall(rb"<DataArray[^>]*>(.*?)</DataArray>", path.read_bytes(), re.S):
                found["frames"].update(array)
        slave.terminate()
        slave.freeInstance()
    return {name: sums.hexdigest() for name, sums in found.items()}


def main(old, new):
    """Prints a line a scene; the number of scenes that differ is the exit status."""
    differ = 0
    for title in SCENES:
        # Each in a process of its own: a library is loaded once in a process.
        one, other = (
            json.loads(subprocess.check_output([sys.executable, __file__, "--bits", fmu, title], text=True))
            for fmu in (old, new)
        )
        changed = [name for name in one if name in other and one[name] != other[name]]
        differ += bool(changed)
        both = sum(name in other for name in one)
        print(f"{title:34} {'the same bits' if not changed else 'DIFFER: ' + ', '.join(changed)} ({both} compared)")
    return differ


if __name__ == "__main__":
    if sys.argv[1] == "--bits":
        print(json.dumps(bits(sys.argv[2], sys.argv[3])))
    else:
        sys.exit(main(sys.argv[1], sys.argv[2]))
