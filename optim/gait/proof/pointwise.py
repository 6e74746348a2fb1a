"""The least of a gait's Lagrangian at each crank angle by itself, which weak duality asks for.

At one crank angle the limits leave a convex polygon of torques and squared rates (T, b). Over it

    inverse / sqrt(b) + heat T^2 / sqrt(b) + strain T^2 + work max(T, 0) - root sqrt(b)
    + on_T T + on_b b + rest

is convex: for a given b the best T of its interval is known in closed form, and what is left of b
alone is searched by golden section. All in units of about 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Float

GOLDEN = (np.sqrt(5) - 1) / 2
ROUNDS = 75
"""The bracket shrinks to 2e-16 of what the limits leave of b."""
SLACK = 1e-9
"""Widening of the limits, in their units, to cover rounding. A bound over
more gaits is one for those inside the limits."""
STEEP = 1e-12
"""A row's coefficient of the torque below which it limits the rate alone."""


@dataclass(frozen=True)
class Lagrangian:
    """Coefficients at m crank angles, each [m]; all of those above `on_T` are >= 0."""

    inverse: Float[np.ndarray, "m"]
    heat: Float[np.ndarray, "m"]
    strain: Float[np.ndarray, "m"]
    work: Float[np.ndarray, "m"]
    root: Float[np.ndarray, "m"]
    on_T: Float[np.ndarray, "m"]
    on_b: Float[np.ndarray, "m"]
    rest: Float[np.ndarray, "m"]


@dataclass(frozen=True)
class Polygons:
    """on_T T + on_b b <= most [rows, m], and least and greatest b [m]."""

    on_T: Float[np.ndarray, "rows m"]
    on_b: Float[np.ndarray, "rows m"]
    most: Float[np.ndarray, "rows m"]
    low: Float[np.ndarray, "m"]
    high: Float[np.ndarray, "m"]

    @classmethod
    def of(
        cls,
        A: Float[np.ndarray, "rows m"],
        B: Float[np.ndarray, "rows m"],
        C: Float[np.ndarray, "rows m"],
        torque: tuple[np.ndarray, np.ndarray, np.ndarray],
        ends: tuple[np.ndarray, np.ndarray],
    ) -> Polygons:
        """Polygons of rows in a and b; torque = on_a a + on_b b + rest [m]; ends: of b [m]."""
        on_a, of_b, rest = torque
        per = A / on_a
        on_T, on_b, most = per, B - per * of_b, C + per * rest + SLACK
        on_T = np.where(np.abs(on_T) < STEEP, 0.0, on_T)
        return cls(on_T, on_b, most, *_rates(on_T, on_b, most, *ends))

    def sides(self, sign: int) -> tuple[np.ndarray, np.ndarray]:
        """The rows that hold T from below (sign -1) or from above (1) as T = at - per b, two of
        [rows, m]; the others hold nothing."""
        own = sign * self.on_T > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.where(own, self.most / self.on_T, sign * np.inf)
            per = np.where(own, self.on_b / self.on_T, 0.0)
        kept = np.any(own, axis=1)
        none = np.full((1, own.shape[1]), sign * np.inf)  # where no row does
        return np.concatenate([at[kept], none]), np.concatenate([per[kept], np.zeros_like(none)])


def least(polygons: Polygons, form: Lagrangian) -> Float[np.ndarray, "m"]:
    """The least value at each angle; infinite where the limits leave nothing."""
    low, high = polygons.low, polygons.high
    empty = low > high
    low, high = np.where(empty, 0.0, low), np.where(empty, 0.0, high)
    value = Searched(polygons, form)
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


class Searched:
    """The least over T at given b [m], prepared for many b.

    curve T^2 + on_T T + work max(T, 0) is convex in T: without limits it is least where
    2 curve T = max(-on_T - work, 0) - max(on_T, 0), with limits at the nearest T that they leave.
    """

    def __init__(self, polygons: Polygons, form: Lagrangian):
        self._form = form
        self._floors = polygons.sides(-1)
        self._tops = polygons.sides(1)
        self._pull = np.maximum(-form.on_T - form.work, 0.0) - np.maximum(form.on_T, 0.0)

    def __call__(self, b: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m"]:
        """The value at b >= 0."""
        form = self._form
        (at, per), (at_top, per_top) = self._floors, self._tops
        floor, top = np.max(at - per * b, axis=0), np.min(at_top - per_top * b, axis=0)
        rate = np.sqrt(np.maximum(b, 0.0))
        slow = 1 / np.maximum(rate, 1e-150)
        curve = form.heat * slow + form.strain
        T = self._pull / np.maximum(2 * curve, 1e-290)
        T = np.minimum(np.maximum(T, floor), np.maximum(floor, top))
        found = (curve * T + form.on_T) * T + form.work * np.maximum(T, 0.0)
        return found + form.inverse * slow - form.root * rate + form.on_b * b + form.rest


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
            apart = (on_T[i] < 0) & (on_T[j] > 0)
            if np.any(apart):
                u, v = -on_T[i], on_T[j]
                keep(on_b[j] * u + on_b[i] * v, most[j] * u + most[i] * v, apart)
    return low, high
