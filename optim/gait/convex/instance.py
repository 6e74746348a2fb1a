"""A gait problem in numbers: profiles on its grid, rows, units, and the program's numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.limits import (
    STANDING,
    Limits,
    Rows,
    affine_torque,
    rows_of,
    torque_unit,
)
from stickslip.optim.gait.convex.program import Numbers, Structure
from stickslip.optim.gait.convex.units import Units
from stickslip.optim.gait.gait import Gait
from stickslip.optim.gait.profile import Closely, profile_of
from stickslip.optim.gait.proof.certificate import Sample

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.dynamics.biped import BipedParams
    from stickslip.optim.gait.convex.goal import Goal
    from stickslip.optim.gait.convex.program import Solved
    from stickslip.optim.gait.grid import Grid
    from stickslip.optim.gait.profile import Profile, Robot


@dataclass(frozen=True)
class Instance:
    """params, robot: in float64. longest: time of the whole walk [s], None: any. first, last: least
    and greatest b there [rad^2/s^2]."""

    params: BipedParams
    robot: Robot
    grid: Grid
    goal: Goal
    limits: Limits
    periodic: bool
    longest: float | None
    first: tuple[float, float]
    last: tuple[float, float]
    rate_unit: float | None = None
    """[rad/s]; None: chosen from the robot and the mean rate."""

    @cached_property
    def profiles(self) -> tuple[Profile, Profile]:
        """Profiles at the nodes [n, K+1] and inside the cells [n, K, Q]."""
        theta, x = self.grid.theta, self.grid.inside[0]
        nodes, inside = theta.size, theta[:, :-1, None] + x
        both = np.concatenate([theta.ravel(), inside.ravel()])
        whole = profile_of(self.params, self.robot, both)
        return _part(whole, slice(0, nodes), theta.shape), _part(
            whole, slice(nodes, None), inside.shape
        )

    @cached_property
    def rows(self) -> tuple[Rows, Rows]:
        """The limits at the nodes and inside the cells, SI."""
        return rows_of(self.profiles[0], self.limits), rows_of(self.profiles[1], self.limits)

    @cached_property
    def closely(self) -> Closely:
        """Profile at the grid's samples."""
        return Closely(self.params, self.robot, self.grid)

    @cached_property
    def rows_between(self) -> Rows:
        """The limits at the grid's samples, SI."""
        return rows_of(self.closely.profile, self.limits)

    @cached_property
    def units(self) -> Units:
        """Units; that of the rate is the lift-off rate, or nearer to a far lower mean rate."""
        rate = self.limits.lift_off if self.rate_unit is None else self.rate_unit
        if self.rate_unit is None and self.longest is not None:
            asked = 2 * np.pi * self.grid.steps / self.longest
            rate = float(np.clip(asked, rate / 10, rate))
        return Units(rate, torque_unit(self.profiles[0]))

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
        profile, rows = self.profiles[inside], self.rows[inside].flat()
        weight = self.grid.inside[1] if inside else self.grid.weights
        b = self.units.b
        count = weight.size
        low, high = np.zeros(count), np.full(count, np.inf)
        if not inside:
            low[0], high[0] = np.array(self.first) / b
            last = np.array(self.last) / b
            low[-1], high[-1] = max(low[-1], last[0]), min(high[-1], last[1])
        return Sample(
            rows.A * b, rows.B * b, rows.C, self._torque(profile), (low, high), weight.ravel()
        )

    def _torque(self, p: Profile) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        on_a, on_b, rest = (part.ravel() for part in affine_torque(p))
        b, T = self.units.b, self.units.torque
        return on_a * b / T, on_b * b / T, rest / T

    def numbers(
        self, tighter: Float[np.ndarray, "m nodes"] | None = None, relaxed: str = ""
    ) -> Numbers:
        """The program's numbers. tighter: what is kept of each row in reserve, in its unit.
        relaxed: a limit that may be missed by r units."""
        sample = self.sample(inside=False)
        names = np.array(self.limits.names)
        C = sample.C if tighter is None else sample.C - tighter
        for node, end in ((0, self.first), (-1, self.last)):
            if _end(end) == "rest":  # said by an equality already: a limit would have no inside
                C = C + np.where(names == STANDING, 1.0, 0.0)[:, None] * _one_at(node, C.shape[1])
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
        b = squares_of(self.grid, a, first)
        return Gait(self.grid, a, b, self.profiles[0], self.closely)

    def gait_of(self, solved: Solved) -> Gait:
        """The gait that a program found. What rounding leaves at an end that is given is taken off
        all accelerations alike. ValueError without a point."""
        if solved.a is None or solved.b is None:
            raise ValueError(f"{solved.words}; accepted: an outcome with a point")
        b = self.units.b
        a, first = solved.a * b, float(np.clip(solved.b[0, 0] * b, *self.first))
        end = float(squares_of(self.grid, a, first)[-1, -1])
        wanted = first if self.periodic else float(np.clip(end, *self.last))
        return self.gait(a + (wanted - end) / (2 * np.pi * self.grid.steps), first)

    def use(self, **changes: object) -> Instance:
        """The same with some limits changed; what was computed of the profiles is kept."""
        return self.towards(limits=replace(self.limits, **changes))

    def finer(self, times: int) -> Instance:
        """The same on a grid of so many times the cells."""
        return replace(self, grid=replace(self.grid, cells=times * self.grid.cells))

    def towards(self, **changes: object) -> Instance:
        """The same with other fields."""
        other = replace(self, **changes)
        other.__dict__.update(profiles=self.profiles, closely=self.closely)
        return other


def _end(given: tuple[float, float]) -> str:
    """An end's kind in the program's structure."""
    low, high = given
    return "free" if low < high else "given" if low > 0 else "rest"


def _one_at(place: int, count: int) -> np.ndarray:
    found = np.zeros(count)
    found[place] = 1.0
    return found


def squares_of(
    grid: Grid, a: Float[np.ndarray, "n K+1"], first: float
) -> Float[np.ndarray, "n K+1"]:
    """b at the nodes from the accelerations, the same on both sides of an exchange."""
    gained = grid.h * (a[:, :-1] + a[:, 1:])
    within = np.concatenate([np.zeros((grid.steps, 1)), np.cumsum(gained, axis=1)], axis=1)
    before = np.concatenate([[0.0], np.cumsum(within[:, -1])[:-1]])
    return first + before[:, None] + within


def _part(whole: Profile, where: slice, shape: tuple[int, ...]) -> Profile:
    names = ("theta", "M", "dM", "P", "dP", "Y", "dY", "L", "dL", "X")
    parts = {name: getattr(whole, name)[where].reshape(shape) for name in names}
    return replace(whole, **parts)
