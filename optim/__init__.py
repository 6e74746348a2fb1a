"""Optimisation problems apart from the methods that solve them.

What a problem is, whatever it is about (`Problem`), and one door to all methods (`solve`). The
UGV's: which leg angles to drive over a track with (`PostureProblem`), by which of several criteria.
Nothing here imports a solver: each method's module is imported when that method is asked for.
"""

from stickslip.optim.posture.criteria import CRITERIA, Criterion, Weighted, criterion_by_name
from stickslip.optim.posture.problem import PostureProblem
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.station import Station, station
from stickslip.optim.problem import FreeProblem, Method, Problem, Structure
from stickslip.optim.result import Evaluation, OptimStatus, Result
from stickslip.optim.solve import methods_of, solve

METHODS: dict[str, str] = {name: one.what for name, one in PostureProblem.methods.items()}
"""The methods of a posture problem by name; `methods_of` tells those of any problem."""

__all__ = [
    "CRITERIA",
    "METHODS",
    "Criterion",
    "Evaluation",
    "FreeProblem",
    "Method",
    "OptimStatus",
    "PostureProblem",
    "PostureResult",
    "Problem",
    "Result",
    "Station",
    "Structure",
    "Weighted",
    "criterion_by_name",
    "methods_of",
    "solve",
    "station",
]
