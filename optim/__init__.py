"""Optimisation problems, and the methods that solve them.

`Problem` is the interface, and `solve` runs a method on it. `PostureProblem` chooses the UGV's leg
angles along a track by a criterion; `GaitProblem` is the best gait of the biped without slip,
`slip_transfer` a start or a stop with it. `suite` has fixed instances of both; `identify` finds
friction and load in the log of a walk. A method's module is imported when the method is first used.
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

GENERAL_METHODS: dict[str, str] = {
    "gradient": "nonlinear programming by scipy on exact derivatives",
    "cma": "evolution by the package cma, where it is installed",
}
"""Methods for all problems by name."""

if TYPE_CHECKING:
    from stickslip.optim.function_problem import FunctionProblem as FunctionProblem
    from stickslip.optim.gait.gait import Certificate as Certificate
    from stickslip.optim.gait.gait import Gait as Gait
    from stickslip.optim.gait.gait import GaitResult as GaitResult
    from stickslip.optim.gait.problem import GaitProblem as GaitProblem
    from stickslip.optim.gait.problem import best_transfer as best_transfer
    from stickslip.optim.gait.replay import Replay as Replay
    from stickslip.optim.gait.replay import replay as replay
    from stickslip.optim.gait.slip_transfer import SlipTransfer as SlipTransfer
    from stickslip.optim.gait.slip_transfer import slip_transfer as slip_transfer
    from stickslip.optim.identification import Identified as Identified
    from stickslip.optim.identification import WalkLog as WalkLog
    from stickslip.optim.identification import identify as identify
    from stickslip.optim.instances.instance import FAMILIES as FAMILIES
    from stickslip.optim.instances.instance import Instance as Instance
    from stickslip.optim.instances.instance import instance as instance
    from stickslip.optim.instances.instance import suite as suite
    from stickslip.optim.instances.objective import BudgetSpent as BudgetSpent
    from stickslip.optim.instances.objective import Objective as Objective
    from stickslip.optim.instances.objective import Record as Record
    from stickslip.optim.posture import METHODS as METHODS
    from stickslip.optim.posture.bounds.branch import DriveBound as DriveBound
    from stickslip.optim.posture.bounds.branch import bound_every_drive as bound_every_drive
    from stickslip.optim.posture.criteria import CRITERIA as CRITERIA
    from stickslip.optim.posture.criteria import Criterion as Criterion
    from stickslip.optim.posture.criteria import Station as Station
    from stickslip.optim.posture.criteria import criterion_by_name as criterion_by_name
    from stickslip.optim.posture.criteria import station as station
    from stickslip.optim.posture.evaluate import PostureResult as PostureResult
    from stickslip.optim.posture.problem import PostureProblem as PostureProblem
    from stickslip.optim.problem import Evaluation as Evaluation
    from stickslip.optim.problem import FreeProblem as FreeProblem
    from stickslip.optim.problem import Method as Method
    from stickslip.optim.problem import OptimStatus as OptimStatus
    from stickslip.optim.problem import Problem as Problem
    from stickslip.optim.problem import Result as Result
    from stickslip.optim.problem import Structure as Structure
    from stickslip.optim.problem import methods_of as methods_of
    from stickslip.optim.problem import solve as solve
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
