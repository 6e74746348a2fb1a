"""Conversion of UGVEnv's states into data for the renderer."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import PoseSolver, place
from stickslip.envs.rendering.ugv import UGVFrame
from stickslip.envs.ugv.state import ground, places_ahead

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Float

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
    """The frame of an episode's states, every leaf [n], with the info of the step that led to each.

    preview: how many points ahead are observed.
    """
    odometer, friction = ground(jax.tree.map(lambda leaf: leaf[0], states.drawn), params)
    at = states.station
    ahead = places_ahead(preview, params, jnp.result_type(at.x)) if preview else np.empty(0)
    status = infos.get("status", at.status)
    about = odometer, friction, params.vehicle, solver
    return station_frames(at, states.cost, *about, ahead, float(params.start), status)


def station_frames(
    stations: Station,
    costs: Array,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
    solver: PoseSolver,
    ahead: Float[Array, " m"] = np.empty(0),  # noqa: B008
    start: float | None = None,
    status: Array | None = None,
) -> UGVFrame:
    """The frame of a drive's stations [n]; costs: so far [n]; friction: mu, one or [n], by which a
    surface's is multiplied. ahead: distances of the points that are observed [m]. start: of the
    drive [m], by default the first station's; status: by default the stations' [n]."""
    placed = _placed(solver, stations, odometer, friction, vehicle, ahead)
    tree: Any = jax.device_get((*placed, stations, costs))
    pose, turned, points, seen, mu, at, cost = jax.tree.map(lambda leaf: leaf.astype(float), tree)
    return UGVFrame(
        at=at,
        placed=pose,
        turned=turned,
        ground=points,
        preview=seen,
        cost=cost,
        status=np.asarray(stations.status if status is None else status, int),
        start=float(stations.x[0]) if start is None else start,
        ground_mu=mu,
    )


@partial(jax.jit, static_argnums=0)
def _placed(
    solver: PoseSolver,
    stations: Station,
    odometer: Odometer,
    friction: Number,
    vehicle: UGVParams,
    ahead: Float[Array, " m"],
) -> Sampled:
    """Pose, angles of the wheels in the world, points of the ground, those observed, and mu at the
    points where the ground has a surface, each [n]."""
    track, kind = odometer.track, stations.x.dtype
    reach = REACH * (vehicle.body_length + 2 * vehicle.leg_length)
    about = reach * jnp.linspace(-1, 1, GROUND_POINTS, dtype=kind)

    def one(at: Station, friction: Number) -> Sampled:
        placed = place(vehicle, track, at.x, at.leg_angles, solver)
        turned = [
            wheel.slope_angle - odometer.distance(wheel.x) / vehicle.wheel_radius
            for wheel in (placed.rear, placed.front)
        ]
        points, seen = (
            jnp.stack([x, track.height(x)], -1) for x in (at.x + about, at.x + ahead.astype(kind))
        )
        surface = track.surface
        mu = None if surface is None else surface.mu(friction, surface.at(at.x + about))
        return placed, jnp.stack(turned), points, seen, mu

    return jax.vmap(one)(stations, jnp.broadcast_to(friction, stations.x.shape))
