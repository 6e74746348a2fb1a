"""One door to all methods: `solve(problem, method, **options)`."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

from stickslip.dynamics.checks import require_choice, require_kind, require_known
from stickslip.optim import GENERAL_METHODS
from stickslip.optim.problem import Method, Problem, R, Structure

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.optim.result import Result

GENERAL: dict[str, Method] = {
    "gradient": Method(
        GENERAL_METHODS["gradient"],
        "stickslip.optim.methods:solve_gradient",
        frozenset({Structure.SMOOTH}),
    ),
    "cma": Method(GENERAL_METHODS["cma"], "stickslip.optim.methods:solve_cma"),
}
"""The methods for every problem that has what they need."""


def methods_of(problem: Problem[Any]) -> dict[str, Method]:
    """The methods that take a problem, by name: its own, and those of GENERAL that it fits."""
    fitting = {name: one for name, one in GENERAL.items() if one.needs <= problem.structure}
    return dict(problem.methods) | {
        name: one for name, one in fitting.items() if name not in problem.methods
    }


def solve(
    problem: Problem[R],
    method: str | None = None,
    *,
    polish: bool = True,
    progress: bool = False,
    **options: Any,
) -> R:
    """Solve a problem by one of `methods_of` it; None: its default ("dp" of a posture problem).

    polish: let a local method follow where a method has that choice (scp after those of a posture
    problem's grid); False: the method's own point, of which alone is proved what it proves. The
    other methods take no notice of it. progress: told on standard error.
    options: the method's own, see its function's docstring; ValueError lists them where one is
    unknown.
    """
    require_kind("problem", problem, Problem, "a Problem, such as a PostureProblem")
    known = methods_of(problem)
    if method is None:
        method = problem.default_method or next(iter(known))
    require_choice("method", method, tuple(known))
    for name, value in (("polish", polish), ("progress", progress)):
        require_kind(name, value, bool, "True or False")
    function = _function(known[method])
    require_known(options, accepted_options(function), f"option of {method!r}")
    if "polish" in inspect.signature(function).parameters:
        options["polish"] = polish
    return cast("R", function(problem, progress=progress, **options))


def options_of_method(method: Method) -> tuple[str, ...]:
    """Names of the options that `solve` takes for one of `methods_of` a problem."""
    return accepted_options(_function(method))


def accepted_options(function: Callable) -> tuple[str, ...]:
    """The keyword-only parameters of a method's function, without those of `solve` itself."""
    found = inspect.signature(function).parameters.values()
    own = ("progress", "polish")
    return tuple(p.name for p in found if p.kind is p.KEYWORD_ONLY and p.name not in own)


def _function(method: Method) -> Callable[..., Result]:
    module, name = method.function.split(":")
    return getattr(import_module(module), name)
