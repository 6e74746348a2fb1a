"""The posture problem's own methods."""

from __future__ import annotations

from stickslip.optim.posture.names import METHODS as WORDS
from stickslip.optim.problem import Method, Structure

_NEEDS = {
    "grid": Structure.ADDITIVE,
    "dp": Structure.ADDITIVE,
    "lp": Structure.ADDITIVE,
    "branch": Structure.ADDITIVE,
    "scp": Structure.COMPOSITE,
    "gradient": Structure.COMPOSITE,
}
_MODULES = {
    "grid": "graph.grid",
    "dp": "graph.dp",
    "lp": "graph.lp",
    "branch": "branch",
    "scp": "local.scp",
    "gradient": "local.gradient",
    "cma": "local.cma",
}

METHODS = {
    name: Method(
        words,
        f"stickslip.optim.posture.{_MODULES[name]}:solve_{name}",
        frozenset({_NEEDS[name]} if name in _NEEDS else ()),
    )
    for name, words in WORDS.items()
}
""""gradient" takes the criterion's kinks apart (epigraph form), and both it and "cma" begin where a
method of the grid ends; else they are the methods for all problems."""
