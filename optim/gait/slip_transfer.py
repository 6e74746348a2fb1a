"""Transfers of a biped whose foot may slip, by dynamic programming over the crank angle.

The state at a node is w, the square of the centre of mass's speed relative to the foot, and the
foot's velocity; a cell joins it to any w of the next node (`sliding.py`). Values are interpolated
over the velocity, never between rest and sliding. Later rounds search closer nodes around the walk
of the round before, so the result is a local optimum: no bound but the impulse's is known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.inertia import GroundMoment, ReducedInertia
from stickslip.dynamics.checks import require_integer, require_kind, require_that, shown
from stickslip.dynamics.pytrees import float64_program, read_only
from stickslip.dynamics.status import Status
from stickslip.optim.gait.gait import TIME, TORQUE, WORK
from stickslip.optim.gait.problem import GaitProblem
from stickslip.optim.gait.profile import Grid, Profile, Profiles, mark_of
from stickslip.optim.gait.replay import Replay, replay
from stickslip.optim.gait.sliding import NEVER, Limits, Passage, Place, SlidingLaw, over_cell
from stickslip.optim.problem import require_scalar
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

HALVES = 2
"""Pieces of a cell, in each of which the foot may stop once."""
UNSTOPPED = 1.0, 100.0
"""Cost of a foot that slides at the end, and of each m/s: it leads to one that rests."""
CREEP = 1e-7
"""Speed that stands for a slide that begins or ends [m/s]."""
FASTER, QUICKER = 1.25, 1.5
"""Largest speed of the centre that is searched, in the larger of the ends' or, of a walk from rest
to rest or to any rate, in what friction gives it on its way; and that of the foot, in that."""
LEVELS, SPEEDS = 101, 25
"""Nodes of the centre's speed and of the foot's, in each direction, of the first round."""
ROUNDS, WIDTH, SHRINK, CLOSE, NEAR = 6, 0.2, 0.6, 61, 9
"""Later rounds: number, half width of the first in the largest speed, and what it shrinks by; nodes
of the centre's speed, and those of the foot's that lie close to the walk's."""
CALM = 12
"""One in so many cells of a step, at a stop, in which the foot rests; else it is the last one."""
FINER = 3
"""Rounds on twice as many cells."""
RESERVES = (0.02, 0.05, 0.1, 0.2)
"""Reserves that are tried in turn until the replay arrives."""
ARRIVED = 0.01
"""Largest deviation with which a replay arrives."""
MARKS, AT_MARK = 6, 1e-3
"""Searches for the crank angle at which the centre of mass stops at a mark, and how close [m]."""
NOT_TAKEN = ("mean_rate", "max_torque_rate", "max_rate")
"""Limits of a GaitProblem that are not kept here."""


@dataclass(frozen=True)
class SlipTransfer:
    """A walk whose foot may slip, in K pieces of the crank angle in each of n steps.

    value: of the objective, by the trapezoid rule over pieces; infinite if not feasible.
    lower_bound: no walk is better, slip or not: friction takes at least that time for the change of
    the momentum. feasible: the walk keeps all limits at the ends of pieces, and ends as asked, its
    foot at rest. reserve: see slip_transfer. duration [s]; slid: path of the foot over the floor,
    displacement: its way forwards, distance: that of the centre of mass [m]. theta [n, K+1]: crank
    angle of the supporting leg [rad]; there crank_rate [rad/s], foot_velocity [m/s] and clock [s].
    torque [n, K]: at the beginning of each piece [N m]. replay: in event-exact simulation, None of
    a walk that is not feasible.
    """

    problem: GaitProblem
    mu_kinetic: float
    reserve: float
    value: float
    lower_bound: float
    feasible: bool
    duration: float
    slid: float
    displacement: float
    distance: float
    nodes: Profile
    grid: Grid
    law: SlidingLaw
    crank_rate: Float[np.ndarray, "n K+1"]
    foot_velocity: Float[np.ndarray, "n K+1"]
    clock: Float[np.ndarray, "n K+1"]
    torque: Float[np.ndarray, "n K"]
    replay: Replay | None = None
    repeats = False

    @property
    def theta(self) -> Float[np.ndarray, "n K+1"]:
        return self.grid.theta

    @property
    def b(self) -> Float[np.ndarray, "n K+1"]:
        """Squared crank rate [rad^2/s^2]."""
        return self.crank_rate**2

    @property
    def deviation(self) -> float:
        """What the replay's end is off: crank rate, or foot's velocity over the crank's length, in
        the walk's largest crank rate; infinite after a fall, or without a replay."""
        found, asked = self.replay, self.problem.end_rate
        if found is None or not found.arrived or found.status > Status.SLIP_ONSET:
            return np.inf
        off = 0.0 if asked is None else abs(found.end_rate - asked)
        slides = abs(found.end_velocity) * self.nodes.robot.mass / float(np.max(self.nodes.P))
        return max(off, slides) / float(np.max(self.crank_rate))

    @property
    def arrives(self) -> bool:
        """True if the replay ends as asked, but for a deviation of 1 %."""
        return self.deviation <= ARRIVED


def slip_transfer(
    problem: GaitProblem,
    mu_kinetic: float,
    *,
    reserve: float | None = None,
    feedback: float = 2.0,
    cells: int = 48,
    progress: bool = False,
) -> SlipTransfer:
    """The best walk of a transfer whose foot may slip, and its replay.

    problem: a transfer with one mu; the foot rests at its beginning and over the last cell, of a
    stop over the last twelfth of a step's. With end_phase the centre of mass stops as far ahead as
    it would without slip. mu_kinetic: of the sliding foot, at most mu. reserve: share of the static
    friction that a resting foot leaves unused, and by which a slip that is meant exceeds it; None:
    the least of RESERVES whose replay arrives, or else that of the least deviation. feedback
    [1/rad]: of the replay, on the energy. cells: of the crank angle in each step, even; half of
    them are searched first.

    The walk is a local optimum of the grid. In a cell the centre of mass has a constant
    acceleration, so where the motor's limit binds, not friction, the walk is slower than the best:
    by 5 % with 48 cells, 3.5 % with 96. ValueError for a periodic gait, the objective "friction", a
    limit of NOT_TAKEN, or a robot whose centre of mass goes back within a step.
    """
    _check(problem, mu_kinetic, reserve, cells)
    shares = RESERVES if reserve is None else (float(reserve),)
    floor: dict[str, Any] = {"mu": problem.mu, "mu_kinetic": mu_kinetic}
    walks: list[SlipTransfer] = []
    with Bar("dynamic programming", None, "round", progress) as bar:
        for share in shares:
            found = _to_mark(problem, float(mu_kinetic), cells, share, bar)
            if found.feasible:
                walked = replay(problem.params, found, feedback=feedback, zmp=problem.zmp, **floor)
                found = replace(found, replay=walked)
            walks.append(found)
            if found.arrives or not found.feasible:  # a larger reserve leaves less
                break
    return min(walks, key=lambda walk: walk.deviation)


def _to_mark(
    problem: GaitProblem, mu_kinetic: float, cells: int, reserve: float, bar: Bar
) -> SlipTransfer:
    """The best walk on half the cells, then close to it on all; one with end_phase is moved until
    the centre of mass stops where it should."""
    found: Any = None
    moved, mark, ahead = problem, np.nan, np.nan
    for i in range(MARKS + 1):
        found = _Search(moved, mu_kinetic, cells // 2).walk(reserve, bar)
        found = _Search(moved, mu_kinetic, cells).walk(reserve, bar, found)
        if i == 0:
            mark = ahead = found.distance - found.displacement
        off = mark - found.distance
        if problem.end_phase is None or abs(off) <= AT_MARK:
            return found
        ahead += off
        steps, end = mark_of(problem.params, max(ahead, AT_MARK))
        moved = replace(problem, steps_taken=steps, end_phase=end)
    return replace(found, feasible=False, value=np.inf)


def _check(problem: GaitProblem, mu_kinetic: float, reserve: float | None, cells: int) -> None:
    require_kind("problem", problem, GaitProblem, "a GaitProblem.transfer")
    one = problem.mu is not None and np.ndim(np.asarray(problem.mu)) == 0
    if problem.is_periodic or problem.goal.is_friction or not one:
        raise ValueError(
            f"objective = {shown(problem.objective_asked)}, periodic = {problem.is_periodic}, mu = "
            f"{shown(problem.mu)}; accepted: a transfer with one mu, and not 'friction'"
        )
    for name in NOT_TAKEN:
        if getattr(problem, name) is not None:
            raise ValueError(f"{name} where the foot may slip; accepted: None")
    most = float(np.asarray(problem.mu))
    if most == 0:
        raise ValueError("mu = 0.0, on which no walk begins or ends; accepted: a number > 0")
    require_scalar("mu_kinetic", mu_kinetic, low=0.0, high=most, accepted=f"0 to mu = {most:g}")
    if reserve is not None:
        require_scalar("reserve", reserve, low=0.0, high=0.9, accepted="None, or 0 to 0.9")
    require_integer("cells", cells, low=8, high=400)
    require_that(cells % 2 == 0, "cells", cells, "an even number")


class _Search:
    """The search on one grid of the crank angle, at whose cells' ends there are nodes: squares
    [S+1, N] of the centre's speed, and speeds [S+1, J] of the foot."""

    def __init__(self, problem: GaitProblem, mu_kinetic: float, cells: int):
        robot = problem.on_grid.profiles.robot
        ends = problem.start_rate == 0.0, problem.end_rate == 0.0
        self.problem, self.mu_kinetic = problem, mu_kinetic
        self.mu = float(np.asarray(problem.mu, float))
        self.grid = Grid(problem.steps_taken, cells * HALVES, *ends, problem.end_phase)
        self.calm = max(1, cells // CALM) if ends[1] else 1
        self.nodes = at = Profiles(problem.params, robot, self.grid).nodes
        if not np.min(at.P) > 0:
            raise ValueError("params: the centre of mass goes back within a step of this robot")
        self.pick = np.arange(cells)[:, None] * HALVES + np.arange(HALVES + 1)
        terms: Any = (at.M, at.dM, at.P, at.dP, at.Y, at.dY), (at.L, at.dL, at.X, at.Y)
        inertia, moment = ([self._cut(one) for one in row] for row in terms)
        theta: Any = self._cut(at.theta)
        self.places = Place(theta, ReducedInertia(*inertia), GroundMoment(*moment))
        pace = at.P / robot.mass
        rates = [problem.start_rate, problem.end_rate]
        self.asked = [
            None if rate is None else (rate * first) ** 2
            for rate, first in zip(rates, (pace[0, 0], pace[-1, -1]), strict=True)
        ]
        far = 2 * self.mu * robot.gravity * np.sum(at.X[:, -1] - at.X[:, 0]) / robot.mass
        fastest = max([rate or 0.0 for rate in rates]) * np.max(pace)
        self.top = FASTER * (fastest or np.sqrt(far))

    def _cut(self, rows: np.ndarray) -> Any:
        """Values [n, K+1] at the ends of the pieces of every cell [S, HALVES + 1]."""
        return rows[:, self.pick].reshape(-1, HALVES + 1)

    def limits(self, reserve: float) -> Limits:
        at, robot = self.problem.on_grid, self.nodes.robot
        heel, toe = (robot.heel, robot.toe) if self.problem.zmp else (np.inf, np.inf)
        weights = self.problem.goal.weights
        numbers: Any = (
            robot.mass, robot.gravity, self.mu, self.mu_kinetic, reserve, at.torque,
            np.inf if at.power is None else at.power, at.min_normal, heel, toe,
            np.array([weights.get(term, 0.0) for term in (TIME, TORQUE, WORK)]),
        )  # fmt: skip
        return Limits(*jax.tree.map(np.float64, numbers))

    def walk(self, reserve: float, bar: Bar, before: SlipTransfer | None = None) -> SlipTransfer:
        """The best walk of all rounds. before: one of half as many cells, to search close to."""
        limits = self.limits(reserve)
        if before is None:
            count, first, rounds = len(self.places.theta) + 1, 1.0, ROUNDS + 1
            levels = np.linspace(0.0, 1.0, LEVELS) ** 2 * self.top**2
            squares, speeds = (np.tile(one, (count, 1)) for one in (levels, self._speeds(SPEEDS)))
        else:
            first, rounds = SHRINK ** (ROUNDS - FINER), FINER
            speed = before.crank_rate * before.nodes.P / before.nodes.robot.mass
            at_ends = [np.append(of[:, :-1], of[-1, -1]) for of in (speed, before.foot_velocity)]
            squares, speeds = self._closer(at_ends[0], at_ends[1], WIDTH * first)
        best: Any = None
        for i in range(rounds):
            squares = self._pinned(squares)
            given = limits, self.places, squares, speeds
            values = _values(*given, self._last(squares[-1], speeds[-1]), self.calm)
            rest = squares[0, np.argmin(values[0, :, speeds.shape[1]])]
            start = np.float64(rest if self.asked[0] is None else self.asked[0])
            found = _best_walk(*given, values, start)
            if best is None or np.sum(found[0].cost) <= np.sum(best[0].cost):
                best = found
            velocity = np.append(0.0, best[0].velocity[:, -1])
            squares, speeds = self._closer(np.sqrt(best[1]), velocity, WIDTH * first * SHRINK**i)
            bar.advance()
        return self._result(reserve, *best)

    def _speeds(self, count: int) -> np.ndarray:
        return np.maximum(QUICKER * self.top * np.linspace(0.0, 1.0, count) ** 2, CREEP)

    def _pinned(self, squares: np.ndarray) -> np.ndarray:
        """The nodes that lie nearest to the ends asked for, moved there."""
        squares = squares.copy()
        for row, asked in zip((squares[0], squares[-1]), self.asked, strict=True):
            if asked is not None:
                row[np.argmin(np.abs(row - asked))] = asked
        return squares

    def _last(self, squares: np.ndarray, speeds: np.ndarray) -> np.ndarray:
        """Values at the end [N, 2J+1]."""
        signed = np.concatenate([-speeds[::-1], [0.0], speeds])
        ends = (squares == self.asked[1]) | (self.asked[1] is None)
        return np.where(ends[:, None], np.where(signed == 0, 0.0, _unstopped(signed)), NEVER)

    def _closer(
        self, speed: np.ndarray, velocity: np.ndarray, width: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Nodes around a walk's speeds of the centre and velocities of the foot [S+1]."""
        spread, own = width * np.linspace(-1.0, 1.0, CLOSE), np.abs(velocity)
        around = np.sort(np.maximum(speed[:, None] / self.top + spread, 0.0), axis=1)
        top = QUICKER * self.top
        reach = 2 * np.sqrt(own / top) / SPEEDS + 1 / SPEEDS**2  # a cell of the first round
        near = own[:, None] + top * reach[:, None] * np.linspace(-1.0, 1.0, NEAR)
        far = np.tile(self._speeds(SPEEDS - NEAR), (len(own), 1))
        speeds = np.sort(np.maximum(np.concatenate([near, far], axis=1), CREEP), axis=1)
        rise = np.arange(CLOSE) * 1e-9, np.arange(SPEEDS) * 1e-12  # ascending where some are equal
        return (around + rise[0]) ** 2 * self.top**2, speeds + rise[1]

    def _result(self, reserve: float, pieces: Passage, squares: np.ndarray) -> SlipTransfer:
        n, at = self.grid.steps, self.nodes
        X = self.places.moment.X / at.robot.mass
        r = np.diff(squares) / (2 * (X[:, -1] - X[:, 0]))
        w = squares[:-1, None] + 2 * r[:, None] * (X[:, :-1] - X[:, :1])
        rows: Any = (X[:, :-1], w, np.broadcast_to(r[:, None], w.shape), pieces.mode, pieces.stop)
        parts: Any = [self.grid.theta, *(row.reshape(n, -1) for row in rows), self.mu_kinetic]
        law = SlidingLaw(*parts)
        speed = np.sqrt(_with_last(w.reshape(n, -1), squares[-1]))
        cost, moved = float(np.sum(pieces.cost)), float(np.sum(pieces.slid))
        rests, end = not np.any(pieces.mode[-self.calm :]), self.asked[1]
        sound = cost < NEVER and rests and (end is None or squares[-1] == end)
        turned = np.cumsum(np.concatenate([[0.0], np.ravel(pieces.time)]))
        velocity = np.concatenate([[0.0], np.ravel(pieces.velocity)])
        ways = at.X[:, -1] - at.X[:, 0]
        return SlipTransfer(
            problem=self.problem, mu_kinetic=self.mu_kinetic, reserve=reserve,
            value=cost if sound else np.inf, lower_bound=self._bound(), feasible=bool(sound),
            duration=float(turned[-1]), slid=float(np.sum(np.abs(pieces.slid))),
            displacement=moved, distance=float(np.sum(ways)) / at.robot.mass + moved, nodes=at,
            grid=self.grid, law=law, crank_rate=read_only(speed * at.robot.mass / at.P),
            foot_velocity=read_only(_with_last(velocity[:-1].reshape(n, -1), velocity[-1])),
            clock=read_only(_with_last(turned[:-1].reshape(n, -1), turned[-1])),
            torque=read_only(np.reshape(pieces.torque, (n, -1))),
        )  # fmt: skip

    def _bound(self) -> float:
        """What the least time costs: |momentum gained| <= mu times the normal force's impulse."""
        at, start, end = self.nodes, self.problem.start_rate, self.problem.end_rate
        if start is None or end is None:
            return 0.0
        speeds = np.sqrt(np.array(self.asked, float))
        rise = end * at.Y[-1, -1] - start * at.Y[0, 0]
        gained = at.robot.mass * abs(speeds[1] - speeds[0])
        time = max(0.0, float(gained / self.mu - rise) / at.robot.weight)
        return time * self.problem.goal.weights.get(TIME, 0.0)


def _with_last(rows: np.ndarray, last: float) -> np.ndarray:
    """Rows [n, K], each with the next one's first number behind it, the last with `last`."""
    return np.concatenate([rows, np.append(rows[1:, 0], last)[:, None]], axis=1)


def _read(row: Float[Array, " 2J+1"], speeds: Float[Array, " J"], velocity: Array) -> Array:
    """The value at a foot velocity; the row holds backwards from the fastest, rest, forwards."""
    count = speeds.size
    ahead = jnp.interp(velocity, speeds, row[count + 1 :], right=NEVER)
    back = jnp.interp(-velocity, speeds, row[:count][::-1], right=NEVER)
    return jnp.where(velocity > 0, ahead, jnp.where(velocity < 0, back, row[count]))


def _unstopped(velocity: Any) -> Any:
    """What a foot that slides costs more where it should rest."""
    return UNSTOPPED[0] + UNSTOPPED[1] * abs(velocity)


@float64_program
def _values(
    limits: Limits, places: Place, squares: Float[Array, "S+1 N"], speeds: Float[Array, "S+1 J"],
    last: Float[Array, "N 2J+1"], calm: Int[Array, ""],
) -> Float[Array, "S+1 N 2J+1"]:  # fmt: skip
    """The least cost from every node. places [S, H+1]; last: of the end; calm: cells at rest."""

    def stage(after: Array, at: tuple[Place, *tuple[Array, ...]]) -> tuple[Array, Array]:
        place, now, later, own, next_speeds, ends = at

        def best(w: Array) -> Array:
            def to(w_next: Array, row: Array, velocity: Array) -> Array:
                whole = over_cell(limits, place, w, w_next, velocity)[0]
                rest = jnp.where(ends & (whole.mode != 0), _unstopped(velocity), 0.0)
                return whole.cost + rest + _read(row, next_speeds, whole.velocity)

            signed = jnp.concatenate([-own[::-1], jnp.zeros(1), own])
            each = jax.vmap(jax.vmap(to, (None, None, 0)), (0, 0, None))(later, after, signed)
            return jnp.minimum(jnp.min(each, axis=0), NEVER)

        found = jax.lax.map(best, now)
        return found, found

    ends = jnp.arange(len(squares) - 1) >= len(squares) - 1 - calm
    stages = places, squares[:-1], squares[1:], speeds[:-1], speeds[1:], ends
    _, found = jax.lax.scan(stage, last, stages, reverse=True)
    return jnp.concatenate([found, last[None]])


@float64_program
def _best_walk(
    limits: Limits, places: Place, squares: Float[Array, "S+1 N"], speeds: Float[Array, "S+1 J"],
    values: Float[Array, "S+1 N 2J+1"], first: Float[Array, ""],
) -> tuple[Passage, Float[Array, " S+1"]]:  # fmt: skip
    """Pieces [S, H] and w at the ends of cells of the walk from rest that the values lead to."""

    def go(now: tuple[Array, Array], at: tuple[Place, Array, Array, Array]):
        (w, velocity), (place, later, after, own) = now, at

        def to(w_next: Array, row: Array) -> tuple[Array, Array, Passage]:
            whole, pieces = over_cell(limits, place, w, w_next, velocity)
            return whole.cost + _read(row, own, whole.velocity), whole.velocity, pieces

        worth, velocities, pieces = jax.vmap(to)(later, after)
        best = jnp.argmin(worth)
        chosen = jax.tree.map(lambda leaf: leaf[best], pieces)
        return (later[best], velocities[best]), (chosen, later[best])

    stages = places, squares[1:], values[1:], speeds[1:]
    _, (pieces, ends) = jax.lax.scan(go, (first, jnp.zeros_like(first)), stages)
    return pieces, jnp.concatenate([first[None], ends])
