"""Sequential convex programming: convexify about a point, solve, repeat.

The objective is a convex outer function of smooth terms (a prox-linear problem): replacing terms
and margins by their linear models leaves a convex program, here a cvxpy one that is built once
with the values and slopes as parameters. Steps stay inside a box that shrinks where the model was
wrong and grows where it was right.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import cvxpy as cp
import numpy as np

from stickslip.dynamics.checks import require_choice, require_integer
from stickslip.optim.options import COUNT, require_scalar
from stickslip.optim.posture.finish import result_at
from stickslip.optim.posture.local.convex_model import ConvexModel
from stickslip.optim.posture.local.linearise import Linear, Near
from stickslip.optim.posture.local.starts import begin
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.sizes import CONVEX, require_waypoint_matrices
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus
from stickslip.optim.start import shortcomings

if TYPE_CHECKING:
    from stickslip.optim.posture.problem import PostureProblem

PENALTIES = (10.0, 1e3, 1e5)
"""Penalties of violated margins, in this order: of the objective's scale for a whole weight."""
MISSED = 1e-7
"""Largest scaled violation that needs no higher penalty."""
GOOD, BAD, TAKEN = 0.75, 0.25, 0.01
"""Parts of the predicted decrease: above GOOD the box grows, below BAD it shrinks, below TAKEN the
step is refused."""


class Step(NamedTuple):
    """One iteration. objective: after it. decrease: predicted and actual of the merit, the scaled
    objective and its penalty. radius: half the box [rad]."""

    objective: float
    predicted: float
    actual: float
    radius: float
    taken: bool


def solve_scp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    start: Any = "dp",
    angles: Any = None,
    iterations: int = 60,
    radius: float = 0.2,
    tolerance: float = 1e-7,
    smallest: float = 1e-7,
    solver: str = cp.CLARABEL,
) -> PostureResult:
    """A local optimum off the grid, from `start`: see start_point, to which angles goes too.

    iterations: of all prices together. radius: the first box [rad]. It stops where the model
    predicts a decrease below `tolerance`, relative to the merit, or where the box is below
    `smallest` [rad]. Margins are kept by an exact penalty with rising price; bounds and leg rates,
    which are linear, exactly. solver: a conic one of cvxpy's.

    Nothing is proved of the value: FEASIBLE, LIMIT after `iterations`, VIOLATED (the message names
    what is missed), INACCURATE where the solver failed to the end, FAILED without a pose to begin.
    evaluations: linearisations. details: history (Steps), radius, predicted (the last relative
    decrease that the model promised within the box: zero at a stationary point), solver_failures.
    """
    began = time.perf_counter()
    for name, value in (("radius", radius), ("tolerance", tolerance), ("smallest", smallest)):
        require_scalar(name, value, low=0.0, strict=True, accepted="a number > 0")
    iterations = require_integer("iterations", iterations, low=0, high=COUNT)
    require_choice("solver", solver, cp.installed_solvers())
    require_waypoint_matrices(problem, "scp", CONVEX)
    begun = begin(problem, "scp", start, angles, progress, began)
    if isinstance(begun, PostureResult):
        return begun
    near, x, note = begun
    search = _Search(near, ConvexModel(near, x, solver), x, tolerance, smallest)
    with Bar("scp", iterations, "step", progress) as bar:
        for penalty in PENALTIES:
            search.price(penalty, radius)
            while len(search.history) < iterations and not search.settled:
                search.step()
                bar.advance(note=f"{near.value(near(search.x)):.6g}")
            if search.missed() <= MISSED:
                break
    status, why = search.ended()
    return result_at(
        problem,
        search.x,
        method="scp",
        began=began,
        status=status,
        evaluations=near.evaluations,
        message=f"{note}{why} after {len(search.history)} steps, the model promising a relative "
        f"decrease of {search.predicted:.3g}{shortcomings(problem, search.x)}",
        details={
            "history": tuple(search.history),
            "radius": search.radius,
            "predicted": search.predicted,
            "solver_failures": search.failures,
        },
    )


class _Search:
    """A point, a box about it, and the history of both; tolerance, smallest: see solve_scp."""

    def __init__(
        self, near: Near, program: ConvexModel, x: np.ndarray, tolerance: float, smallest: float
    ):
        self.near, self.program, self.x = near, program, x
        self.tolerance, self.smallest = tolerance, smallest
        self.penalty = self.radius = 0.0
        self.predicted, self.failures, self.failed = np.inf, 0, False
        self.history: list[Step] = []

    def price(self, penalty: float, radius: float) -> None:
        """Restart from here with this penalty of violated margins and this box [rad]."""
        self.penalty, self.radius, self.predicted = penalty, radius, np.inf
        self.failed = False

    @property
    def settled(self) -> bool:
        """True if nothing more is to be gained at this price."""
        return self.predicted <= self.tolerance or self.radius < self.smallest

    def ended(self) -> tuple[OptimStatus, str]:
        """Outcome of the search, with a message."""
        if not self.settled:
            return OptimStatus.LIMIT, "stopped"
        if self.predicted <= self.tolerance:
            return OptimStatus.FEASIBLE, "stationary"
        status = OptimStatus.INACCURATE if self.failed else OptimStatus.FEASIBLE
        return status, "no step in the smallest box helped"

    def missed(self) -> float:
        """The largest scaled violation."""
        return max(0.0, *(float(-np.min(of)) for of in self.near(self.x).margins.values()))

    def merit(self, at: Linear) -> float:
        """Scaled objective and penalty; infinite where the vehicle has no pose."""
        short = sum(float(np.sum(np.maximum(-of, 0))) for of in at.margins.values())
        return self.near.value(at) / self.program.scale + self.penalty * short

    def step(self) -> None:
        """Solve the model, take or refuse its step, and adapt the box."""
        at = self.near(self.x)
        solution = self.program.solve(self.x, at, self.radius, self.penalty)
        self.failed = solution is None
        if solution is None:
            self.failures += 1
            self.radius /= 4
            self.history.append(Step(self.near.value(at), np.nan, 0.0, self.radius, False))
            return
        step, promised = solution
        low, high = self.near.problem.bounds
        tried = np.clip(self.x + step, low, high)
        before, after = self.merit(at), self.merit(self.near(tried))
        predicted = max(before - promised, 0.0)
        self.predicted = predicted / max(before, 1.0)
        share = (before - after) / max(predicted, 1e-300)
        taken = share > TAKEN
        if taken:
            self.x = tried
        if share < BAD:
            self.radius = min(self.radius, float(np.max(np.abs(step)))) / 3
        elif share > GOOD:
            self.radius *= 2
        value = self.near.value(self.near(self.x))
        self.history.append(Step(value, predicted, before - after, self.radius, taken))
