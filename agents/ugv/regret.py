"""Optimal values of a UGV's states, and the regret of its steps, by dynamic programming."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from stickslip.agents.evaluation.rollout import is_random
from stickslip.agents.pictures.episodes import samples
from stickslip.dynamics.checks import require_integer, require_kind, require_memory
from stickslip.dynamics.pytrees import pytree_dataclass, rebuilt
from stickslip.dynamics.status import Status
from stickslip.envs.adapters.gym import GymEnv
from stickslip.envs.functional import horizon
from stickslip.envs.ugv.env import UGVEnv
from stickslip.optim.posture import criteria

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.exchange.record import Infos
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

ANGLES, MOST_ANGLES = 31, 201
"""Nodes along each leg's angle, and the most."""
TURNS, JUDGED = 5, 11
"""Turns of each leg, evenly spaced, in the recursion and in the step from a state."""


def _pairs(one: Float[Array, " n"]) -> Float[Array, "n^2 2"]:
    """All pairs of these numbers, the first of a pair slowest."""
    return jnp.stack(jnp.meshgrid(one, one, indexing="ij"), -1).reshape(-1, 2)


@pytree_dataclass
class DriveValues:
    """What is still to be earned from the states of an episode of UGVEnv, on its very ground.

    Value iteration backwards over the waypoints, on the environment's own step: from each node of a
    grid of leg angles the best of 5 x 5 pairs of turns. to_go [K + 1, n, n]: the least further
    cost from each waypoint and pair of angles on, in the criterion's unit; with "max" criteria the
    least worst station, this one included. NaN where the posture itself fails. It is interpolated
    bilinearly, with what does not fail. A failed step costs the failure penalty.
    """

    params: UGVEnvParams
    to_go: Float[Array, "waypoints n n"]
    env: UGVEnv = field(metadata={"static": True})

    @classmethod
    def of(
        cls, env: UGVEnv, params: UGVEnvParams, state: UGVEnvState, angles: int = ANGLES
    ) -> DriveValues:
        """The values of the episode that begins in a state. angles: of each leg, evenly spaced."""
        require_kind("env", env, UGVEnv, "a UGVEnv")
        env.check_params(params)
        require_integer("angles", angles, low=2, high=MOST_ANGLES)
        counts = horizon(params), angles
        require_memory(f"angles = {angles}", "values of a drive", counts[0], 8 * angles**2)
        return cls(params, _backwards(env, *counts, params, state), env)

    def value(self, states: UGVEnvState) -> Float[Array, " n"]:
        """The return to come from each state, of a batch; 0 after the end."""
        return _values(self, states)

    def cost(
        self, state: UGVEnvState, action: Float[Array, " 2"], after: Float[Array, "n n"]
    ) -> Float[Array, ""]:
        """Further cost of an action and of the best drive behind it; after: to_go there."""
        plain = rebuilt(self.params, reward_scale=jnp.ones_like(self.params.reward_scale))
        _, then, reward, *_ = self.env.step_env(state, action, plain)
        further = self._read(after, then.leg_angles)
        if self.env.measure.kind == "max":
            further = jnp.maximum(then.cost, further) - then.cost
        further = jnp.where(jnp.isnan(further), plain.failure_penalty, further)
        return jnp.where(then.over, 0, further) - reward

    def _read(self, values: Float[Array, "n n"], angles: Float[Array, " 2"]) -> Array:
        """The interpolation at leg angles; NaN where all corners of the cell are."""
        vehicle, last = self.params.vehicle, len(values) - 1
        low, high = vehicle.leg_angle_min, vehicle.leg_angle_max
        at = jnp.clip((angles - low) / jnp.maximum(high - low, 1e-9) * last, 0, last)
        cell = jnp.minimum(at.astype(jnp.int32), last - 1)
        share = jnp.stack([1 - (at - cell), at - cell])
        corners = jax.lax.dynamic_slice(values, cell, (2, 2))
        weights = jnp.where(jnp.isnan(corners), 0, share[:, None, 0] * share[None, :, 1])
        return jnp.nansum(weights * corners) / jnp.sum(weights)


@jax.jit
def _values(of: DriveValues, states: UGVEnvState) -> Float[Array, " n"]:
    turns = _pairs(jnp.linspace(-1.0, 1.0, JUDGED, dtype=of.to_go.dtype))
    last = len(of.to_go) - 1

    def one(state: UGVEnvState) -> Array:
        after = of.to_go[jnp.minimum(state.elapsed + 1, last)]
        costs = jax.vmap(lambda turn: of.cost(state, turn, after))(turns)
        over = state.over | (state.elapsed >= last)
        return jnp.where(over, 0, -of.params.reward_scale * jnp.min(costs))

    return jax.lax.map(one, states)


def _solve(
    env: UGVEnv, steps: int, count: int, params: UGVEnvParams, begin: UGVEnvState
) -> Float[Array, "waypoints n n"]:
    """to_go of all waypoints."""
    vehicle, dtype = params.vehicle, begin.cost.dtype
    leg = jnp.linspace(vehicle.leg_angle_min, vehicle.leg_angle_max, count, dtype=dtype)
    turns = _pairs(jnp.linspace(-1.0, 1.0, TURNS, dtype=dtype))
    ended = jnp.zeros((1, count, count), dtype)
    place = DriveValues(params, ended, env)
    nothing = jax.tree.map(jnp.zeros_like, begin.rests)

    def step(after: Float[Array, "n n"], k: Int[Array, ""]) -> tuple[Array, Array]:
        def node(angles: Float[Array, " 2"]) -> Array:
            at, attitude = env._stand(params.waypoint(k), angles, begin.drawn, params)
            cost = jnp.zeros((), dtype)
            if env.measure.kind == "max":
                cost = criteria.station_cost(env.measure.of(vehicle), at).astype(dtype)
            own = {"station": at, "attitude": attitude, "cost": cost, "rests": nothing}
            state = replace(begin, elapsed=k, over=at.status != Status.OK, **own)
            further = jnp.min(jax.vmap(lambda turn: place.cost(state, turn, after))(turns))
            return jnp.where(state.over, jnp.nan, cost + further).astype(dtype)

        return (jax.lax.map(jax.vmap(node), _pairs(leg).reshape(count, count, 2)),) * 2

    found = jax.lax.scan(step, ended[0], jnp.arange(steps, dtype=jnp.int32), reverse=True)[1]
    return jnp.concatenate([found, ended])


_backwards = jax.jit(_solve, static_argnums=(0, 1, 2))


def regrets(env: UGVEnv, params: UGVEnvParams) -> Infos:
    """The function that tells `value` and `regret` of an episode's rows, as RegretInfo has them."""

    def entries(rollout: Rollout[UGVEnvState], _: int) -> Mapping[str, np.ndarray]:
        values = DriveValues.of(env, params, rollout.start_state)
        rows = np.minimum(np.arange(horizon(params) + 1), count := len(rollout.reward))
        states = jax.tree.map(lambda leaf: leaf[rows], samples(rollout)[0])  # one program for all
        value = np.asarray(values.value(states))[: count + 1]
        return {"value": value, "regret": np.append(0.0, value[:-1] - rollout.reward - value[1:])}

    return entries


class RegretInfo(gymnasium.Wrapper, RecordConstructorArgs):
    """Tell what each step of a UGV's environment lost against the optimum.

    info["value"], of a reset, too: the return to come of the best drive from the state that was
    reached (see DriveValues). info["regret"]: the value before the step less its reward and the
    value after it. Over an episode regrets sum to the value at its start less its return. Errors of
    the grid make single ones negative. A reset solves its episode's ground, and sees all of it.
    angles: nodes of each leg's angle.
    """

    def __init__(self, env: gymnasium.Env, angles: int = ANGLES):
        inner: Any = getattr(env, "unwrapped", env)
        accepted = "a Gymnasium environment of a UGVEnv"
        require_kind("env.unwrapped", inner, GymEnv, f"{accepted}, and no vector")
        require_kind("env.unwrapped.functional", inner.functional, UGVEnv, "a UGVEnv")
        RecordConstructorArgs.__init__(self, angles=angles)
        gymnasium.Wrapper.__init__(self, env)
        self._inner, self._drawn = inner, is_random(inner.functional, inner.params)
        limit, self._params = env.spec and env.spec.max_episode_steps, inner.params
        if limit is not None and limit < horizon(inner.params):  # TimeLimit's
            self._params = inner.params.shortened(limit)
        self._angles = require_integer("angles", angles, low=2, high=MOST_ANGLES)
        self._values: DriveValues | None = None
        self._value = 0.0

    def reset(self, *, seed=None, options=None):
        """Begin an episode, and solve its ground unless it is always the same."""
        obs, info = self.env.reset(seed=seed, options=options)
        if self._values is None or self._drawn:
            state = self._inner._envs.state_of(0)
            given = self._inner.functional, self._params, state, self._angles
            self._values = DriveValues.of(*given)
        self._value = self._of_state(self._values)
        return obs, info | {"value": self._value}

    def step(self, action):
        """One step, and what it lost."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        before, self._value = self._value, self._of_state(self._values)
        more = {"value": self._value, "regret": before - float(reward) - self._value}
        return obs, reward, terminated, truncated, info | more

    def _of_state(self, values: Any) -> float:
        """The value of the environment's state."""
        state = jax.tree.map(lambda leaf: np.asarray(leaf)[None], self._inner._envs.state_of(0))
        return float(values.value(state)[0])
