"""Bound from a gait's multipliers, computed in NumPy from the robot's own numbers.

For any multiplier pi of b' = 2 a, continuous over exchanges, and nu >= 0 of the time,

    value >= integral of min over (a, b) within the limits of [ l(a, b) - pi' b - 2 pi a ]
             + (pi b at the ends) - nu longest,

l being what a radian costs with nu added to the weight of time: each crank angle by itself
(`pointwise.py`). On the grid the integral is the trapezoid rule's sum and bounds gaits of the
grid; with pi straight between nodes it is taken by Gauss and Legendre, and bounds every gait. The
solver is trusted in nothing: any pi and nu give a bound, and only good ones a good bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.program import STRAIN, TIME, TORQUE, WORK
from stickslip.optim.gait.proof.pointwise import Lagrangian, Polygons, least

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.gait.convex.program import Duals, Numbers
    from stickslip.optim.gait.grid import Grid


@dataclass(frozen=True)
class Multipliers:
    """pi in each cell [n, K], of b at exchanges, and of the time, with one sign."""

    motion: Float[np.ndarray, "n K"]
    exchange: Float[np.ndarray, "e"]
    time: float

    @classmethod
    def of(cls, duals: Duals, sign: float) -> Multipliers:
        """sign: of the equalities; which one the solver's interface gives is not relied on."""
        finite = [np.nan_to_num(part, posinf=0.0, neginf=0.0) for part in duals[:2]]
        time = max(float(np.nan_to_num(duals.time)), 0.0)
        return cls(sign * finite[0], sign * finite[1], time)

    def joined(self, periodic: bool) -> tuple[np.ndarray, np.ndarray]:
        """Multipliers of b at both ends of each step [n]: 0 where nothing joins them."""
        n = len(self.motion)
        begins, ends = np.zeros(n), np.zeros(n)
        count = min(n - 1, len(self.exchange))
        begins[1 : count + 1] = ends[:count] = self.exchange[:count]
        if periodic and len(self.exchange):
            begins[0] = ends[-1] = self.exchange[-1]
        return begins, ends


@dataclass(frozen=True)
class Sample:
    """A program's coefficients at crank angles [m], in its units: rows, torque and least and
    greatest b; `weight` [m] of each angle in an integral over the phase."""

    A: Float[np.ndarray, "rows m"]
    B: Float[np.ndarray, "rows m"]
    C: Float[np.ndarray, "rows m"]
    torque: tuple[np.ndarray, np.ndarray, np.ndarray]
    ends: tuple[np.ndarray, np.ndarray]
    weight: Float[np.ndarray, "m"]

    def least(
        self,
        form: Lagrangian,
        on_a: Float[np.ndarray, "m"],
        C: Float[np.ndarray, "rows m"] | None = None,
    ) -> Float[np.ndarray, "m"]:
        """The least of `form` + on_a a at each angle; C: other right sides."""
        scale, of_b, rest = self.torque
        per = on_a / scale
        full = Lagrangian(
            form.inverse,
            form.heat,
            form.strain,
            form.work,
            form.root,
            form.on_T + per,
            form.on_b - per * of_b,
            form.rest - per * rest,
        )
        limits = self.C if C is None else C
        polygons = Polygons.of(self.A, self.B, limits, self.torque, self.ends)
        return least(polygons, full)


def grid_bound(
    grid: Grid,
    sample: Sample,
    numbers: Numbers,
    multipliers: Multipliers,
    periodic: bool,
    at: tuple[np.ndarray, np.ndarray],
    C: np.ndarray | None = None,
) -> float:
    """The bound on gaits of the grid; at: a and b of the gait found, where the cells' times and
    torques squared over time are replaced by their tangents, which lie below them."""
    h, pi = grid.h, multipliers.motion
    zero = np.zeros((grid.steps, 1))
    begins, ends = (part[:, None] for part in multipliers.joined(periodic))
    on_b = np.hstack([zero, pi]) - np.hstack([pi, zero])
    on_b[:, :1] += begins
    on_b[:, -1:] -= ends
    spread = h * pi
    on_a = -(np.hstack([zero, spread]) + np.hstack([spread, zero]))
    form, constant = _tangents(grid, numbers, multipliers.time, *at)
    weight = sample.weight
    form = Lagrangian(
        form.inverse,
        form.heat,
        numbers.weights.get(STRAIN, 0.0) * weight,
        numbers.weights.get(WORK, 0.0) * weight,
        form.root,
        form.on_T,
        on_b.ravel(),
        form.rest,
    )
    total = float(np.sum(sample.least(form, on_a.ravel(), C))) + constant
    return total - multipliers.time * (numbers.longest or 0.0)


def _tangents(
    grid: Grid, numbers: Numbers, nu: float, a: np.ndarray, b: np.ndarray
) -> tuple[Lagrangian, float]:
    """Lower bounds of 2 h / (s + s') and h (T^2 + T'^2) / (s + s'): node terms and a constant.

    2 h / x >= 2 t - t^2 x / (2 h) with t = 2 h / x found; T^2 / x >= 2 r T - r^2 x, r = T / x.
    """
    rate = np.sqrt(np.maximum(b, 0.0))
    x = np.maximum(rate[:, :-1] + rate[:, 1:], 1e-12)
    weight = numbers.weights.get(TIME, 0.0) + nu
    root = weight * 2 * grid.h / x**2
    constant = float(np.sum(weight * 4 * grid.h / x))
    zero = np.zeros((grid.steps, 1))
    on_T = np.zeros_like(b)
    heat = numbers.weights.get(TORQUE, 0.0)
    if heat > 0:
        shape = b.shape
        parts = (part.reshape(shape) for part in (numbers.on_a, numbers.on_b, numbers.rest))
        of_a, of_b, rest = parts
        T = of_a * a + of_b * b + rest
        r, r_next = T[:, :-1] / x, T[:, 1:] / x
        root = root + heat * grid.h * (r**2 + r_next**2)
        on_T = 2 * heat * (np.hstack([grid.h * r, zero]) + np.hstack([zero, grid.h * r_next]))
    both = np.hstack([root, zero]) + np.hstack([zero, root])
    nothing = np.zeros(b.size)
    form = Lagrangian(
        nothing, nothing, nothing, nothing, both.ravel(), on_T.ravel(), nothing, nothing
    )
    return form, constant


def every_bound(
    grid: Grid,
    sample: Sample,
    numbers: Numbers,
    multipliers: Multipliers,
    periodic: bool,
    C: np.ndarray | None = None,
) -> float:
    """The bound on every gait; sample: at `grid.inside`, flat."""
    pi = _nodes(grid, multipliers, periodic, numbers)
    slope = np.diff(pi, axis=1) / grid.h
    x = grid.inside[0]
    here = pi[:, :-1, None] + slope[..., None] * x
    on_b = np.broadcast_to(-slope[..., None], x.shape)
    count = x.size

    def many(number: float) -> np.ndarray:
        return np.full(count, number)

    weights = {term: numbers.weights.get(term, 0.0) for term in (TIME, TORQUE, WORK, STRAIN)}
    form = Lagrangian(
        many(weights[TIME] + multipliers.time),
        many(weights[TORQUE]),
        many(weights[STRAIN]),
        many(weights[WORK]),
        many(0.0),
        many(0.0),
        on_b.ravel(),
        many(0.0),
    )
    values = sample.least(form, -2 * here.ravel(), C)
    total = float(np.sum(sample.weight * values))
    for sign, multiplier, ends in ((-1, pi[0, 0], numbers.first), (1, pi[-1, -1], numbers.last)):
        if not periodic:
            total += min(sign * multiplier * end for end in ends)
    return total - multipliers.time * (numbers.longest or 0.0)


def _nodes(
    grid: Grid, multipliers: Multipliers, periodic: bool, numbers: Numbers
) -> Float[np.ndarray, "n K+1"]:
    """pi at the nodes: straight between the middles of cells, on to the ends of each step, where it
    is the exchange's own, and 0 at an end of the walk that is free."""
    pi, h = multipliers.motion, grid.h
    nodes = np.zeros((grid.steps, grid.cells + 1))
    between = h[:, :-1] + h[:, 1:]
    nodes[:, 1:-1] = (h[:, 1:] * pi[:, :-1] + h[:, :-1] * pi[:, 1:]) / between
    nodes[:, 0], nodes[:, -1] = 2 * pi[:, 0] - nodes[:, 1], 2 * pi[:, -1] - nodes[:, -2]
    begins, ends = multipliers.joined(periodic)
    nodes[1:, 0], nodes[:-1, -1] = begins[1:], ends[:-1]
    if periodic:
        nodes[0, 0], nodes[-1, -1] = begins[0], ends[-1]
    else:
        if numbers.first[0] < numbers.first[1]:
            nodes[0, 0] = 0.0
        if numbers.last[0] < numbers.last[1]:
            nodes[-1, -1] = 0.0
    return nodes
