"""Doing something when another package is imported, now or later, without importing it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType


class _Watch:
    """A finder that waits on sys.meta_path for one package, and leaves when that is imported."""

    def __init__(self, package: str, act: Callable[[], None]):
        self.package, self.act = package, act

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Spec of the other finders, with a loader that runs `act` after the package."""
        if name != self.package:
            return None
        others = (one for one in sys.meta_path if one is not self and hasattr(one, "find_spec"))
        specs = (finder.find_spec(name, path, target) for finder in others)
        spec = next((spec for spec in specs if spec is not None), None)
        loader: Any = None if spec is None else spec.loader
        if hasattr(loader, "exec_module"):

            def load_and_act(module: ModuleType) -> None:
                del loader.exec_module  # the loader's own is behind it
                loader.exec_module(module)
                if self in sys.meta_path:
                    sys.meta_path.remove(self)
                self.act()

            loader.exec_module = load_and_act
        return spec


def when_imported(package: str, act: Callable[[], None]) -> None:
    """Call `act` once: now where the package is imported already, else right after it is."""
    if package in sys.modules:
        act()
    else:
        sys.meta_path.insert(0, _Watch(package, act))
