"""A gait problem on its grid: limits as rows A a + B b <= C, units, slopes, and its cone program.

    minimise  weights . (time, torque, work)   or the least relaxation r
    subject to  b[k+1] = b[k] + h (a[k] + a[k+1]),   A a + B b <= C + R r,   time <= longest

b = crank rate^2 and a = crank acceleration at the nodes of n steps: a is straight between nodes, so
b is a parabola in each cell and has a slope everywhere. A cell takes the time 2 h / (rate + next
rate), exact for constant acceleration, from rest, too: with s <= sqrt(b) that is a second-order
cone. The program's numbers are in the units of `Numbers`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import cvxpy as cp
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics.pytrees import float64_program
from stickslip.optim.gait.gait import (
    FRICTION,
    TIME,
    TORQUE,
    WORK,
    Gait,
    Goal,
    friction_uses,
    terms_on_grid,
    torque_rates,
)
from stickslip.optim.gait.profile import Rows
from stickslip.optim.problem import FEASIBLE, Ended, OptimStatus, solve_quietly

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.gait.profile import Grid, Profile, Profiles

    Traced = Any  # an array of NumPy, or one of JAX that is traced

MOTOR = "motor"
"""The rows of its power; as a limit that is relaxed, its torque rate, too."""
NORMAL, ZMP, RATE, STANDING = "normal force", "foot edges", "greatest rate", "squared rate >= 0"
UNITS = {TORQUE: "N m", FRICTION: "N", NORMAL: "N", ZMP: "N m", RATE: "rad^2/s^2"}
UNITS |= {STANDING: "rad^2/s^2", "power": "W", "torque rate": "N m/s", "torque jump": "N m"}
"""Unit of a row's violation, or of that of one of `motor_uses`."""
ACCURACY = {"tol_feas": 1e-11, "tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11}
"""Tolerances of Clarabel. Small cells near rest need them; where it stops earlier, the certificate
says how good the gait is all the same."""


@dataclass(frozen=True)
class Sample:
    """A program's scaled coefficients at crank angles [m]: rows A, B, C; torque = torque[0] a +
    torque[1] b + torque[2]; least and greatest b; `weight` in an integral over the phase."""

    A: Float[np.ndarray, "rows m"]
    B: Float[np.ndarray, "rows m"]
    C: Float[np.ndarray, "rows m"]
    torque: tuple[np.ndarray, np.ndarray, np.ndarray]
    ends: tuple[np.ndarray, np.ndarray]
    weight: Float[np.ndarray, "m"]


@dataclass(frozen=True)
class Numbers(Sample):
    """A program's scaled numbers, its sample at the nodes. relaxed: the limit that r may exceed; a
    weight for each term, none where r is minimised; the longest time. changes: most, left, right of
    |T' - T| + left b + right b' <= most in each cell, with a torque that is the same on both sides
    of an exchange; MOTOR relaxes them, too."""

    relaxed: str
    weights: dict[str, float]
    longest: float | None
    changes: tuple[np.ndarray, ...]


class Duals(NamedTuple):
    """Multipliers of the solver, 0 if not finite: of each cell's dynamics [n, K], of b at exchanges
    [n - 1, or n where periodic], of time >= 0, of rows [m, nodes], of `straight`."""

    motion: Float[np.ndarray, "n K"]
    exchange: Float[np.ndarray, "e"]
    time: float
    rows: Float[np.ndarray, "m nodes"]
    straight: Float[np.ndarray, "s"]


class Solved(NamedTuple):
    """Solver status, a and b at the nodes [n, K+1], multipliers, and the relaxation."""

    status: OptimStatus
    message: str
    a: Float[np.ndarray, "n K+1"]
    b: Float[np.ndarray, "n K+1"]
    duals: Duals
    relaxation: float


class Program:
    """The cvxpy problem of a grid with some numbers."""

    def __init__(self, on: GridProblem, given: Numbers):
        self._given, self._h, (n, K) = given, on.grid.h.ravel(), on.grid.h.shape
        nodes, self._shape = n * (K + 1), (n, K)
        self._a, self._b = cp.Variable(nodes, name="a"), cp.Variable(nodes, name="b")
        self._r = cp.Variable()
        self._left, self._right = (  # [n K, nodes]: pick the nodes at both ends of each cell
            sp.kron(sp.eye_array(n), sp.eye_array(K, K + 1, k=i), "csr") for i in (0, 1)
        )
        gained = cp.multiply(self._h, (self._left + self._right) @ self._a)
        self._motion = (self._right - self._left) @ self._b - gained == 0
        self._rows: list[cp.Constraint] = []
        for A, B, C, name in zip(given.A, given.B, given.C, on.rows.names, strict=True):
            taken = cp.multiply(A, self._a) + cp.multiply(B, self._b)
            self._rows.append(taken <= (C + self._r if name == given.relaxed else C))
        self._constraints: list[cp.Constraint] = [self._motion, *self._rows]
        starts = (K + 1) * np.arange(n)
        joined = slice(None if on.periodic else -1)
        self._ends, self._begins = (starts + K)[joined], np.roll(starts, -1)[joined]
        self._exchange: cp.Constraint | None = None
        if len(self._ends):  # b goes on over the exchange of support, or round the periodic step
            self._exchange = self._b[self._begins] - self._b[self._ends] == 0
            self._constraints.append(self._exchange)
        for i in (0, -1):
            if given.ends[0][i] == given.ends[1][i]:
                self._constraints.append(self._b[i] == given.ends[0][i])
        self._straight: cp.Constraint | None = None
        if on.straight is not None:
            self._straight = cp.Zero(on.straight @ self._a)
            self._constraints.append(self._straight)
        self._timing: cp.Constraint | None = None
        self.problem = cp.Problem(cp.Minimize(self._goal()), self._constraints)

    def _changes(self, torque: cp.Expression) -> list[cp.Constraint]:
        """The torque changes little in a cell, and not at all at an exchange."""
        most, on_left, on_right = (part.ravel() for part in self._given.changes)
        relaxed = self._given.relaxed == MOTOR
        more = self._r if relaxed else 0.0
        left, right = self._left @ self._b, self._right @ self._b
        taken = cp.multiply(on_left, left) + cp.multiply(on_right, right)
        change = cp.abs((self._right - self._left) @ torque)
        found = [change + taken <= most + more * (self._h / np.max(self._h))]
        if len(self._ends):
            jump = torque[self._begins] - torque[self._ends]
            found.append(cp.abs(jump) <= more if relaxed else jump == 0)
        return found

    def _goal(self) -> cp.Expression:
        given, weights = self._given, self._given.weights
        on_a, on_b, rest = given.torque
        torque = cp.multiply(on_a, self._a) + cp.multiply(on_b, self._b) + rest
        parts: list[cp.Expression] = []
        self._constraints += self._changes(torque) if given.changes else []
        if given.longest is not None or TIME in weights or TORQUE in weights:
            parts += self._paced(torque)
        if WORK in weights:
            positive = cp.Variable(torque.size, nonneg=True)
            self._constraints.append(positive >= torque)
            parts.append(weights[WORK] * given.weight @ positive)
        if weights:
            return sum(parts[1:], parts[0])
        self._constraints.append(self._r >= -1)
        return self._r

    def _paced(self, torque: cp.Expression) -> list[cp.Expression]:
        """Terms of the objective that go with the time of each cell; its limit is a constraint."""
        given, weights, h = self._given, self._given.weights, self._h
        parts: list[cp.Expression] = []
        rests = [int(given.ends[1][i] == 0) for i in (0, -1)]
        moving = slice(rests[0], self._b.size - rests[1])  # at rest a cone has no inside
        root = cp.Variable(self._b.size - sum(rests))
        pair = sp.csr_array(self._left + self._right)[:, moving] @ root  # rate + next rate
        self._constraints.append(cp.square(root) <= self._b[moving])
        if given.longest is not None or TIME in weights:
            slow = cp.Variable(h.size)  # >= 1 / pair
            rows = cp.vstack([np.full(h.size, 2.0), slow - pair])
            self._constraints.append(cp.SOC(slow + pair, rows, axis=0))
            if given.longest is not None:
                timing = 2 * (h @ slow) <= given.longest
                self._constraints.append(timing)
                self._timing = timing
            if TIME in weights:
                parts.append(2 * weights[TIME] * h @ slow)
        if TORQUE in weights:
            heat = cp.Variable(h.size)  # >= (torque^2 + next torque^2) / pair
            ends = 2 * (self._left @ torque), 2 * (self._right @ torque)
            rows = cp.vstack([*ends, heat - pair])
            self._constraints.append(cp.SOC(heat + pair, rows, axis=0))
            parts.append(weights[TORQUE] * h @ heat)
        return parts

    def solve(self) -> Solved | Ended:
        """The solution, or how the solver ended without a point."""
        ended = solve_quietly(self.problem, bounded=True, **ACCURACY)
        if not ended.answered or self._b.value is None:
            return ended
        a, b = self.read()
        duals = Duals(
            motion=_dual(self._motion).reshape(self._shape),
            exchange=np.ravel(_dual(self._exchange)),
            time=float(np.max(_dual(self._timing), initial=0.0)),
            rows=np.stack([_dual(row) for row in self._rows]),
            straight=_dual(self._straight),
        )
        relaxation = 0.0 if self._given.weights else float(np.asarray(self._r.value))
        return Solved(*ended, a, b, duals, relaxation)

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        """a and b at the nodes of the solved problem [n, K+1]."""
        a, b = (np.asarray(one.value).reshape(self._shape[0], -1) for one in (self._a, self._b))
        return a, b


def _dual(constraint: cp.Constraint | None) -> np.ndarray:
    value = np.zeros(0) if constraint is None else np.asarray(constraint.dual_value)
    return np.nan_to_num(value, posinf=0.0, neginf=0.0)


class Units(NamedTuple):
    """Units in which a program's numbers are about 1: rate [rad/s], torque [N m]."""

    rate: float
    torque: float

    @property
    def b(self) -> float:
        """Unit of rate^2 and of acceleration [rad^2/s^2]."""
        return self.rate**2

    def of(self, term: str) -> float:
        """Unit of an objective's term."""
        square = self.torque**2
        return {TIME: 1 / self.rate, TORQUE: square / self.rate, WORK: self.torque}[term]


@dataclass(frozen=True)
class GridProblem:
    """mu: static friction [n], one a step. torque [N m]; motor: whether that is the motor's, not a
    torque beyond all that matters. min_normal [N]. zmp: whether the zero-moment point must stay
    inside the foot. cap: greatest crank rate [rad/s]. longest: time of the whole walk [s], None:
    any. first, last: least and greatest b there [rad^2/s^2]. rate_unit [rad/s], None: chosen from
    the robot and the mean rate. programs: how many were solved, of this one and of those made from
    it. power [W], torque_rate [N m/s]: of the motor, None: any. around: b at the nodes, about which
    tangents replace these two limits; None: they are left out. straight: straight @ a = 0."""

    profiles: Profiles
    goal: Goal
    mu: Float[np.ndarray, "n"] | None
    torque: float
    motor: bool
    min_normal: float
    zmp: bool
    cap: float
    periodic: bool
    longest: float | None
    first: tuple[float, float]
    last: tuple[float, float]
    rate_unit: float | None = None
    programs: list[int] = field(default_factory=lambda: [0])
    power: float | None = None
    torque_rate: float | None = None
    around: Float[np.ndarray, "n K+1"] | None = None
    straight: sp.csr_array | None = None

    @property
    def grid(self) -> Grid:
        return self.profiles.grid

    @cached_property
    def rows(self) -> Rows:
        return self.rows_of(self.profiles.nodes)

    @cached_property
    def rows_between(self) -> Rows:
        return self.rows_of(self.profiles.samples)

    def rows_of(self, p: Profile) -> Rows:
        """All limits along a profile [n, ...], its first axis the steps."""
        weight, zero, one = p.robot.weight, np.zeros_like(p.M), np.ones_like(p.M)
        parts: list[tuple[str, np.ndarray, np.ndarray, np.ndarray, float]] = []
        for s in (1, -1):
            most = self.torque - s * p.fall
            parts.append((TORQUE, s * p.M, s * (p.dM / 2), most, p.torque_unit))
            if self.power is not None and self.around is not None:
                most, slope = self._power_tangent(p, self.power, self.around)
                B, most = s * p.dM / 2 + slope, most - s * p.fall
                parts.append((MOTOR, s * p.M, B, most, p.torque_unit))
        if self.mu is not None:
            mu = self.mu.reshape(-1, *[1] * (p.M.ndim - 1))
            for s in (1, -1):
                A, B = s * p.P - mu * p.Y, s * p.dP - mu * p.dY
                parts.append((FRICTION, A, B, mu * weight * one, weight))
        parts.append((NORMAL, -p.Y, -p.dY, (weight - self.min_normal) * one, weight))
        if self.zmp:
            unit = weight * max(p.robot.heel + p.robot.toe, p.robot.crank)
            lean = p.robot.gravity * p.X
            for s, edge in ((1, p.robot.toe), (-1, p.robot.heel)):
                A, B = s * p.L - edge * p.Y, s * p.dL - edge * p.dY
                parts.append((ZMP, A, B, edge * weight - s * lean, unit))
        parts.append((RATE, zero, one, self.cap**2 * one, self.cap**2))
        parts.append((STANDING, zero, -one, zero, self.profiles.nodes.lift_off_rate**2))
        names, A, B, C, sizes = zip(*parts, strict=True)
        return Rows(names, np.stack(A), np.stack(B), np.stack(C), np.array(sizes))

    def _power_tangent(
        self, p: Profile, power: float, around: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """|torque| + slope b <= most along a profile: the tangent of |torque| <= power / sqrt(b).

        That curve is convex in b, so what the tangent leaves is within the limit. It touches where
        `around` is, or where the greatest torque meets the curve.
        """
        rows = zip(p.theta, self.grid.theta, around, strict=True)
        b = np.stack([np.interp(theta, nodes, near) for theta, nodes, near in rows])
        b = np.maximum(b, (power / self.torque) ** 2)
        most = power / np.sqrt(b)
        return 1.5 * most, most / (2 * b)

    def _change_tangents(self) -> tuple[np.ndarray, ...]:
        """Numbers.changes about `around`: tangents of |T' - T| <= torque_rate x 2 h / (s + s'), s
        the crank rate, as those of the power; none by the b of a rest, which is 0."""
        if self.torque_rate is None or self.around is None:
            return ()
        h, rate, unit = self.grid.h, np.sqrt(np.maximum(self.around, 0.0)), self.units
        rate = np.maximum(rate, self.torque_rate * np.min(h) / (2 * self.torque))
        for end, _ in self.grid.rests:
            rate[end, end] = 0.0
        s = rate[:, :-1], rate[:, 1:]
        most = 2 * self.torque_rate * h / (s[0] + s[1]) / unit.torque
        slope = most / (s[0] + s[1]) * unit.b
        ends = (np.divide(slope, 2 * x, out=np.zeros_like(x), where=x > 0) for x in s)
        return 1.5 * most, *ends

    @cached_property
    def units(self) -> Units:
        """Units; that of the rate is the lift-off rate, or nearer to a far lower mean rate."""
        nodes = self.profiles.nodes
        rate = nodes.lift_off_rate if self.rate_unit is None else self.rate_unit
        if self.rate_unit is None and self.longest is not None:
            asked = 2 * self.grid.turn / self.longest
            rate = float(np.clip(asked, rate / 10, rate))
        return Units(rate, nodes.torque_unit)

    @property
    def scale(self) -> float:
        """The size of the objective in SI units; its values are about 1 in the program."""
        if self.goal.is_friction:
            return 1.0
        return max(w * self.units.of(term) for term, w in self.goal.weights.items())

    def solve(self, numbers: Numbers) -> Solved | Ended:
        self.programs[0] += 1
        return Program(self, numbers).solve()

    def sample(self, inside: bool) -> Sample:
        """Data of a certificate, at the nodes or inside the cells."""
        p = self.profiles.inside if inside else self.profiles.nodes
        names, *rows, size = self.rows_of(p) if inside else self.rows
        A, B, C = (part.reshape(len(names), -1) / size[:, None] for part in rows)
        weight = self.grid.inside[1] if inside else self.grid.weights
        b, T = self.units.b, self.units.torque
        low, high = np.zeros(weight.size), np.full(weight.size, np.inf)
        if not inside:
            low[0], high[0] = np.array(self.first) / b
            last = np.array(self.last) / b
            low[-1], high[-1] = max(low[-1], last[0]), min(high[-1], last[1])
        M, half, fall = (part.ravel() for part in (p.M, p.dM / 2, p.fall))
        torque = M * b / T, half * b / T, fall / T
        return Sample(A * b, B * b, C, torque, (low, high), weight.ravel())

    def numbers(self, relaxed: str = "") -> Numbers:
        """The program's numbers. relaxed: a limit whose violation r is minimised."""
        sample = self.sample(inside=False)
        names, C = np.array(self.rows.names), sample.C.copy()
        for node, end in ((0, self.first), (-1, self.last)):
            if end[1] == 0:  # said by an equality already: a limit would have no inside
                C[names == STANDING, node] += 1.0
        terms = {} if relaxed else self.goal.weights
        weights = {term: w * self.units.of(term) / self.scale for term, w in terms.items()}
        scaled: dict[str, Any] = vars(sample) | {"C": C}
        return Numbers(
            **scaled,
            relaxed=relaxed,
            weights=weights,
            longest=None if self.longest is None else self.longest * self.units.rate,
            changes=self._change_tangents(),
        )

    def gait(self, a: Float[np.ndarray, "n K+1"], first: float) -> Gait:
        """The gait with these accelerations that begins with b = first, SI."""
        return Gait(self.profiles, a, squares_of(self.grid, a, first))

    def gait_of(self, a: Float[np.ndarray, "n K+1"], b: Float[np.ndarray, "n K+1"]) -> Gait:
        """The gait of a program's a and b; accelerations take up what rounding leaves at ends."""
        unit = self.units.b
        a, first = a * unit, float(np.clip(b[0, 0] * unit, *self.first))
        end = float(squares_of(self.grid, a, first)[-1, -1])
        wanted = first if self.periodic else float(np.clip(end, *self.last))
        return self.gait(a + (wanted - end) / (2 * self.grid.turn), first)

    def margins(self, a: Traced, b: Traced, time: Traced, xp: ModuleType = np) -> Traced:
        """Scaled margins [m] of a and b [n, K+1]: the rows at the nodes, the time, both sides of
        the end, and those of the motor. xp: numpy, or jax.numpy for traced arrays."""
        low, high = (b[0, 0], b[0, 0]) if self.periodic else self.last
        late = [] if self.longest is None else [1 - time / self.longest]
        ends = [(b[-1, -1] - low) / self.units.b, (high - b[-1, -1]) / self.units.b]
        parts = [xp.ravel(-self.rows.scaled_excess(a, b)), xp.stack([*late, *ends])]
        return xp.concatenate([*parts, *self.motor_margins(a, b, xp)])

    def motor_margins(self, a: Traced, b: Traced, xp: ModuleType = np) -> list[Traced]:
        """Scaled margins of `motor_uses`."""
        uses = [(xp.ravel(use), most) for use, most in self.motor_uses(a, b, xp).values()]
        sizes = [most or self.units.torque for _, most in uses]
        pairs = [(most / size, use / size) for (use, most), size in zip(uses, sizes, strict=True)]
        return [side for most, use in pairs for side in (most - use, most + use)]

    def motor_uses(self, a: Traced, b: Traced, xp: ModuleType = np) -> dict[str, tuple[Any, float]]:
        """What the motor does, and its limit either way: power at the nodes [W]; mean torque rate
        in each cell [N m/s], and jumps of the torque at exchanges [N m]."""
        torque, found = self.profiles.nodes.torque(a, b), {}
        if self.power is not None:
            found["power"] = torque * xp.sqrt(xp.maximum(b, 0.0)), self.power
        if self.torque_rate is not None:
            found["torque rate"] = torque_rates(self.grid, torque, b, xp), self.torque_rate
            jumps = torque[:, 0] - xp.roll(torque[:, -1], 1)
            found["torque jump"] = jumps if self.periodic else jumps[1:], 0.0
        return found

    def exceeds_motor(self, gait: Gait) -> bool:
        """True of a gait beyond the motor's power or torque rate."""
        parts = self.motor_margins(gait.a, gait.b)
        return any(np.min(part, initial=0.0) < -FEASIBLE for part in parts)

    @cached_property
    def of_point(self) -> dict[str, Callable[..., Any]]:
        """Functions of x. both: value and `margins`; all: of a batch. gradient of the value,
        jacobian of the margins: none at kinks."""
        p = self.profiles.nodes

        def both(x: Traced) -> tuple[Traced, Traced]:
            a = x[1:].reshape(self.grid.theta.shape)
            b = squares_of(self.grid, a, x[0], jnp)
            spent: Any = terms_on_grid(self.grid, b, p.torque(a, b), jnp)
            margins = finite_margins(self.margins(a, b, spent[TIME], jnp), jnp)
            if self.goal.is_friction:
                uses = friction_uses(p.friction(a, b), p.normal(a, b), jnp)
                return jnp.max(uses), margins
            value = self.goal.of(spent)
            return jnp.where(jnp.isfinite(value), value, jnp.inf), margins

        functions = {
            "both": both,
            "all": jax.vmap(both),
            "gradient": jax.grad(lambda x: both(x)[0]),
            "jacobian": jax.jacfwd(lambda x: both(x)[1]),
        }
        return {name: float64_program(of) for name, of in functions.items()}


def finite_margins(margins: Traced, xp: ModuleType = np) -> Traced:
    """-1 for margins that are no numbers or infinitely violated, 1e9 for infinite ones."""
    return xp.nan_to_num(margins, nan=-1.0, posinf=1e9, neginf=-1.0)


def squares_of(grid: Grid, a: Traced, first: Traced, xp: ModuleType = np) -> Traced:
    """b at the nodes from the accelerations [n, K+1], the same on both sides of an exchange."""
    gained = grid.h * (a[:, :-1] + a[:, 1:])
    within = xp.concatenate([np.zeros((grid.steps, 1)), xp.cumsum(gained, axis=1)], axis=1)
    before = xp.concatenate([np.zeros(1), xp.cumsum(within[:, -1])[:-1]])
    return first + before[:, None] + within
