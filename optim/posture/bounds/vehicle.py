"""Interval version of statics.py and rolling.py: forces and turns over intervals of leg angles.

Written once for numbers that know +, -, *, /, sin, cos, sqrt and arctan: Interval for a posture,
Jet for a box of postures with derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from stickslip.optim.intervals.arithmetic import Interval, interval
from stickslip.optim.intervals.jet import Jet
from stickslip.optim.posture.bounds.contact import Wheel

if TYPE_CHECKING:
    from stickslip.dynamics.ugv import UGVParams
    from stickslip.optim.posture.bounds.contact import Bracket

Z = TypeVar("Z", Interval, Jet)
"""A posture's numbers, or a box's."""


@dataclass(frozen=True)
class Numbers:
    """A vehicle's numbers as floats."""

    body: float
    leg: float
    radius: float
    wheel_mass: float
    body_mass: float
    leg_mass: float
    gravity: float
    low: float
    high: float

    @classmethod
    def of(cls, params: UGVParams) -> Numbers:
        """Those of the parameters."""
        names = (
            "body_length", "leg_length", "wheel_radius", "wheel_mass", "body_mass", "leg_mass",
            "gravity", "leg_angle_min", "leg_angle_max",
        )  # fmt: skip
        return cls(*(float(np.asarray(getattr(params, name))) for name in names))

    @property
    def weight(self) -> Interval:
        """Weight of the vehicle [N]."""
        masses = interval(self.wheel_mass) * 2.0 + interval(self.leg_mass) * 2.0 + self.body_mass
        return masses * self.gravity


@dataclass(frozen=True)
class Held(Generic[Z]):
    """Quantities of a station, each an Interval or a Jet; signs as in Station."""

    torque: Z
    turn: Z
    """But for what depends on the waypoint alone: see Front.turn [rad]."""
    leg_rear: Z
    leg_front: Z
    F: Z
    N_rear: Z
    N_front: Z


@dataclass(frozen=True)
class Rear(Generic[Z]):
    """The rear wheel as the formulas want it: place behind the front contact, height above it,
    slope and arc length."""

    behind: Z
    height: Z
    slope: Z
    rolled: Z


def wheelbase_squared(v: Numbers, rear: Z, front: Z) -> Z:
    """Q = L^2 + 2 l^2 - 2 L l (cos r + cos f) + 2 l^2 cos(r + f)."""
    square = interval(v.body).square() + interval(v.leg).square() * 2.0
    both = interval(v.body) * v.leg * 2.0
    swing = interval(v.leg).square() * 2.0
    return (rear + front).cos() * swing - (rear.cos() + front.cos()) * both + square


def held(v: Numbers, rear_angle: Z, front_angle: Z, Q: Z, at: Rear[Z], front: Wheel) -> Held[Z]:
    """Forces, torques and turn of one wheel and the other together."""
    l, r, g = v.leg, v.radius, v.gravity
    cr, sr, cf, sf = rear_angle.cos(), rear_angle.sin(), front_angle.cos(), front_angle.sin()
    cos_f = front.q.reciprocal()
    sin_f = front.slope * cos_f
    cos_r = (at.slope.square() + 1.0).sqrt().reciprocal()
    sin_r = at.slope * cos_r

    centre = at.behind - sin_r * r, at.height + cos_r * r
    world = -centre[0] + front.centre[0], -centre[1] + front.centre[1]
    chord = (cr + cf) * (-l) + v.body, (sr - sf) * l
    C = (chord[0] * world[0] + chord[1] * world[1]) / Q
    S = (chord[0] * world[1] - chord[1] * world[0]) / Q

    # x of the legs' and the body's centres of mass from the wheels' centres.
    rear_leg = (C * cr + S * sr) * (-l / 2)
    front_leg = (C * cf - S * sf) * (l / 2)
    body = C * (cr * (-l) + interval(v.body) * 0.5) - S * (sr * l)
    wheels = sin_r * (-r) - at.behind + front.centre[0]
    moment = wheels * v.wheel_mass + (wheels + rear_leg + front_leg) * v.leg_mass
    moment = (moment + (sin_r * (-r) + body) * v.body_mass) * g

    cos_d = cos_r * cos_f + sin_r * sin_f
    sin_d = cos_r * sin_f - sin_r * cos_f
    lever_F = at.height * cos_f - at.behind * sin_f
    lever_N = -(at.behind * cos_f + at.height * sin_f)
    det = (cos_d + 1.0) * lever_N + sin_d * lever_F
    along = sin_r * v.weight
    F = (along * lever_N + sin_d * moment) / det
    N_front = ((cos_d + 1.0) * moment - along * lever_F) / det
    N_rear = cos_r * v.weight - F * sin_d - N_front * cos_d

    carried = (interval(v.wheel_mass) + interval(v.leg_mass) * 0.5) * g
    vx, vy = (C * cr + S * sr) * l, (S * cr - C * sr) * l
    across = vx * (F * sin_r + N_rear * cos_r) - vy * (F * cos_r - N_rear * sin_r)
    leg_rear = F * r + across - vx * carried
    vx, vy = (S * sf - C * cf) * l, -(S * cf + C * sf) * l
    across = vx * (F * sin_f + N_front * cos_f) - vy * (F * cos_f - N_front * sin_f)
    leg_front = -(F * r + across - vx * carried)

    pitch = (S / C).arctan()
    turn = at.slope.arctan() - pitch * 2.0 + rear_angle - front_angle - at.rolled / r
    return Held(F * (-r), turn, leg_rear, leg_front, F, N_rear, N_front)


def angle_jets(rear: Interval, front: Interval) -> tuple[Jet, Jet]:
    """The leg angles themselves over boxes, derivatives along rear and front."""
    shape = rear.shape
    one, zero = np.ones(shape), np.zeros(shape)
    nothing = interval(np.zeros((2, *shape)))
    return (
        Jet(rear, interval(np.stack([one, zero])), nothing),
        Jet(front, interval(np.stack([zero, one])), nothing),
    )


def rear_jets(bracket: Bracket, Q: Jet, first: np.ndarray, last: np.ndarray) -> Rear[Jet]:
    """The rear wheel over boxes whose contacts lie in the bins from `first` to `last`: functions of
    Q alone, whose derivatives by it are known of each bin."""
    rows = bracket.rear.over(first, last)
    jets = [Q.through(rows[k], rows[k + 1], rows[k + 2]) for k in (0, 3, 6, 9)]
    return Rear(*jets)
