"""Bound from a gait's multipliers, computed in NumPy from the robot's own numbers.

For any multiplier pi of b' = 2 a, continuous over exchanges, and nu >= 0 of the time,

    value >= integral of min over (a, b) within the limits of [ l(a, b) - pi' b - 2 pi a ]
             + (pi b at the ends) - nu longest,

l being what a radian costs with nu added to the weight of time: each crank angle by itself. On the
grid the integral is the trapezoid rule's sum and bounds gaits of the grid; with pi straight between
nodes it is taken by Gauss and Legendre, and bounds every gait. The solver is trusted in nothing:
any pi and nu give a bound, and only good ones a good bound.

At one crank angle the limits leave a convex polygon of torques and squared rates (T, b). For a
given b the best T of its interval is known in closed form, and what is left of b alone is searched
by golden section. All in units of about 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.gait.gait import TIME, TORQUE, WORK

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.gait.convex.grid_problem import Duals, GridProblem, Numbers, Sample
    from stickslip.optim.gait.profile import Grid

GOLDEN = (np.sqrt(5) - 1) / 2
ROUNDS = 75
"""The bracket shrinks to 2e-16 of what the limits leave of b."""
SLACK = 1e-9
"""Widening of the limits, in their units, to cover rounding. A bound over
more gaits is one for those inside the limits."""
STEEP = 1e-12
"""A row's coefficient of the torque below which it limits the rate alone."""


def _joined(duals: Duals, periodic: bool) -> tuple[np.ndarray, np.ndarray]:
    """Multipliers of b at both ends of each step [n]: 0 where nothing joins them."""
    n = len(duals.motion)
    begins, ends = np.zeros(n), np.zeros(n)
    count = min(n - 1, len(duals.exchange))
    begins[1 : count + 1] = ends[:count] = duals.exchange[:count]
    if periodic and len(duals.exchange):
        begins[0] = ends[-1] = duals.exchange[-1]
    return begins, ends


def _at_nodes(duals: Duals, problem: GridProblem) -> np.ndarray:
    """pi at the nodes [n, K+1]: straight between the middles of cells, on to the ends of each
    step, where it is the exchange's own, and 0 at an end of the walk that is free."""
    pi, h = duals.motion, problem.grid.h
    nodes = np.zeros(problem.grid.theta.shape)
    between = h[:, :-1] + h[:, 1:]
    nodes[:, 1:-1] = (h[:, 1:] * pi[:, :-1] + h[:, :-1] * pi[:, 1:]) / between
    nodes[:, 0], nodes[:, -1] = 2 * pi[:, 0] - nodes[:, 1], 2 * pi[:, -1] - nodes[:, -2]
    begins, ends = _joined(duals, problem.periodic)
    nodes[1:, 0], nodes[:-1, -1] = begins[1:], ends[:-1]
    if problem.periodic or problem.first[0] < problem.first[1]:
        nodes[0, 0] = begins[0]
    if problem.periodic or problem.last[0] < problem.last[1]:
        nodes[-1, -1] = ends[-1]
    return nodes


class Lagrangian(NamedTuple):
    """Coefficients, numbers or [m], of what is minimised at m crank angles, in torque T and b:

    inverse / sqrt(b) + heat T^2 / sqrt(b) + work max(T, 0) - root sqrt(b)
    + on_T T + on_b b + rest,   all of those above `on_T` being >= 0
    """

    inverse: Float[np.ndarray, "m"] | float = 0.0
    heat: Float[np.ndarray, "m"] | float = 0.0
    work: Float[np.ndarray, "m"] | float = 0.0
    root: Float[np.ndarray, "m"] | float = 0.0
    on_T: Float[np.ndarray, "m"] | float = 0.0
    on_b: Float[np.ndarray, "m"] | float = 0.0
    rest: Float[np.ndarray, "m"] | float = 0.0


def grid_bound(
    problem: GridProblem, numbers: Numbers, duals: Duals, at: tuple[np.ndarray, np.ndarray]
) -> float:
    """The bound on gaits of the grid. at: a and b of the gait found, where the cells' times and
    torques squared over time are replaced by their tangents, which lie below them."""
    sample, grid, pi = problem.sample(inside=False), problem.grid, duals.motion
    zero = np.zeros((grid.steps, 1))
    begins, ends = (part[:, None] for part in _joined(duals, problem.periodic))
    on_b = np.hstack([zero, pi]) - np.hstack([pi, zero])
    on_b[:, :1] += begins
    on_b[:, -1:] -= ends
    spread = grid.h * pi
    on_a = -(np.hstack([zero, spread]) + np.hstack([spread, zero])).ravel()
    if problem.straight is not None:
        on_a += duals.straight @ problem.straight
    root, on_T, constant = _tangents(grid, numbers, duals.time, *at)
    form = Lagrangian(
        work=numbers.weights.get(WORK, 0.0) * sample.weight, root=root, on_T=on_T, on_b=on_b.ravel()
    )
    total = float(np.sum(least_of(sample, form, on_a))) + constant
    return total - duals.time * (numbers.longest or 0.0)


def _tangents(
    grid: Grid, numbers: Numbers, nu: float, a: np.ndarray, b: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Lower bounds of 2 h / (s + s') and h (T^2 + T'^2) / (s + s'): coefficients of the root of b
    and of T at the nodes, and a constant.

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
        of_a, of_b, rest = (part.reshape(b.shape) for part in numbers.torque)
        T = of_a * a + of_b * b + rest
        r, r_next = T[:, :-1] / x, T[:, 1:] / x
        root = root + heat * grid.h * (r**2 + r_next**2)
        on_T = 2 * heat * (np.hstack([grid.h * r, zero]) + np.hstack([zero, grid.h * r_next]))
    both = np.hstack([root, zero]) + np.hstack([zero, root])
    return both.ravel(), on_T.ravel(), constant


def every_bound(problem: GridProblem, numbers: Numbers, duals: Duals) -> float:
    """The bound on every gait."""
    sample, grid = problem.sample(inside=True), problem.grid
    pi = _at_nodes(duals, problem)
    slope = np.diff(pi, axis=1) / grid.h
    x = grid.inside[0]
    here = pi[:, :-1, None] + slope[..., None] * x
    form = Lagrangian(
        inverse=numbers.weights.get(TIME, 0.0) + duals.time,
        heat=numbers.weights.get(TORQUE, 0.0),
        work=numbers.weights.get(WORK, 0.0),
        on_b=np.broadcast_to(-slope[..., None], x.shape).ravel(),
    )
    values = least_of(sample, form, -2 * here.ravel())
    total = float(np.sum(sample.weight * values))
    for sign, multiplier, i in ((-1, pi[0, 0], 0), (1, pi[-1, -1], -1)):
        if not problem.periodic:
            total += min(sign * multiplier * end[i] for end in numbers.ends)
    return total - duals.time * (numbers.longest or 0.0)


def least_of(
    sample: Sample, form: Lagrangian, on_a: Float[np.ndarray, "m"]
) -> Float[np.ndarray, "m"]:
    """The least of `form` + on_a a at each angle; infinite where the limits leave nothing."""
    scale, of_b, rest = sample.torque
    per = on_a / scale
    whole = form._replace(
        on_T=form.on_T + per, on_b=form.on_b - per * of_b, rest=form.rest - per * rest
    )
    return least(Polygons.of(sample), whole)


@dataclass(frozen=True)
class Polygons:
    """on_T T + on_b b <= most [rows, m], and least and greatest b [m]."""

    on_T: Float[np.ndarray, "rows m"]
    on_b: Float[np.ndarray, "rows m"]
    most: Float[np.ndarray, "rows m"]
    low: Float[np.ndarray, "m"]
    high: Float[np.ndarray, "m"]

    @classmethod
    def of(cls, sample: Sample) -> Polygons:
        on_a, of_b, rest = sample.torque
        per = sample.A / on_a
        on_T, on_b, most = per, sample.B - per * of_b, sample.C + per * rest + SLACK
        on_T = np.where(np.abs(on_T) < STEEP, 0.0, on_T)
        return cls(on_T, on_b, most, *_rates(on_T, on_b, most, *sample.ends))

    def sides(self, sign: int) -> tuple[np.ndarray, np.ndarray]:
        """at and per [rows, m] of the rows that hold T from below (-1) or above (1): at - per b."""
        own = sign * self.on_T > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.where(own, self.most / self.on_T, sign * np.inf)
            per = np.where(own, self.on_b / self.on_T, 0.0)
        kept = np.any(own, axis=1)
        none = np.full((1, own.shape[1]), sign * np.inf)  # where no row does
        return np.concatenate([at[kept], none]), np.concatenate([per[kept], np.zeros_like(none)])


def least(polygons: Polygons, form: Lagrangian) -> Float[np.ndarray, "m"]:
    """The least value at each angle, by golden section; infinite where the limits leave nothing."""
    low, high = polygons.low, polygons.high
    empty = low > high
    low, high = np.where(empty, 0.0, low), np.where(empty, 0.0, high)
    value = _least_torque(polygons, form)
    with np.errstate(over="ignore", invalid="ignore"):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        at_left, at_right = value(left), value(right)
        found = np.minimum(value(low), value(high))
        for _ in range(ROUNDS):
            lower = at_left <= at_right
            high, low = np.where(lower, right, high), np.where(lower, low, left)
            part = GOLDEN * (high - low)
            inner = np.where(lower, high - part, low + part)
            new = value(inner)
            left, right = np.where(lower, inner, right), np.where(lower, left, inner)
            at_left, at_right = np.where(lower, new, at_right), np.where(lower, at_left, new)
            found = np.minimum(found, new)
    return np.where(empty, np.inf, found)


def _least_torque(polygons: Polygons, form: Lagrangian) -> Callable[[np.ndarray], np.ndarray]:
    """A function of b [m]: the least over T.

    curve T^2 + on_T T + work max(T, 0) is convex in T: without limits it is least where
    2 curve T = max(-on_T - work, 0) - max(on_T, 0), with limits at the nearest T that they leave.
    """
    (at, per), (at_top, per_top) = polygons.sides(-1), polygons.sides(1)
    pull = np.maximum(-form.on_T - form.work, 0.0) - np.maximum(form.on_T, 0.0)

    def value(b: np.ndarray) -> np.ndarray:
        floor, top = np.max(at - per * b, axis=0), np.min(at_top - per_top * b, axis=0)
        rate = np.sqrt(np.maximum(b, 0.0))
        slow = 1 / np.maximum(rate, 1e-150)
        curve = form.heat * slow
        T = pull / np.maximum(2 * curve, 1e-290)
        T = np.minimum(np.maximum(T, floor), np.maximum(floor, top))
        found = (curve * T + form.on_T) * T + form.work * np.maximum(T, 0.0)
        return found + form.inverse * slow - form.root * rate + form.on_b * b + form.rest

    return value


def _rates(
    on_T: np.ndarray, on_b: np.ndarray, most: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest b for which there is a T: every lower limit below every upper one."""
    low, high = low.copy(), high.copy()
    count = len(on_T)

    def keep(slope: np.ndarray, room: np.ndarray, where: np.ndarray) -> None:
        """slope b <= room, at some of the angles."""
        with np.errstate(divide="ignore", invalid="ignore"):
            at = room / slope
        np.minimum(high, np.where(where & (slope > 0), at, np.inf), out=high)
        np.maximum(low, np.where(where & (slope < 0), at, -np.inf), out=low)
        low[where & (slope == 0) & (room < 0)] = np.inf

    for i in range(count):
        keep(on_b[i], most[i], on_T[i] == 0)
        for j in range(count):
            opposed = (on_T[i] < 0) & (on_T[j] > 0)
            if np.any(opposed):
                u, v = -on_T[i], on_T[j]
                keep(on_b[j] * u + on_b[i] * v, most[j] * u + most[i] * v, opposed)
    return low, high
