"""Importers and checkers other than FMPy's own Python: what each of them says to the packaged FMU.

Each test is also the shortest example of how to use the FMU there.
"""

import shutil
import subprocess
import sys

import fmpy
import numpy as np
import pytest
from conftest import STEP


def test_fmpy_validate_on_the_command_line(fmu):
    """What a user types first."""
    run = subprocess.run([sys.executable, "-m", "fmpy", "validate", fmu], capture_output=True, text=True)
    assert (run.returncode, run.stdout.strip()) == (0, "No problems found."), run.stdout + run.stderr


def test_fmu_manipulation_toolbox_finds_no_fault(fmu):
    """Its own copy of the XSD, and rules on causality, variability, start values and the model structure."""
    pytest.importorskip("fmu_manipulation_toolbox", reason="needs Python 3.10")
    program = "from fmu_manipulation_toolbox.cli.fmutool import fmutool; fmutool()"
    run = subprocess.run([sys.executable, "-c", program, "-input", fmu, "-check"], capture_output=True, text=True)
    text = run.stdout + run.stderr
    assert run.returncode == 0, text
    assert "seems to be compliant with FMI-2.0" in text, text
    assert "No semantic error" in text, text


COSIM = """
import sys
from libcosimpy import CosimLogging
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

fmu, steps = sys.argv[1], int(sys.argv[2])
CosimLogging.log_output_level(CosimLogging.CosimLogLevel.ERROR)
execution = CosimExecution.from_step_size(1_000)  # in nanoseconds: steps of 1 us
first, second = [execution.add_local_slave(CosimLocalSlave(fmu, name)) for name in ("first", "second")]
reference = {v.name.decode(): v.reference for v in execution.slave_variables(first)}
for slave in (first, second):
    assert execution.real_initial_value(slave, reference["numerics.point_spacing"], 4e-5)
assert execution.connect_real_variables(first, reference["chip_thickness"], second, reference["feed"]) == 0
observer = CosimObserver.create_last_value()
assert execution.add_observer(observer)
assert execution.simulate_until(1_000 * steps)
names = ["cutting_force", "feed", "tool_position_y", "energy.plastic"]
for slave in (first, second):
    print(*[value.hex() for value in observer.last_real_values(slave, [reference[name] for name in names])])
"""


def test_two_connected_slaves_under_libcosim(cut, fmu):
    """The second tool is fed as deep as the first one's chip is thick: bit by bit what the same loop in Python gives.

    (libcosim passes over enumerations with a warning; the cut needs none of them.)
    """
    pytest.importorskip("libcosimpy", reason="needs Python 3.11 on Linux")
    steps = 12
    run = subprocess.run([sys.executable, "-c", COSIM, fmu, str(steps)], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stdout + run.stderr
    found = [[float.fromhex(word) for word in line.split()] for line in run.stdout.splitlines()[-2:]]

    first, second = cut(), cut({"feed": 0.0})
    first.begin(), second.begin()
    for k in range(1, steps + 1):
        second.set_values({"feed": first.get("chip_thickness")})
        first.step_to(k * STEP), second.step_to(k * STEP)
    names = ["cutting_force", "feed", "tool_position_y", "energy.plastic"]
    expected = [[one.get(name) for name in names] for one in (first, second)]
    # libcosim counts in nanoseconds and divides: its times differ from k * 1e-6 by a rounding.
    assert found == [pytest.approx(row, rel=1e-9) for row in expected]
    assert found[1][1] > 0


CONTAINER = """
import sys
from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer

sys.argv = ["fmucontainer", *sys.argv[1:]]
fmucontainer()
"""


def test_two_instances_in_a_container(fmu, tmp_path):
    """fmucontainer makes one FMU of several: here twice this one, coupled as above, run by FMPy."""
    pytest.importorskip("fmu_manipulation_toolbox", reason="needs Python 3.10")
    for name in ("first", "second"):
        shutil.copy(fmu, tmp_path / f"{name}.fmu")
    rows = [
        "rule;from_fmu;from_port;to_fmu;to_port",
        "FMU;first.fmu;;;",
        "FMU;second.fmu;;;",
        "LINK;first.fmu;chip_thickness;second.fmu;feed",
        "OUTPUT;first.fmu;cutting_force;;first_force",
        "OUTPUT;second.fmu;cutting_force;;second_force",
        *(f"START;{name}.fmu;numerics.point_spacing;4e-5;" for name in ("first", "second")),
    ]
    (tmp_path / "pair.csv").write_text("\n".join(rows) + "\n")
    arguments = ["-fmu-directory", str(tmp_path), "-container", "pair.csv:1e-6"]
    run = subprocess.run([sys.executable, "-c", CONTAINER, *arguments], capture_output=True, text=True)
    container = tmp_path / "pair.fmu"
    assert container.is_file(), run.stdout + run.stderr
    result = fmpy.simulate_fmu(
        str(container), stop_time=1e-5, output_interval=1e-6, output=["first_force", "second_force"]
    )
    assert np.isfinite(result["first_force"]).all() and result["first_force"][-1] > 100
    assert np.isfinite(result["second_force"]).all()
