"""Tasks and episodes shared by the tests; compiled once and used by many.

Call these inside a test: the precision is the one in force there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np

import stickslip  # noqa: F401  (registers the environments)
from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv, BipedEnvParams, GymEnv, GymVectorEnv, Randomisation

BIPED = "stickslip/Biped-v0"
STEPS = 520
"""Control steps of every rollout: a whole episode and a bit."""
WALKERS = 4

RANGES = Randomisation(
    friction=(0.5, 2.0),
    mass=(0.8, 1.2),
    payload=(0.0, 0.3),
    mean_rate=(2.0, 4.0),
    phase=(1.6, 4.6),
    crank_rate=(-1.0, 3.0),
)


def options(name: str) -> dict[str, Any]:
    """Keyword arguments of gymnasium.make for the tasks of the tests."""
    if name == "random":  # every range drawn, short episodes, falls among them
        return {"see_friction": True, "randomisation": RANGES, "time_limit": 0.6}
    if name == "patches":  # grip behind ice behind a slippery floor, within reach of a sliding foot
        edges, mu = np.asarray([-0.03, 0.02], np.float32), np.asarray([0.5, 0.05, 0.1], np.float32)
        scene = Scene.patches(edges, mu, 0.8 * mu)
        return {"see_friction": True, "see_patch": True, "scene": scene}
    if name == "one":
        return {"scene": Scene.grip(steps="one"), "see_friction": True, "see_patch": True}
    return {}


@lru_cache
def task(
    name: str = "default", autoreset: str = "same_step", dtype: str = "float32", **static: Any
) -> tuple[BipedEnv, BipedEnvParams]:
    """The functional environment and its parameters."""
    given = options(name)
    seen = {key: given.pop(key) for key in ("see_friction", "see_patch") if key in given}
    env = BipedEnv(autoreset=autoreset, **seen, **static)
    return env, env.make_params(dtype=jnp.dtype(dtype), **given)


def make(name: str = "default", **more: Any) -> GymEnv:
    """The Gymnasium environment without wrappers."""
    return single_env(BIPED, options(name) | more)


def make_vec(
    num_envs: int = 3, mode: Any = "next_step", name: str = "random", **more: Any
) -> GymVectorEnv:
    """What gymnasium.make_vec gives, without wrappers; mode: of autoreset."""
    how = {"vectorization_mode": "vector_entry_point", "autoreset_mode": mode}
    env = gymnasium.make_vec(BIPED, num_envs=num_envs, **how, **(options(name) | more))
    assert isinstance(env, GymVectorEnv)
    return env


def single_env(environment: str, given: dict[str, Any]) -> GymEnv:
    """What gymnasium.make gives for an id and keyword arguments, without wrappers."""
    env = gymnasium.make(environment, **given).unwrapped
    assert isinstance(env, GymEnv)
    return env


def actions(scale: float, seed: int = 0, shape: tuple[int, ...] = (WALKERS, STEPS)) -> np.ndarray:
    """Uniform random actions in [-scale, scale], [..., 1]."""
    drawn = np.random.default_rng(seed).uniform(-scale, scale, (*shape, 1))
    return drawn.astype(np.float32)


def constant(*values: float) -> np.ndarray:
    """One constant action for each walker."""
    return np.broadcast_to(np.asarray(values, np.float32)[:, None, None], (WALKERS, STEPS, 1))


class Rollout(NamedTuple):
    """[walkers, steps, ...] of what `step` returned; first_*: [walkers, ...] of `reset`."""

    first_obs: Any
    first_state: Any
    obs: Any
    state: Any
    reward: Any
    terminated: Any
    truncated: Any
    info: Any

    @property
    def over(self) -> np.ndarray:
        return self.terminated | self.truncated

    @property
    def before(self) -> Any:
        """The states that the steps began in."""
        both = self.first_state, self.state
        return jax.tree.map(lambda a, b: np.concatenate([a[:, None], b[:, :-1]], axis=1), *both)


def rollout(
    env: BipedEnv, params: BipedEnvParams, given: np.ndarray, axis: int | None = None
) -> Rollout:
    """Walker i acts from seed i on, with the chain of keys that PackedEnvs documents.

    axis: 0 where every walker has parameters of its own, a leading axis on every leaf.
    """
    keys = jax.vmap(jax.random.key)(jnp.arange(len(given)))
    kind = jnp.result_type(params.robot.total_mass)
    result = _rollout(env, axis, params, keys, jnp.asarray(given, kind))
    return jax.tree.map(np.asarray, result)


@partial(jax.jit, static_argnums=(0, 1))
def _rollout(env, axis, params, keys, given) -> Rollout:
    return jax.vmap(partial(_episode, env), (axis, 0, 0))(params, keys, given)


def _episode(env, params, key, given) -> Rollout:
    chain, sub = jax.random.split(key)
    first_obs, first_state = env.reset(sub, params)

    def body(carry, action):
        chain, state = carry
        following, sub = jax.random.split(chain)
        obs, state, reward, terminated, truncated, info = env.step(sub, state, action, params)
        chain = jnp.where(info["autoreset"], following, chain)
        return (chain, state), (obs, state, reward, terminated, truncated, info)

    _, rest = jax.lax.scan(body, (chain, first_state), given)
    return Rollout(first_obs, first_state, *rest)


lone_walk = jax.jit(_episode, static_argnums=0)
"""One walker of `rollout`, not batched: [steps, ...]; compiles in half the time."""


def warm_then_count(use: Callable[[int], None]) -> int:
    """Compilations by XLA in three turns after a first one."""
    heard: list[str] = []

    def hear(event: str, *_: Any, **__: Any) -> None:
        heard.append(event)

    use(0)
    jax.monitoring.register_event_duration_secs_listener(hear)
    try:
        for turn in range(1, 4):
            use(turn)
    finally:
        jax.monitoring.unregister_event_duration_listener(hear)
    return heard.count("/jax/core/compile/backend_compile_duration")
