"""The best policy of a biped's task, by value iteration on the environment's own step.

    python -m benchmarks.optimum TASK [--fineness 1] [--actions 41] [--ahead 4] [--beam 4]

Two of the ladder's best known scores come from here. Every action is stepped once from every node
of a grid of states; results are exact for the process in which a step leads to the corners of the
cell that it reaches, at random with the weights of the interpolation. The policy looks several
steps ahead with the environment's own step, since states without a way out may be thinner than a
cell. What it earns is a lower bound of the optimum; the grid's value bounds nothing.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import options, provenance, read_json, write_json
from stickslip.agents.evaluation.rollout import Rollout, horizon, play, without_resets
from stickslip.agents.evaluation.table import fraction_interval, keep_of, mean_interval
from stickslip.agents.protocol import Memoryless
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedState
from stickslip.dynamics.checks import require_memory
from stickslip.dynamics.pytrees import register_pytree
from stickslip.dynamics.scene import Grip, Uniform
from stickslip.envs import BipedEnv, task_by_name
from stickslip.envs.biped.state import BipedEnvState, Drawn, Totals
from stickslip.envs.functional import pure_step
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.envs.biped.params import BipedEnvParams

SLACK = 1e-3
"""Share of an outermost cell by which rounding may leave the grid."""
AT_ONCE = 2**15
"""Steps that are computed together."""
WORKING = 3
"""Times the memory of all transitions that is needed while they are put together and swept."""
STOPS = -1
"""Index in place of a cell where the process has ended, or left the grid."""
TOGETHER = 10
"""Sweeps between two reports of progress."""
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


@register_pytree
@dataclass(frozen=True)
class Axis:
    """Ascending nodes along one coordinate; periodic: the last node is the first one again."""

    nodes: np.ndarray | Float[Array, " nodes"]
    periodic: bool = field(default=False, metadata={"static": True})

    def cell(
        self, at: Float[Array, ""]
    ) -> tuple[Int[Array, ""], Float[Array, ""], Bool[Array, ""]]:
        """The cell's first node, the share of the cell before `at`, and whether that is outside;
        there the nearest end stands for it. NaN is outside."""
        nodes = jnp.asarray(self.nodes, at.dtype)
        if self.periodic:
            at = nodes[0] + jnp.mod(at - nodes[0], nodes[-1] - nodes[0])
        index = jnp.clip(jnp.searchsorted(nodes, at, side="right") - 1, 0, nodes.size - 2)
        share = (at - nodes[index]) / (nodes[index + 1] - nodes[index])
        inside = (share >= -SLACK) & (share <= 1 + SLACK)
        share = jnp.where(inside, jnp.clip(share, 0.0, 1.0), jnp.where(share > 1, 1.0, 0.0))
        return index.astype(jnp.int32), share, ~inside


class Cell(NamedTuple):
    """Cell of a grid that holds a state."""

    base: Int[Array, ""]
    """Number of the corner from which all axes ascend."""
    share: Float[Array, " rank"]
    """Position in the cell along each axis, in [0, 1]; 0 along axes that the sheet lacks."""
    outside: Bool[Array, ""]
    """True if the grid does not cover it; the cell is then the nearest one."""


@register_pytree
@dataclass(frozen=True)
class Grid:
    """Sheets of axes, whose nodes are numbered one after the other, the last axis fastest.

    A system that changes its kind has a sheet for each: a foot at rest needs no axis for its
    velocity, and nothing is interpolated between rest and sliding, across which values jump.
    """

    sheets: tuple[tuple[Axis, ...], ...]

    @property
    def rank(self) -> int:
        """Axes of the sheet that has most."""
        return max(map(len, self.sheets))

    @property
    def shapes(self) -> list[tuple[int, ...]]:
        """Nodes along each axis of each sheet."""
        return [tuple(np.size(axis.nodes) for axis in sheet) for sheet in self.sheets]

    @property
    def offsets(self) -> list[int]:
        """Number of each sheet's first node, and of all nodes."""
        return [0, *np.cumsum([math.prod(shape) for shape in self.shapes]).tolist()]

    @property
    def strides(self) -> list[list[int]]:
        """Numbers of nodes from one to the next along each axis."""
        return [[math.prod(one[at + 1 :]) for at in range(len(one))] for one in self.shapes]

    def nodes(self, sheet: int) -> np.ndarray:
        """Coordinates of every node of a sheet [nodes, rank], filled up with zeros."""
        axes = [np.asarray(axis.nodes) for axis in self.sheets[sheet]]
        axes += [np.zeros(1)] * (self.rank - len(axes))
        return np.stack([one.ravel() for one in np.meshgrid(*axes, indexing="ij")], 1)

    def cell(self, sheet: Int[Array, ""] | int, at: Float[Array, " rank"]) -> Cell:
        """The cell of coordinates, which may be more than the sheet has."""
        cells = [self._cell_on(index, at) for index in range(len(self.sheets))]
        return jax.tree.map(lambda *each: jnp.stack(each)[sheet], *cells)

    def _cell_on(self, index: int, at: Float[Array, " rank"]) -> Cell:
        base, outside = jnp.asarray(self.offsets[index], jnp.int32), jnp.zeros((), bool)
        shares = [jnp.zeros((), at.dtype)] * self.rank
        for i, axis in enumerate(self.sheets[index]):
            node, shares[i], beyond = axis.cell(at[i])
            base, outside = base + self.strides[index][i] * node, outside | beyond
        return Cell(base, jnp.stack(shares), outside)

    def read(self, values: Float[Array, " nodes"], cell: Cell) -> Float[Array, ""]:
        """The values' multilinear interpolation in a cell."""
        return sum(
            (weight * values[cell.base + step] for step, weight in self.corners(*cell[:2])),
            start=jnp.zeros((), values.dtype),
        )

    def corners(
        self, base: Int[Array, "*n"], share: Float[Array, "*n rank"]
    ) -> Iterator[tuple[Int[Array, "*n"], Float[Array, "*n"]]]:
        """Index offset and weight of each corner of the cells."""
        sheet = jnp.sum(base[..., None] >= jnp.asarray(self.offsets[1:-1], jnp.int32), -1)
        for corner in product((0, 1), repeat=self.rank):
            steps = [np.dot(corner[: len(one)], one) for one in self.strides]
            weight = jnp.ones(share.shape[:-1], share.dtype)
            for axis, up in enumerate(corner):
                weight = weight * (share[..., axis] if up else 1 - share[..., axis])
            yield jnp.asarray(steps, jnp.int32)[sheet], weight


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
    def of(
        cls, env: BipedEnv, params: BipedEnvParams, actions: int = 41, fineness: float = 1.0
    ) -> Walk:
        """The process with its usual grid, `fineness` times as many cells along each axis.

        ValueError for a task whose rewards depend on more than the coordinates.
        """
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

        def plane(name: str) -> tuple[Axis, Axis]:
            turn, rate = (max(2, round(fineness * count)) + 1 for count in CELLS[name])
            phases = np.linspace(SUPPORT_START, SUPPORT_END, turn)
            return Axis(phases, periodic=True), Axis(np.linspace(low, high, rate))

        slide = (*plane("slide"), Axis(np.asarray(SPEEDS)))
        slides = () if isinstance(params.scene.floor, Grip) else (slide, slide)
        tried = jnp.linspace(-1.0, 1.0, actions)[:, None]
        return cls(params, tried, Grid((plane("rest"), *slides)), without_resets(env))

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

    def cell(self, state: BipedEnvState) -> Cell:
        """The cell of a state."""
        biped = state.biped
        at = jnp.stack([biped.phase, biped.crank_rate, jnp.abs(biped.foot_velocity)])
        if len(self.grid.sheets) == 1:
            return self.grid.cell(REST, at)
        slides = jnp.where(biped.foot_velocity > 0, FORWARDS, BACKWARDS)
        return self.grid.cell(jnp.where(biped.foot_velocity == 0, REST, slides), at)

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


@register_pytree
@dataclass(frozen=True)
class Transitions:
    """Transitions of each node under each action, in blocks of nodes; the last block is filled up.

    base, share: the cell that is reached, see Cell; base is STOPS where nothing follows.
    reward: of the step; where it leaves the grid, with what leaving is worth.
    """

    base: Int[Array, "blocks block actions"]
    share: Float[Array, "blocks block actions rank"]
    reward: Float[Array, "blocks block actions"]
    grid: Grid


def transitions(process: Any, *, progress: bool = False) -> Transitions:
    """Transitions of all nodes under all actions; what the grid does not cover is not guessed.

    process: a Walk, or another pytree with its methods. ValueError for a grid that memory does not
    hold, before anything of it exists.
    """
    grid, count, kind = process.grid, len(process.actions), jnp.result_type(process.actions)
    size, each = grid.offsets[-1], WORKING * (4 + (1 + grid.rank) * kind.itemsize)
    require_memory(f"{size:,} nodes with {count} actions", "transitions", size * count, each)
    block, parts = max(1, min(size, AT_ONCE // count)), []
    with Bar("transitions", size, "node", progress, large=True) as bar:
        for sheet in range(len(grid.sheets)):
            nodes = grid.nodes(sheet).astype(kind)
            for first in range(0, len(nodes), block):
                rows = np.minimum(np.arange(first, first + block), len(nodes) - 1)
                found = _from_nodes(process, sheet, nodes[rows])
                here = min(block, len(nodes) - first)
                parts.append([np.asarray(one)[:here] for one in found])
                bar.advance(here)
    filled = -size % block
    whole = []
    for one in zip(*parts, strict=True):
        rows = np.concatenate(one)
        rows = np.pad(rows, [(0, filled)] + [(0, 0)] * (rows.ndim - 1))
        whole.append(jnp.asarray(rows.reshape(-1, block, *rows.shape[1:])))
    base, share, reward = whole
    return Transitions(base, share, reward, grid)


@jax.jit
def _from_nodes(
    process: Any, sheet: int, nodes: Float[Array, "n rank"]
) -> tuple[Array, Array, Array]:
    """Base, share and reward of nodes [n] under all actions, each [n, actions]."""

    def one(node: Float[Array, " rank"], action: Float[Array, " act"]):
        after, reward, ended = process.step(process.state(sheet, node), action)
        cell = process.cell(after)
        left = cell.outside & ~ended
        reward = reward + jnp.where(left, jnp.asarray(process.outside, reward.dtype), 0)
        return jnp.where(ended | left, STOPS, cell.base), cell.share, reward

    return jax.vmap(jax.vmap(one, (None, 0)), (0, None))(nodes, process.actions)


def finite_horizon(table: Transitions, steps: int, *, progress: bool = False) -> Array:
    """The most that can be earned from each node in `steps` steps [nodes]."""
    value, done = jnp.zeros(table.grid.offsets[-1], table.reward.dtype), 0
    with Bar("sweeps", steps, "sweep", progress) as bar:
        while done < steps:
            count = min(TOGETHER, steps - done)
            value, done = _swept(table, value, count), done + count
            bar.advance(count)
    return value


@partial(jax.jit, static_argnums=2)
def _swept(table: Transitions, value: Float[Array, " nodes"], count: int) -> Array:
    """The values after `count` sweeps of Bellman's equation."""

    def of_block(value: Array, block: tuple[Array, Array, Array]) -> Array:
        base, share, reward = block
        after = table.grid.read(value, Cell(jnp.maximum(base, 0), share, base == STOPS))
        return jnp.max(reward + jnp.where(base == STOPS, 0, after), -1)

    def sweep(_: int, value: Array) -> Array:
        blocks = table.base, table.share, table.reward
        return jax.lax.map(partial(of_block, value), blocks).reshape(-1)[: len(value)]

    return jax.lax.fori_loop(0, count, sweep, value)


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
        over, cell = path.over | ended, process.cell(after)
        off = jnp.asarray(process.outside, values.dtype)
        beyond = jnp.where(cell.outside, off, process.grid.read(values, cell))
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
    depth: int = field(default=4, metadata={"static": True})
    beam: int = field(default=4, metadata={"static": True})

    def validate(self) -> ValuePolicy:
        """Return self."""
        return self

    def act(
        self, memory: None, obs: Array, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[None, Array]:
        """See Controller."""
        walk = replace(self.walk, params=env_params)
        return memory, look_ahead(walk, self.values, env_state, self.depth, self.beam)[0]


def solve(walk: Walk, *, depth: int = 4, beam: int = 4, progress: bool = False) -> ValuePolicy:
    """The policy of the most that can be earned from each node in an episode's steps."""
    table = transitions(walk, progress=progress)
    values = finite_horizon(table, horizon(walk.params), progress=progress)
    return ValuePolicy(walk, values, depth, beam)


class Known(NamedTuple):
    """Episodes of a value function's policy; every entry [episodes]."""

    reward: np.ndarray
    """Return of the episode."""
    fell: np.ndarray
    """True if it ended otherwise than by the time limit."""
    expected: np.ndarray
    """Value of the episode's start on the grid."""
    off_grid: np.ndarray
    """Share of the episode's states that the grid does not cover; there its nearest node counts."""


def known(policy: ValuePolicy, episodes: int) -> Known:
    """Play the policy on seeds 0, 1, ... of its task."""
    walk, grid = policy.walk, policy.walk.grid

    def kept(played: Rollout[BipedEnvState], params: BipedEnvParams) -> Known:
        standard = keep_of(played, params)
        off = jax.vmap(lambda state: walk.cell(state).outside)(played.state)
        real = jnp.arange(len(played.reward)) < played.length
        start = grid.read(policy.values, walk.cell(played.start_state))
        share = jnp.sum(off & real) / played.length
        found: Any = standard.reward, standard.terminated, start, share
        return Known(*found)

    return play(walk.env, policy, walk.params, range(episodes), kept)


def main(arguments: list[str]) -> None:
    """Write and print what the policy earns on a task, and what the grid says."""
    parser = options("optimum", __doc__)
    parser.add_argument("task")
    parser.add_argument("--fineness", type=float, default=1.0)
    parser.add_argument("--actions", type=int, default=41)
    parser.add_argument("--ahead", type=int, default=4)
    parser.add_argument("--beam", type=int, default=4)
    parser.add_argument("--episodes", type=int, default=32)
    given = parser.parse_args(arguments)
    env, params = task_by_name(given.task).make()
    walk = Walk.of(cast("BipedEnv", env), params, given.actions, given.fineness)
    policy = solve(walk, depth=given.ahead, beam=given.beam, progress=True)
    found = known(policy, given.episodes)
    entry = {"settings": vars(given), **found._asdict(), **provenance()}
    write_json({**read_json(given.out), given.task: entry}, given.out)
    print(f"earned {mean_interval(found.reward).shown(4)}, on the grid {found.expected.mean():.4g}")
    print(
        f"fell {fraction_interval(found.fell).value:.0%}, off the grid {found.off_grid.mean():.2%}"
    )


if __name__ == "__main__":
    main(sys.argv[1:])
