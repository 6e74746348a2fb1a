"""Import the packages of an extra only when they are needed, of `viz` when something is drawn."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def require(module: str, what: str = "rendering", extra: str = "viz") -> Any:
    """The module by its dotted name, or an ImportError that says what to install.

    what: that needs it. extra: that brings it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise ModuleNotFoundError(
            f"{what} needs {package}, which is not installed; "
            f'run: pip install "stickslip[{extra}]"',
            name=error.name,
        ) from error
