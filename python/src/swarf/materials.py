"""Materials of the user's own, in the format of the library that the FMU carries."""

from __future__ import annotations

import re
import tomllib
import zipfile
from pathlib import Path
from typing import Any

from swarf._errors import SwarfError
from swarf._fmu import Description

# What a group's keys are called after `material.`; the groups that must be there.
_PREFIXES = {
    "elastic": "",
    "flow": "",
    "thermal": "",
    "damage": "",
    "tanh": "tanh_",
    "zerilli_armstrong": "zerilli_armstrong_",
}
_NEEDED = {
    "elastic": ["density", "youngs_modulus", "poissons_ratio"],
    "flow": [
        "yield_stress",
        "hardening_modulus",
        "hardening_exponent",
        "rate_coefficient",
        "reference_rate",
        "thermal_exponent",
        "melting_temperature",
        "reference_temperature",
    ],
    "thermal": ["specific_heat", "conductivity", "thermal_expansion", "taylor_quinney"],
}


def library(description: Description) -> dict[str, bool]:
    """Materials that the FMU carries by name: whether it knows the name, or only holds the constants."""
    return {name: own for name, (own, _) in _records(description).items()}


def find(name: str, description: Description) -> dict[str, Any]:
    """Settings of the FMU for a material that it carries."""
    own, record = _records(description)[name]
    return {"material.name": name} if own else _settings(record, description.path, description)


def _records(description: Description) -> dict[str, tuple[bool, dict[str, Any]]]:
    found: dict[str, tuple[bool, dict[str, Any]]] = {}
    with zipfile.ZipFile(description.path) as archive:
        # The file of the names that the FMU knows comes first.
        paths = sorted(n for n in archive.namelist() if re.fullmatch(r"resources/materials\w*\.toml", n))
        for path in sorted(paths, key=len):
            for record in tomllib.loads(archive.read(path).decode())["material"]:
                found.setdefault(record["name"], (path == "resources/materials.toml", record))
    return found


def read_file(path: str | Path, description: Description, name: str | None = None) -> dict[str, Any]:
    """Constants of a material file, as settings of the FMU.

    Parameters
    ----------
    path
        A TOML file in the format of the FMU's ``resources/materials.toml``. Groups elastic, flow and thermal
        are needed, damage and the further laws are not; each group must name its source.
    description
        Of the FMU that will take them.
    name
        Which material of the file; may be left out where there is one only.

    Returns
    -------
    dict
        ``material.name`` = custom, and every constant by the FMU's name.
    """
    path = Path(path)
    try:
        records = tomllib.loads(path.read_text(encoding="utf-8")).get("material", [])
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise SwarfError(f"cannot read the materials in '{path}': {error}") from error
    names = [record.get("name") for record in records]
    if name is None and len(records) != 1:
        raise SwarfError(f"'{path}' holds {len(records)} materials; name one as '{path}#NAME'")
    if name is not None and name not in names:
        raise SwarfError(f"'{path}' has no material '{name}', but: {', '.join(map(str, names))}")
    record = records[0] if name is None else records[names.index(name)]
    return _settings(record, path, description)


def _settings(record: dict[str, Any], path: Path, description: Description) -> dict[str, Any]:
    settings: dict[str, Any] = {"material.name": "custom"}
    for group, needed in _NEEDED.items():
        missing = [key for key in needed if key not in record.get(group, {})]
        if missing:
            raise SwarfError(f"'{path}': [material.{group}] lacks {', '.join(missing)}")
    for group, content in record.items():
        if group == "name":
            continue
        if group not in _PREFIXES:
            raise SwarfError(f"'{path}': [material.{group}] is none of {', '.join(_PREFIXES)}")
        if not content.get("source"):
            raise SwarfError(f"'{path}': [material.{group}] names no source")
        for key, value in content.items():
            variable = f"material.{_PREFIXES[group]}{key}"
            if key == "source":
                continue
            if variable not in description.variables:
                raise SwarfError(f"'{path}': the FMU has no {variable} for {key} of [material.{group}]")
            settings[variable] = description.variables[variable].read(value)
    return settings
