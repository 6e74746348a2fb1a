"""A controller made better by trying other actions first, in the environment itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.agents.protocol import Controller, Memory, Params, State
from stickslip.dynamics.checks import require_integer, require_kind
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.functional import FunctionalEnv, pure_step

if TYPE_CHECKING:
    from jaxtyping import Array, Float

MOST = 10**4
"""Actions that may be tried, and steps looked ahead."""


@register_pytree
@dataclass(frozen=True)
class Improved(Generic[Memory, State, Params]):
    """At every step try some actions, follow `base` for `horizon` steps after each, take the best.

    One step of policy iteration with the environment as its own model (a rollout policy: Bertsekas,
    Reinforcement Learning and Optimal Control, ch. 2). It works wherever the environment can be
    stepped, drawn masses, hidden friction and patches included, since it steps the true state: it
    knows what no observation tells, so what it earns bounds from below what is possible with that
    knowledge. With a horizon up to the episode's end and no draws in a step it earns at least what
    `base` does; with a shorter one usually.

    base: a controller. env: without resets, with the observation that base reads. count: values of
    each action number, evenly from -1 to 1, beside the base's own action. horizon: steps. The
    last three are static.
    """

    base: Controller[Memory, State, Params]
    env: FunctionalEnv[State, Params] = field(metadata={"static": True})
    count: int = field(default=15, metadata={"static": True})
    horizon: int = field(default=40, metadata={"static": True})

    def validate(self) -> Improved[Memory, State, Params]:
        """Return self, or raise ValueError naming the field."""
        require_kind("env", self.env, FunctionalEnv, "an environment")
        if self.env.autoreset != "disabled":
            raise ValueError(
                f"env.autoreset = {self.env.autoreset!r}; accepted: 'disabled', or what is tried "
                "goes on in another episode"
            )
        require_integer("count", self.count, low=2, high=MOST)
        require_integer("horizon", self.horizon, high=MOST)
        self.base.validate()
        return self

    def init(self, env_params: Params, env_state: State) -> Memory:
        """The base's memory."""
        return self.base.init(env_params, env_state)

    def act(
        self, memory: Memory, obs: Float[Array, " obs"], env_state: State, env_params: Params
    ) -> tuple[Memory, Float[Array, " act"]]:
        """See Controller."""
        after, own = self.base.act(memory, obs, env_state, env_params)
        tried = jnp.concatenate([own[None], self._actions(own)])
        worth = jax.vmap(lambda one: self._worth(one, after, obs, env_state, env_params))(tried)
        return after, tried[jnp.argmax(worth)]

    def _actions(self, like: Float[Array, " act"]) -> Float[Array, "tried act"]:
        """Every combination of the values."""
        values = jnp.linspace(-1.0, 1.0, self.count, dtype=like.dtype)
        mesh = jnp.meshgrid(*[values] * like.shape[0], indexing="ij")
        return jnp.stack(mesh, -1).reshape(-1, like.shape[0])

    def _worth(
        self,
        first: Float[Array, " act"],
        memory: Memory,
        obs: Float[Array, " obs"],
        state: State,
        params: Params,
    ) -> Float[Array, ""]:
        """Return of a first action, followed by the base policy."""
        unused = jax.random.key(0)  # an environment that leaves resetting to the caller

        def body(step: Array, now: _Way[Memory, State]) -> _Way[Memory, State]:
            over = self.env.is_over(now.state)
            memory, own = self.base.act(now.memory, now.obs, now.state, params)
            action = jnp.where(step == 0, first, own)
            memory = _unless(step == 0, memory, now.memory)  # of the first it is known already
            found = pure_step(self.env, unused, now.state, action, params)
            earned = now.earned + jnp.where(over, 0.0, found[2])
            return _Way(found[0], _unless(over, found[1], now.state), memory, earned)

        begun = _Way(obs, state, memory, jnp.zeros((), obs.dtype))
        return jax.lax.fori_loop(0, self.horizon + 1, body, begun).earned


def _unless(over: Array, new: State, old: State) -> State:
    return jax.tree.map(lambda a, b: jnp.where(over, b, a), new, old)


class _Way(NamedTuple, Generic[Memory, State]):
    """State of one candidate."""

    obs: Float[Array, " obs"]
    state: State
    memory: Memory
    earned: Float[Array, ""]
