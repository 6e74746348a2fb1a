"""Baselines and planners of the UGV, to measure a policy against. See stickslip.agents.protocol."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.protocol import Memoryless, Ruled
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.envs.functional import NON_NEGATIVE
from stickslip.envs.ugv.env import UGVEnv
from stickslip.optim.problem import solve

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.agents.protocol import Action, Obs
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState
    from stickslip.optim import PostureResult


MOST_POSTURES = 1000
"""Most angles of each leg that FixedPosture tries."""


def towards(
    target: ArrayLike, env_state: UGVEnvState, env_params: UGVEnvParams
) -> Float[Array, " 2"]:
    """The action that brings the legs as near to the angles [2] as one step can [rad]."""
    angles = env_state.leg_angles
    step = env_params.leg_rate * env_params.spacing
    return jnp.clip((jnp.asarray(target, angles.dtype) - angles) / step, -1.0, 1.0)


@pytree_dataclass
class FollowPath(Memoryless):
    """Play back a path: the legs' angles at every waypoint, the first included.

    angles: [K, 2], rear and front [rad]; a result's `leg_angles`. Past its end the last stays.
    """

    angles: ArrayLike
    RULES: ClassVar = {"angles": {"low": 0.0, "accepted": "finite angles >= 0 [rad]"}}

    def validate(self) -> FollowPath:
        super().validate()
        if np.ndim(self.angles) < 2 or np.shape(self.angles)[-1] != 2:
            raise ValueError(f"angles has shape {np.shape(self.angles)}; accepted: [K, 2]")
        return self

    def act(
        self, memory: None, obs: Obs, env_state: UGVEnvState, env_params: UGVEnvParams
    ) -> tuple[None, Action]:
        """See Controller."""
        at = jnp.minimum(env_state.elapsed + 1, np.shape(self.angles)[0] - 1)
        return memory, towards(jnp.asarray(self.angles)[at], env_state, env_params)


@pytree_dataclass
class FixedPosture(Ruled):
    """Go to one posture as fast as the legs turn, and keep it: the best on the very track.

    At the start of an episode `count` x `count` pairs of angles are driven with to the end, on the
    ground and friction that the episode has, and the one of the greatest return is taken (static:
    env, count). It sees what no policy sees, but does not use it on the way.
    """

    env: UGVEnv = field(default_factory=UGVEnv, metadata={"static": True})
    count: int = field(default=9, metadata={"static": True})
    COUNTS: ClassVar = {"count": {"high": MOST_POSTURES}}

    def init(self, env_params: UGVEnvParams, env_state: UGVEnvState) -> Float[Array, " 2"]:
        """The posture."""
        dtype, vehicle = env_state.leg_angles.dtype, env_params.vehicle
        part = jnp.linspace(0, 1, self.count, dtype=dtype)
        one = vehicle.leg_angle_min + (vehicle.leg_angle_max - vehicle.leg_angle_min) * part
        pairs = jnp.stack(jnp.meshgrid(one, one), -1).reshape(-1, 2)

        def return_with(pair: Float[Array, " 2"]) -> Float[Array, ""]:
            """Of keeping a posture; of two that fail, the later failure is worth more."""

            def step(state: UGVEnvState) -> UGVEnvState:
                return self.env.step_env(state, towards(pair, state, env_params), env_params)[1]

            end = jax.lax.while_loop(lambda state: ~state.over, step, env_state)
            missed = (env_params.steps - end.elapsed).astype(env_state.cost.dtype)
            late = env_params.reward_scale * env_params.failure_penalty * missed
            return end.totals.reward - late

        return pairs[jnp.argmax(jax.vmap(return_with)(pairs))]

    def act(
        self, memory: Float[Array, " 2"], obs: Obs, env_state: UGVEnvState, env_params: UGVEnvParams
    ) -> tuple[Float[Array, " 2"], Action]:
        """See Controller."""
        return memory, towards(memory, env_state, env_params)


@pytree_dataclass
class LevelBody(Memoryless):
    """Keep the body level: the leg on the low side straightens, the other one spreads.

    Both angles begin at `posture` and keep their mean there: rear = posture - share,
    front = posture + share, where share grows by gain x pitch a step. posture [rad]. gain [-]:
    about how much of the pitch is taken out in a step. Wanted angles stay between 90 degrees
    (straight down) and the end of the legs' range.
    """

    posture: ArrayLike = 2 * np.pi / 3
    gain: ArrayLike = 0.8
    RULES: ClassVar = {
        "posture": {"low": 0.0, "accepted": "a finite angle >= 0 [rad]"},
        "gain": NON_NEGATIVE,
    }

    def act(
        self, memory: None, obs: Obs, env_state: UGVEnvState, env_params: UGVEnvParams
    ) -> tuple[None, Action]:
        """See Controller."""
        rear, front = env_state.leg_angles
        share = (front - rear) / 2 + self.gain * env_state.attitude.pitch
        wanted = self.posture + share * jnp.asarray([-1.0, 1.0], share.dtype)
        highest = env_params.vehicle.leg_angle_max
        wanted = jnp.clip(wanted, jnp.minimum(np.pi / 2, highest), highest)
        return memory, towards(wanted, env_state, env_params)


@dataclass(frozen=True)
class Optimum(Ruled):
    """The optimiser's path for the whole episode, by `solve(problem, "dp")`.

    angles: least number of the grid's angles, for each leg (see `fitting_grid`). Knows ground and
    friction; no path on its grid is better, off the grid some are. polish: go on to a local optimum
    off the grid, from the best path on it; of the two the better one.
    """

    angles: int = 31
    polish: bool = False
    COUNTS: ClassVar = {"angles": {"low": 2}}

    def validate(self) -> Optimum:
        require_kind("polish", self.polish, bool, "True or False")
        return super().validate()

    def solve(self, env: UGVEnv, params: UGVEnvParams, state: UGVEnvState) -> PostureResult:
        """The result for the episode that begins in `state`."""
        return solve(env.problem(state, params), "dp", polish=self.polish, least=self.angles)

    def path(self, env: UGVEnv, params: UGVEnvParams, state: UGVEnvState) -> FollowPath:
        """The path, or the legs held where there is none."""
        angles = self.solve(env, params, state).leg_angles
        if angles is None:
            angles = np.tile(np.asarray(state.leg_angles, float), (int(params.steps) + 1, 1))
        return FollowPath(angles).validate()
