"""A functional environment in brax's conventions (extra `brax`)."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp

from stickslip.dynamics.checks import require_integer, require_kind, require_known
from stickslip.envs.functional import FunctionalEnv, bare_step, pure_step
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
        key = jax.eval_shape(lambda: jax.random.key(0))
        self._obs, state = jax.eval_shape(env.reset_env, key, params)
        action = jax.ShapeDtypeStruct((self.action_size,), self._obs.dtype)
        info = jax.eval_shape(
            lambda state, action: bare_step(self.functional, None, state, action, params)[5],
            state,
            action,
        )
        require_known(self.metrics, info, "metric")

    def reset(self, rng: Array) -> BraxState:
        """Begin an episode. rng: a key, of either kind that JAX has."""
        obs, state = self.functional.reset_env(_typed(rng), self.params)
        zero = jnp.zeros((), self._obs.dtype)
        metrics = dict.fromkeys(self.metrics, zero)
        return base.State(state, obs, zero, zero, metrics, {"truncation": zero})

    def step(self, state: BraxState, action: Array) -> BraxState:
        """One control step."""
        action = jnp.asarray(self.functional.check_action(action))
        result = pure_step(self.functional, None, state.pipeline_state, action, self.params)
        return self.stepped(state, result, result[3])

    def stepped(self, state: BraxState, result: tuple[Any, ...], done: Array) -> BraxState:
        """The state with a step's results; entries of wrappers in its info stay."""
        obs, after, reward, _, truncated, info = result
        kind = self._obs.dtype
        return state.replace(
            pipeline_state=after,
            obs=obs,
            reward=reward,
            done=done.astype(kind),
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
        """Whose physics it is."""
        return "stickslip"


class FreshEpisodes(base.Wrapper):
    """A batch of a BraxEnv whose episodes are drawn anew, with what brax's trainers read in info.

    As `brax.envs.training.wrap`: done is 1 where an episode ends in any way, truncation where its
    time was over and nothing else ended it, and the observation is then the next episode's first.
    """

    def reset(self, rng: Array) -> BraxState:
        """rng: keys [n]."""

        def one(rng: Array) -> BraxState:
            chain, first = jax.random.split(_typed(rng))
            state = self.env.reset(first)
            zero = state.done
            sums = dict.fromkeys(("sum_reward", "length", *self.env.metrics), zero)
            more = {"steps": zero, "episode_done": zero, "episode_metrics": sums}
            return state.replace(info=state.info | more | {"chain": jax.random.key_data(chain)})

        return jax.vmap(one)(rng)

    def step(self, state: BraxState, action: Array) -> BraxState:
        """state, action: of all, [n, ...]."""
        inner = self.env.unwrapped
        env = replace(inner.functional, autoreset="same_step")
        action = jnp.asarray(env.check_action(action, state.done.shape))

        def one(state: BraxState, action: Array) -> BraxState:
            chain, key = jax.random.split(jax.random.wrap_key_data(state.info["chain"]))
            result = pure_step(env, key, state.pipeline_state, action, inner.params)
            state = inner.stepped(state, result, result[3] | result[4])
            new = {"sum_reward": state.reward, "length": jnp.ones_like(state.reward)}
            new |= state.metrics
            goes_on = 1 - state.info["episode_done"]
            before = state.info["episode_metrics"]
            more = {
                "steps": goes_on * state.info["steps"] + 1,
                "episode_done": state.done,
                "episode_metrics": {
                    name: goes_on * value + new[name] for name, value in before.items()
                },
                "chain": jax.random.key_data(chain),
            }
            return state.replace(info=state.info | more)

        return jax.vmap(one)(state, action)


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
    return FreshEpisodes(env)


def _typed(rng: Array) -> Array:
    """A key as `jax.random.key` makes them."""
    if jax.dtypes.issubdtype(rng.dtype, jax.dtypes.prng_key):
        return rng
    return jax.random.wrap_key_data(rng)
