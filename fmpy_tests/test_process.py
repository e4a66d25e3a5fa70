"""The process around the FMU: libraries loaded and unloaded, odd folders, a foreign locale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from conftest import DRAFT

LOADING = """
import _ctypes, ctypes, sys, threading, time

guid, library, rounds, spacing = sys.argv[1], sys.argv[2], int(sys.argv[3]), ctypes.c_uint32(int(sys.argv[4]))
Callbacks = ctypes.c_void_p * 5  # no logger: a documented leniency


def status(name):
    with open("/proc/self/status") as file:
        return int(next(line for line in file if line.startswith(name)).split()[1])


def life(fmu):
    fmu.fmi2Instantiate.restype = ctypes.c_void_p
    one = fmu.fmi2Instantiate(b"one", 1, guid.encode(), None, ctypes.byref(Callbacks()), 0, 0)
    one, count = ctypes.c_void_p(one), ctypes.c_size_t(1)
    assert fmu.fmi2SetReal(one, ctypes.byref(spacing), count, ctypes.byref(ctypes.c_double(1.5e-5))) == 0
    assert fmu.fmi2EnterInitializationMode(one) == 0
    assert fmu.fmi2ExitInitializationMode(one) == 0
    # Enough points for threads of the solver's own.
    assert fmu.fmi2DoStep(one, ctypes.c_double(0), ctypes.c_double(2e-9), 1) == 0
    fmu.fmi2FreeInstance(one)
    lives.append(one)


lives, memory = [], []
for count in range(rounds):
    fmu = ctypes.CDLL(library)
    if count % 2:
        # On a thread that ends: only then does the C library really unload, as Rust's thread-locals hold it.
        caller = threading.Thread(target=life, args=[fmu])
        caller.start(), caller.join()
    else:
        life(fmu)
    _ctypes.dlclose(fmu._handle)
    memory.append(status("VmRSS"))
time.sleep(0.5)  # the system buries threads that have ended
print(len(lives), status("Threads"), memory[rounds // 5], memory[-1])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_library_can_be_loaded_and_unloaded_a_hundred_times(description, unpacked):
    """Importers load and unload an FMU for each simulation: neither threads nor memory may stay behind."""
    library = str(Path(unpacked) / "binaries/linux64/swarf.so")
    spacing = next(v for v in description.modelVariables if v.name == "numerics.point_spacing").valueReference
    arguments = [description.guid, library, "100", str(spacing)]
    run = subprocess.run([sys.executable, "-c", LOADING, *arguments], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stdout + run.stderr
    lives, threads, early, late = map(int, run.stdout.split())
    assert (lives, threads) == (100, 1)
    # Each life takes some 5 MB, so that 80 leaked ones would be 400 MB; stacks of ended threads are kept for reuse.
    assert late < early + 8000, run.stdout


def test_a_folder_with_spaces_percent_signs_and_umlauts(description, fmu, tmp_path):
    """Users unpack FMUs anywhere."""
    folder = tmp_path / "my FMUs 100% Späne"
    fmpy.extract(fmu, str(folder))
    result = fmpy.simulate_fmu(str(folder), start_values=DRAFT, stop_time=2e-6, output=["cutting_force"])
    assert np.isfinite(result["cutting_force"]).all()


def test_a_read_only_folder_and_missing_resources(fmu, tmp_path):
    """An FMU on a read-only share, or unpacked without its resources, runs: all it needs is built in."""
    folder = tmp_path / "share"
    fmpy.extract(fmu, str(folder))
    shutil.rmtree(folder / "resources")
    for path in [folder, *folder.rglob("*")]:
        path.chmod(path.stat().st_mode & ~0o222)
    try:
        result = fmpy.simulate_fmu(str(folder), start_values=DRAFT, stop_time=2e-6, output=["cutting_force"])
    finally:
        for path in [folder, *folder.rglob("*")]:
            path.chmod(path.stat().st_mode | 0o200)
    assert np.isfinite(result["cutting_force"]).all()


LOCALE = """
import ctypes, locale, sys
import fmpy

if sys.argv[2]:
    locale.setlocale(locale.LC_ALL, sys.argv[2])
    # The C library itself writes decimal commas now.
    buffer = ctypes.create_string_buffer(20)
    ctypes.CDLL(None).snprintf(buffer, ctypes.c_size_t(20), b"%.1f", ctypes.c_double(1.5))
    assert buffer.value == b"1,5", buffer.value
values = {"numerics.point_spacing": 4e-5, "material.name": "AISI 1045", "results.directory": sys.argv[3]}
result = fmpy.simulate_fmu(sys.argv[1], start_values=values, stop_time=2e-6, output=["cutting_force", "peak_strain"])
print([value.hex() for row in result for value in row.tolist()])
"""


@pytest.mark.skipif(shutil.which("localedef") is None, reason="needs localedef to make a German locale")
def test_a_locale_with_decimal_commas_changes_nothing(fmu, tmp_path):
    """Half of Europe writes 1,5; neither the material library nor the results files may follow."""
    locales = tmp_path / "locales"
    locales.mkdir()
    made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", str(locales / "de_DE.UTF-8")], capture_output=True)
    if not (locales / "de_DE.UTF-8").is_dir():
        pytest.skip(f"no German locale: {made.stderr.decode()}")
    outputs, histories = [], []
    for name in ("", "de_DE.UTF-8"):
        results = tmp_path / f"results {name}"
        run = subprocess.run(
            [sys.executable, "-c", LOCALE, fmu, name, str(results)],
            capture_output=True,
            text=True,
            env={**os.environ, "LOCPATH": str(locales)},
        )
        assert run.returncode == 0, run.stderr
        outputs.append(run.stdout)
        lines = (results / "history.csv").read_text().splitlines()
        table = [line.split(",") for line in lines if not line.startswith("#")]
        histories.append(table)
    assert outputs[0] == outputs[1]
    assert histories[0] == histories[1]
