"""Attributes of a package that are loaded when they are first used (PEP 562)."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping


def loaded_when_used(
    package: str, homes: Mapping[str, Iterable[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package.

    homes: module (its name within the package) -> names that the package takes from it. The
    package's modules are attributes, too, as they are once they are imported.
    """
    module = sys.modules[package]
    public = {name: home for home, names in homes.items() for name in names}

    def load(name: str) -> Any:
        if name in public:
            found = getattr(import_module(f"{package}.{public[name]}"), name)
        elif not name.startswith("_") and find_spec(f"{package}.{name}") is not None:
            found = import_module(f"{package}.{name}")
        else:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        vars(module)[name] = found
        return found

    return load, lambda: sorted({*vars(module), *public})
