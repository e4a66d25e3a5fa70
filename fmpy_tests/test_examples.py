"""How to use the FMU, from one line to a study: each test is a small program in plain FMPy. Start reading here.

They run a coarse cut of about 1,900 points (`DRAFT`), so that each takes a second or two; without it they would run the
reference cut of 30,000 points. What the numbers must satisfy stands behind each program.
"""

import re
from pathlib import Path

import fmpy
import numpy as np
import pytest
from conftest import CALLBACKS, DRAFT, MESSAGES
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2Discard, fmi2LastSuccessfulTime


@pytest.fixture
def slave(description, unpacked, request):
    """An instance ready for its first step, as a master makes one; `reference` finds variables by name."""
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=unpacked,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName=request.node.name,
    )
    slave.instantiate(callbacks=CALLBACKS)
    slave.reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    slave.setReal([slave.reference[name] for name in DRAFT], DRAFT.values())
    yield slave
    slave.freeInstance()


def initialize(slave):
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()


def test_one_call_runs_a_cut(fmu):
    """The one call most users make: start values by name, a table of outputs back."""
    names = ["cutting_force", "thrust_force", "chip_temperature", "peak_strain", "energy.balance_error"]
    result = fmpy.simulate_fmu(fmu, start_values=DRAFT, output=names)

    assert result["time"][-1] == pytest.approx(4e-5, rel=1e-9)
    for name in names:
        assert np.all(np.isfinite(result[name])), name
    steady = result["time"] > 2e-5
    # Within a factor of two of the single shear plane's 527 N/mm: draft size, 1 mm wide.
    assert 260 < result["cutting_force"][steady].mean() < 1060
    assert result["peak_strain"][-1] > 0.5
    assert result["chip_temperature"][-1] > 400


def test_the_program_of_the_readme_runs(fmu, capsys):
    """What README.md shows is a program; here it runs, with the FMU under test in place of its path."""
    readme = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"```python\n(.*?)```", readme, flags=re.DOTALL)
    assert '"target/swarf.fmu"' in program
    scope = {}
    exec(program.replace('"target/swarf.fmu"', repr(str(fmu))), scope)

    force = scope["result"]["cutting_force"][-1]
    assert np.isfinite(force) and force > 0
    assert capsys.readouterr().out.startswith(str(force))


def test_another_material_tool_and_effects(fmu):
    """Texts, angles in rad, Booleans, enumerations by number: all start values are set the same way."""
    values = {
        **DRAFT,
        "material.name": "Al 2024-T351",
        "tool.rake_angle": np.radians(10),
        "effects.heat": 1,  # none, by its number in the type definition `Heat`
        "effects.thermal_softening": False,
    }
    result = fmpy.simulate_fmu(fmu, start_values=values, output=["cutting_force", "chip_temperature"], stop_time=1e-5)

    steel = fmpy.simulate_fmu(fmu, start_values=DRAFT, output=["cutting_force"], stop_time=1e-5)
    assert 0 < result["cutting_force"][-1] < 0.8 * steel["cutting_force"][-1]
    # A mean of equal temperatures, rounded.
    assert result["chip_temperature"] == pytest.approx(298.15, rel=1e-12)


def test_inputs_over_time(fmu):
    """Cutting speed and feed as a table over time; FMPy interpolates it and holds the values over each step."""
    ramps = np.array(
        [(0.0, 50.0, 3e-4), (1e-5, 50.0, 3e-4), (2e-5, 100.0, 2.8e-4), (3e-5, 100.0, 2.8e-4)],
        dtype=[("time", float), ("tool_velocity", float), ("feed", float)],
    )
    result = fmpy.simulate_fmu(
        fmu,
        start_values=DRAFT,
        input=ramps,
        output=["tool_position_x", "tool_position_y", "cutting_force"],
        stop_time=3e-5,
        output_interval=1e-6,
    )

    # 10 µs at 50 m/s, a microsecond each at 50, 55, ... 95 m/s, 10 µs at 100 m/s.
    travel = result["tool_position_x"][0] - result["tool_position_x"][-1]
    expected = 10 * 50e-6 + sum(range(50, 100, 5)) * 1e-6 + 10 * 100e-6
    # An input counts from the first substep after it, and the solver is ahead by less than one: 20 ns at this size.
    assert travel == pytest.approx(expected, abs=100 * 2e-8)
    assert result["tool_position_y"][-1] == pytest.approx(1e-3 - 2.8e-4, abs=1e-9)


def test_a_controller_steps_the_cut(slave):
    """A master's own loop: while the force is above what the spindle bears, the feed is taken back."""
    force, feed, bearable = slave.reference["cutting_force"], slave.reference["feed"], 400.0
    initialize(slave)
    depth, step, forces = 3e-4, 1e-6, []
    for k in range(40):
        slave.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
        forces.append(slave.getReal([force])[0])
        if forces[-1] > bearable:
            depth *= 0.97
            slave.setReal([feed], [depth])

    # With the feed left at 0.3 mm this coarse cut ends above 600 N.
    assert np.mean(forces[-5:]) < 1.1 * bearable, forces
    assert 1e-4 < depth < 2.5e-4


def test_branches_from_a_saved_state(slave):
    """What if? One run-in, three feeds from there on, without computing the run-in again."""
    feed, energy = slave.reference["feed"], slave.reference["energy.tool_work"]
    initialize(slave)
    slave.doStep(0.0, 1e-5)
    fork = slave.getFMUstate()
    work = {}
    for depth in (2.9e-4, 3.0e-4, 3.1e-4, 3.0e-4):
        slave.setFMUstate(fork)
        slave.setReal([feed], [depth])
        slave.doStep(1e-5, 5e-6)
        work.setdefault(depth, []).append(slave.getReal([energy])[0])
    slave.freeFMUstate(fork)

    assert work[2.9e-4][0] < work[3.0e-4][0] < work[3.1e-4][0]
    assert work[3.0e-4][0] == work[3.0e-4][1], "the same branch twice is the same to the bit"


def test_a_step_with_a_deadline(slave):
    """A master with other things to do limits the wall time of a step; a discarded step can be gone on with."""
    slave.setReal([slave.reference["numerics.wall_time_limit"]], [0.02])
    initialize(slave)
    time, end, discarded = 0.0, 1e-5, 0
    while time < end:
        try:
            slave.doStep(time, end - time)
            time = end
        except FMICallException as refusal:
            assert refusal.status == fmi2Discard
            discarded += 1
            time = slave.getRealStatus(fmi2LastSuccessfulTime)

    assert discarded > 0
    assert "by numerics.wall_time_limit; call it again from" in "".join(MESSAGES[slave.instanceName])


def test_messages_of_the_solver(slave):
    """Which effects run, what each step took, and news from long steps: the log category `solver`."""
    slave.setDebugLogging(loggingOn=True, categories=["solver"])
    initialize(slave)
    slave.doStep(0.0, 1e-6)

    first, *_, second = MESSAGES[slave.instanceName]
    assert "solver: effects: plasticity (AISI 4340)" in first
    substeps = slave.getInteger([slave.reference["numerics.substeps"]])[0]
    assert f"{substeps} substeps" in second


def test_results_for_paraview(fmu, tmp_path):
    """Fields of all points every microsecond, and a table of the outputs: open `frames.pvd` in ParaView."""
    values = {**DRAFT, "results.directory": str(tmp_path / "fields"), "results.interval": 1e-6}
    fmpy.simulate_fmu(fmu, start_values=values, stop_time=3e-6)

    names = {path.name for path in (tmp_path / "fields").iterdir()}
    assert {"frame_00000.vtu", "frame_00003.vtu", "tool_00003.vtp", "frames.pvd", "history.csv"} <= names
    assert b"friction = 0.2" in (tmp_path / "fields/frame_00000.vtu").read_bytes()
