"""One door to all methods: `solve(problem, method, **options)`."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.checks import require_choice, require_kind, require_known
from stickslip.optim.names import METHODS
from stickslip.optim.polish import ON_GRID, polished, require_room
from stickslip.optim.problem import PostureProblem

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.optim.result import Result

__all__ = ["METHODS", "accepted_options", "solve"]


def solve(
    problem: PostureProblem,
    method: str = "dp",
    *,
    polish: bool = True,
    progress: bool = False,
    **options: Any,
) -> Result:
    """Solve a problem by one of METHODS.

    polish: let scp follow where a method of ON_GRID ends, see `polished`; False: the grid's own
    path, of which alone it is proved that it is optimal. The other methods take no notice of it.
    progress: a bar on standard error, where tqdm is installed. options: the method's own, see its
    function's docstring; ValueError lists them where one is unknown.
    """
    require_kind("problem", problem, PostureProblem, "a PostureProblem")
    require_choice("method", method, tuple(METHODS))
    for name, value in (("polish", polish), ("progress", progress)):
        require_kind(name, value, bool, "True or False")
    function = _function(method)
    known = accepted_options(function)
    require_known(options, known, f"option of {method!r}")
    polish = polish and method in ON_GRID
    if polish:
        require_room(problem)
    found = function(problem, progress=progress, **options)
    return polished(problem, found, progress) if polish else found


def accepted_options(function: Callable) -> tuple[str, ...]:
    """The keyword-only parameters of a method's function, without progress."""
    found = inspect.signature(function).parameters.values()
    return tuple(p.name for p in found if p.kind is p.KEYWORD_ONLY and p.name != "progress")


def _function(method: str) -> Callable[..., Result]:
    return getattr(import_module(f"stickslip.optim.{method}"), f"solve_{method}")
