"""Conversion of UGVEnv's states into data for the renderer."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, place
from stickslip.envs.rendering import UGVFrame, WheelFrame
from stickslip.envs.ugv.state import ground

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.dynamics.numeric import Number
    from stickslip.dynamics.ugv import Odometer, Pose, UGVParams
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState
    from stickslip.optim.posture.station import Station

    Array: TypeAlias = jax.Array | np.ndarray
    Sampled: TypeAlias = tuple[Pose, Array, Array, Array, Array | None]

GROUND_POINTS = 361
REACH = 4.0
"""Range of ground drawn before and behind the front contact, in vehicle lengths."""


def ugv_frame(
    state: UGVEnvState,
    info: Mapping[str, float],
    params: UGVEnvParams,
    solver: PoseSolver,
    preview: int = 0,
) -> UGVFrame:
    """One unbatched state as plain numbers; `info` of the step that led to it, {} after a reset.

    preview: how many points ahead are observed.
    """
    sampled, state = jax.device_get((_sampled(solver, preview, state, params), state))
    status = int(info.get("status", state.station.status))
    return _frame(sampled, state.station, float(state.cost), float(params.start), status)


def ugv_frames(
    states: UGVEnvState,
    infos: Mapping[str, np.ndarray],
    params: UGVEnvParams,
    solver: PoseSolver,
    preview: int = 0,
) -> list[UGVFrame]:
    """The same of states in a row, every leaf [n], with the info of the step that led to each."""
    sampled = jax.device_get(_sampled_each(solver, preview, states, params))
    stations, costs = jax.device_get((states.station, states.cost))
    return _frames(sampled, stations, costs, float(params.start), infos["status"])


def station_frames(
    stations: Station,
    costs: np.ndarray,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
    solver: PoseSolver,
) -> list[UGVFrame]:
    """The frames of a drive, every entry of its stations [n]; costs: so far [n]; friction: mu, one
    or [n], by which a surface's is multiplied."""
    sampled = jax.device_get(_at_each(solver, stations, odometer, friction, vehicle))
    stations = jax.device_get(stations)
    return _frames(sampled, stations, costs, float(stations.x[0]), stations.status)


def _frames(
    sampled: Sampled, stations: Station, costs: np.ndarray, start: float, statuses: Array
) -> list[UGVFrame]:
    frames = []
    for i in range(len(costs)):
        rows = jax.tree.map(lambda leaf, i=i: leaf[i], (sampled, stations))
        frames.append(_frame(rows[0], rows[1], float(costs[i]), start, int(statuses[i])))
    return frames


def _frame(sampled: Sampled, at: Station, cost: float, start: float, code: int) -> UGVFrame:
    """Frame of a station, from NumPy arrays."""
    placed, turned, points, seen, mu = sampled
    wheels = []
    hinges = placed.rear_hinge, placed.front_hinge
    for i, contact in enumerate((placed.rear, placed.front)):
        wheels.append(
            WheelFrame(
                centre=np.asarray(contact.centre),
                contact=np.asarray(contact.point),
                slope=float(np.arctan2(contact.tangent[1], contact.tangent[0])),
                turned=float(turned[i]),
                hinge=np.asarray(hinges[i]),
                leg_angle=float(at.leg_angles[i]),
                **dict(zip(("friction", "normal", "mu"), map(float, at.wheels[i]), strict=True)),
            )
        )
    status = Status(code)
    return UGVFrame(
        x=float(at.x),
        start=start,
        rear=wheels[0],
        front=wheels[1],
        ground=np.asarray(points),
        preview=np.asarray(seen),
        pitch=float(placed.pitch),
        torque=float(at.torque),
        cost=cost,
        mu=float(np.min(at.friction)),
        grip=float(at.grip),
        status="ok" if status == Status.OK else status.name.lower().replace("_", " "),
        ground_mu=None if mu is None else np.asarray(mu),
    )


@partial(jax.jit, static_argnums=(0, 1))
def _sampled(solver: PoseSolver, preview: int, state: UGVEnvState, params: UGVEnvParams) -> Sampled:
    """Pose, angles of the wheels in the world, points of the ground, those observed, and mu at the
    points where the ground has a surface."""
    odometer, friction = ground(state.drawn, params)
    length = params.preview_length
    return _at(solver, state.station, odometer, friction, params.vehicle, preview, length)


@partial(jax.jit, static_argnums=(0, 1))
def _sampled_each(
    solver: PoseSolver, preview: int, states: UGVEnvState, params: UGVEnvParams
) -> Sampled:
    return jax.vmap(lambda state: _sampled(solver, preview, state, params))(states)


@partial(jax.jit, static_argnums=0)
def _at_each(
    solver: PoseSolver,
    stations: Station,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
) -> Sampled:
    each = jnp.broadcast_to(friction, stations.x.shape)
    return jax.vmap(lambda at, mu: _at(solver, at, odometer, mu, vehicle))(stations, each)


def _at(
    solver: PoseSolver,
    at: Station,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
    preview: int = 0,
    length: Number = 0.0,
) -> Sampled:
    track = odometer.track
    placed = place(vehicle, track, at.x, at.leg_angles, solver)
    turned = [
        wheel.slope_angle - odometer.distance(wheel.x) / vehicle.wheel_radius
        for wheel in (placed.rear, placed.front)
    ]
    reach = REACH * (vehicle.body_length + 2 * vehicle.leg_length)
    x = at.x + reach * jnp.linspace(-1, 1, GROUND_POINTS, dtype=at.x.dtype)
    part = jnp.arange(1, preview + 1, dtype=at.x.dtype) / max(preview, 1)
    points, seen = (jnp.stack([each, track.height(each)], -1) for each in (x, at.x + length * part))
    mu = None if track.surface is None else friction * track.surface.at(x)
    return placed, jnp.stack(turned), points, seen, mu
