"""Info of UGVEnv: the entries in its docstring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.envs.ugv.state import StepWork, UGVEnvState
from stickslip.optim.posture.criteria import CRITERIA, step_cost
from stickslip.optim.posture.station import Station

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array

    from stickslip.envs.ugv.params import UGVEnvParams


def work_between(before: Station, after: Station, dtype: DTypeLike) -> StepWork:
    """Work between one station and the next."""
    wheels, total = CRITERIA["wheel_energy"], CRITERIA["total_energy"]
    return StepWork(
        jnp.asarray(step_cost(wheels, before, after), dtype),
        jnp.asarray(step_cost(total, before, after), dtype),
    )


def info_of(state: UGVEnvState, params: UGVEnvParams) -> dict[str, Array]:
    """Entries of info about the state."""
    at = state.station
    return {
        "x": at.x,
        "rear_angle": at.leg_angles[0],
        "front_angle": at.leg_angles[1],
        "pitch": state.attitude.pitch,
        "torque": at.torque,
        "friction_force": at.F_front,
        "N_rear": at.N_rear,
        "N_front": at.N_front,
        "grip": at.grip,
        "clearance": at.clearance,
        "episode_return": state.totals.reward,
        "episode_length": state.elapsed,
        "episode_cost": state.cost,
        "episode_distance": at.x - params.start,
        "episode_wheel_energy": state.totals.wheel_energy,
        "episode_total_energy": state.totals.total_energy,
    }
