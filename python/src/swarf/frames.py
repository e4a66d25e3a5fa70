"""Frames that the FMU has written: material points and the tool's outline, as numpy arrays.

The files are VTK's XML formats with raw appended data, which ParaView and pyvista read too.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from swarf._errors import SwarfError, needs

_TYPES = {
    "Float32": "f4",
    "Float64": "f8",
    "Int32": "i4",
    "Int64": "i8",
    "UInt8": "u1",
    "UInt32": "u4",
    "UInt64": "u8",
}
# Units of the fields; a stress is xx, yy, zz, xy, yz, xz.
UNITS = {
    "von_mises": "Pa",
    "pressure": "Pa",
    "speed": "m/s",
    "strain_rate": "1/s",
    "stress_cell": "Pa",
    "damage": "1",
    "velocity": "m/s",
    "stress": "Pa",
    "plastic_strain": "1",
    "temperature": "K",
    "jacobian": "1",
    "mass": "kg",
}


def read_vtk(path: str | Path) -> tuple[float, dict[str, np.ndarray]]:
    """Arrays of a file by name.

    Parameters
    ----------
    path
        A ``.vtu`` or ``.vtp`` file with raw appended data, little-endian, with 64-bit headers.

    Returns
    -------
    tuple
        The time (s; nan where the file names none) and the arrays; ``Points`` has a row for each point.
    """
    data = Path(path).read_bytes()
    mark = data.find(b"<AppendedData")
    begin = data.find(b"_", mark) + 1
    if mark < 0 or begin == 0:
        raise SwarfError(f"'{path}' has no appended data")
    root = ElementTree.fromstring(data[:mark] + b"</VTKFile>")
    if root.get("byte_order") != "LittleEndian" or root.get("header_type") != "UInt64":
        raise SwarfError(f"'{path}' is not little-endian with 64-bit headers")
    time, arrays = float("nan"), {}
    for array in root.iter("DataArray"):
        name = array.get("Name", "")
        if array.get("format") == "ascii":
            if name == "TimeValue":
                time = float(array.text or "nan")
            continue
        at = begin + int(array.get("offset", 0))
        size = int(np.frombuffer(data, "<u8", 1, at)[0])
        kind = np.dtype("<" + _TYPES[array.get("type", "")])
        values = np.frombuffer(data, kind, size // kind.itemsize, at + 8)
        components = int(array.get("NumberOfComponents", 1))
        arrays[name] = values.reshape(-1, components) if components > 1 else values
    return time, arrays


@dataclass(frozen=True)
class Frame:
    """Material points and tool at one instant.

    Attributes
    ----------
    path
        Of the points' file.
    """

    path: Path

    @cached_property
    def _read(self) -> tuple[float, dict[str, np.ndarray]]:
        return read_vtk(self.path)

    @property
    def time(self) -> float:
        """Time (s)."""
        return self._read[0]

    @property
    def points(self) -> np.ndarray:
        """Positions (m), a row for each point."""
        return self._read[1]["Points"]

    @property
    def names(self) -> list[str]:
        """Fields that `field` gives."""
        own = [name for name, values in self._read[1].items() if len(values) == len(self.points)]
        return [*dict.fromkeys(["von_mises", "pressure", "speed", *(n for n in own if n in UNITS)])]

    def field(self, name: str) -> np.ndarray:
        """A field over the points, in SI units.

        Parameters
        ----------
        name
            One of `names`: an array of the file, or ``speed``. Equivalent stress ``von_mises`` and
            ``pressure`` are those of a cell's mean stress where the file has them, else of each point's own.
        """
        arrays = self._read[1]
        if name in arrays and len(arrays[name]) == len(self.points):
            return arrays[name].astype(float)
        if name == "von_mises":
            xx, yy, zz, xy, yz, xz = arrays["stress"].astype(float).T
            direct = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
            return np.sqrt(0.5 * direct + 3.0 * (xy**2 + yz**2 + xz**2))
        if name == "pressure":
            return -arrays["stress"][:, :3].astype(float).mean(axis=1)
        if name == "speed":
            return np.linalg.norm(arrays["velocity"].astype(float), axis=1)
        raise SwarfError(f"a frame has no field '{name}', but: {', '.join(self.names)}")

    @cached_property
    def tool(self) -> np.ndarray:
        """The tool's outline (m), a row for each corner; empty where no file of it lies beside."""
        path = self.path.with_name(self.path.name.replace("frame_", "tool_")).with_suffix(".vtp")
        return read_vtk(path)[1]["Points"] if path.is_file() else np.empty((0, 3))

    def pyvista(self):
        """The points as a pyvista data set (needs pyvista)."""
        return needs("pyvista", "plot").read(str(self.path))

    def __repr__(self) -> str:
        return f"<frame at {self.time:.4g} s with {len(self.points)} points>"


def frames_in(folder: str | Path) -> list[Frame]:
    """All frames of a results folder, in order of time."""
    found = (path for path in Path(folder).glob("frame_*.vtu") if re.fullmatch(r"frame_\d+\.vtu", path.name))
    return [Frame(path) for path in sorted(found, key=lambda path: int(path.stem.split("_")[1]))]
