"""A gait problem on its grid: limits as rows A a + B b <= C, units, numbers, and slopes."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.pytrees import read_only
from stickslip.optim.gait.convex.program import Numbers, Program, Sample
from stickslip.optim.gait.gait import (
    FRICTION,
    TIME,
    TORQUE,
    WORK,
    Gait,
    friction_uses,
    terms_on_grid,
)
from stickslip.optim.problem import as_floats, float64_program

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from jaxtyping import Float

    from stickslip.dynamics.pytrees import Lists, Number
    from stickslip.optim.gait.convex.program import Solved
    from stickslip.optim.gait.gait import Goal
    from stickslip.optim.gait.profile import Grid, Profile, Profiles
    from stickslip.optim.result import Ended

    Traced = Any  # an array of NumPy, or one of JAX that is traced

NORMAL, ZMP, RATE, STANDING = "normal force", "foot edges", "greatest rate", "squared rate >= 0"
UNITS = {TORQUE: "N m", FRICTION: "N", NORMAL: "N", ZMP: "N m", RATE: "rad^2/s^2"}
UNITS |= {STANDING: "rad^2/s^2"}
"""Unit of a row's violation."""
ACCEPTED = "None, a number >= 0, or one for each step"


class Rows(NamedTuple):
    """Coefficients [m, n, ...] of A a + B b <= C, with the size of one unit of each [m]."""

    names: tuple[str, ...]
    A: Float[np.ndarray, "m n ..."]
    B: Float[np.ndarray, "m n ..."]
    C: Float[np.ndarray, "m n ..."]
    size: Float[np.ndarray, "m"]

    def excess(
        self, a: Float[np.ndarray, "n ..."], b: Float[np.ndarray, "n ..."]
    ) -> Float[np.ndarray, "m n ..."]:
        """Violation of each limit, > 0, in its own unit."""
        return self.A * a + self.B * b - self.C

    def scaled_excess(
        self, a: Float[np.ndarray, "n ..."], b: Float[np.ndarray, "n ..."]
    ) -> Float[np.ndarray, "m n ..."]:
        """Violation of each limit in units of `size`."""
        return self.excess(a, b) / self.size.reshape(-1, *[1] * np.ndim(a))


def torque_unit(p: Profile) -> float:
    """A torque of the robot's own size [N m]: its weight on a crank's length."""
    return p.robot.weight * p.robot.crank


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


class Units(NamedTuple):
    """Units in which a program's numbers are about 1: rate [rad/s], torque [N m]; time 1 / rate,
    work one torque over a radian."""

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
    it."""

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

    @property
    def grid(self) -> Grid:
        return self.profiles.grid

    @property
    def lift_off(self) -> float:
        """A crank rate of the robot's own [rad/s]."""
        return self.profiles.nodes.lift_off_rate

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
            parts.append((TORQUE, s * p.M, s * (p.dM / 2), most, torque_unit(p)))
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
        parts.append((STANDING, zero, -one, zero, self.lift_off**2))
        names, A, B, C, sizes = zip(*parts, strict=True)
        return Rows(names, np.stack(A), np.stack(B), np.stack(C), np.array(sizes))

    @cached_property
    def units(self) -> Units:
        """Units; that of the rate is the lift-off rate, or nearer to a far lower mean rate."""
        rate = self.lift_off if self.rate_unit is None else self.rate_unit
        if self.rate_unit is None and self.longest is not None:
            asked = 2 * np.pi * self.grid.steps / self.longest
            rate = float(np.clip(asked, rate / 10, rate))
        return Units(rate, torque_unit(self.profiles.nodes))

    @property
    def scale(self) -> float:
        """The size of the objective in SI units; its values are about 1 in the program."""
        if self.goal.is_friction:
            return 1.0
        return max(w * self.units.of(term) for term, w in self.goal.weights.items())

    def solve(self, numbers: Numbers) -> Solved | Ended:
        self.programs[0] += 1
        return Program(numbers).solve()

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
        """The program's numbers. relaxed: a limit that may be violated by r units, of which the
        least is looked for."""
        sample = self.sample(inside=False)
        names, C = np.array(self.rows.names), sample.C.copy()
        for node, end in ((0, self.first), (-1, self.last)):
            if end[1] == 0:  # said by an equality already: a limit would have no inside
                C[names == STANDING, node] += 1.0
        b, rate = self.units.b, self.units.rate
        terms = {} if relaxed else self.goal.weights
        weights = {term: w * self.units.of(term) / self.scale for term, w in terms.items()}
        return Numbers(
            **vars(sample) | {"C": C},
            h=self.grid.h,
            relaxed=names == relaxed,
            weights=weights,
            longest=None if self.longest is None else self.longest * rate,
            first=(self.first[0] / b, self.first[1] / b),
            last=(self.last[0] / b, self.last[1] / b),
            periodic=self.periodic,
        )

    def gait(self, a: Float[np.ndarray, "n K+1"], first: float) -> Gait:
        """The gait with these accelerations that begins with b = first, SI."""
        return Gait(self.profiles, a, squares_of(self.grid, a, first))

    def gait_of(self, a: Float[np.ndarray, "n K+1"], b: Float[np.ndarray, "n K+1"]) -> Gait:
        """The gait of a program's a and b. What rounding leaves at an end that is given is taken
        off all accelerations alike."""
        unit = self.units.b
        a, first = a * unit, float(np.clip(b[0, 0] * unit, *self.first))
        end = float(squares_of(self.grid, a, first)[-1, -1])
        wanted = first if self.periodic else float(np.clip(end, *self.last))
        return self.gait(a + (wanted - end) / (2 * np.pi * self.grid.steps), first)

    def margins(self, a: Traced, b: Traced, time: Traced, xp: ModuleType = np) -> Traced:
        """Scaled margins [m] of a and b [n, K+1]: the rows at the nodes, the time, and both sides
        of the end. xp: numpy, or jax.numpy for arrays that are traced."""
        low, high = (b[0, 0], b[0, 0]) if self.periodic else self.last
        late = [] if self.longest is None else [1 - time / self.longest]
        ends = [(b[-1, -1] - low) / self.units.b, (high - b[-1, -1]) / self.units.b]
        rows = -self.rows.scaled_excess(a, b)
        return xp.concatenate([xp.ravel(rows), xp.stack([*late, *ends])])

    @cached_property
    def slopes(self) -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
        """Functions of x: gradient of the value and jacobian of `margins`; none at kinks."""
        p = self.profiles.nodes

        def walk(x: Traced) -> tuple[Traced, Traced, dict[str, Traced]]:
            a = x[1:].reshape(self.grid.theta.shape)
            b = squares_of(self.grid, a, x[0], jnp)
            return a, b, terms_on_grid(self.grid, b, p.torque(a, b), jnp)

        def value(x: Traced) -> Traced:
            a, b, spent = walk(x)
            if self.goal.is_friction:
                return jnp.max(friction_uses(p.friction(a, b), p.normal(a, b), jnp))
            return self.goal.of(spent)

        def margins(x: Traced) -> Traced:
            a, b, spent = walk(x)
            return self.margins(a, b, spent[TIME], jnp)

        return float64_program(jax.grad(value)), float64_program(jax.jacfwd(margins))


def squares_of(grid: Grid, a: Traced, first: Traced, xp: ModuleType = np) -> Traced:
    """b at the nodes from the accelerations [n, K+1], the same on both sides of an exchange."""
    gained = grid.h * (a[:, :-1] + a[:, 1:])
    within = xp.concatenate([np.zeros((grid.steps, 1)), xp.cumsum(gained, axis=1)], axis=1)
    before = xp.concatenate([np.zeros(1), xp.cumsum(within[:, -1])[:-1]])
    return first + before[:, None] + within
