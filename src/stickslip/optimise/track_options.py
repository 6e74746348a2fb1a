"""Options of each named track (`--track-option`), for the help."""

from __future__ import annotations

import ast
from importlib.util import find_spec
from typing import Any, TypeGuard

from stickslip.dynamics.ugv.names import ROUGH_OPTIONS, TRACKS

MODULE = "stickslip.dynamics.ugv.track"


def track_options() -> dict[str, tuple[str, ...]]:
    """The options of each named track, `name=default`: the arguments of its constructor.

    They are read from the constructors' source, since importing it takes JAX; where an
    installation has no source, there are none.
    """
    loader: Any = getattr(find_spec(MODULE), "loader", None)
    source = loader.get_source(MODULE) if hasattr(loader, "get_source") else None
    found: dict[str, tuple[str, ...]] = dict.fromkeys(TRACKS, ())
    for one in ast.walk(ast.parse(source or "")):
        if isinstance(one, ast.ClassDef) and one.name == "Track":
            found |= {f.name: _words(f) for f in one.body if _builds_a_track(f)}
    return found


def _builds_a_track(statement: ast.stmt) -> TypeGuard[ast.FunctionDef]:
    return isinstance(statement, ast.FunctionDef) and statement.name in TRACKS


def _words(constructor: ast.FunctionDef) -> tuple[str, ...]:
    own = constructor.args
    optional = own.args[len(own.args) - len(own.defaults) :] + own.kwonlyargs
    pairs = zip(optional, [*own.defaults, *own.kw_defaults], strict=True)
    words = (f"{argument.arg}{_shown(default)}" for argument, default in pairs)
    return (*words, *(ROUGH_OPTIONS if own.kwarg else ()))


def _shown(default: ast.expr | None) -> str:
    if default is None:
        return ""
    return f"={default.value if isinstance(default, ast.Constant) else ast.unparse(default)}"
