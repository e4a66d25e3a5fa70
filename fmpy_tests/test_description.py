"""The model description is valid, and says what importers rely on."""

import re
import subprocess
import zipfile
from pathlib import Path

import fmpy
import pytest
from conftest import Refused
from fmpy.validation import validate_fmu
from lxml import etree


def test_fmpy_finds_no_fault(fmu):
    """FMPy checks the XSD and the rules that the XSD cannot say."""
    assert validate_fmu(fmu) == []


def test_fmpy_reads_it_with_validation_on(fmu):
    """An importer that validates must still open the FMU."""
    assert fmpy.read_model_description(fmu, validate=True).fmiVersion == "2.0"


def test_the_xsd_accepts_the_xml(fmu):
    """Against FMPy's copy of the standard's schema directly, so that no step of FMPy's between can hide an error."""
    schema = etree.XMLSchema(etree.parse(str(Path(fmpy.__file__).parent / "schema/fmi2/fmi2ModelDescription.xsd")))
    with zipfile.ZipFile(fmu) as archive:
        schema.assertValid(etree.fromstring(archive.read("modelDescription.xml")))


def test_identity_and_default_experiment(description):
    """What INTERFACE.md fixes for scripts."""
    assert description.coSimulation.modelIdentifier == "swarf"
    assert description.variableNamingConvention == "structured"
    experiment = description.defaultExperiment
    assert (float(experiment.startTime), float(experiment.stopTime), float(experiment.stepSize)) == (0, 4e-5, 1e-6)


def test_author_copyright_date_and_licence(description):
    """What an importer shows of the FMU's origin; the date is a constant, as equal sources give equal files."""
    assert description.author and description.copyright.startswith("Copyright (c) ")
    assert description.license == "MIT OR Apache-2.0"
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", description.generationDateAndTime)


def test_what_the_version_refuses_is_marked(description, cut):
    """Nobody should choose from a list what is refused: marked items and variables, and no others, are."""
    mark = "(not in this version)"
    variables = {v.name: v for v in description.modelVariables}
    refused = [item for item in variables["scene"].declaredType.items if mark in item.description]
    assert [item.name for item in refused] == ["press", "taylor"]
    marked = {name: value for name, value in [("workpiece.endless", True), ("workpiece.revolution_length", 0.01)]}
    assert {v.name for v in description.modelVariables if mark in v.description} == set(marked)
    for values in [{"scene": int(item.value)} for item in refused] + [{k: v} for k, v in marked.items()]:
        with pytest.raises(Refused, match="not available"):
            cut(values).begin()


def test_capabilities(description):
    """Importers choose by these flags what to call."""
    unit = description.coSimulation
    assert unit.canHandleVariableCommunicationStepSize and unit.canInterpolateInputs
    assert unit.canGetAndSetFMUstate and unit.canSerializeFMUstate
    assert not unit.needsExecutionTool and not unit.canBeInstantiatedOnlyOncePerProcess
    assert unit.maxOutputDerivativeOrder == 0


def test_every_variable_is_described(description):
    """A user meets the FMU as a list of variables: each needs a text, each quantity a unit."""
    for variable in description.modelVariables:
        assert variable.description and len(variable.description) > 5, variable.name
        if variable.type == "Real":
            assert variable.unit, f"{variable.name} has no unit"
        if variable.causality == "parameter":
            assert variable.variability == "fixed", variable.name
        if variable.causality in ("parameter", "input"):
            assert variable.start is not None, variable.name


def test_every_unit_is_defined_in_si(description):
    """A unit without base units cannot be converted by an importer."""
    units = {unit.name: unit for unit in description.unitDefinitions}
    for variable in description.modelVariables:
        if variable.type == "Real":
            assert units[variable.unit].baseUnit is not None, variable.unit


def test_references_are_unique(description):
    """Two variables behind one reference would be set together."""
    references = [variable.valueReference for variable in description.modelVariables]
    assert len(references) == len(set(references))


@pytest.mark.parametrize(
    "name, start",
    [
        ("tool_velocity", 50.0),
        ("feed", 3e-4),
        ("friction", 0.2),
        ("workpiece.length", 3e-3),
        ("tool.clearance_angle", 0.0873),
        ("numerics.point_spacing", 1e-5),
        ("material.melting_temperature", 1573.15),
    ],
)
def test_start_values_give_the_reference_cut(description, name, start):
    """Untouched, the FMU is the paper's cut."""
    variable = next(v for v in description.modelVariables if v.name == name)
    assert float(variable.start) == pytest.approx(start, rel=1e-12)


def test_the_archive_is_complete_and_knows_nothing_of_its_build_machine(fmu):
    """A distributed file carries its licences and documentation, and nobody's home folder."""
    with zipfile.ZipFile(fmu) as archive:
        names = archive.namelist()
        for wanted in (
            "modelDescription.xml",
            "model.png",
            "documentation/index.html",
            "documentation/licenses/LICENSE-MIT.txt",
            "documentation/licenses/LICENSE-APACHE.txt",
            "documentation/licenses/THIRD-PARTY.txt",
        ):
            assert wanted in names, wanted
        libraries = {name: archive.read(name) for name in names if name.startswith("binaries/")}
    assert libraries
    for name, library in libraries.items():
        found = re.search(rb"/(?:root|home|Users)/[\w./-]+", library)
        assert found is None, f"{name}: {found}"
        assert b".cargo/registry" not in library, name


def test_the_documentation_is_complete(fmu, description):
    """Every picture and file that the page names is in the archive, and every variable has its line."""
    with zipfile.ZipFile(fmu) as archive:
        names, page = archive.namelist(), archive.read("documentation/index.html").decode()
    links = re.findall(r'(?:src|href)="([^"#]+)"', page)
    assert "reference_cut.png" in links
    for link in links:
        assert f"documentation/{link}" in names, link
    for target in re.findall(r'href="#([^"]+)"', page):
        assert f'id="{target}"' in page, target
    for variable in description.modelVariables:
        assert f"<td><code>{variable.name}</code></td>" in page, variable.name
    etree.HTMLParser(recover=False).feed(page)


def test_the_library_needs_only_the_c_library(unpacked):
    """Anything else would have to be installed on the user's machine."""
    library = Path(unpacked) / "binaries/linux64/swarf.so"
    if not library.is_file():
        pytest.skip("not packaged on Linux")
    listing = subprocess.run(["ldd", str(library)], capture_output=True, text=True, check=True).stdout
    names = {line.split()[0].split("/")[-1] for line in listing.splitlines() if line.strip()}
    allowed = ("linux-vdso", "libc.so", "libm.so", "libgcc_s.so", "libpthread.so", "libdl.so", "ld-linux")
    assert all(name.startswith(allowed) for name in names), names
