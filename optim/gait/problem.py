"""The best gait of the biped as a convex program in the squared crank rate (MODEL 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.checks import require_integer, require_kind, require_memory, shown
from stickslip.optim.gait.convex.goal import goal_of
from stickslip.optim.gait.convex.instance import Instance
from stickslip.optim.gait.convex.limits import TORQUE, UNITS, Limits
from stickslip.optim.gait.convex.units import lift_off_rate, swing_torque
from stickslip.optim.gait.grid import Grid
from stickslip.optim.gait.names import METHODS as IN_WORDS
from stickslip.optim.gait.places import friction_along
from stickslip.optim.gait.profile import profile_of, robot_of
from stickslip.optim.gait.result import GaitResult
from stickslip.optim.gait.slopes import Slopes
from stickslip.optim.options import require_scalar
from stickslip.optim.problem import FEASIBLE, Method, Problem, Structure
from stickslip.optim.result import Evaluation, OptimStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    import cvxpy as cp
    from jaxtyping import Float

    from stickslip.dynamics.numeric import Lists, Number
    from stickslip.dynamics.scene import Scene
    from stickslip.optim.gait.convex.goal import Goal
    from stickslip.optim.gait.gait import Gait

NODE = 20_000
"""Bytes that a node takes while a program is built and solved, about."""
LEAST_CELLS, MOST_STEPS = 8, 1000
CAP = 20.0
"""Crank rates up to this many times the lift-off rate are searched, where no limit is given."""
TORQUES = 30.0
"""Torques up to this many times the robot's own size, where none is given."""
POSITIVE, NOT_NEGATIVE = "None, or a finite number > 0", "a finite number >= 0"


@dataclass(frozen=True)
class GaitProblem(Problem[GaitResult]):
    """The best periodic step, or the best walk of n steps, of a foot that does not slip.

    Build it with `periodic` or `transfer`. params: the robot, its payload in params.payload.
    objective: a name of OBJECTIVES, or a mapping of names to weights. mu: static friction, None for
    a foot that never slips; one number, one for each step, or a Scene, whose patches give each
    foothold's. torque_limit [N m]; mean_rate: the mean crank rate, at least [rad/s]; None: any.
    min_normal: least normal force [N]. zmp: whether the zero-moment point stays inside the foot.
    max_rate: greatest crank rate [rad/s], by default 20 times the lift-off rate. copper_loss: for
    the objective "energy" [W/(N m)^2]. cells: of the grid in each step.

    start_rate, end_rate: crank rate at the beginning and at the end [rad/s], None: any.

    Decision vector [1 + n (cells + 1)]: b = crank rate^2 at the beginning [rad^2/s^2], then the
    crank acceleration at both ends of every cell of each step [rad/s^2], straight in between.
    Constraints hold at these nodes; what happens between them the result tells. Neglected: the
    other foot, slip, and torques that cannot change at once (the motor's inductance).
    """

    params: BipedParams
    objective_asked: str | Mapping[str, float] | Goal = "time"
    steps_taken: int = 1
    is_periodic: bool = True
    mu: Number | Lists | Scene | None = None
    torque_limit: float | None = None
    mean_rate: float | None = None
    min_normal: float = 0.0
    zmp: bool = False
    max_rate: float | None = None
    copper_loss: float = 0.5
    start_rate: float | None = None
    end_rate: float | None = None
    cells: int = 200
    goal: Goal = field(init=False)

    methods: ClassVar[Mapping[str, Method]] = {
        "conic": Method(IN_WORDS["conic"], "stickslip.optim.gait.convex.conic:solve_conic")
    }
    result_kind = GaitResult
    default_method = "conic"

    @classmethod
    def periodic(
        cls,
        params: BipedParams,
        objective: str | Mapping[str, float] = "time",
        *,
        mu: Number | Scene | None = None,
        torque_limit: float | None = None,
        mean_rate: float | None = None,
        min_normal: float = 0.0,
        zmp: bool = False,
        max_rate: float | None = None,
        copper_loss: float = 0.5,
        steps: int = 200,
    ) -> GaitProblem:
        """One step that ends as it begins. steps: cells of its grid; else see the class."""
        return cls(
            params, objective, 1, True, mu, torque_limit, mean_rate, min_normal, zmp, max_rate,
            copper_loss, cells=steps,
        )  # fmt: skip

    @classmethod
    def transfer(
        cls,
        params: BipedParams,
        steps_taken: int,
        objective: str | Mapping[str, float] = "time",
        *,
        start_rate: float | None = 0.0,
        end_rate: float | None = None,
        mu: Number | Lists | Scene | None = None,
        torque_limit: float | None = None,
        mean_rate: float | None = None,
        min_normal: float = 0.0,
        zmp: bool = False,
        max_rate: float | None = None,
        copper_loss: float = 0.5,
        steps: int = 200,
    ) -> GaitProblem:
        """A walk of `steps_taken` steps, from rest unless start_rate is given.

        end_rate: 0 for a stop, the crank rate at which a steady gait begins its step to go on with
        it, None for any. steps: cells of the grid in each step; else see the class.
        """
        return cls(
            params, objective, steps_taken, False, mu, torque_limit, mean_rate, min_normal, zmp,
            max_rate, copper_loss, start_rate, end_rate, steps,
        )  # fmt: skip

    def __post_init__(self):
        _check(self)
        robot = robot_of(self.params, self.steps_taken, self.is_periodic)
        mu = friction_along(self.mu, self.steps_taken, robot.step_length)
        goal = goal_of(self.objective_asked, float(self.copper_loss))
        if goal.is_friction and mu is not None:
            raise ValueError("mu with the objective 'friction', which looks for it; accepted: None")
        if goal.is_friction and self.mean_rate is None:
            raise ValueError(
                "mean_rate = None with the objective 'friction', which standing still would meet "
                "without any; accepted: a mean rate"
            )
        for name, value in (("goal", goal), ("_friction", mu), ("_robot", robot)):
            object.__setattr__(self, name, value)

    @cached_property
    def instance(self) -> Instance:
        """The problem in numbers."""
        from_rest, to_rest = self.start_rate == 0.0, self.end_rate == 0.0
        grid = Grid(self.steps_taken, self.cells, from_rest, to_rest)
        robot = self.__dict__["_robot"]
        profile = profile_of(self.params, robot, grid.theta)
        lift = lift_off_rate(profile)
        cap = CAP * lift if self.max_rate is None else float(self.max_rate)
        most = self.torque_limit
        motor = most is not None
        most = float(most) if most is not None else TORQUES * swing_torque(profile, lift)
        limits = Limits(
            self.__dict__["_friction"], most, float(self.min_normal), self.zmp, cap, lift, motor
        )
        longest = None
        if self.mean_rate is not None:
            longest = np.pi * self.steps_taken / float(self.mean_rate)
        first, last = (_squares(rate, cap) for rate in (self.start_rate, self.end_rate))
        return Instance(
            self.params, robot, grid, self.goal, limits, self.is_periodic, longest, first, last
        )

    @property
    def structure(self) -> frozenset[Structure]:
        """Convex, with slopes but at kinks of work and friction."""
        return frozenset({Structure.CONVEX, Structure.SMOOTH})

    @property
    def n(self) -> int:
        """Length of the decision vector."""
        return 1 + self.steps_taken * (self.cells + 1)

    @property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Bounds of b at the beginning, and of the accelerations by the greatest torque."""
        at, nodes = self.instance, self.instance.profiles[0]
        b = at.limits.cap**2
        needed = at.limits.torque + np.abs(nodes.fall) + np.abs(nodes.dM) / 2 * b
        most = np.ravel(needed / nodes.M)
        low, high = at.first
        return np.concatenate([[low], -most]), np.concatenate([[high], most])

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "n"]]]:
        """See Problem. ValueError for the objective "friction", which is no convex program."""
        if self.goal.is_friction:
            raise ValueError('objective = "friction" is no convex program; accepted: another')
        from stickslip.optim.gait.convex.program import Program, Solved

        at = self.instance
        program = Program(at.structure)
        problem = program.filled(at.numbers())

        def found() -> Float[np.ndarray, "n"]:
            gait = at.gait_of(Solved(OptimStatus.FEASIBLE, "", *program.read()))
            return np.concatenate([[gait.b[0, 0]], np.ravel(gait.a)])

        return problem, found

    def gait(self, x: Float[np.ndarray, "n"]) -> Gait:
        """The gait of a decision vector."""
        x = self.batch([x])[0]
        return self.instance.gait(x[1:].reshape(self.steps_taken, -1), float(x[0]))

    def evaluate(self, x: Float[np.ndarray, "n"]) -> Evaluation:
        """Value and constraints at the grid's nodes."""
        return self.looked_at(self.gait(x))

    @cached_property
    def _slopes(self) -> Slopes:
        return Slopes(self.instance)

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """See Problem; a subgradient where the torque changes its sign or friction its worst
        node, 0 where the crank stands still."""
        return self._slopes.gradient(self.batch([x])[0])

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """See Problem."""
        return self._slopes.jacobian(self.batch([x])[0])

    def looked_at(self, gait: Gait) -> Evaluation:
        """The same of a gait on the problem's grid."""
        at, b = self.instance, self.instance.units.b
        rows = at.rows[0]
        excess = rows.excess(gait.a, gait.b)
        spent = gait.on_grid
        value = gait.friction_at_nodes if self.goal.is_friction else self.goal.of(spent)
        margins: list[np.ndarray] = [np.ravel(-excess / rows.size[:, None, None])]
        residuals = {
            name: max(
                0.0, float(np.max(excess[[i for i, o in enumerate(rows.names) if o == name]]))
            )
            for name in dict.fromkeys(rows.names)
        }
        if at.longest is not None:
            margins.append(np.array([1 - spent["time"] / at.longest]))
            residuals["time"] = max(0.0, float(spent["time"]) - at.longest)
        end, (low, high) = float(gait.b[-1, -1]), at.last
        if self.is_periodic:
            low = high = float(gait.b[0, 0])
        margins.append(np.array([(end - low) / b, (high - end) / b]))
        residuals["end"] = max(0.0, low - end, end - high)
        flat = np.nan_to_num(np.concatenate(margins), nan=-1.0, posinf=1e9, neginf=-1e9)
        sound = bool(np.isfinite(value))
        feasible = sound and bool(np.all(flat >= -FEASIBLE))
        return Evaluation(float(value) if sound else np.inf, flat, feasible, residuals)


RESIDUAL_UNITS = UNITS | {"time": "s", "end": "rad^2/s^2"}
"""Units of GaitProblem.residuals."""


def _squares(rate: float | None, cap: float) -> tuple[float, float]:
    """Least and greatest b at an end with that crank rate, None: any up to the cap."""
    return (0.0, cap**2) if rate is None else (float(rate) ** 2, float(rate) ** 2)


def _check(p: GaitProblem) -> None:
    """ValueError for a field of a gait problem that will not do."""
    accepted = "a BipedParams of one robot (carry a payload in params.payload)"
    require_kind("params", p.params, BipedParams, accepted)
    require_integer("steps_taken", p.steps_taken, high=MOST_STEPS)
    require_integer("steps", p.cells, low=LEAST_CELLS, accepted="an integer >= 8, cells of a step")
    require_memory(f"steps = {shown(p.cells)}", "nodes", p.steps_taken * (p.cells + 1), NODE)
    require_kind("zmp", p.zmp, bool, "True or False")
    for name in (TORQUE + "_limit", "mean_rate", "max_rate"):
        given = getattr(p, name)
        if given is not None:
            require_scalar(name, given, low=0.0, strict=True, accepted=POSITIVE)
    for name in ("min_normal", "copper_loss"):
        require_scalar(name, getattr(p, name), low=0.0, accepted=NOT_NEGATIVE)
    for name in ("start_rate", "end_rate"):
        if getattr(p, name) is not None:
            require_scalar(name, getattr(p, name), low=0.0, accepted=f"None, or {NOT_NEGATIVE}")
