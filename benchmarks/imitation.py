"""A network that imitates dynamic programming on a task of the biped that PPO leaves unsolved.

    python -m benchmarks.imitation BipedStop-v0

DAgger (Ross, Gordon and Bagnell 2011): in each round the network walks, value iteration says what
it would do in the states that were met, and the network is fitted to all that was said so far. The
round that earns most on validation episodes goes into the package, measured on the task's own.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
import optax

from benchmarks.optimum import ValuePolicy, planner
from benchmarks.policies import computed_with, write
from benchmarks.report import options
from stickslip.agents.biped.task import ANY_PHASE
from stickslip.agents.evaluation.rollout import play, play_unseen
from stickslip.agents.evaluation.table import keep_of
from stickslip.agents.policy.file import installed
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.policy.shipped import FOLDER
from stickslip.agents.training.ppo import Layers, Moments, Sizes, begin_learning, network
from stickslip.envs import task_by_name

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.agents.evaluation.rollout import Rollout

ROUNDS, EPISODES, STATES, VALIDATION = 10, 48, 5000, 64
"""Rounds; episodes of each; states that value iteration is asked about in half of these; validation
episodes."""
SIZES, STEPS, RATE = Sizes(1, 1, 4096, 1, hidden=64), 6000, 2e-3
"""Of the network; gradient steps of a round, and the learning rate that falls to 0 in them."""
FASTEST, FIRST = 3.0, 10_000
"""Crank rate up to which half of the training episodes begin, at any phase [rad/s]; first seed."""


def whole(episode: Rollout[Any], _: object) -> Rollout[Any]:
    """All of an episode."""
    return episode


def met(played: Rollout[Any], random: np.random.Generator) -> tuple[np.ndarray, Any]:
    """Observations and states of some steps of episodes [episodes, steps], before each step."""
    begun = played.start_obs, played.start_state
    steps = np.arange(played.reward.shape[1]) < played.length[:, None]
    taken = random.permutation(np.flatnonzero(steps))[:STATES]

    def rows(first: np.ndarray, later: np.ndarray) -> np.ndarray:
        both = np.concatenate([first[:, None], later[:, :-1]], axis=1)
        return both.reshape(-1, *both.shape[2:])[taken]

    return jax.tree.map(rows, begun, (played.obs, played.state))


@jax.jit
def asked(policy: ValuePolicy, states: Any) -> Float[Array, "n act"]:
    """What value iteration would do."""
    params = policy.walk.params
    return jax.lax.map(lambda at: policy.act(None, at, at, params)[1], states, batch_size=256)


@jax.jit
def fitted(layers: Layers, seen: Moments, obs: Array, action: Array, key: Array) -> Layers:
    """Layers of the network that is nearest to the actions in least squares, from these on."""
    adam = optax.adam(optax.cosine_decay_schedule(RATE, STEPS))

    def error(layers: Layers, rows: Array) -> Float[Array, ""]:
        found = network(layers, seen).unlimited(obs[rows])
        return jnp.mean((jnp.clip(found, -1.5, 1.5) - action[rows]) ** 2)

    def step(carried: tuple[Layers, Any], key: Array) -> tuple[tuple[Layers, Any], None]:
        layers, state = carried
        slope = jax.grad(error)(layers, jax.random.randint(key, (SIZES.batch_size,), 0, len(obs)))
        change, state = adam.update(slope, state)
        return (cast("Layers", optax.apply_updates(layers, change)), state), None

    return jax.lax.scan(step, (layers, adam.init(layers)), jax.random.split(key, STEPS))[0][0]


class Imitation(NamedTuple):
    """A network, its mean return in validation episodes, and the states that it was fitted to."""

    network: MLPPolicy
    earned: float
    states: int


def imitations(policy: ValuePolicy) -> Iterator[Imitation]:
    """The network after each round."""
    env, params, random = policy.walk.env, policy.walk.params, np.random.default_rng(0)
    drawn = replace(params.randomisation, phase=ANY_PHASE, crank_rate=(0.0, FASTEST))
    places = params.replace(randomisation=drawn), params

    def answers(player: ValuePolicy | MLPPolicy, number: int) -> Iterator[tuple[Any, np.ndarray]]:
        seeds = FIRST + EPISODES * number + np.arange(EPISODES)
        for its, own in zip(places, np.split(seeds, 2), strict=True):
            obs, states = met(play(env, player, its, own.tolist(), whole), random)
            yield obs, np.asarray(asked(policy, states))

    found = list(answers(policy, 0))
    obs = np.concatenate([one for one, _ in found])
    seen = Moments(obs.mean(0), obs.var(0), jnp.float32(len(obs)))
    *keys, first = jax.random.split(jax.random.key(0), ROUNDS + 1)
    layers = begin_learning(obs.shape[1], 1, SIZES, first).actor
    for number, key in enumerate(keys, 1):
        obs, action = map(np.concatenate, zip(*found, strict=True))
        layers = fitted(layers, seen, obs, action, key)
        player = network(layers, seen).validate()
        earned = play_unseen(env, player, params, VALIDATION, keep_of).reward.mean()
        print(f"{len(obs):,} states: {earned:.4g}", flush=True)
        yield Imitation(player, float(earned), len(obs))
        found += answers(player, number) if number < ROUNDS else ()


def main(arguments: list[str]) -> None:
    """Imitate on a task, and put the best network into the package."""
    parser = options("imitation", __doc__)
    parser.add_argument("task")
    task = task_by_name(parser.parse_args(arguments).task)
    rounds = list(imitations(planner(task)))
    best = max(rounds, key=lambda one: one.earned)
    record = {
        "program": f"python -m benchmarks.imitation {task.name}",
        "timesteps": rounds[-1].states,
        "best_after": best.states,
        **computed_with(installed()),
    }
    print(write(task, best.network, record, FOLDER))


if __name__ == "__main__":
    main(sys.argv[1:])
