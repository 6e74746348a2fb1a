"""A functional environment in brax's conventions (extra `brax`)."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp

from stickslip.dynamics.checks import require_integer, require_kind, require_known
from stickslip.dynamics.kernels.fused import where_needed
from stickslip.envs.functional import FunctionalEnv, abstract_step, pure_step
from stickslip.envs.params import horizon
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.envs.params import Timed

with warnings.catch_warnings():  # brax loads jaxopt, which says that nobody maintains it
    warnings.simplefilter("ignore", DeprecationWarning)
    base = require("brax.envs.base", "BraxEnv", "brax")

BraxState: TypeAlias = Any
"""brax's State: pipeline_state, obs, reward, done, metrics, info."""


class BraxEnv(base.Env):
    """One environment as a brax.envs.Env, for `brax.training` and what else takes one.

    State holds the functional environment's state as `pipeline_state`. done: 1 where the episode
    terminated. Time limits are the wrappers' in brax, so give `episode_length`, the steps of this
    one's, to whatever trains: it sets info["truncation"], which masks the last step of a truncated
    episode where advantages are estimated. metrics: names of info whose values State carries,
    which brax's evaluations sum over an episode.

    brax's own wrapper begins every episode of an environment in the state of its first one. With
    `wrap_env_fn=fresh_episodes` the starts, frictions and tracks are drawn anew for each, as the
    task says. Actions saturate beyond [-1, 1].
    """

    def __init__(
        self,
        env: FunctionalEnv,
        params: Timed,
        metrics: tuple[str, ...] = (),
    ):
        require_kind("env", env, FunctionalEnv, "a BipedEnv or UGVEnv")
        env.check_params(params)
        self.functional: FunctionalEnv = replace(env, autoreset="disabled")  # type: ignore[type-var]
        self.params, self.metrics = params, tuple(metrics)
        self._obs, _, step = abstract_step(self.functional, params)
        require_known(self.metrics, step[5], "metric")

    def reset(self, rng: Array) -> BraxState:
        """Begin an episode. rng: a key, of either kind that JAX has."""
        obs, state = self.functional.reset_env(_typed(rng), self.params)
        zero = jnp.zeros((), self._obs.dtype)
        metrics = dict.fromkeys(self.metrics, zero)
        return base.State(state, obs, zero, zero, metrics, {"truncation": zero})

    def step(self, state: BraxState, action: Array) -> BraxState:
        """One control step."""
        action = jnp.asarray(self.functional.check_action(action))
        obs, after, reward, terminated, truncated, info = pure_step(
            self.functional, None, state.pipeline_state, action, self.params
        )
        kind = self._obs.dtype
        return state.replace(
            pipeline_state=after,
            obs=obs,
            reward=reward,
            done=terminated.astype(kind),
            metrics=state.metrics | {name: info[name].astype(kind) for name in self.metrics},
            info=state.info | {"truncation": truncated.astype(kind)},
        )

    @property
    def episode_length(self) -> int:
        """Control steps to the time limit."""
        return horizon(self.params)

    @property
    def observation_size(self) -> int:
        """Numbers in an observation."""
        return self._obs.shape[-1]

    @property
    def action_size(self) -> int:
        """Numbers in an action."""
        return len(self.functional.action_names)

    @property
    def backend(self) -> str:
        """Name of the physics engine."""
        return "stickslip"


class FreshEpisodes(base.Wrapper):
    """A batch of a BraxEnv in brax's EpisodeWrapper whose episodes are drawn anew.

    In place of brax's AutoResetWrapper: where an episode has ended in any way the observation is
    the next episode's first.
    """

    def reset(self, rng: Array) -> BraxState:
        """rng: keys [n]."""
        chain, first = jnp.moveaxis(jax.vmap(jax.random.split)(_typed(rng)), 1, 0)
        state = self.env.reset(jax.random.key_data(first))
        return state.replace(info=state.info | {"chain": jax.random.key_data(chain)})

    def step(self, state: BraxState, action: Array) -> BraxState:
        """state, action: of all, [n, ...]."""
        env, params = self.env.unwrapped.functional, self.env.unwrapped.params
        action = jnp.asarray(env.check_action(action, state.done.shape))
        begun = {"steps": (1 - state.done) * state.info["steps"]}
        after = self.env.step(
            state.replace(done=jnp.zeros_like(state.done), info=state.info | begun), action
        )

        def following(chain: Array, done: Array, now: Any) -> Any:
            chain, key = jax.random.split(jax.random.wrap_key_data(chain))
            obs, state = where_needed(done > 0, env.reset_env, (key, params), now)
            return jax.random.key_data(chain), obs, state

        chain, obs, inner = jax.vmap(following)(
            state.info["chain"], after.done, (after.obs, after.pipeline_state)
        )
        info = after.info | {"chain": chain}
        return after.replace(obs=obs, pipeline_state=inner, info=info)


def fresh_episodes(
    env: BraxEnv,
    episode_length: int,
    action_repeat: int = 1,
    randomization_fn: None = None,
) -> FreshEpisodes:
    """Argument `wrap_env_fn` of brax's trainers.

    The task's own time limit ends its episodes: ValueError for a shorter episode_length, for
    repeated actions, and for a randomisation of brax's, which changes a brax system.
    """
    require_kind("env", env, BraxEnv, "a BraxEnv")
    require_integer("episode_length", episode_length, low=env.episode_length)
    require_integer("action_repeat", action_repeat, high=1)
    if randomization_fn is not None:
        raise ValueError(
            "randomization_fn is not accepted; accepted: None, and the task's own randomisation"
        )
    training = require("brax.envs.wrappers.training", "fresh_episodes", "brax")
    inner = training.VmapWrapper(env)
    return FreshEpisodes(training.EpisodeWrapper(inner, env.episode_length, action_repeat))


def _typed(rng: Array) -> Array:
    """A key as `jax.random.key` makes them."""
    if jax.dtypes.issubdtype(rng.dtype, jax.dtypes.prng_key):
        return rng
    return jax.random.wrap_key_data(rng)
