"""Conversion of UGVEnv's states into data for the renderer."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import PoseSolver, place
from stickslip.envs.rendering.ugv import UGVFrame
from stickslip.envs.ugv.state import ground

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.dynamics.pytrees import Number
    from stickslip.dynamics.ugv import Odometer, Pose, UGVParams
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState
    from stickslip.optim.posture.criteria import Station

    Array: TypeAlias = jax.Array | np.ndarray
    Sampled: TypeAlias = tuple[Pose, Array, Array, Array, Array | None]

GROUND_POINTS = 361
REACH = 4.0
"""Range of ground drawn before and behind the front contact, in vehicle lengths."""


def ugv_frames(
    states: UGVEnvState,
    infos: Mapping[str, np.ndarray],
    params: UGVEnvParams,
    solver: PoseSolver,
    preview: int = 0,
) -> UGVFrame:
    """The frame of states in a row, every leaf [n], with the info of the step that led to each.

    preview: how many points ahead are observed.
    """
    sampled = _sampled(solver, preview, states, params)
    return _frame(sampled, states.station, states.cost, params.start, infos["status"])


def station_frames(
    stations: Station,
    costs: np.ndarray,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
    solver: PoseSolver,
) -> UGVFrame:
    """The frame of a drive's stations [n]; costs: so far [n]; friction: mu, one or [n], by which a
    surface's is multiplied."""
    sampled = _at_each(solver, stations, odometer, friction, vehicle)
    return _frame(sampled, stations, costs, stations.x[0], np.asarray(stations.status))


def _frame(
    sampled: Sampled, at: Station, cost: Array, start: Number, status: np.ndarray
) -> UGVFrame:
    tree: Any = jax.tree.map(lambda leaf: leaf.astype(float), jax.device_get((*sampled, at, cost)))
    placed, turned, points, seen, mu, stations, costs = tree
    return UGVFrame(
        at=stations,
        placed=placed,
        turned=turned,
        ground=points,
        preview=seen,
        cost=costs,
        status=np.asarray(status, int),
        start=float(start),
        ground_mu=mu,
    )


@partial(jax.jit, static_argnums=(0, 1))
def _sampled(
    solver: PoseSolver, preview: int, states: UGVEnvState, params: UGVEnvParams
) -> Sampled:
    """Pose, angles of the wheels in the world, points of the ground, those observed, and mu at the
    points where the ground has a surface, each [n]."""

    def one(state: UGVEnvState) -> Sampled:
        odometer, friction = ground(state.drawn, params)
        length = params.preview_length
        return _at(solver, state.station, odometer, friction, params.vehicle, preview, length)

    return jax.vmap(one)(states)


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
