"""Pose and equilibrium without the package: a loop with brentq, and NumPy on whole batches.

The same equations (38), (39), (43) of the default vehicle, written anew. Fields of an answer as in
benchmarks.ugv.program; status 0 is a pose with grip and room
between the wheels, 1 anything else.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, exp, hypot, sin, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import brentq

if TYPE_CHECKING:
    from stickslip.dynamics.ugv.ground.shapes import Bump
    from stickslip.dynamics.ugv.ground.spline import Spline

LENGTH, LEG, RADIUS = 0.83, 0.35, 0.28
"""Body, leg and wheel radius [m]."""
WHEEL, BODY, SHANK, GRAVITY, FRICTION = 50.0, 300.0, 20.0, 9.81, 0.8
"""Masses of each wheel, of the body and of each leg [kg]; [m/s^2]; mu."""
WEIGHT = (2 * WHEEL + 2 * SHANK + BODY) * GRAVITY
"""[N]."""
COLUMNS = ("F_rear", "N_rear", "F_front", "N_front", "torque", "x_rear", "pitch",
           "body_x", "body_y", "status")  # fmt: skip
"""Of an answer, in this order: forces [N], torque [N m], rear contact [m], pitch [rad], the body's
centre of mass [m], status."""
BLOCK = 2048
"""Poses that NumPy works on at once, so that its temporaries stay in the cache."""


@dataclass(frozen=True)
class NumpyBump:
    """The soft bump; of numbers or arrays."""

    height: float
    centre: float
    width: float

    @classmethod
    def of(cls, shape: Bump) -> NumpyBump:
        """With the numbers of the package's."""
        return cls(float(shape.height), float(shape.centre), float(shape.width))

    def scalar(self, x: float) -> tuple[float, float, float]:
        """Height, slope, second derivative at a number."""
        z = (x - self.centre) / self.width
        y = self.height * exp(-z * z)
        return y, -2 * z * y / self.width, (4 * z * z - 2) * y / self.width**2

    def array(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same at an array."""
        z = (x - self.centre) * (1 / self.width)
        y = self.height * np.exp(-z * z)
        return y, (-2 / self.width) * z * y, (4 * z * z - 2) * y * (1 / self.width**2)


@dataclass(frozen=True)
class NumpyTable:
    """Even pieces of polynomials; of numbers or arrays, inside the table only."""

    first: float
    step: float
    rows: Any
    """[pieces, powers]."""
    lists: Any

    @classmethod
    def of(cls, shape: Spline) -> NumpyTable:
        """With the package's coefficients."""
        knots = np.asarray(shape.knots, float) + np.asarray(shape.rests, float)
        rows = np.array(shape.coefficients, float)
        rows[:, 0] += np.asarray(shape.lows, float)
        step = float(knots[-1] - knots[0]) / len(rows)
        return cls(float(knots[0]), step, rows.T.copy(), rows.tolist())

    def scalar(self, x: float) -> tuple[float, float, float]:
        """Height, slope, second derivative at a number."""
        piece = int((x - self.first) / self.step)
        t = x - self.first - piece * self.step
        y = dy = half = 0.0
        for c in reversed(self.lists[piece]):
            half, dy, y = half * t + dy, dy * t + y, y * t + c
        return y, dy, 2 * half

    def array(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same at an array."""
        piece = ((x - self.first) * (1 / self.step)).astype(np.int32)
        t = x - self.first - piece * self.step
        c = [row[piece] for row in self.rows]
        y, dy, half = c[-1], np.zeros_like(t), np.zeros_like(t)
        for k in range(len(c) - 2, -1, -1):
            half, dy, y = half * t + dy, dy * t + y, y * t + c[k]
        return y, dy, 2 * half


def loop(
    profile: Any, x: np.ndarray, angles: np.ndarray, tolerance: float = 1e-14
) -> dict[str, np.ndarray]:
    """One pose after the other, the rear contact by scipy's brentq to `tolerance` [m]."""
    pairs = zip(x.tolist(), angles.tolist(), strict=True)
    rows = [_one(profile.scalar, place, rear, front, tolerance) for place, (rear, front) in pairs]
    return dict(zip(COLUMNS, np.array(rows).T, strict=True))


def _one(profile, x_front: float, rear: float, front: float, tolerance: float) -> tuple:
    def wheel(x):
        f, df, _ = profile(x)
        q = sqrt(1 + df * df)
        return x - RADIUS * df / q, f + RADIUS / q, 1 / q, df / q, x, f

    frame = _frame(cos(rear), sin(rear), cos(front), sin(front))
    base = hypot(*frame[2:])
    ahead = wheel(x_front)

    def miss(x):
        behind = wheel(x)
        return hypot(behind[0] - ahead[0], behind[1] - ahead[1]) - base

    x_rear = brentq(miss, ahead[0] - base - RADIUS, x_front, xtol=tolerance)
    *found, C, S, least = _statics(wheel(x_rear), ahead, frame, sqrt, min)
    good = least >= 0 and base >= 2 * RADIUS
    return (*found[:5], x_rear, atan2(S, C), *found[5:], float(not good))


def vectorised(
    profile: Any, x: np.ndarray, angles: np.ndarray, steps: int = 12, tolerance: float = 4.0
) -> dict[str, np.ndarray]:
    """Newton's method on whole arrays, BLOCK poses at a time.

    It ends when every pose of a block is within `tolerance` roundings of the wheelbase, or after
    `steps`; no bracket, so only for ground that needs none.
    """
    found = {name: np.empty(x.shape, x.dtype) for name in COLUMNS}
    for begin in range(0, len(x), BLOCK):
        part = slice(begin, begin + BLOCK)
        _block(profile.array, x[part], angles[part], steps, tolerance, found, part)
    return found


def _block(profile, x_front, angles, steps, tolerance, found, part) -> None:
    rear, front = angles[:, 0], angles[:, 1]
    frame = _frame(np.cos(rear), np.sin(rear), np.cos(front), np.sin(front))
    base = np.sqrt(frame[2] * frame[2] + frame[3] * frame[3])
    f, df, _ = profile(x_front)
    c = 1 / np.sqrt(1 + df * df)
    s = df * c
    ahead = (x_front - RADIUS * s, f + RADIUS * c, c, s, x_front, f)
    x = x_front - base * c
    stop = tolerance * np.finfo(x.dtype).eps * base.max()
    for _ in range(steps):
        f, df, d2f = profile(x)
        c = 1 / np.sqrt(1 + df * df)
        s = df * c
        dx, dy = x - RADIUS * s - ahead[0], f + RADIUS * c - ahead[1]
        distance = np.sqrt(dx * dx + dy * dy)
        gap = distance - base
        bend = 1 - RADIUS * d2f * (c * c * c)
        x = x - gap * distance / ((dx + dy * df) * bend)
        if np.abs(gap).max() <= stop:
            break
    f, df, _ = profile(x)
    c = 1 / np.sqrt(1 + df * df)
    s = df * c
    behind = (x - RADIUS * s, f + RADIUS * c, c, s, x, f)
    *held, C, S, least = _statics(behind, ahead, frame, np.sqrt, np.minimum)
    for name, value in zip((*COLUMNS[:5], *COLUMNS[7:9]), held, strict=True):
        found[name][part] = value
    found["x_rear"][part], found["pitch"][part] = x, np.arctan2(S, C)
    found["status"][part] = ~((least >= 0) & (base >= 2 * RADIUS))


def _frame(cos_rear, sin_rear, cos_front, sin_front):
    """The rear wheel's centre in the body's frame, and the chord from it to the front one's."""
    ax, ay = LEG * cos_rear, -LEG * sin_rear
    return ax, ay, LENGTH - LEG * cos_front - ax, -LEG * sin_front - ay


def _statics(behind, ahead, frame, root, lesser):
    """F_rear, N_rear, F_front, N_front, torque, body's centre (x, y), the pitch's cosine and sine,
    unscaled, and the lesser of both wheels' mu N - |F|, as mu N - F and mu N + F.

    Numbers or arrays. Forces by elimination out of both force balances and the moments about the
    rear contact.
    """
    (cx, cy, cr, sr, xr, fr), (sx, sy, cf, sf, xf, ff) = behind, ahead
    ax, ay, chord_x, chord_y = frame
    wx, wy = sx - cx, sy - cy
    C, S = chord_x * wx + chord_y * wy, chord_x * wy - chord_y * wx
    scale = 1 / root(C * C + S * S)
    c, s = C * scale, S * scale
    hinge_x, hinge_y = cx - (c * ax - s * ay), cy - (s * ax + c * ay)
    body_x, body_y = hinge_x + LENGTH / 2 * c, hinge_y + LENGTH / 2 * s
    legs = (2 * body_x + cx + sx) / 2 - 2 * xr
    wheels = cx + sx - 2 * xr
    moment = (WHEEL * wheels + SHANK * legs + BODY * (body_x - xr)) * GRAVITY
    dx, dy = xf - xr, ff - fr
    one, turn = 1 + cr * cf + sr * sf, cr * sf - sr * cf
    lever_F, lever_N = dx * sf - dy * cf, dx * cf + dy * sf
    scale = 1 / (one * lever_N + turn * lever_F)
    along = WEIGHT * sr
    F = (along * lever_N + turn * moment) * scale
    N_front = (one * moment - along * lever_F) * scale
    N_rear = WEIGHT * cr - F * turn - N_front * (one - 1)
    light = lesser(N_rear, N_front) * FRICTION
    return F, N_rear, F, N_front, -RADIUS * F, body_x, body_y, C, S, lesser(light - F, light + F)
