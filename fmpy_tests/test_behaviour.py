"""What an importer can rely on: steps, inputs, saved states, instances, refusals. (How to use it: `test_examples.py`.)"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import CALLBACKS, DRAFT, MESSAGES, STEP, Refused
from fmpy.fmi2 import FMU2Slave


def test_a_run_after_reset_is_bit_identical(cut):
    """Nothing of the first life may be left."""
    one = cut({"friction": 0.1}).begin()
    first = one.run(8e-6)
    one.call(one.slave.reset)
    one.set_values({**DRAFT, "friction": 0.1}).begin()
    assert np.array_equal(one.run(8e-6), first)


def test_one_text_sets_what_single_variables_set(cut):
    """A master that reaches Strings alone has the same run; what is set by itself wins, and the log tells."""
    text = "effects.heat=conduction; material.name=AISI_1045; feed=2e-4; tool_velocity=1; numerics.speed=1"
    one = cut({"settings": text, "tool_velocity": 60.0}).begin()
    other = cut({"effects.heat": 3, "material.name": "AISI 1045", "feed": 2e-4, "tool_velocity": 60.0}).begin()
    assert any("settings taken over: effects.heat = conduction" in line for line in one.messages)
    assert any("tool_velocity stays 60 as set by itself" in line for line in one.messages)
    assert np.array_equal(one.run(4e-6), other.run(4e-6))


def test_a_wrong_setting_names_itself_and_what_is_allowed(cut):
    """A slip in a long text has to be found."""
    with pytest.raises(Refused, match=r"settings: numerics.accuracy=finest: .*fine \(3\)"):
        cut({"settings": "friction=0; numerics.accuracy=finest"}).begin()


def test_every_output_is_the_same_in_every_run(cut):
    """Regressions compare all outputs, those of the cost included."""
    one, other = [cut().begin() for _ in range(2)]
    assert "numerics.estimated_cpu_time" in one.outputs and one.get("numerics.estimated_cpu_time") > 0
    assert one.step_to(2e-6).state() == other.step_to(2e-6).state()


def test_waiting_is_one_stride_however_it_is_cut(cut):
    """A tool at rest for 0.2 ms before it cuts: the same bits from one step and from many."""
    runs = []
    for steps in (1, 20):
        one = cut({"tool_velocity": 0.0}).begin(stop=1e-3)
        for k in range(1, steps + 1):
            one.step_to(2e-4 * (k / steps))
        one.set_values({"tool_velocity": 50.0})
        runs.append(one.step_to(2.04e-4))
    assert runs[0].get("cutting_force") > 100
    assert runs[0].state() == runs[1].state()


@pytest.mark.parametrize("step", [1e-7, 7.3e-6, 2.5e-9])
def test_the_result_does_not_depend_on_communication_steps(cut, step):
    """The solver keeps its own clock: steps shorter than a substep and steps of thousands give the same bits."""
    stop = 7.3e-6 if step > 1e-8 else 2e-7
    plain, other = cut().begin(), cut().begin()
    plain.step_to(stop)
    other.run(stop, step)
    assert other.state() == plain.state()


def test_irregular_steps_give_the_impulse_of_regular_ones(cut):
    """Means over communication steps, weighted by their length, add up to the same impulse."""
    rng = np.random.default_rng(7)
    times = np.append(np.sort(rng.uniform(0, 8e-6, 25)), 8e-6)
    one, other = cut().begin(), cut().begin()
    impulse = 0.0
    for time in times:
        length = time - one.time
        impulse += one.step_to(time).get("cutting_force") * length
    whole = other.step_to(8e-6).get("cutting_force") * 8e-6
    # 26 sums of products, each rounded.
    assert impulse == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("threads", [1, 2])
def test_threads_do_not_change_the_bits(cut, threads):
    """Sums have an order of their own, not that of the threads."""
    assert cut({"numerics.threads": threads}).begin().step_to(5e-6).state() == cut().begin().step_to(5e-6).state()


def test_a_restored_state_continues_bit_identically(cut):
    """Saved mid-cut, run on, restored: the same run again."""
    one = cut().begin()
    one.run(6e-6)
    state = one.call(one.slave.getFMUstate)
    saved_at = one.time
    first = one.run(1e-5)
    one.call(one.slave.setFMUstate, state)
    one.time = saved_at
    assert np.array_equal(one.run(1e-5), first)
    one.call(one.slave.freeFMUstate, state)


def test_a_serialised_state_continues_in_a_new_process(cut, fmu, tmp_path):
    """A long study is stopped and goes on tomorrow: only the bytes cross over."""
    one = cut().begin()
    one.run(5e-6)
    state = one.call(one.slave.getFMUstate)
    (tmp_path / "state.bin").write_bytes(bytes(one.call(one.slave.serializeFMUstate, state)))
    saved_at = one.time
    expected = one.run(8e-6)
    program = f"""
import sys, numpy as np, fmpy
sys.path.insert(0, {str(Path(__file__).parent)!r})
from conftest import Cut
description = fmpy.read_model_description({fmu!r}, validate=False)
one = Cut(description, fmpy.extract({fmu!r})).begin()
state = one.slave.deSerializeFMUstate(open({str(tmp_path / "state.bin")!r}, "rb").read())
one.slave.setFMUstate(state)
one.time = {saved_at!r}
np.save({str(tmp_path / "table.npy")!r}, one.run(8e-6))
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)
    assert np.array_equal(np.load(tmp_path / "table.npy"), expected)


def test_a_damaged_state_is_refused_and_the_instance_goes_on(cut):
    """One flipped bit must not become a wrong result."""
    one, plain = cut().begin(), cut().begin()
    one.run(3e-6)
    state = one.call(one.slave.getFMUstate)
    data = bytearray(one.call(one.slave.serializeFMUstate, state))
    for place in (0, len(data) // 2, len(data) - 1):
        damaged = bytearray(data)
        damaged[place] ^= 1
        with pytest.raises(Refused):
            one.call(one.slave.deSerializeFMUstate, bytes(damaged))
    with pytest.raises(Refused):
        one.call(one.slave.deSerializeFMUstate, bytes(data[: len(data) // 2]))
    plain.run(3e-6)
    assert np.array_equal(one.run(6e-6), plain.run(6e-6))


def test_two_instances_do_not_touch_each_other(cut):
    """Different cuts, stepped in turns, each as if alone."""
    alone = [cut({"feed": feed}).begin().run(6e-6) for feed in (3e-4, 2e-4)]
    pair = [cut({"feed": feed}, name=f"cut{feed}").begin() for feed in (3e-4, 2e-4)]
    rows = [[], []]
    for k in range(1, 7):
        for one, table in zip(pair, rows):
            table.append(one.step_to(k * STEP).all_outputs())
    for table, expected in zip(rows, alone):
        assert np.array_equal(np.array(table), expected[:, 1:])


def test_velocity_changes_on_the_way(cut):
    """The tool goes as fast as it is told, from the communication point on."""
    one = cut().begin()
    one.run(5e-6)
    before = one.get("tool_position_x")
    one.set_values({"tool_velocity": 100.0})
    one.run(1e-5)
    # The solver runs ahead by less than one substep (under 20 ns at this size).
    assert before - one.get("tool_position_x") == pytest.approx(100.0 * 5e-6, abs=100.0 * 2e-8)


def test_feed_moves_the_tool_at_a_limited_rate(cut):
    """A step of the input is no step of the tool: 10 m/s by default, carried across communication steps."""
    one = cut().begin()
    one.run(5e-6)
    height = one.get("tool_position_y")
    assert height == pytest.approx(1e-3 - 3e-4, abs=1e-12)
    one.set_values({"feed": 2.5e-4})
    one.run(7e-6)
    assert one.get("tool_position_y") - height == pytest.approx(2e-5, abs=10 * 2e-8)
    one.run(2e-5)
    assert one.get("tool_position_y") == pytest.approx(1e-3 - 2.5e-4, abs=1e-12)


def test_a_feed_slope_is_followed_exactly(cut):
    """With an input derivative the tool follows the ramp between communication points."""
    one = cut().begin()
    one.run(5e-6)
    slope = -4.0  # m/s, below the limit
    reference = [one.variables["feed"].valueReference]
    for _ in range(5):
        one.call(one.slave.setReal, reference, [3e-4 + slope * (one.time - 5e-6)])
        one.call(one.slave.setRealInputDerivatives, reference, [1], [slope])
        one.step_to(one.time + 1e-6)
    assert one.get("tool_position_y") == pytest.approx(1e-3 - 3e-4 + 4.0 * 5e-6, abs=4.0 * 2e-8)


@pytest.mark.parametrize(
    "name, value, words",
    [
        ("tool_velocity", 900.0, ["tool_velocity", "900", "500"]),
        ("tool_velocity", float("nan"), ["tool_velocity", "finite"]),
        ("friction", -0.1, ["friction", "-0.1"]),
        ("numerics.point_spacing", -1e-5, ["numerics.point_spacing"]),
        ("numerics.courant", 5.0, ["numerics.courant"]),
        ("material.poissons_ratio", 0.7, ["material.poissons_ratio"]),
        ("scene", 9, ["scene", "9"]),
    ],
)
def test_wrong_values_are_refused_with_a_message(cut, name, value, words):
    """The message names the variable, what was asked and what is allowed."""
    one = cut()
    with pytest.raises(Refused) as refusal:
        one.set_values({name: value})
    for word in words:
        assert word in str(refusal.value), str(refusal.value)


def test_values_that_do_not_go_together_are_refused(cut):
    """A feed as deep as the workpiece leaves nothing to hold it."""
    one = cut({"feed": 9.9e-4})
    with pytest.raises(Refused) as refusal:
        one.begin()
    assert "feed" in str(refusal.value)


def test_a_constant_beside_a_library_material_is_refused(cut):
    """Otherwise the run would silently use the library's value."""
    one = cut({"material.yield_stress": 500e6})
    with pytest.raises(Refused) as refusal:
        one.begin()
    assert "material.yield_stress" in str(refusal.value)


@pytest.mark.parametrize("length", [0.0, -1e-6, float("nan")])
def test_a_step_that_goes_nowhere_is_refused_and_changes_nothing(cut, length):
    """A refused call leaves the instance as it was."""
    one, plain = cut().begin(), cut().begin()
    one.run(2e-6)
    with pytest.raises(Refused):
        one.call(one.slave.doStep, one.time, length)
    plain.run(2e-6)
    assert np.array_equal(one.run(4e-6), plain.run(4e-6))


def test_calls_out_of_order_are_refused_with_a_message(cut):
    """The message says what was called and when it is allowed."""
    one = cut()
    with pytest.raises(Refused) as refusal:
        one.call(one.slave.doStep, 0.0, 1e-6)
    assert "fmi2DoStep" in str(refusal.value)
    one.begin()
    with pytest.raises(Refused):
        one.call(one.slave.exitInitializationMode)
    one.run(1e-6)


def test_an_unknown_reference_is_refused(cut):
    """No value is made up for a variable that is not there."""
    one = cut().begin()
    with pytest.raises(Refused) as refusal:
        one.call(one.slave.getReal, [4_000_000_000])
    assert "4000000000" in str(refusal.value)


def test_a_wrong_guid_gives_no_instance(description, unpacked):
    """An instance of another model's description would mix up references."""
    slave = FMU2Slave(
        guid="{no such model}", unzipDirectory=unpacked, modelIdentifier="swarf", instanceName="wrong GUID"
    )
    with pytest.raises(Exception, match="instantiate"):
        slave.instantiate(callbacks=CALLBACKS)
    assert "no such model" in "".join(MESSAGES["wrong GUID"])


def test_results_are_written_where_asked_and_foreign_files_kept(cut, tmp_path):
    """Files for ParaView name the run; a run in use and a user's own file stop another run instead of being lost."""
    values = {"results.directory": str(tmp_path / "fields"), "results.interval": 1e-6}
    first = cut(values).begin()
    first.run(3e-6)
    with pytest.raises(Refused, match="another run"):
        cut(values).begin()
    first.call(first.slave.terminate)
    names = sorted(path.name for path in (tmp_path / "fields").iterdir())
    assert {"frame_00000.vtu", "frame_00002.vtu", "tool_00002.vtp", "frames.pvd", "history.csv"} <= set(names)
    assert b"friction = 0.2" in (tmp_path / "fields/frame_00000.vtu").read_bytes()
    (tmp_path / "fields/history.csv").write_text("my own")
    with pytest.raises(Refused) as refusal:
        cut(values).begin()
    assert "history.csv" in str(refusal.value)
    assert (tmp_path / "fields/history.csv").read_text() == "my own"
