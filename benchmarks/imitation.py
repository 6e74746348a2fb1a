"""A network that imitates dynamic programming on a task that PPO leaves unsolved.

    python -m benchmarks.imitation BipedStop-v0

DAgger (Ross, Gordon and Bagnell 2011): in each round the network plays, value iteration says what
it would do in the states that were met, and the network is fitted to all that was said so far. Of
the UGV's actions it says what each costs, and the mean cost is minimised (AggreVaTe, Ross and
Bagnell 2014). The round that earns most on validation episodes goes into the package.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any, cast

import jax
import jax.numpy as jnp
import numpy as np
import optax

from benchmarks.optimum import REST, Grid, ValuePolicy, finite_horizon, planner, transitions
from benchmarks.policies import computed_with, write
from benchmarks.report import options
from stickslip.agents.biped.task import ANY_PHASE
from stickslip.agents.evaluation import rollout
from stickslip.agents.evaluation.table import keep_of
from stickslip.agents.policy.file import installed
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.policy.shipped import FOLDER
from stickslip.agents.training.ppo import Layers, Moments, Sizes, begin_learning, network
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs import TaskDefinition, UGVEnv, known_of, task_by_name
from stickslip.envs.functional import pure_step
from stickslip.envs.ugv.state import UGVDrawn, UGVEnvState
from stickslip.optim.posture import criteria

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from benchmarks.optimum import Place
    from stickslip.envs.tasks.known import Known
    from stickslip.envs.ugv.params import UGVEnvParams

ROUNDS, EPISODES, STATES, VALIDATION = 10, 48, 5000, 64
"""Rounds; episodes of each; states that value iteration is asked about in half of the biped's;
validation episodes."""
SIZES, STEPS, RATE = Sizes(1, 1, 4096, 1, hidden=64), 6000, 2e-3
"""Of the network; gradient steps of a round, and the learning rate that falls to 0 in them."""
FASTEST, FIRST = 3.0, 10_000
"""Crank rate up to which half of the training episodes begin, at any phase [rad/s]; first seed."""
ANGLES, TURNS, CHOICES, AWAY = 21, 5, 11, 4
"""Grid of each leg's angle, its turns in the value iteration and those that are judged, all evenly
spaced; one UGV episode in so many begins with any leg angles."""
SHARPNESS, MOST_LOST, BEYOND = 10.0, 1.5, 0.1
"""Exponent for a score of 1; most that a failure costs, in score; price of actions off the box."""


def whole(episode: rollout.Rollout[Any], _: object) -> rollout.Rollout[Any]:
    """All of an episode."""
    return episode


def before_steps(played: Any) -> tuple[Any, Bool[np.ndarray, " n"]]:
    """Observations and states before each step of episodes [episodes, steps], row by row, and which
    of them are real."""

    def rows(first: np.ndarray, later: np.ndarray) -> np.ndarray:
        both = np.concatenate([first[:, None], later[:, :-1]], axis=1)
        return both.reshape(-1, *both.shape[2:])

    found = jax.tree.map(rows, (played.start_obs, played.start_state), (played.obs, played.state))
    return found, (np.arange(played.reward.shape[1]) < played.length[:, None]).ravel()


@jax.jit
def asked(policy: ValuePolicy, states: Any) -> Float[Array, "n act"]:
    """What value iteration would do."""
    params = policy.walk.params
    return jax.lax.map(lambda at: policy.act(None, at, at, params)[1], states, batch_size=256)


@dataclass(frozen=True)
class WalkTeacher:
    """Value iteration on the biped's step says what it would do. Plays the first round itself."""

    policy: ValuePolicy
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    @property
    def place(self) -> tuple[Any, Any]:
        """Environment and parameters."""
        return self.policy.walk.env, self.policy.walk.params

    def lessons(self, player: MLPPolicy, number: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Observations [n, obs] that a player met in a round, and what is said of them [n, ...]."""
        env, params = self.place
        drawn = replace(params.randomisation, phase=ANY_PHASE, crank_rate=(0.0, FASTEST))
        places = params.replace(randomisation=drawn), params
        first = FIRST + EPISODES * number
        who = player if number else self.policy
        for its, seeds in zip(places, np.split(first + np.arange(EPISODES), 2), strict=True):
            found, real = before_steps(rollout.play(env, who, its, seeds.tolist(), whole))
            taken = self.random.permutation(np.flatnonzero(real))[:STATES]
            obs, states = jax.tree.map(lambda leaf, taken=taken: leaf[taken], found)
            yield obs, np.asarray(asked(self.policy, states))

    @staticmethod
    def error(action: Float[Array, " act"], said: Float[Array, " act"]) -> Float[Array, ""]:
        """How far an action, before it is clipped, is from what was said."""
        return jnp.mean((jnp.clip(action, -1.5, 1.5) - said) ** 2)


def turns(count: int) -> tuple[np.ndarray, Float[Array, "count^2 2"]]:
    """Evenly spaced turns of a leg, and all pairs of them."""
    one = np.linspace(-1.0, 1.0, count)
    return one, jnp.asarray(np.stack(np.meshgrid(one, one, indexing="ij"), -1).reshape(-1, 2))


@register_pytree
@dataclass(frozen=True)
class Drive:
    """An episode of the UGV's environment as a process on a grid of waypoints and leg angles.

    Rewards are in score. Where the worst place decides, a place's cost is the exponential of its
    score times -SHARPNESS, so that the logarithm of their sum is about the worst one's.
    """

    params: UGVEnvParams
    drawn: UGVDrawn
    actions: Float[Array, "count 2"]
    grid: Grid
    scale: Any = field(metadata={"static": True})  # a Scale, of arrays
    env: UGVEnv = field(metadata={"static": True})

    @property
    def outside(self) -> Float[Array, ""]:
        """The reward of a failure."""
        return -jnp.exp(SHARPNESS * MOST_LOST) if self.is_worst else -jnp.asarray(MOST_LOST)

    @property
    def is_worst(self) -> bool:
        """True where the worst place decides."""
        return self.env.measure.kind == "max"

    def state(self, sheet: Int[Array, ""], at: Float[Array, " 3"]) -> UGVEnvState:
        """The state at a node."""
        elapsed, first = at[0].astype(jnp.int32), self.env.reset_env(jax.random.key(0), self.params)
        standing = self.params.waypoint(elapsed), at[1:], self.drawn, self.params
        station, attitude = self.env._stand(*standing)
        own = {"station": station, "attitude": attitude, "elapsed": elapsed, "drawn": self.drawn}
        return replace(first[1], **own)

    def place(self, state: UGVEnvState) -> Place:
        """The place of a state."""
        return self.grid.place(REST, jnp.append(state.leg_angles[::-1], state.elapsed)[::-1])

    def step(self, state: UGVEnvState, action: Float[Array, " 2"]) -> tuple[Any, Array, Array]:
        """The state after a step, its reward in score and whether the episode has ended."""
        given = jax.random.key(0), state, action, self.params
        after, reward, failed, done = pure_step(self.env, *given)[1:5]
        if self.is_worst:
            cost = criteria.station_cost(self.env.measure.of(self.params.vehicle), after.station)
            worth = jnp.maximum(-jnp.exp(-SHARPNESS * self.scale.score(-cost)), self.outside)
            return after, jnp.where(failed, self.outside, worth), failed | done
        return after, self.scale.score(self.scale.zero + reward), failed | done


@jax.jit
def costs(drive: Drive, values: Float[Array, " nodes"], states: Any) -> Float[Array, "n count"]:
    """Score that each action loses against the best, up to MOST_LOST."""

    def worth(state: UGVEnvState, action: Float[Array, " 2"]) -> Float[Array, ""]:
        after, reward, ended = drive.step(state, action)
        return reward + jnp.where(ended, 0, drive.grid.read(values, drive.place(after)))

    def one(state: UGVEnvState) -> Float[Array, " count"]:
        lost = -jax.vmap(partial(worth, state))(drive.actions)
        lost = jnp.log(lost) / SHARPNESS if drive.is_worst else lost
        return jnp.minimum(lost - jnp.min(lost), MOST_LOST)

    return jax.lax.map(one, states, batch_size=64)


@dataclass(frozen=True)
class DriveTeacher:
    """Value iteration on the UGV's step over an episode's ground says what each action costs."""

    task: TaskDefinition

    @property
    def place(self) -> tuple[Any, Any]:
        return self.task.make()

    def lessons(self, player: MLPPolicy, number: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        env, params = self.place
        ends = float(params.vehicle.leg_angle_min), float(params.vehicle.leg_angle_max)
        away = params.replace(randomisation=replace(params.randomisation, start_angles=ends))
        first, drawn = FIRST + EPISODES * number, rollout.is_random(env, params)
        for seed in range(first, first + EPISODES):
            its = params if number and seed % AWAY else away
            (obs, states), real = before_steps(rollout.play(env, player, its, [seed], whole))
            said = costs(*solved(self.task.name, seed if drawn else 0), states)
            yield obs[real], np.asarray(said)[real]

    @staticmethod
    def error(action: Float[Array, " 2"], said: Float[Array, " count"]) -> Float[Array, ""]:
        grid = Grid(((turns(CHOICES)[0],) * 2,))
        beyond = BEYOND * jnp.sum(jnp.maximum(jnp.abs(action) - 1, 0) ** 2)
        return grid.read(said, grid.place(REST, jnp.clip(action, -1, 1))) + beyond


@cache
def solved(name: str, seed: int) -> tuple[Drive, Float[Array, " nodes"]]:
    """An episode's process with the actions that are judged, and the values of its nodes."""
    task = task_by_name(name)
    (env, params), known = task.make(), cast("Known", known_of(task))
    vehicle = params.vehicle
    leg = np.linspace(float(vehicle.leg_angle_min), float(vehicle.leg_angle_max), ANGLES)
    grid = Grid(((np.arange(rollout.horizon(params) + 1.0), leg, leg),))
    drawn = rollout.first_state(env, params, seed).drawn
    drive = Drive(params, drawn, turns(TURNS)[1], grid, known.scale, cast("UGVEnv", env))
    values = finite_horizon(grid, transitions(drive), rollout.horizon(params))
    return replace(drive, actions=turns(CHOICES)[1]), values


@partial(jax.jit, static_argnums=0)
def fitted(
    teacher: Any, layers: Layers, seen: Moments, obs: Array, said: Array, key: Array
) -> Layers:
    """Layers of the network that is nearest to what was said, from these on. teacher: its class."""
    adam = optax.adam(optax.cosine_decay_schedule(RATE, STEPS))

    def error(layers: Layers, rows: Array) -> Float[Array, ""]:
        found = network(layers, seen).unlimited(obs[rows])
        return jnp.mean(jax.vmap(teacher.error)(found, said[rows]))

    def step(carried: tuple[Layers, Any], key: Array) -> tuple[tuple[Layers, Any], None]:
        layers, state = carried
        slope = jax.grad(error)(layers, jax.random.randint(key, (SIZES.batch_size,), 0, len(obs)))
        change, state = adam.update(slope, state)
        return (cast("Layers", optax.apply_updates(layers, change)), state), None

    return jax.lax.scan(step, (layers, adam.init(layers)), jax.random.split(key, STEPS))[0][0]


def imitations(teacher: WalkTeacher | DriveTeacher) -> Iterator[tuple[float, int, MLPPolicy]]:
    """Mean return in validation episodes, number of states and network of each round."""
    env, params = teacher.place
    *keys, first = jax.random.split(jax.random.key(0), ROUNDS + 1)
    sizes = len(env.observation_bounds(params)[0]), len(env.action_names)
    layers = begin_learning(*sizes, SIZES, first).actor
    seen = Moments(jnp.zeros(sizes[0]), jnp.ones(sizes[0]), jnp.float32(0))
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for number, key in enumerate(keys):
        found += teacher.lessons(network(layers, seen).validate(), number)
        obs, said = map(np.concatenate, zip(*found, strict=True))
        if number == 0:
            seen = Moments(obs.mean(0), obs.var(0), jnp.float32(len(obs)))
        layers = fitted(type(teacher), layers, seen, obs, said, key)
        player = network(layers, seen).validate()
        earned = rollout.play_unseen(env, player, params, VALIDATION, keep_of).reward.mean()
        print(f"{len(obs):,} states: {earned:.4g}", flush=True)
        yield float(earned), len(obs), player


def main(arguments: list[str]) -> None:
    """Imitate on a task, and put the best network into the package."""
    parser = options("imitation", __doc__)
    parser.add_argument("task")
    task = task_by_name(parser.parse_args(arguments).task)
    teacher = WalkTeacher(planner(task)) if task.machine == "biped" else DriveTeacher(task)
    rounds = list(imitations(teacher))
    _, states, best = max(rounds, key=lambda one: one[0])
    record = {
        "program": f"python -m benchmarks.imitation {task.name}",
        "timesteps": rounds[-1][1],
        "best_after": states,
        **computed_with(installed()),
    }
    print(write(task, best, record, FOLDER))


if __name__ == "__main__":
    main(sys.argv[1:])
