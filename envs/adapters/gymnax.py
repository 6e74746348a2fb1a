"""A functional environment in gymnax's conventions; only its spaces need gymnax itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.lazily import require
from stickslip.envs.adapters.base import require_autoreset
from stickslip.envs.functional import FunctionalEnv, Params, State

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.pytrees import Lists, Number


class GymnaxEnv(Generic[State, Params]):
    """An environment with gymnax's protocol, for gymnax, purejaxrl and their successors.

    values = 6, gymnax 1.0's: step(key, state, action, params) returns observation, state, reward,
    terminated, truncated, info. values = 5, those of gymnax 0.0.9 and purejaxrl: observation,
    state, reward, done, info, with done = terminated or truncated. Either way the next episode's
    first observation comes with the step that ends one, and info holds beside its own entries
    `terminated`, `truncated`, `final_observation`, the episode's last one, and `discount`, 0 where
    the episode terminated, else 1: to bootstrap a truncated episode, take the value of
    `final_observation` times `discount`. A loop that reads `done` alone learns that time kills.

    Without params (None) both calls take those given here. The wrappers of gymnax expect as many
    values as its own environments return.
    """

    def __init__(self, env: FunctionalEnv[State, Params], params: Params, values: int = 6):
        require_autoreset(env, "same_step", "as gymnax resets")
        env.check_params(params)
        self.functional, self.default_params = env, params
        self.values = require_integer("values", values, low=5, high=6)

    def reset(self, key: Array, params: Params | None = None) -> tuple[Float[Array, " obs"], State]:
        """Begin an episode: observation and state."""
        return self.functional.reset(key, self._or_default(params))

    def step(
        self,
        key: Array,
        state: State,
        action: Real[Number, " act"] | Lists,
        params: Params | None = None,
    ) -> tuple[Any, ...]:
        """One control step; see the class."""
        obs, state, reward, terminated, truncated, info = self.functional.step(
            key, state, action, self._or_default(params)
        )
        info |= {
            "terminated": terminated,
            "truncated": truncated,
            "final_observation": info["final_obs"],
            "discount": jnp.where(terminated, 0.0, 1.0).astype(reward.dtype),
        }
        if self.values == 5:
            return obs, state, reward, terminated | truncated, info
        return obs, state, reward, terminated, truncated, info

    def observation_space(self, params: Params | None = None) -> Any:
        """A Box of gymnax's (extra `gymnax`)."""
        low, high = self.functional.observation_bounds(self._or_default(params))
        return _box(low, high)

    def action_space(self, params: Params | None = None) -> Any:
        """A Box of gymnax's, [-1, 1] for every action (extra `gymnax`)."""
        del params
        one = np.ones(len(self.functional.action_names))
        return _box(-one, one)

    def _or_default(self, params: Params | None) -> Params:
        return self.default_params if params is None else params


def _box(low: np.ndarray, high: np.ndarray) -> Any:
    spaces = require("gymnax.environments.spaces", "a gymnax space", "gymnax")
    return spaces.Box(jnp.float32(low), jnp.float32(high), low.shape, jnp.float32)
