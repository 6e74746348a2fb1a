"""Enclosures of the rear contact and of the forces, over intervals of leg angles.

With the front wheel at its waypoint the rear contact x follows from the squared wheelbase alone:
P(x) = |C(x) - C_front|^2 = Q(leg angles), C being the path of the wheel's centre (eq. 38, 39). The
bracket of contacts is cut into bins; where P falls all through the bins that may hold a contact,
there is just one. Forces and turns are written once for numbers that know +, -, *, /, sin, cos,
sqrt and arctan: Interval for a posture, Jet for a box of postures with derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from stickslip.dynamics.ugv.statics import solved
from stickslip.optim.intervals import Interval, Jet, hull, interval

if TYPE_CHECKING:
    from jaxtyping import Bool, Int

    from stickslip.dynamics.ugv import UGVParams
    from stickslip.optim.posture.bounds.ground import Ground


BINS = 1024
"""Bins of the bracket."""
RUN = 16
"""Bins that may hold the contact of one posture, at most: several where P hardly falls, the ground
being nearly as hollow as the wheel."""
STEPS = 3
"""Steps of Newton's method for a posture's contact."""


@dataclass(frozen=True)
class Wheel:
    """A wheel at x, over intervals: sine and cosine of the slope angle, its slope and derivatives,
    its height above the front contact, and its centre counted from there; [m]."""

    slope: Interval
    second: Interval
    third: Interval
    height: Interval
    q: Interval
    centre: tuple[Interval, Interval]


def wheel_at(ground: Ground, radius: float, x: Interval, origin: tuple[float, Interval]) -> Wheel:
    """The wheel touching at x; origin: the front contact and the ground's height there."""
    f, m, f2, f3 = ground.profile(x)
    q = (m.square() + 1.0).sqrt()
    height = f - origin[1]
    centre = (x - origin[0]) - m / q * radius, height + interval(radius) / q
    return Wheel(m, f2, f3, height, q, centre)


def distance(radius: float, rear: Wheel, front: Wheel) -> tuple[Interval, Interval, Interval]:
    """P = |W|^2, P' = 2 s (W_x + m W_y), P'' = 2 s^2 q^2 + 2 (s' (W_x + m W_y) + s f'' W_y), with
    W = C - C_front and the stretch s = 1 - r f'' / q^3."""
    across, up = (a - b for a, b in zip(rear.centre, front.centre, strict=True))
    m, q = rear.slope, rear.q
    cube = q.square() * q
    s = interval(1.0) - rear.second / cube * radius
    fifth = cube * q.square()
    ds = (rear.third / cube - m * rear.second.square() * 3.0 / fifth) * (-radius)
    along = across + m * up
    bend = s.square() * q.square() * 2.0 + (ds * along + s * rear.second * up) * 2.0
    return across.square() + up.square(), s * along * 2.0, bend


def _by_distance(behind: Interval, wheel: Wheel, dP: Interval, d2P: Interval) -> list[Interval]:
    """The rows of Bracket.rear: along the ground, x' = 1 / P' and x'' = -P'' / P'^3."""
    m, f2, q = wheel.slope, wheel.second, wheel.q
    by = dP.reciprocal()
    square = by.square()
    bend = -(d2P * square * by)
    one, zero = interval(np.ones(by.shape)), interval(np.zeros(by.shape))
    rows = []
    for value, slope, second in (
        (behind, one, zero),
        (wheel.height, m, f2),
        (m, f2, wheel.third),
        (zero, q, m * f2 / q),
    ):
        rows += [value, slope * by, second * square + slope * bend]
    return rows


def _runs(rows: list[Interval]) -> list[Interval]:
    """Hulls of intervals over runs of 1, 2, 4, ... bins, each [rows, runs]."""
    lo, hi = (np.stack([getattr(one, end) for one in rows]) for end in ("lo", "hi"))
    lost = np.isnan(lo) | np.isnan(hi)
    tables = [Interval(np.where(lost, -np.inf, lo), np.where(lost, np.inf, hi))]
    while 2 ** len(tables) <= lo.shape[1]:
        one, by = tables[-1], 2 ** (len(tables) - 1)
        tables.append(hull(one[:, :-by], one[:, by:]))
    return tables


@dataclass(frozen=True)
class Bracket:
    """All that is known of P behind one waypoint."""

    ground: Ground
    radius: float
    origin: tuple[float, Interval]
    front: Wheel
    edges: np.ndarray
    slope: Interval
    """Of P over each bin."""
    lost: Int[np.ndarray, "bins+1"]
    """Number of bins before each edge that are not used: P may rise there, or jump."""
    from_left: np.ndarray
    """The least P of all bins up to each, lower ends."""
    from_right: np.ndarray
    """The largest P of all bins from each on, upper ends."""
    rear: list[Interval]
    """Place behind the front contact, height above it, slope and arc length of the rear wheel, each
    with two derivatives by P, over runs of bins: [4, 3]."""

    @classmethod
    def behind(cls, ground: Ground, radius: float, x_front: float, longest: float) -> Bracket:
        at = interval(np.asarray(x_front, float))
        origin = (x_front, ground.profile(at)[0])
        front = wheel_at(ground, radius, at, origin)
        edges = np.linspace(x_front - 1.001 * (longest + 2 * radius), x_front, BINS + 1)
        x = Interval(edges[:-1], edges[1:])
        wheel = wheel_at(ground, radius, x, origin)
        P, dP, d2P = distance(radius, wheel, front)
        broken = np.histogram(ground.kinks, edges)[0] > 0
        bad = broken | ~(dP.hi < 0)
        with np.errstate(all="ignore"):
            rear = _runs(_by_distance(x - x_front, wheel, dP, d2P))
        return cls(
            ground, radius, origin, front, edges, dP,
            np.concatenate([[0], np.cumsum(bad)]),
            np.minimum.accumulate(P.lo),
            np.maximum.accumulate(P.hi[::-1])[::-1],
            rear,
        )  # fmt: skip

    def where(self, Q: Interval) -> tuple[Interval, Bool[np.ndarray, "..."], np.ndarray]:
        """Contacts of squared wheelbases, whether all is known there, and the bins."""
        # from_left and from_right both fall.
        first = np.searchsorted(-self.from_left, -Q.hi, side="left")
        last = np.searchsorted(-self.from_right, -Q.lo, side="right") - 1
        none = (first > last) | (first >= BINS)
        first, last = np.clip(first, 0, BINS - 1), np.clip(last, 0, BINS - 1)
        last = np.maximum(first, last)
        good = ~none & (self.lost[last + 1] == self.lost[first])
        return Interval(self.edges[first], self.edges[last + 1]), good, np.stack([first, last])

    def contact(self, Q: Interval) -> tuple[Interval, Bool[np.ndarray, "..."]]:
        """The contact of narrow Q to rounding, and where that is known."""
        x, good, bins = self.where(Q)
        first, last = bins
        good &= last - first < RUN
        falls = np.max([self.slope.hi[np.minimum(first + k, last)] for k in range(RUN)], axis=0)
        least = np.where(good, -falls, 1.0)
        at = x.middle
        for _ in range(STEPS):
            P, dP, _ = self._distance(interval(at))
            at = np.clip(at - (P.middle - Q.middle) / dP.middle, x.lo, x.hi)
        missed = (self._distance(interval(at))[0] - Q).size
        off = np.nextafter(missed / least, np.inf) * (1 + 1e-15)
        off = np.where(good & np.isfinite(off), off, 0.0)
        found = interval(at) + Interval(-off, off)
        return Interval(np.maximum(found.lo, x.lo), np.minimum(found.hi, x.hi)), good

    def _distance(self, x: Interval) -> tuple[Interval, Interval, Interval]:
        return distance(self.radius, wheel_at(self.ground, self.radius, x, self.origin), self.front)


Z = TypeVar("Z", Interval, Jet)
"""A posture's numbers, or a box's."""


def weight_of(v: UGVParams) -> Interval:
    """Weight of a vehicle whose parameters are floats [N]."""
    masses = interval(v.wheel_mass) * 2.0 + interval(v.leg_mass) * 2.0 + v.body_mass
    return masses * v.gravity


def wheelbase_squared(v: UGVParams, rear: Z, front: Z) -> Z:
    """Q = L^2 + 2 l^2 - 2 L l (cos r + cos f) + 2 l^2 cos(r + f)."""
    square = interval(v.body_length).square() + interval(v.leg_length).square() * 2.0
    both = interval(v.body_length) * v.leg_length * 2.0
    swing = interval(v.leg_length).square() * 2.0
    return (rear + front).cos() * swing - (rear.cos() + front.cos()) * both + square


def held(
    v: UGVParams, rear_angle: Z, front_angle: Z, Q: Z, rear: tuple[Z, ...], front: Wheel
) -> dict[str, Z]:
    """Quantities of a station by name; signs as in Station. rear: place of the rear wheel behind
    the front contact, height above it, slope and arc length. turn: of one wheel and the other
    together, but for what depends on the waypoint alone: see StationCells.own_turn [rad]. F: of the
    rear wheel, and of the front one where there is no rolling resistance."""
    behind, height, slope, rolled = rear
    l, r, g = v.leg_length, v.wheel_radius, v.gravity
    cr, sr, cf, sf = rear_angle.cos(), rear_angle.sin(), front_angle.cos(), front_angle.sin()
    cos_f = front.q.reciprocal()
    sin_f = front.slope * cos_f
    cos_r = (slope.square() + 1.0).sqrt().reciprocal()
    sin_r = slope * cos_r

    centre = behind - sin_r * r, height + cos_r * r
    world = -centre[0] + front.centre[0], -centre[1] + front.centre[1]
    chord = (cr + cf) * (-l) + v.body_length, (sr - sf) * l
    C = (chord[0] * world[0] + chord[1] * world[1]) / Q
    S = (chord[0] * world[1] - chord[1] * world[0]) / Q

    # x of the legs' and the body's centres of mass from the wheels' centres.
    rear_leg = (C * cr + S * sr) * (-l / 2)
    front_leg = (C * cf - S * sf) * (l / 2)
    body = C * (cr * (-l) + interval(v.body_length) * 0.5) - S * (sr * l)
    wheels = sin_r * (-r) - behind + front.centre[0]
    moment = wheels * v.wheel_mass + (wheels + rear_leg + front_leg) * v.leg_mass
    moment = (moment + (sin_r * (-r) + body) * v.body_mass) * g

    cos_d = cos_r * cos_f + sin_r * sin_f
    sin_d = cos_r * sin_f - sin_r * cos_f
    lever_F = height * cos_f - behind * sin_f
    lever_N = -(behind * cos_f + height * sin_f)
    weight = weight_of(v)
    weight = sin_r * weight, cos_r * weight
    F_front, N_front, N_rear = solved(v, weight, (cos_d, sin_d), (lever_F, lever_N), moment)
    F = drive = F_front  # of the motor: -torque / r
    if (c := v.rolling_resistance) is not None:
        F, drive = F_front + (N_front - N_rear) * c, F_front + N_front * c

    carried = (interval(v.wheel_mass) + interval(v.leg_mass) * 0.5) * g
    vx, vy = (C * cr + S * sr) * l, (S * cr - C * sr) * l
    across = vx * (F * sin_r + N_rear * cos_r) - vy * (F * cos_r - N_rear * sin_r)
    leg_rear = drive * r + across - vx * carried
    vx, vy = (S * sf - C * cf) * l, -(S * cf + C * sf) * l
    across = vx * (F_front * sin_f + N_front * cos_f)
    across = across - vy * (F_front * cos_f - N_front * sin_f)
    leg_front = -(drive * r + across - vx * carried)

    turn = slope.arctan() - (S / C).arctan() * 2.0 + rear_angle - front_angle - rolled / r
    legs = {"leg_rear": leg_rear, "leg_front": leg_front}
    forces = {"F": F, "F_front": F_front, "N_rear": N_rear, "N_front": N_front}
    return {"torque": drive * (-r), "turn": turn} | legs | forces


def angle_jets(angles: Interval) -> tuple[Jet, Jet]:
    """The leg angles themselves over boxes [2, n], derivatives along rear and front."""
    nothing, one = np.zeros(angles.shape), np.eye(2)[:, :, None]
    rear, front = (Jet(angles[k], interval(nothing + one[k]), interval(nothing)) for k in (0, 1))
    return rear, front


def rear_jets(bracket: Bracket, Q: Jet, first: np.ndarray, last: np.ndarray) -> tuple[Jet, ...]:
    """The rear wheel over boxes whose contacts lie in the bins from `first` to `last`: functions of
    Q alone, whose derivatives by it are known of each bin."""
    level = np.frexp(last - first + 1)[1] - 1
    lo = np.empty((bracket.rear[0].shape[0], *first.shape))
    rows = Interval(lo, lo.copy())  # hulls from bin `first` to `last`
    for number, table in enumerate(bracket.rear):
        here = level == number
        begin, end = first[here], last[here] + 1 - 2**number
        run = hull(table[:, begin], table[:, end])
        rows.lo[:, here], rows.hi[:, here] = run.lo, run.hi
    return tuple(Q.through(rows[k], rows[k + 1], rows[k + 2]) for k in (0, 3, 6, 9))
