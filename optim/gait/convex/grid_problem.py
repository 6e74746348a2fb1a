"""A gait problem on its grid: rows, units, the program's numbers, and slopes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim.gait.convex.limits import STANDING, Limits, Rows, rows_of, torque_unit
from stickslip.optim.gait.convex.program import Numbers, Structure
from stickslip.optim.gait.gait import Gait, friction_uses, terms_on_grid
from stickslip.optim.gait.objective import STRAIN, TIME, TORQUE, WORK
from stickslip.optim.options import float64_program

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from jaxtyping import Array, Float

    from stickslip.dynamics.numeric import Number
    from stickslip.optim.gait.convex.program import Solved
    from stickslip.optim.gait.objective import Goal
    from stickslip.optim.gait.profile import Grid, Profiles


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
        sizes: dict[str, float] = {
            TIME: 1 / self.rate,
            TORQUE: self.torque**2 / self.rate,
            WORK: self.torque,
            STRAIN: self.torque**2,
        }
        return sizes[term]


class Sample(NamedTuple):
    """A program's coefficients at crank angles [m], in its units: rows; torque = torque[0] a +
    torque[1] b + torque[2]; least and greatest b; `weight` of each angle in an integral over the
    phase."""

    A: Float[np.ndarray, "rows m"]
    B: Float[np.ndarray, "rows m"]
    C: Float[np.ndarray, "rows m"]
    torque: tuple[np.ndarray, np.ndarray, np.ndarray]
    ends: tuple[np.ndarray, np.ndarray]
    weight: Float[np.ndarray, "m"]


@dataclass(frozen=True)
class GridProblem:
    """longest: time of the whole walk [s], None: any. first, last: least and greatest b there
    [rad^2/s^2]. rate_unit [rad/s], None: chosen from the robot and the mean rate."""

    profiles: Profiles
    goal: Goal
    limits: Limits
    periodic: bool
    longest: float | None
    first: tuple[float, float]
    last: tuple[float, float]
    rate_unit: float | None = None

    @property
    def grid(self) -> Grid:
        """Its nodes."""
        return self.profiles.grid

    @cached_property
    def rows(self) -> Rows:
        """The limits at the nodes, SI."""
        return rows_of(self.profiles.nodes, self.limits)

    @cached_property
    def rows_between(self) -> Rows:
        """The limits at the grid's samples, SI."""
        return rows_of(self.profiles.samples, self.limits)

    @cached_property
    def units(self) -> Units:
        """Units; that of the rate is the lift-off rate, or nearer to a far lower mean rate."""
        rate = self.limits.lift_off if self.rate_unit is None else self.rate_unit
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

    @property
    def structure(self) -> Structure:
        """Structure of the program with the goal's own objective."""
        return Structure(
            self.grid.steps,
            self.grid.cells,
            len(self.limits.names),
            self.periodic,
            tuple(sorted(self.goal.weights)),
            self.longest is not None,
            _end(self.first),
            _end(self.last),
        )

    def sample(self, inside: bool) -> Sample:
        """Data of a certificate, at the nodes or inside the cells."""
        p = self.profiles.inside if inside else self.profiles.nodes
        A, B, C = (rows_of(p, self.limits) if inside else self.rows).flat()
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
        """The program's numbers. relaxed: a limit that may be violated by r units."""
        sample = self.sample(inside=False)
        names, C = np.array(self.limits.names), sample.C
        for node, end in ((0, self.first), (-1, self.last)):
            if _end(end) == "rest":  # said by an equality already: a limit would have no inside
                C = C.copy()
                C[names == STANDING, node] += 1.0
        R = np.where((names == relaxed)[:, None], 1.0, 0.0) * np.ones_like(C)
        on_a, on_b, rest = sample.torque
        b, rate = self.units.b, self.units.rate
        weights = {
            term: w * self.units.of(term) / self.scale for term, w in self.goal.weights.items()
        }
        return Numbers(
            h=self.grid.h,
            A=sample.A,
            B=sample.B,
            C=C,
            R=R,
            on_a=on_a,
            on_b=on_b,
            rest=rest,
            trapezoid=self.grid.weights.ravel(),
            weights=weights,
            longest=None if self.longest is None else self.longest * rate,
            first=(self.first[0] / b, self.first[1] / b),
            last=(self.last[0] / b, self.last[1] / b),
        )

    def gait(self, a: Float[np.ndarray, "n K+1"], first: float) -> Gait:
        """The gait with these accelerations that begins with b = first, SI."""
        return Gait(self.profiles, a, squares_of(self.grid, a, first))

    def gait_of(self, solved: Solved) -> Gait:
        """The gait that a program found. What rounding leaves at an end that is given is taken off
        all accelerations alike. ValueError without a point."""
        if solved.a is None or solved.b is None:
            raise ValueError(f"{solved.message}; accepted: an outcome with a point")
        b = self.units.b
        a, first = solved.a * b, float(np.clip(solved.b[0, 0] * b, *self.first))
        end = float(squares_of(self.grid, a, first)[-1, -1])
        wanted = first if self.periodic else float(np.clip(end, *self.last))
        return self.gait(a + (wanted - end) / (2 * np.pi * self.grid.steps), first)

    def limited(self, **changes: object) -> GridProblem:
        """The same with some limits changed."""
        return replace(self, limits=replace(self.limits, **changes))

    def margins(
        self,
        a: Float[Number, "n K+1"],
        b: Float[Number, "n K+1"],
        time: Float[Number, ""],
        xp: ModuleType = np,
    ) -> Float[Number, "m"]:
        """Scaled margins: the rows at the nodes, the time, and both sides of the end. xp: numpy, or
        jax.numpy for arrays that are traced."""
        low, high = (b[0, 0], b[0, 0]) if self.periodic else self.last
        late = [] if self.longest is None else [1 - time / self.longest]
        ends = [(b[-1, -1] - low) / self.units.b, (high - b[-1, -1]) / self.units.b]
        rows = -self.rows.scaled_excess(a, b)
        return xp.concatenate([xp.ravel(rows), xp.stack([*late, *ends])])

    def gradient(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Gradient of the value; a subgradient at kinks, 0 where there is none."""
        return np.nan_to_num(self._slopes[0](x), posinf=0.0, neginf=0.0)

    def jacobian(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m n"]:
        """Jacobian of `margins`; of the time 0 where there is none."""
        return np.nan_to_num(self._slopes[1](x), posinf=0.0, neginf=0.0)

    @cached_property
    def _slopes(self) -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
        """Programs of the gradient and of the jacobian."""
        p = self.profiles.nodes

        def walk(x: Array) -> tuple[Array, Array, dict[str, Any]]:
            a = x[1:].reshape(self.grid.theta.shape)
            b = squares_of(self.grid, a, x[0], jnp)
            return a, b, terms_on_grid(self.grid, b, p.torque(a, b), jnp)

        def value(x: Array) -> Array:
            a, b, spent = walk(x)
            if self.goal.is_friction:
                return jnp.max(friction_uses(p.friction(a, b), p.normal(a, b), jnp))
            return jnp.asarray(self.goal.of(spent))

        def margins(x: Array) -> Array:
            a, b, spent = walk(x)
            return self.margins(a, b, spent[TIME], jnp)

        return float64_program(jax.grad(value)), float64_program(jax.jacfwd(margins))


def _end(given: tuple[float, float]) -> str:
    """An end's kind in the program's structure."""
    low, high = given
    return "free" if low < high else "given" if low > 0 else "rest"


def squares_of(
    grid: Grid, a: Float[Number, "n K+1"], first: Float[Number, ""], xp: ModuleType = np
) -> Float[Number, "n K+1"]:
    """b at the nodes from the accelerations, the same on both sides of an exchange."""
    gained = grid.h * (a[:, :-1] + a[:, 1:])
    within = xp.concatenate([np.zeros((grid.steps, 1)), xp.cumsum(gained, axis=1)], axis=1)
    before = xp.concatenate([np.zeros(1), xp.cumsum(within[:, -1])[:-1]])
    return first + before[:, None] + within
