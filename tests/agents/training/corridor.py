"""An environment whose value function is known in closed form, whatever is done in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.envs import FunctionalEnv


class CorridorState(NamedTuple):
    """Steps from the terminating end, and steps made."""

    left: jax.Array
    elapsed: jax.Array
    total: jax.Array


class CorridorParams(NamedTuple):
    """Control period [s], length [steps], and steps after which an episode is cut off."""

    control_period: float = 0.1
    length: int = 6
    limit: int = 4


@dataclass(frozen=True)
class Corridor(FunctionalEnv[CorridorState, CorridorParams]):
    """One step nearer to the end a step, reward 1 each; a start is 1 to `length` steps from it.

    So the value of a place is the sum of discount^k over the steps that are left, also where the
    episode is cut off before them. The observation is the place alone.
    """

    autoreset: str = "same_step"
    action_names = ("push",)
    params_kind = CorridorParams

    @property
    def default_params(self):
        return CorridorParams()

    def reset_env(self, key, params):
        left = jax.random.randint(key, (), 1, params.length + 1)
        state = CorridorState(left, jnp.zeros_like(left), jnp.zeros(()))
        return self._observe(state), state

    def step_env(self, state, action, params):
        after = CorridorState(state.left - 1, state.elapsed + 1, state.total + 1)
        terminated = after.left <= 0
        truncated = ~terminated & (after.elapsed >= params.limit)
        info = {"episode_return": after.total, "episode_length": after.elapsed}
        return self._observe(after), after, jnp.ones(()), terminated, truncated, info

    def observation_bounds(self, params):
        return np.zeros(1), np.full(1, 100.0)

    def is_over(self, state):
        return state.left <= 0

    def picture(self, state, info, params):
        return state

    def renderer(self, params):
        raise NotImplementedError

    def _observe(self, state):
        return jnp.asarray(state.left, jnp.float32)[None]


def value(left: jax.Array, discount: float) -> jax.Array:
    """Of places so many steps from the end."""
    return (1 - discount**left) / (1 - discount)
