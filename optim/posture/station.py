"""One waypoint of a drive: what the criteria and the constraints see of the UGV there."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Odometer, Pose, PoseSolver, Track, UGVParams, balance
from stickslip.dynamics.ugv.odometer import wheel_lags
from stickslip.dynamics.ugv.poses import stand
from stickslip.dynamics.ugv.statics import friction_under

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float, Int, Real

    from stickslip.dynamics.numeric import Number


PLACED = (Status.OK, Status.OVERLAP, Status.ROLLOVER, Status.GROUNDED, Status.WHEEL_SLIP)
"""Statuses of a vehicle that has a place on the track and forces, good or bad ones."""

SOLVER = PoseSolver()
"""Default solver of poses."""


class Station(NamedTuple):
    """The UGV held still with its front wheel at x; every entry of one batch shape [...]."""

    x: Float[Array, "..."]
    """Contact of the front wheel [m]."""
    leg_angles: Float[Array, "... 2"]
    """Rear and front [rad]."""
    torque: Float[Array, "..."]
    """M on each wheel [N m], anticlockwise positive: driving forwards is negative."""
    lag: Float[Array, "..."]
    """Angle of the rear and the front wheel against their legs, summed, less what both turn on
    level ground, -per_metre (x - start of the odometer) [rad]. Keeps the digits of short steps at
    the end of long ways. Only differences mean something: see `turned`."""
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
        """The same with a function applied to every entry."""
        return Station._make(function(of) for of in self)

    @property
    def numbers(self) -> tuple[Float[Array, "..."], ...]:
        """All entries but the status, which has no slope."""
        return self[: self._fields.index("status")]

    def with_numbers(self, numbers: Iterable[Any]) -> Station:
        """The same status beside other numbers."""
        return Station(*numbers, status=self.status)

    @classmethod
    def unpacked(cls, rows: Float[Array | np.ndarray, "rows ..."]) -> Station:
        """The station of its rows (see `rows_of`), status last: NumPy's or JAX's arrays as they
        are."""
        numbers = _numbers(rows[:-1])
        return cls(*numbers, status=rows[-1].astype(np.int32))

    @classmethod
    def unpacked_with_slopes(
        cls, rows: Float[Array | np.ndarray, "rows ..."]
    ) -> tuple[Station, Station]:
        """The same of rows that go on with the slopes in either angle of all but the status; the
        slopes have a last axis of 2, and a status of 0."""
        size = (len(rows) + 2) // 3
        at = cls.unpacked(rows[:size])
        each = rows[size:].reshape(2, size - 1, *rows.shape[1:])
        slopes = _numbers(each.transpose(1, *range(2, each.ndim), 0), 1)
        return at, cls(*slopes, status=0 * slopes[cls._fields.index("torque")])

    @property
    def wheels(self) -> tuple[tuple[Array, Array, Array], tuple[Array, Array, Array]]:
        """Friction and normal force [N] and mu [-] of the rear and the front wheel, each [...]."""
        each = jnp.ndim(self.friction) > jnp.ndim(self.N_rear)
        rear, front = (self.friction[..., i] if each else self.friction for i in range(2))
        return (self.F_rear, self.N_rear, rear), (self.F_front, self.N_front, front)

    @property
    def turn(self) -> Float[Array, "..."]:
        """Angle of both wheels against their legs, summed [rad]; falls when driving forwards. Only
        differences mean something: M d(turn) is the work of both motors."""
        return self.lag - self.per_metre * self.x

    @property
    def placed(self) -> Bool[Array, "..."]:
        """True if the vehicle has a place on the track and finite forces."""
        placed = self.status == PLACED[0]
        for status in PLACED[1:]:
            placed |= self.status == status
        return placed

    @property
    def finite(self) -> Bool[Array, "..."]:
        """True if every number that a criterion reads is finite."""
        legs = jnp.sum(self.leg_torques, -1)
        return jnp.isfinite(self.torque + self.lag + legs + self.N_rear + self.N_front)


def station(
    params: UGVParams,
    track: Track,
    odometer: Odometer,
    x_front: Float[Array, "..."],
    leg_angles: Float[Array, "... 2"],
    friction: Numeric,
    solver: PoseSolver = SOLVER,
) -> Station:
    """The vehicle with its front wheel at x_front [...] [m] and leg_angles [..., 2] [rad].

    For use inside a trace: nothing is checked, and the status tells. friction: mu, [...], where the
    track's surface has the factor 1. The
    odometer must reach from the rearmost contact asked for to the foremost, and be the same for
    stations whose turns are compared.
    """
    placed = stand(params, track, x_front, leg_angles, solver)
    return station_of(params, odometer, placed, leg_angles, friction)


def station_of(
    params: UGVParams,
    odometer: Odometer,
    placed: Pose,
    leg_angles: Float[Array, "... 2"],
    friction: Numeric,
) -> Station:
    """The station of a vehicle that has its place, best one of `stand`; see `station`."""
    mu = friction_under(odometer.track, placed, friction)
    held = balance(params, placed, mu)
    shape, dtype = placed.wheelbase.shape, placed.wheelbase.dtype
    angles = jnp.broadcast_to(jnp.asarray(leg_angles, dtype), (*shape, 2))
    return Station(
        x=placed.origin[..., 0] + placed.front.x,
        leg_angles=angles,
        torque=held.torque,
        lag=jnp.sum(wheel_lags(params, odometer, placed, angles), -1),
        per_metre=jnp.broadcast_to(jnp.asarray(2 / params.wheel_radius, dtype), shape),
        leg_torques=held.leg_torques,
        F_rear=held.F_rear,
        N_rear=held.N_rear,
        F_front=held.F_front,
        N_front=held.N_front,
        friction=_by_wheel(mu, shape, dtype),
        grip=jnp.where(held.grip_rear < held.grip_front, held.grip_rear, held.grip_front),
        clearance=held.clearance,
        wheel_clearance=held.wheel_clearance,
        status=held.status,
    )


def _by_wheel(
    mu: Real[Array, "..."] | float | tuple[Array, Array], shape: tuple[int, ...], dtype: DTypeLike
) -> Array:
    """mu of both wheels [...], or of each [..., 2]."""
    if isinstance(mu, tuple):
        return jnp.stack([jnp.broadcast_to(jnp.asarray(of, dtype), shape) for of in mu], -1)
    return jnp.broadcast_to(jnp.asarray(mu, dtype), shape)


def rows_of(numbers: Iterable[Float[Array, "..."]]) -> list[Float[Array, "..."]]:
    """Entries that are numbers, x first, each of them [...]: two for one with a last axis of 2."""
    x, *others = numbers
    pairs = ([of] if of.ndim == x.ndim else [of[..., 0], of[..., 1]] for of in others)
    return [x, *(row for pair in pairs for row in pair)]


_PAIRS = ("leg_angles", "leg_torques")
"""Entries with a last axis of 2; friction has one, too, where the track has a surface."""


def _numbers(rows: Float[Array | np.ndarray, "rows ..."], behind: int = 0) -> list[Any]:
    """All entries but the status, of their rows; behind: axes that come after an entry's own."""
    names = Station._fields[: Station._fields.index("status")]
    pairs = _PAIRS if len(rows) == len(names) + len(_PAIRS) else (*_PAIRS, "friction")
    numbers, begin, axes = [], 0, list(range(1, rows.ndim))
    axes.insert(len(axes) - behind, 0)
    for name in names:
        if name in pairs:
            numbers.append(rows[begin : begin + 2].transpose(axes))
        else:
            numbers.append(rows[begin])
        begin += 1 + (name in pairs)
    return numbers


def torque_left(at: Station, max_torque: Real[Number, "..."]) -> Float[Array, "... 2"]:
    """Torque margin of each wheel's motor, backwards and forwards [N m]; max_torque: the most
    it gives, either way. Below 0 the station is beyond it."""
    return jnp.stack([max_torque - at.torque, max_torque + at.torque], -1)


def turned(a: Station, b: Station) -> Float[Array, "..."]:
    """Turn of both wheels against their legs from station a to station b, summed [rad]."""
    return (b.lag - a.lag) - b.per_metre * (b.x - a.x)
