"""Optimisation problems, and the methods that solve them.

`Problem` is the interface, and `solve` runs a method on it. `PostureProblem` chooses the UGV's leg
angles along a track by a criterion; `GaitProblem` is the best gait of the biped without slip.
`suite` has fixed instances of both. A method's module is imported when the method is first used.
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

GENERAL_METHODS: dict[str, str] = {
    "gradient": "nonlinear programming by scipy on exact derivatives",
    "cma": "evolution by the package cma, where it is installed",
}
"""Methods for all problems by name."""

if TYPE_CHECKING:
    from stickslip.optim.function_problem import FunctionProblem
    from stickslip.optim.gait.gait import Certificate, Gait, GaitResult
    from stickslip.optim.gait.problem import GaitProblem, best_transfer
    from stickslip.optim.gait.replay import Replay, replay
    from stickslip.optim.instances.instance import FAMILIES, Instance, instance, suite
    from stickslip.optim.instances.objective import BudgetSpent, Objective, Record
    from stickslip.optim.posture import METHODS
    from stickslip.optim.posture.bounds.branch import DriveBound, bound_every_drive
    from stickslip.optim.posture.criteria import (
        CRITERIA,
        Criterion,
        Station,
        criterion_by_name,
        station,
    )
    from stickslip.optim.posture.evaluate import PostureResult
    from stickslip.optim.posture.problem import PostureProblem
    from stickslip.optim.problem import (
        Evaluation,
        FreeProblem,
        Method,
        OptimStatus,
        Problem,
        Result,
        Structure,
        methods_of,
        solve,
    )
else:
    __getattr__, __dir__ = loaded_when_used(__name__)

__all__ = [
    "CRITERIA",
    "FAMILIES",
    "METHODS",
    "BudgetSpent",
    "Certificate",
    "Criterion",
    "DriveBound",
    "Evaluation",
    "FreeProblem",
    "FunctionProblem",
    "Gait",
    "GaitProblem",
    "GaitResult",
    "Instance",
    "Method",
    "Objective",
    "OptimStatus",
    "PostureProblem",
    "PostureResult",
    "Problem",
    "Record",
    "Replay",
    "Result",
    "Station",
    "Structure",
    "best_transfer",
    "bound_every_drive",
    "criterion_by_name",
    "instance",
    "methods_of",
    "replay",
    "solve",
    "station",
    "suite",
]
