"""From a state of UGVEnv to what its renderer draws."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, place
from stickslip.envs.rendering import UGVFrame, WheelFrame
from stickslip.envs.ugv.draw import ground

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.dynamics.ugv import Pose
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

    Sampled: TypeAlias = tuple[Pose, np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]

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
    sampled = jax.device_get(_sampled(solver, preview, state, params))
    return _frame(sampled, jax.device_get(state), info, params)


def ugv_frames(
    states: UGVEnvState,
    infos: Mapping[str, np.ndarray],
    params: UGVEnvParams,
    solver: PoseSolver,
    preview: int = 0,
) -> list[UGVFrame]:
    """The same of states in a row, every leaf [n], with the info of the step that led to each."""
    sampled = jax.device_get(_sampled_each(solver, preview, states, params))
    states = jax.device_get(states)
    frames = []
    for i in range(len(states.elapsed)):
        rows = jax.tree.map(lambda leaf, i=i: leaf[i], (sampled, states, dict(infos)))
        frames.append(_frame(rows[0], rows[1], rows[2], params))
    return frames


def _frame(
    sampled: Sampled, state: UGVEnvState, info: Mapping[str, float], params: UGVEnvParams
) -> UGVFrame:
    """From what was sampled of a state, as NumPy arrays."""
    placed, turned, points, seen, mu = sampled
    at = state.station
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
    placed, turned = _posed(solver, state, params)
    odometer, friction = ground(state.drawn, params)
    track, vehicle, at = odometer.track, params.vehicle, state.station
    reach = REACH * (vehicle.body_length + 2 * vehicle.leg_length)
    x = at.x + reach * jnp.linspace(-1, 1, GROUND_POINTS, dtype=at.x.dtype)
    part = jnp.arange(1, preview + 1, dtype=at.x.dtype) / max(preview, 1)
    ahead = at.x + params.preview_length * part
    points, seen = (jnp.stack([each, track.height(each)], -1) for each in (x, ahead))
    mu = None if track.surface is None else friction * track.surface.at(x)
    return placed, turned, points, seen, mu


@partial(jax.jit, static_argnums=(0, 1))
def _sampled_each(solver: PoseSolver, preview: int, states: UGVEnvState, params: UGVEnvParams):
    return jax.vmap(lambda state: _sampled(solver, preview, state, params))(states)


def _posed(solver: PoseSolver, state: UGVEnvState, params: UGVEnvParams):
    """The vehicle in its place, and the angles of its wheels in the world [2]."""
    odometer, _ = ground(state.drawn, params)
    vehicle, at = params.vehicle, state.station
    placed = place(vehicle, odometer.track, at.x, at.leg_angles, solver)
    turned = [
        wheel.slope_angle - odometer.distance(wheel.x) / vehicle.wheel_radius
        for wheel in (placed.rear, placed.front)
    ]
    return placed, jnp.stack(turned)
