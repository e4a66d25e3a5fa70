"""Puts the packaged FMU into the wheel and names the platforms that it holds libraries for.

The FMU is the file that the environment variable SWARF_FMU names, or `target/swarf.fmu` of the clone, which
`cargo xtask package` makes. An editable installation takes it from there at run time.
"""

from __future__ import annotations

import os
import re
import zipfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Folder of `binaries` in the FMU, and the tag of a wheel for that platform; Linux's follows from the library.
PLATFORMS = {"linux64": "", "win64": "win_amd64", "darwin64": "macosx_11_0_x86_64"}


class CustomBuildHook(BuildHookInterface):
    """Adds the FMU as package data and sets the wheel's tag."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Called before the wheel is written."""
        if self.target_name != "wheel" or version == "editable":
            return
        fmu = find_fmu(Path(self.root))
        build_data["force_include"][str(fmu)] = "swarf/swarf.fmu"
        build_data["pure_python"] = False
        build_data["tag"] = "py3-none-" + ".".join(sorted(platform_tags(fmu)))


def find_fmu(root: Path) -> Path:
    """The FMU that goes into the wheel."""
    named = os.environ.get("SWARF_FMU")
    places = [Path(named)] if named else [root.parent / "target" / "swarf.fmu"]
    for place in places:
        if place.is_file():
            return place.resolve()
    raise FileNotFoundError(
        f"no FMU at '{places[0]}': run `cargo xtask package` first, or name one in SWARF_FMU"
    )


def platform_tags(fmu: Path) -> set[str]:
    """Tags of the platforms that the FMU has a library for."""
    tags = set()
    with zipfile.ZipFile(fmu) as archive:
        for name in archive.namelist():
            folder = name.split("/")[1] if name.startswith("binaries/") and name.count("/") == 2 else ""
            if folder == "linux64":
                tags.add(linux_tag(archive.read(name)))
            elif folder in PLATFORMS:
                tags.add(PLATFORMS[folder])
    if not tags:
        raise ValueError(f"'{fmu}' has no library for any of {', '.join(PLATFORMS)}")
    return tags


def linux_tag(library: bytes) -> str:
    """Tag by the newest version of glibc that a library names; 2.17 has a name of its own."""
    versions = [(int(a), int(b)) for a, b in re.findall(rb"GLIBC_(\d+)\.(\d+)", library)]
    major, minor = max(versions, default=(2, 17))
    if (major, minor) <= (2, 17):
        return "manylinux2014_x86_64"
    return f"manylinux_{major}_{minor}_x86_64"
