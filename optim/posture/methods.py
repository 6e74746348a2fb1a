"""The posture problem's own methods."""

from __future__ import annotations

from stickslip.optim.problem import Method, Structure

_ADDITIVE = frozenset({Structure.ADDITIVE})
_COMPOSITE = frozenset({Structure.COMPOSITE})


def _own(what: str, name: str, needs: frozenset[Structure] = frozenset()) -> Method:
    return Method(what, f"stickslip.optim.posture.{name}:solve_{name}", needs)


METHODS = {
    "grid": _own(
        "every pair of angles at each waypoint, the best one chosen point by point",
        "grid",
        _ADDITIVE,
    ),
    "dp": _own("dynamic programming over the grid: the best path of all, proved", "dp", _ADDITIVE),
    "lp": _own("the same as a flow in cvxpy: its dual certifies the value", "lp", _ADDITIVE),
    "scp": _own("sequential convex programming in cvxpy, from a feasible path", "scp", _COMPOSITE),
    "gradient": _own("nonlinear programming by scipy on exact derivatives", "gradient", _COMPOSITE),
    "cma": _own("evolution by the package cma, where it is installed", "cma"),
}
""""gradient" takes the criterion's kinks apart (epigraph form), and both it and "cma" begin where a
method of the grid ends; else they are the methods for all problems."""
