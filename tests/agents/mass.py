"""A third machine: a mass pulled over a floor with a slippery patch, towards x = 1."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents import Machine
from stickslip.agents.protocol import Memoryless
from stickslip.agents.training.configuration import Configuration, shared
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs import FunctionalEnv


class MassState(NamedTuple):
    """Where the mass is [m], how fast [m/s], and how long ago it began [steps]."""

    place: jax.Array
    speed: jax.Array
    elapsed: jax.Array
    over: jax.Array
    total: jax.Array


@register_pytree
@dataclass(frozen=True)
class MassParams:
    """In SI units; the patch is from 0.4 m to 0.6 m."""

    mass: float = 2.0
    mu: float = 0.3
    mu_patch: float = 0.05
    force_limit: float = 12.0
    control_period: float = 0.1
    time_limit: float = 3.0


@dataclass(frozen=True)
class MassEnv(FunctionalEnv[MassState, MassParams]):
    """Action: force / force limit."""

    autoreset: str = "same_step"
    action_names = ("force",)
    params_kind = MassParams

    @property
    def default_params(self):
        return MassParams()

    def reset_env(self, key, params):
        place = jax.random.uniform(key, (), minval=-0.2, maxval=0.2)
        state = MassState(place, 0 * place, jnp.int32(0), jnp.bool_(False), 0 * place)
        return self._observe(state), state

    def step_env(self, state, action, params):
        slippery = (state.place > 0.4) & (state.place < 0.6)
        drag = jnp.where(slippery, params.mu_patch, params.mu) * 9.81 * params.control_period
        driven = state.speed + action[0] * params.force_limit / params.mass * params.control_period
        speed = jnp.sign(driven) * jnp.maximum(jnp.abs(driven) - drag, 0.0)
        place = state.place + speed * params.control_period
        elapsed, lost = state.elapsed + 1, jnp.abs(place) > 3
        late = elapsed >= params.time_limit / params.control_period - 0.5
        reward = jnp.exp(-jnp.abs(place - 1)) - 0.01 * action[0] ** 2 - 5.0 * lost
        after = MassState(place, speed, elapsed, lost | late, state.total + reward)
        info = {"speed": speed, "episode_return": after.total, "episode_length": elapsed}
        return self._observe(after), after, reward, lost, late & ~lost, info

    def observation_bounds(self, params):
        return np.full(2, -50.0), np.full(2, 50.0)

    def pictures(self, states, infos, params):
        """A black square on white."""

        def draw(i: int) -> np.ndarray:
            page = np.full((24, 96, 3), 255, np.uint8)
            at = int(np.clip(24 + 40 * states.place[i], 0, 90))
            page[8:20, at : at + 6] = 0
            return page

        return draw

    def _observe(self, state):
        return jnp.stack([state.place, state.speed])


@register_pytree
@dataclass(frozen=True)
class Pull(Memoryless):
    """Pull towards x = 1, the harder the farther."""

    gain: float = 1.5

    def act(self, memory, obs, env_state, env_params):
        wanted = self.gain * (1 - env_state.place) - 0.8 * env_state.speed
        return memory, jnp.clip(wanted, -1.0, 1.0)[None]


@dataclass(frozen=True)
class MassConfig(Configuration):
    """Small enough for a test."""

    timesteps: int = shared("timesteps", 256)
    num_envs: int = shared("num_envs", 4)
    batch_size: int = shared("batch_size", 64)
    rollout_steps: int = shared("rollout_steps", 32)
    epochs: int = shared("epochs", 1)
    checkpoint_interval: int = shared("checkpoint_interval", 128)
    evaluation_episodes: int = shared("evaluation_episodes", 3)
    machine = "mass"


class MassMachine(Machine[MassEnv, MassParams, MassConfig]):
    """The mass as a machine."""

    name = title = "mass"
    environment, modules = "MassEnv", (__name__,)
    configuration = MassConfig
    baselines, scenes = ("pull",), ("patchy", "even")

    def env(self) -> MassEnv:
        return MassEnv()

    def with_scene(self, params: MassParams, scene: str) -> MassParams:
        return params if scene == "patchy" else replace(params, mu_patch=params.mu)

    def baseline(self, name: str, env: MassEnv) -> Pull:
        return Pull()
