"""One waypoint of a drive, and criteria that are minimised: sums over steps, worst stations."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field, replace
from functools import reduce
from math import inf
from operator import or_
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.pytrees import Number, Numeric, pytree_dataclass, same_rank
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Odometer, Pose, PoseSolver, UGVParams, balance
from stickslip.dynamics.ugv.poses import stand, wheel_lags
from stickslip.dynamics.ugv.statics import friction_under, safe_split
from stickslip.optim.posture import CRITERIA_IN_WORDS

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int, Real


PLACED = (Status.OK, Status.OVERLAP, Status.ROLLOVER, Status.GROUNDED, Status.WHEEL_SLIP)
"""Statuses of a vehicle that has a place on the track and forces, good or bad ones."""

ROUNDED = 1 - 1e-9
"""Share of the friction that a free split may use: the rest is for roundings."""


class Station(NamedTuple):
    """The UGV held still with its front wheel at x; every entry of one batch shape [...]."""

    x: Float[Array, "..."]
    """Contact of the front wheel [m]."""
    leg_angles: Float[Array, "... 2"]
    """Rear and front [rad]."""
    torque: Float[Array, "..."]
    """M on each wheel [N m], anticlockwise positive: driving forwards is negative; [..., 2], rear
    and front, as is the lag, where the split is free."""
    lag: Float[Array, "..."]
    """Angle of both wheels against their legs, summed, less what they turn on level ground,
    -per_metre (x - start of the odometer) [rad], which would cost digits: see `turned`."""
    per_metre: Float[Array, "..."]
    """Turn of both wheels on a metre of level ground, 2 / r [rad/m]."""
    leg_torques: Float[Array, "... 2"]
    """Torque of the leg actuators [N m], positive outwards; times d(leg_angles) is their work."""
    F_rear: Float[Array, "..."]
    """Friction along the ground [N]; N: normal force; of each wheel."""
    N_rear: Float[Array, "..."]
    F_front: Float[Array, "..."]
    N_front: Float[Array, "..."]
    friction: Float[Array, "..."]
    """mu between wheels and ground [-]; [..., 2], rear and front, on a track with a surface."""
    grip: Float[Array, "..."]
    """The lesser of both wheels' mu N - |F| [N]."""
    clearance: Float[Array, "..."]
    """Clearance of body and legs above the ground [m]; infinite where the solver leaves it out."""
    wheel_clearance: Float[Array, "..."]
    """Clearance between the wheels [m], likewise."""
    status: Int[Array, "..."]
    """Status of `balance`."""

    def map(self, function: Callable[[Any], Any]) -> Station:
        """The station with a function applied to every entry."""
        return Station._make(function(of) for of in self)

    @property
    def numbers(self) -> tuple[Float[Array, "..."], ...]:
        """All entries but the status, which has no slope."""
        return self[:-1]

    def with_numbers(self, numbers: Iterable[Any]) -> Station:
        """The same status beside other numbers."""
        return Station(*numbers, status=self.status)

    @property
    def rows(self) -> Float[Array, "rows ..."]:
        """All entries in one array, which crosses from and to a device faster than fifteen."""
        parts = [jnp.moveaxis(of, -1, 0) if of.ndim > self.x.ndim else of[None] for of in self]
        return jnp.concatenate([of.astype(self.x.dtype) for of in parts])

    @classmethod
    def of_rows(cls, rows: Any) -> Station:
        """The station that has these `rows`, of NumPy or of JAX."""
        pairs = {"leg_angles", "leg_torques"}
        split, surface = divmod(len(rows) - len(cls._fields) - len(pairs), 2)
        pairs |= {"friction"} if surface else set()
        pairs |= {"torque", "lag"} if split else set()
        entries, at = [], 0
        for name in cls._fields:
            pair = rows[at : at + 2] if name in pairs else None
            entries.append(rows[at] if pair is None else pair.transpose(*range(1, pair.ndim), 0))
            at += 1 if pair is None else 2
        return cls(*entries[:-1], status=entries[-1].astype("int32"))

    @property
    def wheels(self) -> tuple[tuple[Array, Array, Array], tuple[Array, Array, Array]]:
        """Friction and normal force [N] and mu [-] of the rear and the front wheel, each [...]."""
        each = jnp.ndim(self.friction) > jnp.ndim(self.N_rear)
        rear, front = (self.friction[..., i] if each else self.friction for i in range(2))
        return (self.F_rear, self.N_rear, rear), (self.F_front, self.N_front, front)

    @property
    def motors(self) -> tuple[Float[Array, "... m"], Float[Array, "... m"]]:
        """Torque and lag of the wheels: of both as one [..., 1], or of each [..., 2]."""
        each = jnp.ndim(self.torque) > jnp.ndim(self.N_rear)
        return (self.torque, self.lag) if each else (self.torque[..., None], self.lag[..., None])

    @property
    def turn(self) -> Float[Array, "..."]:
        """Angle of both wheels against their legs, summed [rad]; falls when driving forwards. Only
        differences mean something: M d(turn) is the work of both motors with the same torque."""
        return self.motors[1].sum(-1) - self.per_metre * self.x

    @property
    def placed(self) -> Bool[Array, "..."]:
        """True if the vehicle has a place on the track and finite forces."""
        return reduce(or_, (self.status == status for status in PLACED))

    @property
    @np.errstate(invalid="ignore")
    def finite(self) -> Bool[Array, "..."]:
        """True if every number that a criterion reads is finite."""
        torques, lags = self.motors
        whole = (torques + lags).sum(-1) + self.leg_torques.sum(-1)
        return abs(whole + self.N_rear + self.N_front) < inf


def station(
    solver: PoseSolver,
    params: UGVParams,
    odometer: Odometer,
    x_front: Float[Array, "..."],
    leg_angles: Float[Array, "... 2"],
    friction: Numeric,
    split: tuple[Any, Any] | None = None,
) -> Station:
    """The vehicle with its front wheel at x_front [...] [m] and leg_angles [..., 2] [rad].

    Nothing is checked, and the status tells. friction: mu, [...], where the track's surface has the
    factor 1. The odometer must reach over all contacts and be the same where turns are compared.
    split: min_grip and max_torque of `safe_split` between the wheels; None: one torque at both.
    """
    placed = stand(params, odometer.track, x_front, leg_angles, solver)
    return station_of(params, odometer, placed, leg_angles, friction, split)


def station_of(
    params: UGVParams,
    odometer: Odometer,
    placed: Pose,
    leg_angles: Float[Array, "... 2"],
    friction: Numeric,
    split: tuple[Any, Any] | None = None,
) -> Station:
    """The station of a vehicle that has its place, best one of `stand`; see `station`."""
    mu = friction_under(odometer.track, placed, friction)
    most = jax.tree.map(lambda of: of * ROUNDED, mu)
    difference = None if split is None else safe_split(params, placed, most, *split).difference
    held = balance(params, placed, mu, difference)
    shape, dtype = placed.wheelbase.shape, placed.wheelbase.dtype
    angles = jnp.broadcast_to(jnp.asarray(leg_angles, dtype), (*shape, 2))
    lags = wheel_lags(params, odometer, placed, angles)
    wide = jax.tree.map(lambda of: jnp.broadcast_to(jnp.asarray(of, dtype), shape), mu)
    return Station(
        x=placed.origin[..., 0] + placed.front.x,
        leg_angles=angles,
        torque=held.torque,
        lag=jnp.sum(lags, -1) if split is None else lags,
        per_metre=jnp.broadcast_to(jnp.asarray(2 / params.wheel_radius, dtype), shape),
        leg_torques=held.leg_torques,
        **held.forces._asdict(),
        friction=jnp.stack(wide, -1) if isinstance(wide, tuple) else wide,
        grip=jnp.where(held.grip_rear < held.grip_front, held.grip_rear, held.grip_front),
        clearance=held.clearance,
        wheel_clearance=held.wheel_clearance,
        status=held.status,
    )


def torque_left(at: Station, max_torque: Real[Number, "..."]) -> list[Any]:
    """Torque margins of each wheel's motor, backwards and forwards [N m]; max_torque: the most
    it gives, either way. Below 0 the station is beyond it."""
    torques = at.motors[0]
    return [max_torque - s * torques[..., i] for s in (1, -1) for i in range(torques.shape[-1])]


def turned(a: Station, b: Station) -> Float[Array, "... m"]:
    """Turn of the wheels against their legs from station a to b, like `motors` [..., m] [rad]."""
    after, before = b.motors[1], a.motors[1]
    return (after - before) - (b.per_metre * (b.x - a.x))[..., None] / after.shape[-1]


LEAST_NORMAL = 1e-3
"""A wheel that carries less than this [N] is taken to carry it where friction is divided by it."""


STATIC = {"static": True}


@pytree_dataclass
class Criterion:
    """One criterion; all of it static but for `rates`.

    kind "sum": terms(a, b), [..., m] smooth terms of the step from station a to b; the value is the
    sum over steps and terms of outer(term), "positive", max(0, t), or "square", t^2. kind "max":
    terms(a) of a station; the largest over stations and terms. unit: of the value. pointwise(a,
    before): for sums, the cost of a station alone in the method "grid", after another. works:
    number of terms, the first the wheels' work; 0: none is. rates: what a positive and a negative
    unit of each term cost [2, m], in place of 1 and 0: see `of`.
    """

    name: str = field(metadata=STATIC)
    kind: str = field(metadata=STATIC)
    unit: str = field(metadata=STATIC)
    about: str = field(metadata=STATIC)
    terms: Callable[..., Array] = field(metadata=STATIC)
    outer: str | None = field(default=None, metadata=STATIC)
    pointwise: Callable[[Station, Station], Array] | None = field(default=None, metadata=STATIC)
    works: int = field(default=0, metadata=STATIC)
    rates: Float[Array, "2 m"] | None = None

    def of(self, params: UGVParams) -> Criterion:
        """The criterion of a vehicle: with efficiencies the work W of the wheels' motors counts as
        electrical energy, W / drive_efficiency or W regeneration_efficiency, whichever is more;
        with a holding loss, heat of the legs' actuators is added to their work."""
        drive, recovery = params.drive_efficiency, params.regeneration_efficiency
        holding = params.holding_loss if self.terms is _total_work else None
        if not self.works or (drive is None and recovery is None and holding is None):
            return self
        up = 1.0 if drive is None else 1 / drive
        down = 0.0 if recovery is None else recovery
        rest = self.works - 1
        heat = [] if holding is None else [holding, holding]
        rates = [up, *[1.0] * rest, *heat], [down, *[0.0] * rest, *heat]
        terms = self.terms if holding is None else _total_work_and_heat
        return replace(self, terms=terms, rates=jnp.stack([jnp.stack(row) for row in rates]))


def _wheel_work(a: Station, b: Station) -> Array:
    return jnp.sum((a.motors[0] + b.motors[0]) / 2 * turned(a, b), -1, keepdims=True)


def _total_work(a: Station, b: Station) -> Array:
    legs = (a.leg_torques + b.leg_torques) / 2 * (b.leg_angles - a.leg_angles)
    return jnp.concatenate([_wheel_work(a, b), legs], -1)


def _total_work_and_heat(a: Station, b: Station) -> Array:
    """And for each leg the integral of its torque squared over x [(N m)^2 m], ends averaged."""
    squares = (jnp.square(a.leg_torques) + jnp.square(b.leg_torques)) / 2
    return jnp.concatenate([_total_work(a, b), (b.x - a.x)[..., None] * squares], -1)


def _torque_slope(a: Station, b: Station) -> Array:
    change = b.motors[0] - a.motors[0]  # of both wheels: the mean of their squares counts
    return change / jnp.sqrt(change.shape[-1] * (b.x - a.x))[..., None]


def _torque(a: Station) -> Array:
    return jnp.concatenate([a.motors[0], -a.motors[0]], -1)


def _grip_missing(a: Station) -> Array:
    return jnp.stack([sign * F - mu * N for F, N, mu in a.wheels for sign in (1, -1)], -1)


def _load(a: Station) -> Array:
    return -jnp.stack([a.N_rear, a.N_front], -1)


def _demand(a: Station) -> Array:
    shares = [F / jnp.maximum(N, LEAST_NORMAL) for F, N, _ in a.wheels]
    return jnp.stack([sign * share for share in shares for sign in (1, -1)], -1)


def _torque_size(a: Station, before: Station) -> Array:
    return jnp.max(jnp.abs(a.motors[0]), -1)


def _torque_change(a: Station, before: Station) -> Array:
    return jnp.max(jnp.abs(a.motors[0] - before.motors[0]), -1)


_FORMS: dict[str, tuple[Any, ...]] = {
    "wheel_energy": ("sum", "J", _wheel_work, "positive", _torque_size, 1),
    "total_energy": ("sum", "J", _total_work, "positive", _torque_size, 3),
    "peak_torque": ("max", "N m", _torque),
    "torque_variation": ("sum", "N^2 m", _torque_slope, "square", _torque_change),
    "grip": ("max", "N", _grip_missing),
    "normal_force": ("max", "N", _load),
    "friction_demand": ("max", "-", _demand),
}
CRITERIA: dict[str, Criterion] = {
    name: Criterion(name, kind, unit, CRITERIA_IN_WORDS[name], *terms)
    for name, (kind, unit, *terms) in _FORMS.items()
}
"""All criteria by name."""


def criterion_by_name(criterion: str | Criterion) -> Criterion:
    """The criterion of that name, or the one given."""
    if isinstance(criterion, Criterion):
        return criterion
    require_choice("criterion", criterion, tuple(CRITERIA))
    return CRITERIA[criterion]


def step_cost(criterion: Criterion, a: Station, b: Station) -> Float[Array, "..."]:
    """Cost of the step from a to b, for criteria whose kind is "sum"."""
    return jnp.sum(paid(criterion, criterion.terms(a, b)), -1)


def paid(criterion: Criterion, terms: Float[Array, "... m"]) -> Float[Array, "... m"]:
    """What each term of a step adds to a sum."""
    if criterion.outer == "square":
        return jnp.square(terms)
    if criterion.rates is None:
        return larger(terms, 0)
    up, down = same_rank(*criterion.rates, terms)[:2]
    return larger(up * terms, down * terms)


def station_cost(criterion: Criterion, a: Station) -> Float[Array, "..."]:
    """The largest of a station's terms; for criteria whose kind is "max"."""
    return largest(criterion.terms(a), -1)


def drive_cost(
    criterion: Criterion, stations: Station, count: Numeric | None = None
) -> Float[Array, "..."]:
    """The value of a whole drive; waypoints along the stations' leading axis, [K, ...].

    count: how many of them make up the drive, the others being the last one repeated.
    """
    if criterion.kind == "max":
        return largest(station_cost(criterion, stations), 0)
    cost = step_cost(criterion, *steps(stations))
    if count is not None:
        cost = jnp.where(jnp.arange(len(cost), dtype=jnp.int32) < count - 1, cost, 0)
    return jnp.sum(cost, 0)


def steps(stations: Station) -> tuple[Station, Station]:
    """Starts and ends of the steps between stations [K, ...]: two of [K-1, ...]."""
    return stations.map(lambda of: of[:-1]), stations.map(lambda of: of[1:])


def increase(
    criterion: Criterion, so_far: Float[Array, "..."], a: Station, b: Station, first: Numeric
) -> Float[Array, "..."]:
    """Increase of the cost so far by the step from a to b; first: it is a drive's first step.

    The increases along a drive add up to `drive_cost`, from a cost of 0.
    """
    if criterion.kind == "sum":
        return step_cost(criterion, a, b)
    begin, end = station_cost(criterion, a), station_cost(criterion, b)
    return larger(jnp.where(first, begin, larger(so_far, begin)), end) - so_far


def larger(a: Array, b: Numeric) -> Array:
    """max(a, b) with the slope of the one it is.

    jnp.maximum asks which operand equals the result: under jit, rounded twice, maybe neither.
    """
    return jnp.where(a > b, a, b)


def largest(terms: Array, axis: int) -> Array:
    """The same along an axis: the largest entry with the slope of the first that is it."""
    which = jnp.expand_dims(jnp.argmax(jax.lax.stop_gradient(terms), axis), axis)
    return jnp.take_along_axis(terms, which, axis).squeeze(axis)
