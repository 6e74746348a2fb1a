"""Optimisation problems apart from the methods that solve them.

The UGV's: which leg angles to drive over a track with (`PostureProblem`), by which of several
criteria, and methods that solve it or prove how good a solution can be (`solve`). Nothing here
imports a solver: each method's module is imported when that method is asked for.
"""

from stickslip.optim.criteria import CRITERIA, Criterion, Weighted, criterion_by_name
from stickslip.optim.free_view import FreeProblem
from stickslip.optim.problem import PostureProblem
from stickslip.optim.result import OptimStatus, Result
from stickslip.optim.solve import METHODS, solve
from stickslip.optim.station import Station, station

__all__ = [
    "CRITERIA",
    "METHODS",
    "Criterion",
    "FreeProblem",
    "OptimStatus",
    "PostureProblem",
    "Result",
    "Station",
    "Weighted",
    "criterion_by_name",
    "solve",
    "station",
]
