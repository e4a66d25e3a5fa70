"""Orthogonal metal cutting by the material point method.

Two lines give a force::

    import swarf
    print(swarf.Cut("AISI 1045", speed="180 m/min", feed="0.1 mm").run().steady.cutting_force)

All mechanics are those of the swarf FMU, which the package carries and runs by FMPy.
"""

from swarf._errors import SwarfError
from swarf._fmu import find_fmu, variables
from swarf.cut import Cut, Estimate
from swarf.result import Result
from swarf.steady import Figure, Steady
from swarf.studies import Study, open_study, study

__version__ = "0.1.0"

__all__ = [
    "Cut",
    "Estimate",
    "Figure",
    "Result",
    "Steady",
    "Study",
    "SwarfError",
    "find_fmu",
    "open_study",
    "study",
    "variables",
]
