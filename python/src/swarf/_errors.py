"""The package's error, and what to say when an optional package is missing."""

from __future__ import annotations

import importlib
from types import ModuleType


class SwarfError(Exception):
    """Something was asked that cannot be done; the text says what is allowed and what holds now."""


def needs(module: str, extra: str) -> ModuleType:
    """Import an optional package.

    Parameters
    ----------
    module
        Its import name.
    extra
        The extra of this package that installs it.

    Returns
    -------
    ModuleType
        The imported module.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.split(".")[0]
        raise SwarfError(f"this needs {package}: pip install 'swarf[{extra}]'") from error
