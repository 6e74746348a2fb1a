"""Frame stacking: an environment that observes its last steps, for policies without a memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_integer, require_kind
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.envs.functional import FunctionalEnv, Params, State

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

MOST_FRAMES = 64
"""Most steps that are stacked."""


def stacked(obs: Float[Array, " obs"], frames: Float[Array, "steps frame"]) -> Array:
    """The observation, and behind it the frames, the latest first: [stacked]."""
    return jnp.concatenate([obs, jnp.ravel(frames).astype(obs.dtype)])


def pushed(
    frames: Float[Array, "steps frame"], obs: Float[Array, " obs"], action: Float[Array, " act"]
) -> Float[Array, "steps frame"]:
    """The frames with that of a step in front. The oldest one goes.

    A frame is the observation before a step and the action taken, in [-1, 1].
    """
    frame = jnp.concatenate([obs, action]).astype(frames.dtype)
    return jnp.concatenate([frame[None], frames[:-1]])


@pytree_dataclass
class FrameStackState(Generic[State]):
    """State of a FrameStack. state, obs: the environment's; frames: zeros before the first step."""

    state: State
    obs: Float[Array, " obs"]
    frames: Float[Array, "steps frame"]


@dataclass(frozen=True)
class FrameStack(FunctionalEnv[FrameStackState[State], Params]):
    """Any environment whose observation also holds the last `steps` observations and actions.

    Observation: that of `env`, then the frames, the latest first; a frame is the observation before
    a step and its action. Frames of steps before the episode are zeros. All else is as in `env`,
    its parameters, too; resets are as `autoreset` of this environment says. A network trained here
    plays `env` as `MLPPolicy(..., history=steps)`, which stacks the frames itself. Every adapter
    takes it.
    """

    env: FunctionalEnv[State, Params]
    steps: int
    autoreset: str = "same_step"
    state_kind = FrameStackState

    def __post_init__(self):
        require_kind("env", self.env, FunctionalEnv, "a BipedEnv or UGVEnv")
        require_integer("steps", self.steps, high=MOST_FRAMES)
        super().__post_init__()
        for name in ("action_names", "params_kind", "option_names"):
            object.__setattr__(self, name, getattr(self.env, name))

    @property
    def default_params(self) -> Params:
        return self.env.default_params

    def make_params(self, **changes: Any) -> Params:
        """The parameters that `make_params` of `env` makes."""
        env: Any = self.env
        return env.make_params(**changes)

    def episode_params(self, params: Params, options: Mapping[str, Any]) -> Params:
        return self.env.episode_params(params, options)

    def reset_env(
        self, key: Array, params: Params
    ) -> tuple[Float[Array, " stacked"], FrameStackState[State]]:
        obs, state = self.env.reset_env(key, params)
        frames = jnp.zeros((self.steps, len(obs) + len(self.action_names)), obs.dtype)
        return stacked(obs, frames), FrameStackState(state, obs, frames)

    def step_env(
        self, state: FrameStackState[State], action: Float[Array, " act"], params: Params
    ) -> tuple[Array, FrameStackState[State], Array, Array, Array, dict[str, Any]]:
        frames = pushed(state.frames, state.obs, action)
        obs, after, *_ = found = self.env.step_env(state.state, action, params)
        return stacked(obs, frames), FrameStackState(after, obs, frames), *found[2:]

    def observation_bounds(self, params: Params) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.env.observation_bounds(params)
        one = np.ones(len(self.action_names), low.dtype)
        first, last = np.append(np.minimum(low, 0), -one), np.append(np.maximum(high, 0), one)
        frames = np.tile(first, self.steps), np.tile(last, self.steps)
        return np.append(low, frames[0]), np.append(high, frames[1])

    def pictures(self, states, infos, params):
        return self.env.pictures(states.state, infos, params)

    def is_over(self, state: FrameStackState[State]) -> Bool[Array, ""]:
        return self.env.is_over(state.state)
