"""Observation of UGVEnv: the entries of its docstring's table, and their bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.envs.ugv.params import penalty_for
from stickslip.envs.ugv.state import ground

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float

    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState
    from stickslip.optim.posture.criteria import Criterion
    from stickslip.optim.posture.station import Station

MAX_SLOPE = 1.6
"""Clip of slope angle and pitch [rad]."""
MAX_TORQUE = 2.0
"""Clip of the torque on a wheel, in weight x wheel radius."""
MAX_GRIP = 4.0
"""Clip of the grip margin, in weights."""
MAX_HEIGHT = 5.0
"""Clip of height or depth of the ground ahead, in wheel radii."""
MAX_COST = 10.0
"""Clip of the worst value so far, in units of `penalty_for`."""
MAX_FRICTION = 10.0
"""Clip of the friction coefficient ahead [-]."""
MOST_PREVIEW = 256


def observe(
    criterion: Criterion,
    preview: int,
    state: UGVEnvState,
    params: UGVEnvParams,
    see_friction: bool = False,
) -> Float[Array, " obs"]:
    """The observation of a state."""
    at, dtype = state.station, state.cost.dtype
    W, r = params.vehicle.weight, params.vehicle.wheel_radius
    margins = [mu * normal - jnp.abs(force) for force, normal, mu in at.wheels]
    entries = [*(at.leg_angles - np.pi / 2)]
    entries += [jnp.clip(angle, -MAX_SLOPE, MAX_SLOPE) for angle in state.attitude]
    entries += [jnp.clip(at.torque / (W * r), -MAX_TORQUE, MAX_TORQUE)]
    entries += [jnp.clip(margin / W, -MAX_GRIP, MAX_GRIP) for margin in margins]
    if criterion.kind == "max":
        unit = penalty_for(criterion, params.vehicle, _usual(at), params.end - params.start)
        entries += [jnp.clip(state.cost / unit, -MAX_COST, MAX_COST)]
    seen = jnp.stack([jnp.asarray(entry, dtype) for entry in entries])
    if preview == 0:
        return seen
    heights = _heights_ahead(preview, state, params) / r
    ahead = [jnp.clip(heights, -MAX_HEIGHT, MAX_HEIGHT).astype(dtype)]
    if see_friction:
        ahead += [jnp.minimum(_friction_ahead(preview, state, params), MAX_FRICTION).astype(dtype)]
    return jnp.concatenate([seen, *ahead])


def bounds(
    criterion: Criterion, preview: int, params: UGVEnvParams, see_friction: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest value of every entry."""
    low = float(np.min(np.asarray(params.vehicle.leg_angle_min))) - np.pi / 2
    high = float(np.max(np.asarray(params.vehicle.leg_angle_max))) - np.pi / 2
    slack = 1e-6  # an angle at the end of its range, in single precision
    rows = [(low - slack, high + slack)] * 2 + [(-MAX_SLOPE, MAX_SLOPE)] * 3
    rows += [(-MAX_TORQUE, MAX_TORQUE)] + [(-MAX_GRIP, MAX_GRIP)] * 2
    rows += [(-MAX_COST, MAX_COST)] * (criterion.kind == "max")
    rows += [(-MAX_HEIGHT, MAX_HEIGHT)] * preview
    rows += [(0, MAX_FRICTION)] * (preview if see_friction else 0)
    lows, highs = np.asarray(rows, np.float64).T
    return lows, highs


def _usual(at: Station) -> Array:
    """mu of the better wheel, where they differ."""
    return at.friction if jnp.ndim(at.friction) == 0 else jnp.max(at.friction)


def _places_ahead(preview: int, params: UGVEnvParams, dtype: DTypeLike) -> Float[Array, " n"]:
    """Distances of the points ahead of the front contact [m]."""
    return params.preview_length * (jnp.arange(1, preview + 1, dtype=dtype) / preview)


def _friction_ahead(preview: int, state: UGVEnvState, params: UGVEnvParams) -> Float[Array, " n"]:
    """mu at the points ahead [-]."""
    odometer, friction = ground(state.drawn, params)
    surface, dtype = odometer.track.surface, state.cost.dtype
    if surface is None:
        return jnp.full(preview, friction, dtype)
    return friction * surface.at(state.station.x + _places_ahead(preview, params, dtype))


def _heights_ahead(preview: int, state: UGVEnvState, params: UGVEnvParams) -> Float[Array, " n"]:
    """Heights of the points ahead over the front contact [m], with this step's noise."""
    x, dtype = state.station.x, state.cost.dtype
    track = ground(state.drawn, params)[0].track
    heights = track.seen_from(x).height(_places_ahead(preview, params, dtype))
    if state.drawn.noise is None or params.preview_noise is None:
        return heights
    key = jax.random.fold_in(jax.random.wrap_key_data(state.drawn.noise), state.elapsed)
    return heights + params.preview_noise * jax.random.normal(key, heights.shape, dtype)
