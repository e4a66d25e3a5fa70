"""The wheel names its platforms by what the FMU holds."""

import importlib.util
import tomllib
import zipfile
from pathlib import Path

import pytest

import swarf

CLONE = Path(__file__).resolve().parents[2]


@pytest.fixture
def build():
    pytest.importorskip("hatchling")
    path = CLONE / "python" / "hatch_build.py"
    if not path.is_file():
        pytest.skip("not in a clone of the repository")
    spec = importlib.util.spec_from_file_location("hatch_build", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "names, tag",
    [
        (b"GLIBC_2.2.5\0GLIBC_2.17\0", "manylinux2014_x86_64"),
        (b"GLIBC_2.2.5\0GLIBC_2.34\0GLIBC_2.4\0", "manylinux_2_34_x86_64"),
        (b"", "manylinux2014_x86_64"),
    ],
)
def test_linux_s_tag_follows_from_the_library(build, names, tag):
    """pip must not install it where the C library is older than what it names."""
    assert build.linux_tag(b"\x7fELF" + names) == tag


def test_all_platforms_of_the_fmu_are_named(build, tmp_path):
    path = tmp_path / "some.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("binaries/linux64/swarf.so", b"GLIBC_2.17")
        archive.writestr("binaries/win64/swarf.dll", b"")
    assert build.platform_tags(path) == {"manylinux2014_x86_64", "win_amd64"}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", b"")
    with pytest.raises(ValueError, match="no library"):
        build.platform_tags(path)


def test_a_missing_fmu_is_told_with_its_command(build, tmp_path, monkeypatch):
    monkeypatch.delenv("SWARF_FMU", raising=False)
    with pytest.raises(FileNotFoundError, match="cargo xtask package"):
        build.find_fmu(tmp_path / "python")


def test_the_package_has_the_version_of_the_solver():
    """Both are released together."""
    cargo = CLONE / "Cargo.toml"
    if not cargo.is_file():
        pytest.skip("not in a clone of the repository")
    told = tomllib.loads(cargo.read_text())
    version = told["package"]["version"]
    if isinstance(version, dict):
        version = told["workspace"]["package"]["version"]
    assert swarf.__version__ == version
