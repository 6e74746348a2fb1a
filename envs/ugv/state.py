"""State of an episode of UGVEnv, the draws of its reset, its sight and its info."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.envs.functional import noisy, uniform
from stickslip.envs.ugv.params import UGVEnvParams

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.ugv import Odometer
    from stickslip.optim.posture.criteria import Station

MOST_PREVIEW = 256


class Attitude(NamedTuple):
    """Angles of the vehicle [rad]."""

    pitch: Float[Array, ""]
    slope_rear: Float[Array, ""]
    """Slope of the ground under the rear wheel."""
    slope_front: Float[Array, ""]


class UGVTotals(NamedTuple):
    """Sums over the episode, or what a step adds to them."""

    reward: Float[Array, ""]
    wheel_energy: Float[Array, ""]
    """Put in by the motors, none recovered [J]."""
    total_energy: Float[Array, ""]
    """The same with the legs' actuators [J]."""


@pytree_dataclass
class UGVEnvState:
    """State of an episode. station, attitude: the last ones inside the model. over: it has ended.

    cost: the criterion so far; it starts at 0.
    """

    station: Station
    attitude: Attitude
    elapsed: Int[Array, ""]
    """Steps so far."""
    cost: Float[Array, ""]
    over: Bool[Array, ""]
    drawn: UGVDrawn
    totals: UGVTotals
    rests: tuple[Float[Array, ""], UGVTotals]
    """Rounding errors of cost and totals (see `compensated`)."""

    @property
    def leg_angles(self) -> Float[Array, "... 2"]:
        """Rear and front [rad]."""
        return self.station.leg_angles


class UGVDrawn(NamedTuple):
    """Draws of a reset; None for what is not drawn."""

    odometer: Odometer | None
    friction: Float[Array, ""] | None
    noise: Array | None
    """Random key of the preview's noise, as plain numbers."""


def draw(key: Array, params: UGVEnvParams) -> tuple[UGVDrawn, Float[Array, " 2"]]:
    """Draw the start of an episode: draws and leg angles [rad]."""
    ranges, dtype = params.randomisation, jnp.result_type(params.start)
    keys = [jax.random.fold_in(key, index) for index in range(4)]
    odometer = friction = noise = None
    if ranges.track is not None:
        odometer = ranges.track.draw(keys[0], params.track.start, params.track.end, dtype)
    if ranges.friction is not None:
        friction = uniform(keys[1], ranges.friction, dtype)
    angles = jnp.asarray(params.start_angles, dtype)
    if ranges.start_angles is not None:
        angles = uniform(keys[2], ranges.start_angles, dtype, (2,))
    if params.preview_noise is not None:
        noise = jax.random.key_data(keys[3])
    return UGVDrawn(odometer, friction, noise), angles


def ground(drawn: UGVDrawn, params: UGVEnvParams) -> tuple[Odometer, Any]:
    """The episode's ground, with its arc length, and friction coefficient."""
    odometer = params.odometer if drawn.odometer is None else drawn.odometer
    return odometer, params.friction if drawn.friction is None else drawn.friction


def info_of(state: UGVEnvState, params: UGVEnvParams) -> dict[str, Array]:
    """Entries of info about the state."""
    at = state.station
    names = ("x", "torque", "N_rear", "N_front", "grip", "clearance")
    return {name: getattr(at, name) for name in names} | {
        "rear_angle": at.leg_angles[0],
        "front_angle": at.leg_angles[1],
        "pitch": state.attitude.pitch,
        "friction_force": at.F_front,
        "episode_return": state.totals.reward,
        "episode_length": state.elapsed,
        "episode_cost": state.cost,
        "episode_distance": at.x - params.start,
        "episode_wheel_energy": state.totals.wheel_energy,
        "episode_total_energy": state.totals.total_energy,
    }


def places_ahead(preview: int, params: UGVEnvParams, dtype: DTypeLike) -> Float[Array, " n"]:
    """Distances of the points ahead of the front contact [m]."""
    return params.preview_length * (jnp.arange(1, preview + 1, dtype=dtype) / preview)


def friction_ahead(preview: int, state: UGVEnvState, params: UGVEnvParams) -> Float[Array, " n"]:
    """mu at the points ahead [-]."""
    odometer, friction = ground(state.drawn, params)
    surface, dtype = odometer.track.surface, state.cost.dtype
    if surface is None:
        return jnp.full(preview, friction, dtype)
    return surface.mu(friction, surface.at(state.station.x + places_ahead(preview, params, dtype)))


def heights_ahead(preview: int, state: UGVEnvState, params: UGVEnvParams) -> Float[Array, " n"]:
    """Heights of the points ahead over the front contact [m], with this step's noise."""
    x, dtype = state.station.x, state.cost.dtype
    track = ground(state.drawn, params)[0].track
    heights = track.seen_from(x).height(places_ahead(preview, params, dtype))
    return noisy(heights, params.preview_noise, state.drawn.noise, state.elapsed)
