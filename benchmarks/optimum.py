"""The best policy of a biped's task, by value iteration on the environment's own step.

    python -m benchmarks.optimum TASK

Two of the ladder's best known scores come from here. Every action is stepped once from every node
of a grid of states; results are exact for the process in which a step leads to the corners of the
cell that it reaches, at random with the weights of the interpolation. The policy looks several
steps ahead with the environment's own step, since states without a way out may be thinner than a
cell. What it earns is a lower bound of the optimum; the grid's value bounds nothing.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.ndimage import map_coordinates

from benchmarks.report import options, provenance, read_json, write_json
from stickslip.agents.evaluation.rollout import horizon, play, without_resets
from stickslip.agents.evaluation.table import fraction_interval, keep_of, mean_interval
from stickslip.agents.protocol import Memoryless
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedState
from stickslip.dynamics.pytrees import register_pytree
from stickslip.dynamics.scene import Grip, Uniform
from stickslip.envs import BipedEnv, task_by_name
from stickslip.envs.biped.state import BipedEnvState, Drawn, Totals
from stickslip.envs.functional import pure_step

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.envs.biped.params import BipedEnvParams

SLACK = 1e-3
"""Share of an outermost cell by which rounding may leave the grid."""
AT_ONCE = 2**15
"""Steps that are computed together."""
STOPS = -1
"""Sheet where the process has ended, or left the grid."""
REST, FORWARDS, BACKWARDS = range(3)
"""Sheets of a floor on which the foot slips; one that holds has the first alone."""
CELLS = {"rest": (144, 160), "slide": (36, 40)}
"""Cells of phase and crank rate."""
SPEEDS = (0.0, 0.01, 0.03, 0.07, 0.15, 0.3, 0.6)
"""Nodes of the foot's speed while it slides [m/s]."""
SLOWEST = 1e-5
"""The speed that stands for a slide that is just beginning or ending [m/s]."""
RATES = (-0.5, 2.5)
"""Crank rates that the grid covers, in commanded rates."""
ACTIONS, AHEAD, BEAM, EPISODES = 41, 4, 4, 32
"""Torques, steps that the policy looks ahead, paths that it keeps, episodes that it plays."""


class Place(NamedTuple):
    """Place of a state on a grid; every leaf [*n]."""

    sheet: Int[Array, "*n"]
    at: Float[Array, "*n rank"]
    """Coordinates counted in nodes, 0 along axes that the sheet lacks."""
    outside: Bool[Array, "*n"]
    """True if the grid does not cover it; `at` is then on the nearest end."""


@register_pytree
@dataclass(frozen=True)
class Grid:
    """Sheets of axes, each its ascending nodes. All nodes are numbered, the last axis fastest.

    A system that changes its kind has a sheet for each: a foot at rest needs no axis for its
    velocity, and nothing is interpolated between rest and sliding, across which values jump.
    periodic: the last node of every sheet's first axis is the first one again.
    """

    sheets: tuple[tuple[np.ndarray, ...], ...]
    periodic: bool = field(default=False, metadata={"static": True})

    @property
    def rank(self) -> int:
        """Axes of the sheet that has most."""
        return max(map(len, self.sheets))

    @property
    def shapes(self) -> list[tuple[int, ...]]:
        """Nodes along each axis of each sheet."""
        return [tuple(map(np.size, sheet)) for sheet in self.sheets]

    @property
    def size(self) -> int:
        """Number of nodes."""
        return sum(map(math.prod, self.shapes))

    @property
    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Sheet [nodes] and coordinates [nodes, rank] of every node, filled up with zeros."""
        places = []
        for sheet in self.sheets:
            axes = [*map(np.asarray, sheet), *[np.zeros(1)] * (self.rank - len(sheet))]
            places.append(np.stack([one.ravel() for one in np.meshgrid(*axes, indexing="ij")], 1))
        return np.repeat(np.arange(len(places)), list(map(len, places))), np.concatenate(places)

    def place(self, sheet: Int[Array, ""] | int, at: Float[Array, " rank"]) -> Place:
        """The place of coordinates, which may be more than the sheet has. NaN is outside."""
        found = [self._place_on(i, at) for i in range(len(self.sheets))]
        return jax.tree.map(lambda *each: jnp.stack(each)[sheet], *found)

    def _place_on(self, sheet: int, at: Float[Array, " rank"]) -> Place:
        counted, outside = [jnp.zeros((), at.dtype)] * self.rank, jnp.zeros((), bool)
        for i, axis in enumerate(self.sheets[sheet]):
            nodes, x = jnp.asarray(axis, at.dtype), at[i]
            if self.periodic and i == 0:
                x = nodes[0] + jnp.mod(x - nodes[0], nodes[-1] - nodes[0])
            low, high = (
                nodes[end] + SLACK * (nodes[end] - nodes[by]) for end, by in ((0, 1), (-1, -2))
            )
            outside |= ~((x >= low) & (x <= high))
            counted[i] = jnp.interp(jnp.nan_to_num(x), nodes, jnp.arange(nodes.size, dtype=x.dtype))
        return Place(jnp.asarray(sheet, jnp.int8), jnp.stack(counted), outside)

    def read(self, values: Float[Array, " nodes"], place: Place) -> Float[Array, ""]:
        """The values' multilinear interpolation at a place."""
        ends = np.cumsum([math.prod(shape) for shape in self.shapes])[:-1]
        parts = zip(jnp.split(values, ends), self.shapes, strict=True)
        found = [
            map_coordinates(part.reshape(shape), list(place.at[: len(shape)]), 1, "nearest")
            for part, shape in parts
        ]
        return jnp.stack(found)[place.sheet]


@register_pytree
@dataclass(frozen=True)
class Walk:
    """The biped's environment as a process on a grid of phase, crank rate and the foot's speed.

    All functions of the phase have period pi. Steps taken, time and place on the floor change no
    later reward, so they are left out: the floor must be the same everywhere, and nothing but the
    start may be drawn. actions [count, 1].
    """

    params: BipedEnvParams
    actions: Float[Array, "count 1"]
    grid: Grid
    env: BipedEnv = field(metadata={"static": True})

    @classmethod
    def of(cls, env: BipedEnv, params: BipedEnvParams, actions: int = ACTIONS) -> Walk:
        """The process with its usual grid; ValueError for a task whose rewards depend on more than
        the coordinates."""
        drawn = params.randomisation
        more = [one for one in ("friction", "mass", "payload") if getattr(drawn, one) is not None]
        more += ["mean_rate"] if drawn.mean_rate is not None else []
        more += [] if isinstance(params.scene.floor, Grip | Uniform) else ["floor"]
        more += [] if params.mark is None else ["mark"]
        if more:
            raise ValueError(
                f"{more[0]}: rewards depend on it; accepted: a task on a floor of Grip or Uniform "
                "without a mark, of which only the start is drawn"
            )
        low, high = (share * float(params.mean_rate) for share in RATES)

        def plane(name: str) -> tuple[np.ndarray, np.ndarray]:
            turn, rate = (count + 1 for count in CELLS[name])
            return np.linspace(SUPPORT_START, SUPPORT_END, turn), np.linspace(low, high, rate)

        slide = (*plane("slide"), np.asarray(SPEEDS))
        slides = () if isinstance(params.scene.floor, Grip) else (slide, slide)
        tried = jnp.linspace(-1.0, 1.0, actions)[:, None]
        return cls(params, tried, Grid((plane("rest"), *slides), True), without_resets(env))

    def state(self, sheet: Int[Array, ""], at: Float[Array, " rank"]) -> BipedEnvState:
        """The state at a node: the foot at its foothold, the first step of an episode."""
        kind = at.dtype
        zero, one, none = jnp.zeros((), kind), jnp.ones((), kind), jnp.zeros((), jnp.int32)
        velocity = zero
        if len(at) > 2:
            quick = jnp.maximum(at[2], SLOWEST)
            velocity = jnp.stack([zero, quick, -quick])[sheet]
        nothing = Totals(*[zero] * len(Totals._fields))
        phase = jnp.clip(at[0], SUPPORT_START, SUPPORT_END)
        return BipedEnvState(
            biped=BipedState(phase, none, at[1], zero, velocity, zero),
            mode=jnp.sign(velocity).astype(jnp.int32),
            elapsed=none,
            over=jnp.zeros((), bool),
            drawn=Drawn(one, one, zero, jnp.asarray(self.params.mean_rate, kind), mark=None),
            totals=nothing,
            rests=nothing,
        )

    def place(self, state: BipedEnvState) -> Place:
        """The place of a state."""
        biped = state.biped
        at = jnp.stack([biped.phase, biped.crank_rate, jnp.abs(biped.foot_velocity)])
        if len(self.grid.sheets) == 1:
            return self.grid.place(REST, at)
        slides = jnp.where(biped.foot_velocity > 0, FORWARDS, BACKWARDS)
        return self.grid.place(jnp.where(biped.foot_velocity == 0, REST, slides), at)

    def step(self, state: BipedEnvState, action: Float[Array, " 1"]) -> tuple[Any, Array, Array]:
        """The state after a step, its reward and whether it terminated."""
        unused = jax.random.key(0)  # an environment that leaves resetting to the caller
        found = pure_step(self.env, unused, state, action, self.params)
        return found[1], found[2], found[3]

    @property
    def outside(self) -> Array:
        """Less than a state off the grid is worth: a fall, and an episode walked backwards."""
        own = self.params
        return -jnp.asarray(own.fall_penalty + own.tracking_weight * own.time_limit)


class Transitions(NamedTuple):
    """Transitions of each node under each action, [nodes, actions].

    to: the place that is reached; its sheet is STOPS where nothing follows. reward: of the step;
    where it leaves the grid, with what leaving is worth.
    """

    to: Place
    reward: Float[Array, "nodes actions"]


def transitions(process: Any) -> Transitions:
    """Transitions of all nodes under all actions; what the grid does not cover is not guessed.

    process: a Walk, or another pytree with its methods.
    """
    sheets, nodes = process.grid.nodes
    return _from_nodes(process, sheets.astype(np.int8), nodes.astype(process.actions.dtype))


@jax.jit
def _from_nodes(
    process: Any, sheets: Int[Array, " n"], nodes: Float[Array, "n rank"]
) -> Transitions:
    """Transitions of nodes under all actions."""

    def one(node: tuple[Array, Array], action: Float[Array, " act"]) -> Transitions:
        after, reward, ended = process.step(process.state(*node), action)
        place = process.place(after)
        left = place.outside & ~ended
        reward = reward + jnp.where(left, jnp.asarray(process.outside, reward.dtype), 0)
        sheet = jnp.where(ended | left, jnp.int8(STOPS), place.sheet)
        return Transitions(place._replace(sheet=sheet), reward)

    def all_actions(node: tuple[Array, Array]) -> Transitions:
        return jax.vmap(one, (None, 0))(node, process.actions)

    block = max(1, AT_ONCE // len(process.actions))
    return jax.lax.map(all_actions, (sheets, nodes), batch_size=block)


@partial(jax.jit, static_argnums=2)
def finite_horizon(grid: Grid, table: Transitions, steps: int) -> Float[Array, " nodes"]:
    """The most that can be earned from each node in `steps` steps, by Bellman's equation."""

    def of_node(value: Array, found: Transitions) -> Array:
        after = jax.vmap(partial(grid.read, value))(found.to)
        return jnp.max(found.reward + jnp.where(found.to.sheet == STOPS, 0, after))

    def sweep(_: int, value: Array) -> Array:
        block = max(1, AT_ONCE // table.reward.shape[1])
        return jax.lax.map(partial(of_node, value), table, batch_size=block)

    return jax.lax.fori_loop(0, steps, sweep, jnp.zeros(grid.size, table.reward.dtype))


class Paths(NamedTuple):
    """Paths that are followed together; every leaf [paths]."""

    state: Any
    first: Int[Array, " paths"]
    """Number of the action they began with."""
    earned: Float[Array, " paths"]
    worth: Float[Array, " paths"]
    """Reward so far, and the value at the end."""
    over: Bool[Array, " paths"]


def look_ahead(
    process: Any, values: Float[Array, " nodes"], state: Any, depth: int, beam: int
) -> tuple[Float[Array, " act"], Float[Array, ""]]:
    """The best first action from a state, and the reward of the best sequence plus the grid's value
    at its end: all actions in each of `depth` steps, after each the `beam` best paths kept."""
    count, numbers = len(process.actions), jnp.arange(len(process.actions), dtype=jnp.int32)

    def one(path: Paths, number: Int[Array, ""]) -> Paths:
        after, reward, ended = process.step(path.state, process.actions[number])
        earned = path.earned + jnp.where(path.over, 0, reward)
        over, place = path.over | ended, process.place(after)
        off = jnp.asarray(process.outside, values.dtype)
        beyond = jnp.where(place.outside, off, process.grid.read(values, place))
        first = jnp.where(path.first < 0, number, path.first)
        return Paths(after, first, earned, earned + jnp.where(over, 0, beyond), over)

    def further(_: int, paths: Paths) -> Paths:
        every = jax.vmap(jax.vmap(one, (None, 0)), (0, None))(paths, numbers)
        every = jax.tree.map(lambda leaf: leaf.reshape(beam * count, *leaf.shape[2:]), every)
        kept = jax.lax.top_k(every.worth, beam)[1]
        return jax.tree.map(lambda leaf: leaf[kept], every)

    begun = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (beam, *jnp.shape(leaf))), state)
    alone = jnp.where(jnp.arange(beam) == 0, 0, -jnp.inf).astype(values.dtype)  # others are copies
    paths = Paths(begun, jnp.full(beam, -1, jnp.int32), alone, alone, jnp.zeros(beam, bool))
    best = jax.lax.fori_loop(0, depth, further, paths)
    return process.actions[best.first[0]], best.worth[0]


@register_pytree
@dataclass(frozen=True)
class ValuePolicy(Memoryless):
    """The action that earns most in the steps that are looked ahead, the value at their end added.

    Reads the environment's true state and steps the environment itself.
    """

    walk: Walk
    values: Float[Array, " nodes"]

    def act(
        self, memory: None, obs: Array, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[None, Array]:
        """See Controller."""
        walk = replace(self.walk, params=env_params)
        return memory, look_ahead(walk, self.values, env_state, AHEAD, BEAM)[0]


def solve(walk: Walk) -> ValuePolicy:
    """The policy of the most that can be earned from each node in an episode's steps."""
    values = finite_horizon(walk.grid, transitions(walk), horizon(walk.params))
    return ValuePolicy(walk, values)


def main(arguments: list[str]) -> None:
    """Write and print what the policy earns on a task."""
    parser = options("optimum", __doc__)
    parser.add_argument("task")
    given = parser.parse_args(arguments)
    env, params = task_by_name(given.task).make()
    walk = Walk.of(cast("BipedEnv", env), params)
    found = play(walk.env, solve(walk), params, range(EPISODES), keep_of)
    entry = {"reward": found.reward, "fell": found.fell, **provenance()}
    write_json({**read_json(given.out), given.task: entry}, given.out)
    fell = fraction_interval(found.fell).value
    print(f"earned {mean_interval(found.reward).shown(4)}, fell {fell:.0%}")


if __name__ == "__main__":
    main(sys.argv[1:])
