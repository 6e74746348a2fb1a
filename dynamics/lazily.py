"""What is loaded when it is first used: attributes of a package (PEP 562), packages of an extra."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any


def loaded_when_used(
    package: str,
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package: what its `if TYPE_CHECKING` imports.

    The package's modules are attributes, too, as they are once they are imported.
    """
    module = sys.modules[package]
    loader: Any = getattr(module, "__loader__", None)
    body = ast.parse(loader.get_source(package)).body
    (block,) = (one for one in body if isinstance(one, ast.If))
    imports = [one for one in block.body if isinstance(one, ast.ImportFrom)]
    homes = {name.name: str(one.module) for one in imports for name in one.names}

    def load(name: str) -> Any:
        if homes.get(name, package) != package:
            found = getattr(import_module(homes[name]), name)
        elif not name.startswith("_") and find_spec(f"{package}.{name}") is not None:
            found = import_module(f"{package}.{name}")
        else:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        vars(module)[name] = found
        return found

    return load, lambda: sorted({*vars(module), *homes}), sorted(homes)


def require(module: str, what: str = "rendering", extra: str = "viz") -> Any:
    """The module by its dotted name, or an ImportError that says what to install.

    what: that needs it. extra: that brings it, empty where none does.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise ModuleNotFoundError(
            f"{what} needs {package}, which is not installed; "
            f'run: pip install "{f"stickslip[{extra}]" if extra else package}"',
            name=error.name,
        ) from error
