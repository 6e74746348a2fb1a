"""A functional environment that compiles at once: the protocol and the adapters without physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.vector import AutoresetMode

from stickslip.envs import FunctionalEnv, GymEnv, GymVectorEnv


class ToyState(NamedTuple):
    """Where an episode is."""

    place: jax.Array
    elapsed: jax.Array
    over: jax.Array
    total: jax.Array


class ToyParams(NamedTuple):
    """Control period [s] and episode length [steps]."""

    control_period: float = 0.1
    limit: int = 7

    @property
    def time_limit(self) -> float:
        """[s]"""
        return self.limit * self.control_period


@dataclass(frozen=True)
class Toy(FunctionalEnv[ToyState, ToyParams]):
    """A point starts at random in [-0.5, 0.5], moves by 0.3 x action, ends beyond 1 or by time."""

    autoreset: str = "same_step"
    action_names = ("push", "idle")

    @property
    def default_params(self):
        return ToyParams()

    def reset_env(self, key, params):
        place = jax.random.uniform(key, (), minval=-0.5, maxval=0.5)
        none = jnp.zeros((), jnp.int32)
        state = ToyState(place, none, jnp.zeros((), bool), jnp.zeros_like(place))
        return self._observe(state), state

    def step_env(self, state, action, params):
        place = state.place + 0.3 * action[0]
        elapsed = state.elapsed + 1
        terminated = jnp.abs(place) > 1
        truncated = ~terminated & (elapsed >= params.limit)
        reward = place - 0.1 * action[1]
        total = state.total + reward
        after = ToyState(place, elapsed, terminated | truncated, total)
        info = {"place": place, "right": place > 0}
        info |= {"episode_length": elapsed, "episode_return": total}
        return self._observe(after), after, reward, terminated, truncated, info

    def observation_bounds(self, params):
        return np.asarray([-2.0, 0.0]), np.asarray([2.0, 1000.0])

    def pictures(self, states, infos, params):
        """The number of steps as a shade."""
        return lambda i: np.full((4, 6, 3), round(30 * float(states.elapsed[i])), np.uint8)

    def _observe(self, state):
        return jnp.stack([state.place, state.elapsed.astype(state.place.dtype)])


PARAMS = ToyParams()


def toys(count: int = 3, mode: Any = AutoresetMode.NEXT_STEP) -> GymVectorEnv:
    return GymVectorEnv(Toy("disabled"), PARAMS, count, mode)


def one_toy(**more: Any) -> GymEnv:
    return GymEnv(Toy("disabled"), PARAMS, **more)


def pushes(count: int, *values: float) -> np.ndarray:
    """The named environments are pushed, in order; the rest stand."""
    actions = np.zeros((count, 2), np.float32)
    actions[: len(values), 0] = values
    return actions
