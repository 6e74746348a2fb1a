"""One waypoint of a drive: what the criteria and the constraints see of the UGV there."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import (
    Odometer,
    Pose,
    PoseSolver,
    Track,
    UGVParams,
    balance,
    place,
    wheel_turns,
)

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

PLACED = (Status.OK, Status.ROLLOVER, Status.GROUNDED, Status.WHEEL_SLIP)
"""Statuses of a vehicle that has a place on the track and forces, good or bad ones."""

SOLVER = PoseSolver()
"""How poses are found unless something else is said."""


class Station(NamedTuple):
    """The UGV held still with its front wheel at x; every entry of one batch shape [...]."""

    x: Float[Array, ...]
    """Where the front wheel touches [m]."""
    leg_angles: Float[Array, "... 2"]
    """Rear and front [rad]."""
    torque: Float[Array, ...]
    """M on each wheel [N m], anticlockwise positive: driving forwards is negative."""
    turn: Float[Array, ...]
    """Angle of the rear and the front wheel against their legs, summed [rad]; falls when driving
    forwards. Only differences mean something: M d(turn) is the work of both motors."""
    leg_torques: Float[Array, "... 2"]
    """Of the leg actuators [N m], positive outwards; times d(leg_angles) is their work."""
    F_rear: Float[Array, ...]
    """Friction along the ground [N]; N: normal force; of each wheel."""
    N_rear: Float[Array, ...]
    F_front: Float[Array, ...]
    N_front: Float[Array, ...]
    friction: Float[Array, ...]
    """mu between wheels and ground [-]."""
    grip: Float[Array, ...]
    """The lesser of both wheels' mu N - |F| [N]."""
    clearance: Float[Array, ...]
    """Of body and legs above the ground [m]; infinite where the solver leaves it out."""
    status: Int[Array, ...]
    """Status of `balance`."""

    def map(self, function: Callable[[Any], Any]) -> Station:
        """The same with a function applied to every entry."""
        return Station._make(function(of) for of in self)

    @property
    def placed(self) -> Bool[Array, ...]:
        """Whether the vehicle has a place on the track and finite forces."""
        placed = self.status == PLACED[0]
        for status in PLACED[1:]:
            placed |= self.status == status
        return placed

    @property
    def finite(self) -> Bool[Array, ...]:
        """Whether every number that a criterion reads is finite."""
        legs = jnp.sum(self.leg_torques, -1)
        return jnp.isfinite(self.torque + self.turn + legs + self.N_rear + self.N_front)


def station(
    params: UGVParams,
    track: Track,
    odometer: Odometer,
    x_front: Float[Array, ...],
    leg_angles: Float[Array, "... 2"],
    friction: Numeric,
    solver: PoseSolver = SOLVER,
) -> Station:
    """The vehicle with its front wheel at x_front [...] [m] and leg_angles [..., 2] [rad].

    For use inside a trace: nothing is checked, and the status tells. friction: mu, [...]. The
    odometer must reach from the rearmost contact asked for to the foremost, and be the same for
    stations whose turns are compared.
    """
    placed = place(params, track, x_front, leg_angles, solver)
    return station_of(params, odometer, placed, leg_angles, friction)


def station_of(
    params: UGVParams,
    odometer: Odometer,
    placed: Pose,
    leg_angles: Float[Array, "... 2"],
    friction: Numeric,
) -> Station:
    """The station of a vehicle that has its place; see `station`."""
    held = balance(params, placed, friction)
    shape, dtype = placed.wheelbase.shape, placed.wheelbase.dtype
    angles = jnp.broadcast_to(jnp.asarray(leg_angles, dtype), (*shape, 2))
    return Station(
        x=placed.front.x,
        leg_angles=angles,
        torque=held.torque,
        turn=jnp.sum(wheel_turns(params, odometer, placed, angles), -1),
        leg_torques=held.leg_torques,
        F_rear=held.F_rear,
        N_rear=held.N_rear,
        F_front=held.F_front,
        N_front=held.N_front,
        friction=jnp.broadcast_to(jnp.asarray(friction, dtype), shape),
        grip=jnp.where(held.grip_rear < held.grip_front, held.grip_rear, held.grip_front),
        clearance=held.clearance,
        status=held.status,
    )
