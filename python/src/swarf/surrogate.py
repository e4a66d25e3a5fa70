"""A surrogate: a small FMU with a law fitted to a study, for masters that need an answer in microseconds.

The law is a linear trend and a Gaussian process with one kernel for all outputs, fitted by scikit-learn and
exported as coefficients into a C file without dependencies, which the C compiler of this machine builds. The
file lies in the FMU too, with ``sources`` named in its description.
"""

from __future__ import annotations

import html
import os
import re
import shutil
import subprocess
import sys
import tempfile
import uuid
import warnings
import xml.etree.ElementTree as ElementTree
import zipfile
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from swarf._errors import SwarfError, needs
from swarf._fmu import Description

INPUTS = ("tool_velocity", "feed", "friction")
# Outputs of the law, where the study has them; forces scale with the width.
LAWS = (
    "cutting_force",
    "thrust_force",
    "chip_temperature",
    "chip_temperature_peak",
    "peak_strain_p999",
    "chip_thickness",
    "contact_length",
    "shear_angle",
)
_FORCES = ("cutting_force", "thrust_force")
_MADE = ("cutting_power", "specific_cutting_energy", "cut_length")  # from the law's outputs
_MOST = 400  # centres of the process; more cuts than that serve as held-back ones only
_FOLDS = 5
_IN_RANGE, _SLOPES, _CHIP = 900000, (900001, 900002), 900003  # references that the big unit has not


@dataclass(frozen=True)
class Surrogate:
    """A surrogate FMU and what is known of it.

    Attributes
    ----------
    path
        Of the FMU.
    ranges
        Lowest and highest value of each input and parameter in the study (SI).
    errors
        Of cuts that were held back, by output: ``rms`` and ``worst`` (SI), ``relative`` (rms over the mean),
        the study's own ``scatter`` (mean standard error of a cut) and ``band`` (mean; nan where none is
        known).
    cuts
        How many cuts the law is fitted to.
    """

    path: Path
    ranges: pd.DataFrame
    errors: pd.DataFrame
    cuts: int
    _law: _Law

    def predict(self, points: Any) -> pd.DataFrame:
        """The law in numpy, as the FMU has it, for points within the ranges.

        Parameters
        ----------
        points
            A table or mapping with the varied inputs and parameters by name (SI).
        """
        table = pd.DataFrame(points)
        at = self._law.scaled(table[self._law.names].to_numpy(float))
        return pd.DataFrame(self._law(at), columns=self._law.outputs, index=table.index)


@dataclass(frozen=True)
class _Law:
    names: list[str]
    outputs: list[str]
    low: np.ndarray
    high: np.ndarray
    constant: np.ndarray  # of each output
    linear: np.ndarray  # inputs by outputs
    centres: np.ndarray  # cuts by inputs, scaled
    lengths: np.ndarray
    weights: np.ndarray  # cuts by outputs

    def scaled(self, x: np.ndarray) -> np.ndarray:
        return (x - self.low) / (self.high - self.low)

    def __call__(self, at: np.ndarray) -> np.ndarray:
        square = (((at[:, None, :] - self.centres[None]) / self.lengths) ** 2).sum(axis=2)
        return self.constant + at @ self.linear + np.exp(-0.5 * square) @ self.weights


def make(study: Any, path: str | Path, *, seed: int = 0) -> Surrogate:
    """Writes a surrogate FMU of a study.

    Parameters
    ----------
    study
        A study of ranges of the inputs and of Real parameters, with 3 cuts or more for each of them and one
        more.
    path
        File to write; its name without the ending becomes the model's.
    seed
        Of the fit's restarts and of the folds.

    Returns
    -------
    Surrogate
        With the errors of held-back cuts, which stand in the FMU's documentation too.
    """
    path = Path(path)
    description = study.description
    rows = study.good
    names = [name for name in study.varied if name in rows and rows[name].nunique() > 1]
    wrong = [name for name in names if description.variable(name).kind != "Real"]
    if wrong:
        raise SwarfError(
            f"a surrogate is of ranges; {', '.join(wrong)} can take no value between those of the study"
        )
    if "workpiece.width" in names:
        raise SwarfError("workpiece.width only scales forces: do not vary it for a surrogate")
    least = 3 * (len(names) + 1)
    if not names or len(rows) < least:
        raise SwarfError(
            f"a surrogate of {len(names)} varied quantities needs {max(least, 6)} cuts, not {len(rows)}"
        )
    outputs = [name for name in LAWS if name in rows and rows[name].notna().all()]
    if not set(_FORCES) <= set(outputs):
        raise SwarfError("a surrogate needs both forces in the study")
    x, y = rows[names].to_numpy(float), rows[outputs].to_numpy(float)
    errors = _held_back(names, outputs, x, y, rows, seed)
    law = _fit(names, outputs, x[:_MOST], y[:_MOST], seed)
    used = min(len(rows), _MOST)
    unit = _Unit(description, law, rows, errors, used)
    unit.write(path)
    every = [*INPUTS, *(name for name in names if name not in INPUTS)]
    ranges = pd.DataFrame({"low": rows[every].min(), "high": rows[every].max()})
    return Surrogate(path, ranges, errors, used, law)


def _fit(names: list[str], outputs: list[str], x: np.ndarray, y: np.ndarray, seed: int) -> _Law:
    process = needs("sklearn.gaussian_process", "fit")
    kernels = needs("sklearn.gaussian_process.kernels", "fit")
    low, high = x.min(axis=0), x.max(axis=0)
    at = (x - low) / (high - low)
    design = np.column_stack([np.ones(len(at)), at])
    trend, *_ = np.linalg.lstsq(design, y, rcond=None)
    rest = y - design @ trend
    scale = rest.std(axis=0)
    scale[scale == 0.0] = 1.0
    kernel = kernels.ConstantKernel(1.0, (1e-2, 1e2)) * kernels.RBF(
        np.ones(at.shape[1]), (0.2, 20.0)
    ) + kernels.WhiteKernel(0.1, (1e-6, 2.0))
    fitted = process.GaussianProcessRegressor(kernel, alpha=1e-10, n_restarts_optimizer=1, random_state=seed)
    with warnings.catch_warnings():
        # A length at its bound says only that an input acts in a straight line, which the trend holds.
        warnings.simplefilter("ignore")
        fitted.fit(at, rest / scale)
    main = fitted.kernel_.k1
    weights = main.k1.constant_value * fitted.alpha_.reshape(len(at), -1) * scale
    lengths = np.broadcast_to(np.asarray(main.k2.length_scale, float), (at.shape[1],))
    return _Law(names, outputs, low, high, trend[0], trend[1:], at, lengths, weights)


def _held_back(
    names: list[str], outputs: list[str], x: np.ndarray, y: np.ndarray, rows: pd.DataFrame, seed: int
) -> pd.DataFrame:
    """Errors of every cut against the law fitted to the other folds."""
    order = np.random.default_rng(seed).permutation(len(x))
    miss = np.empty_like(y)
    for fold in range(_FOLDS):
        held = order[fold::_FOLDS]
        kept = np.setdiff1d(order, held)[:_MOST]
        law = _fit(names, outputs, x[kept], y[kept], seed)
        # The unit holds inputs at the ends of its range; so does this.
        miss[held] = law(np.clip(law.scaled(x[held]), 0.0, 1.0)) - y[held]
    found = pd.DataFrame(index=outputs)
    found["rms"] = np.sqrt((miss**2).mean(axis=0))
    found["worst"] = np.abs(miss).max(axis=0)
    found["relative"] = found["rms"] / np.abs(y.mean(axis=0))
    root = np.sqrt(rows["blocks"].clip(lower=1))
    found["scatter"] = [
        float((rows[f"{n} scatter"] / root).mean()) if f"{n} scatter" in rows else np.nan for n in outputs
    ]
    found["band"] = [float(rows[f"{n} band"].mean()) if f"{n} band" in rows else np.nan for n in outputs]
    return found


class _Unit:
    """The files of the FMU."""

    def __init__(
        self, description: Description, law: _Law, rows: pd.DataFrame, errors: pd.DataFrame, used: int
    ) -> None:
        self._big, self._law, self._rows, self._errors, self._used = description, law, rows, errors, used
        self._inputs = [*INPUTS, *(name for name in law.names if name not in INPUTS)]
        with zipfile.ZipFile(description.path) as archive:
            self._xml = ElementTree.fromstring(archive.read("modelDescription.xml"))
        self._variables = {v.get("name"): v for v in self._xml.iter("ScalarVariable")}

    def write(self, path: Path) -> None:
        name = re.sub(r"\W", "_", path.stem)
        name = name if re.match(r"[A-Za-z_]", name) else f"_{name}"
        header = self._header("{}")
        guid = "{" + str(uuid.uuid5(uuid.NAMESPACE_OID, header)) + "}"
        header = self._header(guid)
        source = (files("swarf") / "templates" / "surrogate.c").read_text(encoding="utf-8")
        library, place, ending = _compile(source, header, name)
        xml = self._description(name, guid)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + ".part")
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", xml)
            archive.writestr(f"binaries/{place}/{name}{ending}", library)
            archive.writestr("sources/surrogate.c", source)
            archive.writestr("sources/model.h", header)
            archive.writestr("documentation/index.html", self._documentation(name))
        os.replace(part, path)

    def _start(self, name: str) -> float:
        return float(self._rows[name].median())

    def _header(self, guid: str) -> str:
        law, rows = self._law, self._rows
        least = [float(rows[name].min()) for name in self._inputs]
        most = [float(rows[name].max()) for name in self._inputs]
        tolerance = [1e-9 * max(abs(a), abs(b)) for a, b in zip(least, most)]
        outputs = [*law.outputs, *_MADE]
        references = [self._variables[name].get("valueReference") for name in outputs] + [*_SLOPES, _CHIP]
        places = {name: number for number, name in enumerate(outputs)}
        initial = float(rows["workpiece.initial_temperature"].iloc[0])
        rest = [initial if name.startswith("chip_temperature") else 0.0 for name in law.outputs]
        own = {
            "GUID": f'"{guid}"',
            "INPUTS": len(self._inputs),
            "FREE_INPUTS": len(INPUTS),
            "DIMENSIONS": len(law.names),
            "CENTRES": len(law.centres),
            "LAWS": len(law.outputs),
            "OUTPUTS": len(references),
            "SPEED": self._inputs.index("tool_velocity"),
            "FEED": self._inputs.index("feed"),
            "FEED_AXIS": law.names.index("feed") if "feed" in law.names else -1,
            "CUTTING_FORCE": places["cutting_force"],
            "THRUST_FORCE": places["thrust_force"],
            "POWER": places["cutting_power"],
            "SPECIFIC_ENERGY": places["specific_cutting_energy"],
            "CUT_LENGTH": places["cut_length"],
            "CUTTING_SLOPE": len(outputs),
            "THRUST_SLOPE": len(outputs) + 1,
            "CHIP": len(outputs) + 2,
            "STUDY_WIDTH": _number(float(rows["workpiece.width"].iloc[0])),
            "WIDTH_REFERENCE": self._reference("workpiece.width"),
            "REVOLUTION_REFERENCE": self._reference("workpiece.revolution_length"),
            "IN_RANGE_REFERENCE": _IN_RANGE,
        }
        arrays: list[tuple[str, Any]] = [
            ("int VARIED[DIMENSIONS]", [self._inputs.index(name) for name in law.names]),
            ("double LOW[DIMENSIONS]", law.low),
            ("double HIGH[DIMENSIONS]", law.high),
            ("double PER_LENGTH[DIMENSIONS]", 1.0 / law.lengths),
            ("double CONSTANT[LAWS]", law.constant),
            ("double LINEAR[DIMENSIONS][LAWS]", law.linear),
            ("double CENTRE[CENTRES][DIMENSIONS]", law.centres),
            ("double WEIGHT[CENTRES][LAWS]", law.weights),
            ("double REST[LAWS]", rest),
            ("int PER_WIDTH[LAWS]", [int(name in _FORCES) for name in law.outputs]),
            ("int POSITIVE[LAWS]", [1] * len(law.outputs)),
            ("double LEAST[INPUTS]", least),
            ("double MOST[INPUTS]", most),
            ("double TOLERANCE[INPUTS]", tolerance),
            ("double START[INPUTS]", [self._start(name) for name in self._inputs]),
            ("Reference INPUT_REFERENCES[INPUTS]", [self._reference(name) for name in self._inputs]),
            ("Reference OUTPUT_REFERENCES[OUTPUTS]", references),
        ]
        lines = ["/* Made by swarf: the law of one study. */", "typedef unsigned int Reference;"]
        lines += [f"#define {name} {value}" for name, value in own.items()]
        lines += [f"static const {kind} = {_braces(values)};" for kind, values in arrays]
        names = ", ".join(f'"{name}"' for name in self._inputs)
        lines.append(f"static const char *const NAMES[INPUTS] = {{{names}}};")
        return "\n".join(lines) + "\n"

    def _reference(self, name: str) -> int:
        return int(self._variables[name].get("valueReference", "0"))

    def _description(self, name: str, guid: str) -> bytes:
        big = self._xml
        root = ElementTree.Element(
            "fmiModelDescription",
            {
                "fmiVersion": "2.0",
                "modelName": name,
                "guid": guid,
                "version": big.get("version", ""),
                "description": f"law fitted to {self._used} cuts of {self._big.version}",
                "generationTool": f"{self._big.version} (Python package)",
                "variableNamingConvention": "structured",
            },
        )
        unit = ElementTree.SubElement(
            root,
            "CoSimulation",
            {
                "modelIdentifier": name,
                "canHandleVariableCommunicationStepSize": "true",
                "canInterpolateInputs": "true",
                "canGetAndSetFMUstate": "true",
                "canSerializeFMUstate": "true",
                "maxOutputDerivativeOrder": "0",
                "canNotUseMemoryManagementFunctions": "true",
            },
        )
        ElementTree.SubElement(ElementTree.SubElement(unit, "SourceFiles"), "File", {"name": "surrogate.c"})
        units = big.find("UnitDefinitions")
        if units is not None:
            if not any(one.get("name") == "N/m" for one in units):
                stiffness = ElementTree.SubElement(units, "Unit", {"name": "N/m"})
                ElementTree.SubElement(stiffness, "BaseUnit", {"kg": "1", "s": "-2"})
            root.append(units)
        categories = ElementTree.SubElement(root, "LogCategories")
        for category in ("logStatusWarning", "logStatusError"):
            ElementTree.SubElement(categories, "Category", {"name": category})
        ElementTree.SubElement(
            root, "DefaultExperiment", {"startTime": "0", "stopTime": "0.1", "stepSize": "1e-4"}
        )
        variables = ElementTree.SubElement(root, "ModelVariables")
        outputs = self._add_variables(variables)
        structure = ElementTree.SubElement(root, "ModelStructure")
        for kind in ("Outputs", "InitialUnknowns"):
            unknowns = ElementTree.SubElement(structure, kind)
            for index in outputs:
                ElementTree.SubElement(unknowns, "Unknown", {"index": str(index)})
        ElementTree.indent(root)
        return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)

    def _add_variables(self, parent: ElementTree.Element) -> list[int]:
        """All variables; gives the indices of the outputs."""
        for name in self._inputs:
            low, high = float(self._rows[name].min()), float(self._rows[name].max())
            one = self._copy(parent, name, f"; the study covers {low:.6g} to {high:.6g}")
            one[0].set("start", _number(self._start(name)))
        width = self._copy(parent, "workpiece.width", "")
        width[0].set("start", _number(float(self._rows["workpiece.width"].iloc[0])))
        self._copy(
            parent,
            "workpiece.revolution_length",
            "; then the tool lies below that surface less the feed at the start",
        )[0].set("start", "0")
        first = len(parent) + 1
        for name in [*self._law.outputs, *_MADE]:
            self._copy(parent, name, "; steady value of the fitted law" if name in self._law.outputs else "")
        slopes = ("cutting_force_feed_slope", "thrust_force_feed_slope")
        for name, reference in zip(slopes, _SLOPES):
            _output(parent, name, reference, f"change of the {name.split('_feed')[0]} with the feed", "N/m")
        _output(
            parent,
            "uncut_chip_thickness",
            _CHIP,
            "thickness that the tool cuts now, by the memory of the surface",
            "m",
        )
        flag = ElementTree.SubElement(
            parent,
            "ScalarVariable",
            {
                "name": "surrogate.in_range",
                "valueReference": str(_IN_RANGE),
                "causality": "output",
                "variability": "discrete",
                "initial": "calculated",
                "description": "all inputs and parameters lie within the study's ranges; outside the law is "
                "held at their ends",
            },
        )
        ElementTree.SubElement(flag, "Boolean")
        return list(range(first, len(parent) + 1))

    def _copy(self, parent: ElementTree.Element, name: str, further: str) -> ElementTree.Element:
        """A variable as the big unit describes it."""
        big = self._variables[name]
        one = ElementTree.SubElement(parent, "ScalarVariable", dict(big.attrib))
        one.set("description", (big.get("description") or "") + further)
        ElementTree.SubElement(one, big[0].tag, dict(big[0].attrib))
        return one

    def _documentation(self, name: str) -> str:
        def table(heads: list[str], rows: list[list[str]]) -> str:
            lines = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows]
            head = "".join(f"<th>{cell}</th>" for cell in heads)
            return f"<table><tr>{head}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"

        variables = self._big.variables
        ranges = [
            [n, f"{self._rows[n].min():.6g}", f"{self._rows[n].max():.6g}", variables[n].unit]
            for n in self._inputs
        ]
        errors = [
            [
                n,
                variables[n].unit,
                *(f"{row[c]:.3g}" for c in ("rms", "worst", "scatter", "band")),
                f"{100 * row['relative']:.2g} %",
            ]
            for n, row in self._errors.iterrows()
        ]
        fixed = self._rows.iloc[0]
        held = [
            [n, f"{fixed[n]}", v.unit]
            for n, v in variables.items()
            if v.causality == "parameter" and n in fixed and n not in self._inputs
        ]
        return _PAGE.format(
            name=name,
            cuts=self._used,
            made=html.escape(self._big.version),
            ranges=table(["name", "low", "high", "unit"], ranges),
            errors=table(["output", "unit", "rms", "worst", "scatter", "band", "rms over mean"], errors),
            held=table(["name", "value", "unit"], held),
        )


_PAGE = """<!doctype html>
<html lang=en>
<meta charset=utf-8>
<title>{name}</title>
<style>
body {{ font: 16px/1.5 sans-serif; max-width: 60rem; margin: auto; padding: 1rem }}
td, th {{ text-align: left; padding: .1rem .8rem .1rem 0 }}
</style>
<h1>{name}</h1>
<p>A law fitted to {cuts} cuts of {made}: a linear trend and a Gaussian process. Outputs are steady
values: it knows no run-in and no segments. Outside of the study's ranges inputs are held at their ends,
<code>surrogate.in_range</code> is false and a warning is logged; below the smallest feed forces go
straight to zero. With <code>workpiece.revolution_length</code> the chip is as thick as the tool lies
below the surface that it left one revolution ago, less the feed at the start.</p>
<h2>Ranges</h2>
{ranges}
<h2>Errors of cuts that were held back</h2>
<p>Each cut against the law fitted to the other four fifths. Scatter is the mean standard error of a cut's own
mean, band its mean band by the price list.</p>
{errors}
<h2>What all cuts had in common</h2>
{held}
</html>
"""


def _output(parent: ElementTree.Element, name: str, reference: int, text: str, unit: str) -> None:
    one = ElementTree.SubElement(
        parent,
        "ScalarVariable",
        {
            "name": name,
            "valueReference": str(reference),
            "causality": "output",
            "variability": "continuous",
            "initial": "calculated",
            "description": text,
        },
    )
    ElementTree.SubElement(one, "Real", {"unit": unit})


def _compile(source: str, header: str, name: str) -> tuple[bytes, str, str]:
    """The library, its folder in the FMU, and its ending."""
    places = {"linux": ("linux64", ".so"), "win32": ("win64", ".dll"), "darwin": ("darwin64", ".dylib")}
    place, ending = places.get(sys.platform, ("linux64", ".so"))
    asked = os.environ.get("CC")
    compilers = [asked] if asked else ["cc", "gcc", "clang"]
    compiler = next((found for found in map(shutil.which, compilers) if found), None)
    if compiler is None:
        raise SwarfError(
            f"no C compiler found: looked for {', '.join(compilers)}; name one in the variable CC"
        )
    with tempfile.TemporaryDirectory(prefix="swarf-surrogate-") as folder:
        (Path(folder) / "surrogate.c").write_text(source, encoding="utf-8")
        (Path(folder) / "model.h").write_text(header, encoding="utf-8")
        command = [compiler, "-std=c99", "-O2", "-shared", "-fvisibility=hidden", "-ffp-contract=off"]
        command += [] if sys.platform == "win32" else ["-fPIC"]
        done = subprocess.run(
            [*command, "surrogate.c", "-o", f"{name}{ending}", "-lm"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise SwarfError(f"'{compiler}' failed on the surrogate: {done.stderr.strip()[:2000]}")
        return (Path(folder) / f"{name}{ending}").read_bytes(), place, ending


def _number(value: float) -> str:
    return repr(float(value))


def _braces(values: Any) -> str:
    if isinstance(values, np.ndarray) and values.ndim == 2:
        return "{\n" + ",\n".join(_braces(row) for row in values) + "}"
    return (
        "{"
        + ", ".join(_number(v) if isinstance(v, float) else str(v) for v in list(map(_item, values)))
        + "}"
    )


def _item(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
