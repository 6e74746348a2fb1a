"""The UGV's posture problem: which leg angles to drive over a track with, as plain arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.checks import require_integer, require_known, require_memory
from stickslip.dynamics.pytrees import bound_program, read_only, refuse_after_fork, settle
from stickslip.dynamics.ugv import Odometer, Track, UGVParams
from stickslip.optim.posture import METHODS as IN_WORDS
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import Criterion, Station, criterion_by_name
from stickslip.optim.posture.waypoints import (
    STATION,
    PostureData,
    check_problem,
    longest_wheelbase,
    waypoints_along,
)
from stickslip.optim.problem import Evaluation, Method, Problem, Structure, padded, solve

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.problem import Batch, Vector


FACTOR = 10
"""Refinement factor of a drive."""
LEAST_PAD, MOST = 1024, 2**17
"""Stations are padded to powers of two, to compile few sizes; beyond MOST, refined by less."""

_MODULES = {"grid": "grid", "dp": "grid", "branch": "bounds.branch", "scp": "scp"}
METHODS = {
    name: Method(IN_WORDS[name], f"stickslip.optim.posture.{module}:solve_{name}")
    for name, module in _MODULES.items()
}


@dataclass(frozen=True)
class PostureProblem(PostureData, Problem[evaluate.PostureResult]):
    """Leg angles at each waypoint that are best by a criterion, under constraints.

    params, track: the vehicle and the ground. x: where the front wheel is at each waypoint [K]
    [m], increasing, two or more. criterion: a name of CRITERIA, or a Criterion.
    friction: mu [-], a number or one for each waypoint, times the factor of the track's surface
    under each wheel where it has one. leg_rate: how far each leg may turn for
    each metre that the front wheel goes [rad/m]; None: any move. min_normal: least normal force of
    each wheel [N]. min_grip: least mu N - |F| of each wheel [N]. min_clearance: of body and legs
    above the ground [m]. max_torque: of each wheel's motor, either way [N m]; None: any.
    start_angles, end_angles: the first and the last pair where they are given, rear and front
    [rad]. solver: how poses are found. free_split: a motor at each wheel, and at each station the
    `difference` of `safe_split` with min_grip and max_torque in place of the same torque at both.

    The wheels keep params.wheel_gap between them, at the waypoints and, where leg_rate is given and
    apart_between, between them, too; PoseSolver(overlap=True) lets them overlap, as in the chapter.

    The decision vector is flat, float64 [2K]: the pair of each waypoint in turn. Everything is
    computed in float64, whatever jax_enable_x64 says, and returned as NumPy arrays or floats. The
    legs' range and the given ends are `bounds`; all else is in `constraints`, satisfied where
    >= 0. Neglected: dynamics; forces and poses between waypoints; leg torques have no limit.
    """

    def __post_init__(self):
        settle(self, criterion=criterion_by_name(self.criterion))
        settle(self, **check_problem(self))

    @classmethod
    def along(
        cls,
        track: Track,
        criterion: str | Criterion = "wheel_energy",
        params: UGVParams | None = None,
        spacing: float = 0.1,
        start: float | None = None,
        end: float | None = None,
        **options: Any,
    ) -> PostureProblem:
        """Waypoints along a track, evenly spaced by at most `spacing` [m].

        start, end: the front wheel's first and last place [m]; by default the first one is so far
        in that the rear wheel stays on the track in every posture, and the last one is the track's
        end. track: a Track, or one of TRACKS by its name. options: the other fields. ValueError for
        a track that is too short.
        """
        known = {one.name for one in fields(cls)} - {"params", "track", "x", "criterion"}
        require_known(options, sorted(known))
        params = UGVParams() if params is None else params
        x = waypoints_along(track, params, spacing, start, end)
        return cls(params, track, x, criterion, **options)

    methods = METHODS
    result_kind = evaluate.PostureResult
    default_method = "dp"

    @property
    def structure(self) -> frozenset[Structure]:
        """Stations are smooth functions of their own pairs."""
        return frozenset({Structure.SMOOTH})

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:  # type: ignore[override]
        """Least and greatest angles [rad]; the same where an end is given."""
        low = np.full(self.n, self.params.leg_angle_min, dtype=float)
        high = np.full(self.n, self.params.leg_angle_max, dtype=float)
        if self.start_angles is not None:
            low[:2] = high[:2] = self.start_angles
        if self.end_angles is not None:
            low[-2:] = high[-2:] = self.end_angles
        return read_only(low), read_only(high)

    @cached_property
    def posture(self) -> evaluate.Posture:
        """The same problem as a pytree of float64 numbers, for functions that are traced."""
        refuse_after_fork()
        first = float(self.x[0]) - longest_wheelbase(self.params)
        first -= 2 * float(self.params.wheel_radius)
        with jax.enable_x64(True):
            odometer = Odometer.along(jax.tree.map(_number, self.track), first, float(self.x[-1]))
            numbers: dict[str, Any] = {
                "x": self.x,
                "friction": np.broadcast_to(self.friction, self.x.shape),
                "params": self.params,
                "odometer": odometer,
                "criterion": self.criterion.of(self.params),
            }
            numbers |= {name: getattr(self, name) for name in evaluate.LIMITS}
            if self.free_split:
                numbers["split"] = self.min_grip or None, self.max_torque
            return evaluate.Posture(**jax.tree.map(_number, numbers), solver=self.solver)

    @property
    def waypoints(self) -> evaluate.Waypoints:
        """Shared data of a drive's stations, on the device."""
        return self._waypoints_of(1)

    @cached_property
    def _waypoints_of(self) -> Callable[[int], evaluate.Waypoints]:
        """`waypoints` of so many drives, one after the other."""
        at = (self.posture.x, self.posture.friction)
        return cache(lambda drives: evaluate.Waypoints.of(self.posture, *np.tile(at, drives)))

    @cached_property
    def limits(self) -> evaluate.Posture:
        """Limits of stations and angles on the device, one program for all grounds and criteria."""
        bare = replace(self.posture, odometer=None, friction=None, criterion=None)
        with jax.enable_x64(True):
            return jax.device_put(bare)

    @cached_property
    def _of_rows(self) -> tuple[Callable[..., jax.Array], Callable[..., jax.Array]]:
        """`evaluate.value_and_margins` of `Station.rows` and angles: of a drive, of a batch."""
        both = (evaluate.value_and_margins, evaluate.value_and_margins_all)
        one, all_ = (bound_program(of, self.limits, self.posture.criterion) for of in both)
        return one, all_

    def evaluate(self, x: Vector) -> Evaluation:
        """See Problem: the stations are computed once."""
        angles = self.angles(x)
        rows = self.waypoints.padded_rows(angles)
        value, margins = self._value_and_margins(rows, angles)
        feasible = bool(self.meets(angles.reshape(-1), margins))
        stations = Station.of_rows(np.asarray(rows)[:, : len(angles)])
        found = evaluate.violations(self, angles, stations)
        return Evaluation(value, margins, feasible, found)

    def value_and_margins(self, x: Vector) -> tuple[float, Float[np.ndarray, "m"]]:
        waypoints, angles = self.waypoints, self.angles(x)  # a fork is refused before the point
        return self._value_and_margins(waypoints.padded_rows(angles), angles)

    def _value_and_margins(self, rows: Any, angles: np.ndarray) -> tuple[float, np.ndarray]:
        found = np.array(self._of_rows[0](rows, angles))
        return float(found[0]), found[1:]

    def evaluate_all(self, X: Batch) -> tuple[Float[np.ndarray, "B"], Float[np.ndarray, "B m"]]:
        """See Problem; compiled once for each power of two that B rounds up to."""
        count, (rows,) = self.filled(X, each=len(self.x) * STATION)
        angles = rows.reshape(-1, len(self.x), 2)
        if count == 0:
            most = max(of.stop for of in self.constraint_groups.values())
            return np.zeros(0), np.zeros((0, most))
        drives, shape = evaluate.together(len(angles), len(self.x)), angles.shape[:2]
        waypoints = self._waypoints_of(drives)
        begins = range(0, len(angles), drives)
        parts = [waypoints.rows(angles[i : i + drives].reshape(-1, 2)) for i in begins]
        rows = np.concatenate(parts, axis=-1)[:, : angles[..., 0].size]
        found = np.array(self._of_rows[1](rows.reshape(-1, *shape), angles))
        return found[:count, 0], found[:count, 1:]

    def gradient(self, x: Vector) -> Float[np.ndarray, "n"]:
        """Its slope [unit/rad]; a subgradient at kinks, 0 at stations that are not finite."""
        both = self.waypoints.sloped(self.angles(x))
        return np.array(evaluate.gradient(self.posture.criterion, *both)).reshape(-1)

    def jacobian(self, x: Vector) -> Float[np.ndarray, "m n"]:
        """Slopes of `constraints` [1/rad]; those of a station's depend on its own pair alone."""
        K, groups = len(self.x), self.constraint_groups
        require_memory(f"a jacobian of {self.n} angles", "rows", 13.0 * K, 8.0 * self.n)
        both = self.waypoints.sloped(self.angles(x))
        found = np.zeros((max(of.stop for of in groups.values()), self.n))
        for name, slope in evaluate.margins_and_slopes(self.limits, *both)[1].items():
            block = found[groups[name]].reshape(K, slope.shape[1], K, 2)
            block[np.arange(K), :, np.arange(K)] = slope
        if self.leg_rate is not None:
            share = np.diff(np.eye(K), axis=0) / self.longest_moves[:, None]
            of_legs = np.kron(share, np.eye(2)).reshape(K - 1, 2, self.n)
            found[groups["leg_rate"]] = np.hstack([-of_legs, of_legs]).reshape(-1, self.n)
        return found

    @cached_property
    def constraint_groups(self) -> dict[str, slice]:
        """Slice of each group in `constraints`."""
        K, end = len(self.x), 0
        sizes = {"grip": 4 * K, "normal": 2 * K}
        sizes |= {"clearance": K} if self.solver.samples else {}
        sizes |= {} if self.solver.overlap else {"wheels": K}
        sizes |= {} if self.max_torque is None else {"torque": (2 + 2 * self.free_split) * K}
        sizes |= {"pose": K} | ({} if self.leg_rate is None else {"leg_rate": 4 * (K - 1)})
        return {name: slice(end, end := end + size) for name, size in sizes.items()}

    def residuals(self, x: Vector) -> dict[str, float]:
        """Largest violation of each constraint, 0 where it is met, in its own unit.

        leg_range, start_angles, end_angles [rad], leg_rate [rad/m], grip and normal [N], clearance
        and wheels [m], torque [N m], pose: how many waypoints have no pose. Infinite where
        numbers are not finite.
        """
        return evaluate.violations(self, self.angles(x), self.stations(x))

    def stations(self, x: Vector) -> Station:
        """The stations of a drive, as NumPy arrays [K]."""
        return Station.of_rows(self.waypoints.rows(self.angles(x)))

    def result(self, x: Vector, **others: Any) -> evaluate.PostureResult:
        """See Problem.result: the drive is evaluated between its waypoints, too."""
        x = np.array(x, dtype=float).reshape(-1)
        return super().result(x, **evaluate_finer(self, x), **others)

    def start_point(self, start: Any, progress: bool) -> tuple[Float[np.ndarray, "n"], str]:
        """See Problem; None: dp's path, or the middle where there is none."""
        x, note = super().start_point(start, progress)
        if start is not None:
            return x, note
        found = solve(self, "dp", polish=False, progress=progress)
        if found.x is None:
            return x, f"began in the middle, since dp found nothing ({found.message}); "
        return np.clip(found.x, *self.bounds), ""

    def angles(self, x: Vector) -> Float[np.ndarray, "K 2"]:
        """The decision vector as pairs; see `point`."""
        return self.point(x).reshape(-1, 2)


def _number(value: Any) -> Any:
    """A leaf in double precision."""
    return read_only(np.asarray(value, dtype=np.float64))


def finer(problem: PostureProblem, factor: int = FACTOR) -> PostureProblem:
    """The problem with `factor` steps in place of each; friction runs straight between waypoints.

    Its constraints hold at more places, so it is another problem, with an optimum of its own.
    """
    factor = require_integer("factor", factor)
    x = _between(problem.x, factor)
    friction = problem.friction
    if np.ndim(friction):
        friction = _between(np.asarray(friction, float), factor)
    return replace(problem, x=x, friction=friction)


def refined(
    problem: PostureProblem, x: Float[np.ndarray, "n"], factor: int
) -> tuple[PostureProblem, np.ndarray]:
    """The problem `factor` times finer, and the drive in it: legs turn evenly between waypoints."""
    return finer(problem, factor), _between(problem.angles(x), factor).reshape(-1)


def evaluate_finer(problem: PostureProblem, x: Float[np.ndarray, "n"]) -> dict[str, Any]:
    """Fields of PostureResult of a drive between its waypoints, FACTOR times finer; less where
    that makes too many. The value is infinite where there are no forces."""
    fine, x = refined(problem, x, max(min(FACTOR, MOST // len(problem.x)), 1))
    angles, count = fine.angles(x), len(fine.x)
    size = max(LEAST_PAD, 1 << (count - 1).bit_length())
    at = evaluate.stations(fine.posture, angles)
    whole = at.map(lambda of: padded(of, size))
    residuals = evaluate.violations(fine, angles, at)
    return {
        "fine_value": float(evaluate.value(fine.posture.criterion, whole, np.int32(count))),
        "fine_spacing": float(np.max(np.diff(fine.x))),
        "fine_feasible": all(
            by <= evaluate.tolerated(fine, name) for name, by in residuals.items()
        ),
        "fine_residuals": residuals,
    }


def _between(rows: np.ndarray, factor: int) -> np.ndarray:
    """Numbers at waypoints [K, ...] and evenly between them, [(K - 1) factor + 1, ...]."""
    share = np.arange(factor).reshape(-1, *[1] * (rows.ndim - 1)) / factor
    inner = rows[:-1, None] + share * (rows[1:] - rows[:-1])[:, None]
    return np.concatenate([inner.reshape(-1, *rows.shape[1:]), rows[-1:]])
