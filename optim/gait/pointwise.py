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
"""By how much the limits are widened here, in their units: what rounding may hide. A bound over
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
        """From rows in a and b, and torque = on_a a + on_b b + rest, each [m]; ends: of b [m]."""
        on_a, of_b, rest = torque
        per = A / on_a
        on_T, on_b, most = per, B - per * of_b, C + per * rest + SLACK
        on_T = np.where(np.abs(on_T) < STEEP, 0.0, on_T)
        return cls(on_T, on_b, most, *_rates(on_T, on_b, most, *ends))

    def torques(self, b: Float[np.ndarray, "m"]) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest T at given b."""
        with np.errstate(divide="ignore", invalid="ignore"):
            at = (self.most - self.on_b * b) / self.on_T
        low = np.max(np.where(self.on_T < 0, at, -np.inf), axis=0, initial=-np.inf)
        high = np.min(np.where(self.on_T > 0, at, np.inf), axis=0, initial=np.inf)
        return low, high


def least(polygons: Polygons, form: Lagrangian) -> Float[np.ndarray, "m"]:
    """The least value at each angle; infinite where the limits leave nothing."""
    low, high = polygons.low.copy(), polygons.high.copy()
    empty = low > high
    low, high = np.where(empty, 0.0, low), np.where(empty, 0.0, high)
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = (value(polygons, form, b) for b in (left, right))
    found = np.minimum(value(polygons, form, low), value(polygons, form, high))
    for _ in range(ROUNDS):
        lower = at_left <= at_right
        high, low = np.where(lower, right, high), np.where(lower, low, left)
        inner = np.where(lower, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        new = value(polygons, form, inner)
        left, right = np.where(lower, inner, right), np.where(lower, left, inner)
        at_left, at_right = np.where(lower, new, at_right), np.where(lower, at_left, new)
        found = np.minimum(found, new)
    found = np.minimum(found, np.minimum(at_left, at_right))
    return np.where(empty, np.inf, found)


def value(
    polygons: Polygons, form: Lagrangian, b: Float[np.ndarray, "m"]
) -> Float[np.ndarray, "m"]:
    """The least over T at given b."""
    low, high = polygons.torques(b)
    high = np.maximum(low, high)
    rate = np.sqrt(np.maximum(b, 0.0))
    slow = 1 / np.maximum(rate, 1e-150)
    curve = form.heat * slow + form.strain
    best = np.full_like(b, np.inf)
    for work, floor, top in (
        (0.0, low, np.minimum(high, 0.0)),
        (form.work, np.maximum(low, 0.0), high),
    ):
        slope = form.on_T + work
        T = _vertex(curve, slope, floor, top)
        inside = floor <= top
        with np.errstate(over="ignore", invalid="ignore"):
            here = curve * T**2 + slope * T
        best = np.minimum(best, np.where(inside, here, np.inf))
    with np.errstate(over="ignore"):
        spent = np.where(form.inverse > 0, form.inverse * slow, 0.0)
        return best + spent - form.root * rate + form.on_b * b + form.rest


def _vertex(curve: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Where curve T^2 + slope T is least on [low, high]."""
    bent = curve > 0
    middle = -slope / np.where(bent, 2 * curve, 1.0)
    straight = np.where(slope > 0, low, np.where(slope < 0, high, np.clip(0.0, low, high)))
    return np.where(bent, np.clip(middle, low, high), straight)


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
