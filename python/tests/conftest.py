"""What the tests share: one short cut, run once, and its cheap settings."""

from __future__ import annotations

import pytest

import swarf

# Coarser than any preset: a cut of five feeds takes a fraction of a second.
CHEAP = {"points_per_feed": 5, "settings": {"numerics.speed": "fast", "numerics.threads": 1}}


def pytest_addoption(parser):
    parser.addoption("--slow", action="store_true", help="run the tests that take minutes, too")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--slow"):
        skip = pytest.mark.skip(reason="takes minutes: give --slow")
        for item in items:
            if "slow" in item.keywords:
                item.add_marker(skip)


@pytest.fixture(scope="session", autouse=True)
def fmu():
    """Path of the FMU; without one nothing can be tested."""
    try:
        return swarf.find_fmu()
    except swarf.SwarfError as error:
        pytest.exit(str(error), returncode=2)


@pytest.fixture(scope="session")
def cut():
    """An ordinary cut of steel, as coarse as it can be."""
    return swarf.Cut(
        "AISI 1045",
        speed="180 m/min",
        feed="0.1 mm",
        rake="5 deg",
        edge_radius="30 um",
        friction=0.3,
        heat="conduction",
        **CHEAP,
    )


@pytest.fixture(scope="session")
def result(cut):
    """That cut over five feeds, with frames."""
    return cut.run(travel="5 feeds", progress=False)
