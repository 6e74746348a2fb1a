"""Optimisation problems apart from the methods that solve them.

The UGV's: which leg angles to drive over a track with (`PostureProblem`), by which of several
criteria, and methods that solve it or prove how good a solution can be (`solve`). Nothing here
imports a solver: each method's module is imported when that method is asked for.
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.optim.criteria import CRITERIA, Criterion, Weighted, criterion_by_name
    from stickslip.optim.free_view import FreeProblem
    from stickslip.optim.names import METHODS
    from stickslip.optim.problem import PostureProblem
    from stickslip.optim.result import OptimStatus, Result
    from stickslip.optim.solve import solve
    from stickslip.optim.station import Station, station
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "criteria": ("CRITERIA", "Criterion", "Weighted", "criterion_by_name"),
            "free_view": ("FreeProblem",),
            "names": ("METHODS",),
            "problem": ("PostureProblem",),
            "result": ("OptimStatus", "Result"),
            "solve": ("solve",),
            "station": ("Station", "station"),
        },
    )

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
