"""Import the packages of the `viz` extra only when something is drawn."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def require(module: str) -> Any:
    """The module by its dotted name, or an ImportError that says what to install."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise ModuleNotFoundError(
            f'rendering needs {package}, which is not installed; run: pip install "stickslip[viz]"',
            name=error.name,
        ) from error
