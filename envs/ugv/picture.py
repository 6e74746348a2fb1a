"""From a state of UGVEnv to what its renderer draws."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, place
from stickslip.envs.rendering import UGVFrame, WheelFrame
from stickslip.envs.ugv.draw import ground

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

GROUND_POINTS = 361
REACH = 4.0
"""How far the ground is sampled before and behind the front contact, in vehicle lengths."""


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
    placed, turned, points, seen, mu = jax.device_get(_sampled(solver, preview, state, params))
    at = jax.device_get(state.station)
    wheels = []
    hinges = placed.rear_hinge, placed.front_hinge
    for i, contact in enumerate((placed.rear, placed.front)):
        wheels.append(
            WheelFrame(
                centre=contact.centre,
                contact=contact.point,
                slope=float(np.arctan2(contact.tangent[1], contact.tangent[0])),
                turned=float(turned[i]),
                hinge=hinges[i],
                leg_angle=float(at.leg_angles[i]),
                **dict(zip(("friction", "normal", "mu"), map(float, at.wheels[i]), strict=True)),
            )
        )
    status = Status(int(info.get("status", at.status)))
    return UGVFrame(
        x=float(at.x),
        start=float(params.start),
        rear=wheels[0],
        front=wheels[1],
        ground=points,
        preview=seen,
        pitch=float(placed.pitch),
        torque=float(at.torque),
        cost=float(state.cost),
        mu=float(np.min(at.friction)),
        grip=float(at.grip),
        status="ok" if status == Status.OK else status.name.lower().replace("_", " "),
        ground_mu=mu,
    )


@partial(jax.jit, static_argnums=(0, 1))
def _sampled(solver: PoseSolver, preview: int, state: UGVEnvState, params: UGVEnvParams):
    """Pose, angles of the wheels in the world, points of the ground, those observed, and mu at the
    points where the ground has a surface."""
    odometer, friction = ground(state.drawn, params)
    track, vehicle, at = odometer.track, params.vehicle, state.station
    placed = place(vehicle, track, at.x, at.leg_angles, solver)
    turned = [
        wheel.slope_angle - odometer.distance(wheel.x) / vehicle.wheel_radius
        for wheel in (placed.rear, placed.front)
    ]
    reach = REACH * (vehicle.body_length + 2 * vehicle.leg_length)
    x = at.x + reach * jnp.linspace(-1, 1, GROUND_POINTS, dtype=at.x.dtype)
    part = jnp.arange(1, preview + 1, dtype=at.x.dtype) / max(preview, 1)
    ahead = at.x + params.preview_length * part
    points, seen = (jnp.stack([each, track.height(each)], -1) for each in (x, ahead))
    mu = None if track.surface is None else friction * track.surface.at(x)
    return placed, jnp.stack(turned), points, seen, mu
