"""The best gait of the biped as a convex program in the squared crank rate (MODEL 3)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.checks import require_integer, require_kind, require_memory, shown
from stickslip.dynamics.pytrees import Lists, Number, read_only, settle
from stickslip.optim.gait import METHODS
from stickslip.optim.gait.convex.grid_problem import UNITS, GridProblem, Program, finite_margins
from stickslip.optim.gait.gait import Gait, GaitResult, Goal, goal_of
from stickslip.optim.gait.profile import LEAST_END, ROBOT, Grid, Profiles, mark_of, robot_of
from stickslip.optim.problem import (
    FEASIBLE,
    Evaluation,
    Method,
    Problem,
    Structure,
    as_floats,
    require_scalar,
    solve,
)

if TYPE_CHECKING:
    import cvxpy as cp
    from jaxtyping import Float

    from stickslip.optim.problem import Batch, Vector

ACCEPTED = "None, a number >= 0, or one for each step"
NODE = 20_000
"""Bytes that a node takes while a program is built and solved, about."""
MEMBER = 500
"""Bytes that each number of a gait takes in a batch, about."""
LEAST_CELLS, MOST_STEPS = 8, 1000
CAP = 20.0
"""Crank rates up to this many times the lift-off rate are searched, where no limit is given."""
TORQUES = 30.0
"""Torques up to this many times the robot's own size, where none is given."""
NOT_CONVEX = ("max_power", "max_torque_rate")
POSITIVE, NOT_NEGATIVE = "None, or a finite number > 0", "a finite number >= 0"


@dataclass(frozen=True)
class GaitProblem(Problem[GaitResult]):
    """The best periodic step, or the best walk of n steps, of a foot that does not slip.

    Build it with `periodic` or `transfer`. params: the robot, its payload in params.payload.
    objective: a name of OBJECTIVES, or a mapping of names to weights. mu: static friction, None for
    a foot that never slips; one number, or one for each step. torque_limit [N m]; mean_rate: the
    mean crank rate, at least [rad/s]; None: any. min_normal: least normal force [N]. zmp: whether
    the zero-moment point stays inside the foot. max_rate: greatest crank rate [rad/s], by default
    20 times the lift-off rate. copper_loss: for the objective "energy" [W/(N m)^2]. cells: of the
    grid in each step. efficiency: of what drives the crank, for that objective; braking gives
    nothing back. max_power: greatest |torque x crank rate| of the motor [W]. max_torque_rate:
    greatest |dT/dt| [N m/s], in the mean over each cell at the mean of its ends' rates, of `held`,
    too. With it the torque, which else jumps there, is continuous over exchanges of support; at the
    walk's ends it is free: a motor at rest may hold one. These two limits are not convex: where one
    binds, the gait is a local optimum (FEASIBLE), and bounds are without them.

    start_rate, end_rate: crank rate at the beginning and at the end [rad/s], None: any. end_phase:
    crank angle past the last step's beginning where the walk ends, on one foot [rad]; None: pi.

    Decision vector [1 + n (cells + 1)]: b = crank rate^2 at the beginning [rad^2/s^2], then the
    crank acceleration at both ends of every cell of each step [rad/s^2], straight in between.
    Constraints hold at these nodes; what happens between them the result tells. Neglected: the
    other foot, slip, and torques that cannot change at once (the motor's inductance).
    """

    params: BipedParams
    objective_asked: str | Mapping[str, float] = "time"
    steps_taken: int = 1
    is_periodic: bool = True
    mu: Number | Lists | None = None
    torque_limit: float | None = None
    mean_rate: float | None = None
    min_normal: float = 0.0
    zmp: bool = False
    max_rate: float | None = None
    copper_loss: float = 0.5
    start_rate: float | None = None
    end_rate: float | None = None
    cells: int = 200
    max_power: float | None = None
    efficiency: float = 1.0
    max_torque_rate: float | None = None
    end_phase: float | None = None
    goal: Goal = field(init=False)

    methods: ClassVar[Mapping[str, Method]] = {
        "conic": Method(METHODS["conic"], "stickslip.optim.gait.convex.conic:solve_conic")
    }
    result_kind = GaitResult
    default_method = "conic"

    @classmethod
    def periodic(
        cls,
        params: BipedParams,
        objective: str | Mapping[str, float] = "time",
        *,
        steps: int = 200,
        **limits: Any,
    ) -> GaitProblem:
        """One step that ends as it begins. steps: the class's cells, where they are not given by
        that name. limits: its other fields, by name, but those of the walk's ends."""
        limits.setdefault("cells", steps)
        return cls(params, objective, **limits)

    @classmethod
    def transfer(
        cls,
        params: BipedParams,
        steps_taken: int | None,
        objective: str | Mapping[str, float] = "time",
        *,
        start_rate: float | None = 0.0,
        end_rate: float | None = None,
        steps: int = 200,
        distance: float | None = None,
        **limits: Any,
    ) -> GaitProblem:
        """A walk of `steps_taken` steps, from rest unless start_rate is given; None: one that ends
        when the centre of mass is `distance` [m] ahead of its start, in whatever step.

        end_rate: 0 for a stop, the crank rate at which a steady gait begins its step to go on with
        it, None for any. steps, limits: as of `periodic`.
        """
        ends = {"start_rate": start_rate, "end_rate": end_rate}
        if steps_taken is None:
            steps_taken, ends["end_phase"] = mark_of(params, distance)
        elif distance is not None:
            given = f"steps_taken = {shown(steps_taken)} (--steps) and distance (mark)"
            raise ValueError(f"{given}; accepted: one of them")
        limits.setdefault("cells", steps)
        return cls(params, objective, steps_taken, False, **ends, **limits)

    def __post_init__(self):
        _check(self)
        robot = robot_of(self.params, self.steps_taken, self.is_periodic)
        mu = friction_along(self.mu, self.steps_taken)
        goal = goal_of(self.objective_asked, float(self.copper_loss), float(self.efficiency))
        if goal.is_friction and mu is not None:
            raise ValueError("mu with the objective 'friction', which looks for it; accepted: None")
        if goal.is_friction and self.mean_rate is None:
            raise ValueError(
                "mean_rate = None with the objective 'friction', which standing still would meet "
                "without any; accepted: a mean rate"
            )
        settle(self, goal=goal, _friction=mu, _robot=robot)

    @cached_property
    def on_grid(self) -> GridProblem:
        from_rest, to_rest = self.start_rate == 0.0, self.end_rate == 0.0
        grid = Grid(self.steps_taken, self.cells, from_rest, to_rest, self.end_phase)
        profiles = Profiles(self.params, self.__dict__["_robot"], grid)
        cap, most, asked = self.max_rate, self.torque_limit, self.mean_rate
        lift_off = profiles.nodes.lift_off_rate
        cap = CAP * lift_off if cap is None else float(cap)
        # It carries the robot and swings it at that rate.
        swing = profiles.nodes.torque_unit + float(np.max(profiles.nodes.M)) * lift_off**2
        return GridProblem(
            profiles,
            self.goal,
            mu=self.__dict__["_friction"],
            torque=TORQUES * swing if most is None else float(most),
            motor=most is not None,
            min_normal=float(self.min_normal),
            zmp=self.zmp,
            cap=cap,
            periodic=self.is_periodic,
            longest=None if asked is None else grid.turn / float(asked),
            first=_squares(self.start_rate, cap),
            last=_squares(self.end_rate, cap),
            power=None if self.max_power is None else float(self.max_power),
            torque_rate=None if self.max_torque_rate is None else float(self.max_torque_rate),
        )

    @property
    def structure(self) -> frozenset[Structure]:
        """Convex without NOT_CONVEX, with slopes but at kinks of work and friction."""
        bent = any(getattr(self, name) is not None for name in NOT_CONVEX)
        return frozenset({Structure.SMOOTH} if bent else {Structure.SMOOTH, Structure.CONVEX})

    @property
    def n(self) -> int:
        return 1 + self.steps_taken * (self.cells + 1)

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:  # type: ignore[override]
        """Bounds of b at the beginning, and of the accelerations by the greatest torque."""
        at, nodes = self.on_grid, self.on_grid.profiles.nodes
        b = at.cap**2
        needed = at.torque + np.abs(nodes.fall) + np.abs(nodes.dM) / 2 * b
        most = np.ravel(needed / nodes.M)
        low, high = at.first
        return read_only(np.concatenate([[low], -most])), read_only(np.concatenate([[high], most]))

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "n"]]]:
        """See Problem. ValueError for what is no convex program: "friction", and NOT_CONVEX."""
        for name in NOT_CONVEX:
            if getattr(self, name) is not None:
                raise ValueError(f"{name} is not a convex limit; accepted: None")
        return in_cvxpy(self.on_grid)

    def gait(self, x: Vector) -> Gait:
        """The gait of a point."""
        point = self.point(x)
        return self.on_grid.gait(point[1:].reshape(self.steps_taken, -1), float(point[0]))

    def evaluate(self, x: Vector) -> Evaluation:
        """Value and constraints at the grid's nodes."""
        return self.evaluate_gait(self.gait(x))

    def value_and_margins(self, x: Vector) -> tuple[float, Float[np.ndarray, "m"]]:
        value, margins = self.on_grid.of_point["both"](self.point(x))
        return float(value), margins

    def evaluate_all(self, X: Batch) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B m"]]:
        """See Problem; compiled once for each power of two that B rounds up to."""
        count, (rows,) = self.filled(X, each=MEMBER * self.n)
        values, margins = self.on_grid.of_point["all"](rows)
        return values[:count], margins[:count]

    def gradient(self, x: Vector) -> Float[np.ndarray, "n"]:
        """See Problem; a subgradient where the torque changes its sign or friction its worst
        node, 0 where the crank stands still."""
        return _finite(self.on_grid.of_point["gradient"](self.point(x)))

    def jacobian(self, x: Vector) -> Float[np.ndarray, "m n"]:
        return _finite(self.on_grid.of_point["jacobian"](self.point(x)))

    def evaluate_gait(self, gait: Gait) -> Evaluation:
        """Value and constraints of a gait on the problem's grid."""
        at, spent = self.on_grid, gait.spent_on_grid
        value = gait.friction_at_nodes if self.goal.is_friction else self.goal.of(spent)
        margins = finite_margins(at.margins(gait.a, gait.b, np.asarray(spent["time"])))
        excess = np.max(at.rows.excess(gait.a, gait.b), axis=(1, 2))
        residuals: dict[str, float] = {}
        for name, worst in zip(at.rows.names, excess, strict=True):
            residuals[name] = max(residuals.get(name, 0.0), float(worst))
        if at.longest is not None:
            residuals["time"] = max(0.0, spent["time"] - at.longest)
        end, start = float(gait.b[-1, -1]), float(gait.b[0, 0])
        low, high = (start, start) if self.is_periodic else at.last
        residuals["end"] = max(0.0, low - end, end - high)
        sound = bool(np.isfinite(value))
        feasible = sound and bool(np.all(margins >= -FEASIBLE))
        for name, (use, most) in at.motor_uses(gait.a, gait.b).items():
            residuals[name] = max(0.0, float(np.max(np.abs(use), initial=0.0)) - most)
        return Evaluation(float(value) if sound else np.inf, margins, feasible, residuals)


def in_cvxpy(at: GridProblem) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "n"]]]:
    """The program, and a function that reads its point. ValueError for "friction"."""
    if at.goal.is_friction:
        raise ValueError('objective = "friction" is no convex program; accepted: another')
    program = Program(at, at.numbers())

    def found() -> Float[np.ndarray, "n"]:
        gait = at.gait_of(*program.read())
        return np.concatenate([[gait.b[0, 0]], np.ravel(gait.a)])

    return program.problem, found


def friction_along(mu: Number | Lists | None, steps: int) -> Float[np.ndarray, "n"] | None:
    """Static friction of each step [n], None where the foot never slips."""
    if mu is None:
        return None
    found = as_floats("mu", mu, ACCEPTED)
    if found.shape not in ((), (steps,)):
        raise ValueError(f"mu has shape {found.shape}; accepted: one number, or ({steps},)")
    if np.any(found < 0):
        raise ValueError(f"mu = {float(np.min(found))!r} is not accepted; accepted: {ACCEPTED}")
    return read_only(np.broadcast_to(found, (steps,)).astype(float))


def best_transfer(
    problem: GaitProblem, most_steps: int, run: Callable[..., Any] = solve, **options: Any
) -> tuple[GaitProblem, Any]:
    """The problem of the least value, of those of problem.steps_taken to `most_steps` steps that
    differ in nothing else, and its result; where none is feasible the last. run: `solve` or
    `slip_transfer`; options: of it."""
    require_integer("most_steps", most_steps, low=problem.steps_taken, high=MOST_STEPS)
    walks = [replace(problem, steps_taken=n) for n in range(problem.steps_taken, most_steps + 1)]
    found = [(walk, run(walk, **options)) for walk in walks]
    feasible = [pair for pair in found if pair[1].feasible]
    return min(feasible or found[-1:], key=lambda pair: pair[1].value)


RESIDUAL_UNITS = UNITS | {"time": "s", "end": "rad^2/s^2"}
"""Units of GaitProblem.residuals."""


def _finite(slopes: np.ndarray) -> np.ndarray:
    return np.nan_to_num(slopes, posinf=0.0, neginf=0.0)


def _squares(rate: float | None, cap: float) -> tuple[float, float]:
    """Least and greatest b at an end with that crank rate, None: any up to the cap."""
    return (0.0, cap**2) if rate is None else (float(rate) ** 2, float(rate) ** 2)


def _check(p: GaitProblem) -> None:
    """ValueError for a field of a gait problem that will not do."""
    require_kind("params", p.params, BipedParams, ROBOT)
    require_integer("steps_taken", p.steps_taken, high=MOST_STEPS)
    require_integer("steps", p.cells, low=LEAST_CELLS, accepted="an integer >= 8, cells of a step")
    require_memory(f"steps = {shown(p.cells)}", "nodes", p.steps_taken * (p.cells + 1), NODE)
    require_kind("zmp", p.zmp, bool, "True or False")
    for name in ("torque_limit", "mean_rate", "max_rate", *NOT_CONVEX):
        given = getattr(p, name)
        if given is not None:
            require_scalar(name, given, low=0.0, strict=True, accepted=POSITIVE)
    if p.end_phase is not None:
        high, accepted = 0.0 if p.is_periodic else np.pi, f"{LEAST_END} to pi, of a transfer"
        require_scalar("end_phase", p.end_phase, low=LEAST_END, high=high, accepted=accepted)
    for name in ("start_rate", "end_rate"):
        if p.is_periodic and getattr(p, name) is not None:
            raise ValueError(f"{name} of a periodic step; accepted: None, or a transfer")
    how: dict[str, Any] = {"low": 0.0, "high": 1.0, "strict": True, "accepted": "above 0, up to 1"}
    require_scalar("efficiency", p.efficiency, **how)
    for name in ("min_normal", "copper_loss", "start_rate", "end_rate"):
        if getattr(p, name) is not None or not name.endswith("_rate"):
            high = np.inf if p.max_rate is None or not name.endswith("_rate") else p.max_rate
            accepted = NOT_NEGATIVE if high == np.inf else f"from 0 to max_rate = {high:g}"
            require_scalar(name, getattr(p, name), low=0.0, high=high, accepted=accepted)
