"""Puts the packaged FMU into the wheel and names the platforms that it holds libraries for.

The FMU is the file that the environment variable SWARF_FMU names, or `target/swarf.fmu` of the clone, which
`cargo xtask package` makes. An editable installation takes it from there at run time.
"""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Folder of `binaries` in the FMU, and the tag of a wheel for that platform alone.
PLATFORMS = {
    "linux64": "manylinux2014_x86_64",
    "win64": "win_amd64",
    "darwin64": "macosx_11_0_x86_64",
}


class CustomBuildHook(BuildHookInterface):
    """Adds the FMU as package data and sets the wheel's tag."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Called before the wheel is written."""
        if self.target_name != "wheel" or version == "editable":
            return
        fmu = find_fmu(Path(self.root))
        build_data["force_include"][str(fmu)] = "swarf/swarf.fmu"
        build_data["pure_python"] = False
        # SWARF_WHEEL_PLATFORM names one of the platforms, or another tag for a library that needs a newer
        # system.
        asked = os.environ.get("SWARF_WHEEL_PLATFORM")
        tags = [asked] if asked else sorted(platform_tags(fmu))
        build_data["tag"] = "py3-none-" + ".".join(tags)


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
    with zipfile.ZipFile(fmu) as archive:
        folders = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    tags = {PLATFORMS[folder] for folder in folders if folder in PLATFORMS}
    if not tags:
        raise ValueError(f"'{fmu}' has no library for any of {', '.join(PLATFORMS)}")
    return tags
