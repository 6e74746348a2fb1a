"""The best policy of a biped's task, by value iteration on the environment's own step.

    python -m benchmarks.optimum TASK ...

The result goes into known.json; three best known returns are from here. Every action is stepped
once from every node of a grid of states; results are exact for the process in which a step leads to
the corners of the cell that it reaches, at random with the weights of the interpolation. The policy
looks several steps ahead with the environment's own step, since states without a way out may be
thinner than a cell. It earns a lower bound of the optimum; the grid's value bounds nothing.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.report import options
from benchmarks.tasks import VALUE_ITERATION, entry, put, with_planner
from stickslip.agents.evaluation.rollout import horizon, play, without_resets
from stickslip.agents.machine import machine_by_name
from stickslip.agents.protocol import Memoryless
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, floor_position
from stickslip.dynamics.pytrees import register_pytree
from stickslip.dynamics.scene import Grip, Patches
from stickslip.envs import BipedEnv, TaskDefinition, task_by_name
from stickslip.envs.biped.state import BipedEnvState, drawn_robot
from stickslip.envs.functional import pure_step
from stickslip.envs.tasks.known import FILE, read_known

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
DRAWN = {"friction": 6, "mass": 4, "payload": 4, "mean_rate": 6}
"""Nodes of what a reset draws, ever farther apart."""
MOST_NODES = 300_000
"""Nodes of a grid with further axes, about: its cells of phase and crank rate grow accordingly."""
SPACING, EDGE = 0.08, 1e-4
"""Distance of nodes along the floor, and of nodes from each edge of a patch [m]."""
NEAR = 0.01
"""Distance from the mark of the next nodes [m]; each is twice as far as the last, up to SPACING."""
PAST = 0.4
"""Distance behind the mark that the grid covers [m]."""
SLOWEST = 1e-5
"""The speed that stands for a slide that is just beginning or ending [m/s]."""
RATES = (-0.5, 2.5)
"""Crank rates that the grid covers, in commanded rates."""
ACTIONS, AHEAD, BEAM, HELD = 21, 4, 4, 5
"""Torques, steps that the policy looks ahead, paths that it keeps, steps between its choices."""
FINER, FINEST = 4, 16
"""Parts of the environment's steps in the process, and in the replay that confirms a policy."""
MULTIPLIER = 3.2
"""`slip_weight` where a task limits the cost, which is then just kept: 2.7 m a metre slid."""
MOST_LOST = 0.01
"""Score that a policy may lose in that replay, for its returns to count."""


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
        counts = np.array([(*shape, *[1] * (self.rank - len(shape))) for shape in self.shapes])
        strides = np.cumprod(np.append(counts, np.ones((len(counts), 1), int), 1)[:, ::-1], 1)
        starts = np.concatenate([[0], np.cumsum(counts.prod(1))[:-1]])
        last, stride, start = (
            jnp.asarray(one, jnp.int32)[place.sheet]
            for one in (counts - 1, np.where(counts > 1, strides[:, -2::-1], 0), starts)
        )
        low = jnp.clip(jnp.floor(place.at).astype(jnp.int32), 0, jnp.maximum(last - 1, 0))
        share = place.at - low.astype(place.at.dtype)
        found = jnp.zeros((), values.dtype)
        for corner in product((0, 1), repeat=self.rank):
            weights = [share[i] if one else 1 - share[i] for i, one in enumerate(corner)]
            node = start + jnp.vdot(low + jnp.asarray(corner, jnp.int32), stride)
            found += math.prod(weights) * values[node]
        return found


@register_pytree
@dataclass(frozen=True)
class Walk:
    """The biped's environment as a process on a grid of phase, crank rate and the foot's speed, and
    of what a reset draws, the foot's place on a floor of patches, and the distance of a mark.

    All functions of the phase have period pi. Steps taken and time change no later reward, so they
    are left out. A commanded rate counts as if it stayed. actions [count, 1]; names: of the further
    axes.
    """

    params: BipedEnvParams
    actions: Float[Array, "count 1"]
    grid: Grid
    env: BipedEnv = field(metadata={"static": True})
    names: tuple[str, ...] = field(default=(), metadata={"static": True})

    @classmethod
    def of(cls, env: BipedEnv, params: BipedEnvParams, actions: int = ACTIONS) -> Walk:
        """The process with its usual grid."""
        further = _further_axes(params)
        sheets = 1 if isinstance(params.scene.floor, Grip) else 3
        grid = _grid(params, further, sheets, 1.0)
        if further and grid.size > MOST_NODES:
            grid = _grid(params, further, sheets, math.sqrt(MOST_NODES / grid.size))
        tried = jnp.linspace(-1.0, 1.0, actions)[:, None]
        return cls(params, tried, grid, without_resets(env), tuple(further))

    def state(self, sheet: Int[Array, ""], at: Float[Array, " rank"]) -> BipedEnvState:
        """The state at a node: the first step of an episode."""
        foot = velocity = jnp.zeros((), at.dtype)
        if len(self.grid.sheets) > 1:
            quick = jnp.maximum(at[-1], SLOWEST)
            velocity = jnp.stack([foot, quick, -quick])[sheet]
        first = self.env.reset_env(jax.random.key(0), self.params)[1]
        more = dict(zip(self.names, at[2:], strict=False))
        moving = {"crank_rate": at[1], "foot_velocity": velocity}
        moving["foot_position"] = more.pop("place", foot)
        phase = jnp.clip(at[0], SUPPORT_START, SUPPORT_END)
        drawn = first.drawn._replace(commands=None, mark=more.pop("to_go", None), **more)
        biped, mode = replace(first.biped, phase=phase, **moving), jnp.sign(velocity)
        return replace(first, biped=biped, mode=mode.astype(jnp.int32), drawn=drawn)

    def place(self, state: BipedEnvState) -> Place:
        """The place of a state; beyond the end of a further axis it is on the end."""
        biped, robot = state.biped, drawn_robot(state.drawn, self.params)
        values = {
            **state.drawn._asdict(),
            "place": floor_position(robot, biped),
            "to_go": state.to_go,
        }
        axes = self.grid.sheets[REST][2:]
        further = [
            jnp.clip(values[name], axis[0], axis[-1])
            for name, axis in zip(self.names, axes, strict=True)
        ]
        at = jnp.stack([biped.phase, biped.crank_rate, *further, jnp.abs(biped.foot_velocity)])
        if len(self.grid.sheets) == 1:
            return self.grid.place(REST, at)
        slides = jnp.where(biped.foot_velocity > 0, FORWARDS, BACKWARDS)
        return self.grid.place(jnp.where(biped.foot_velocity == 0, REST, slides), at)

    def step(self, state: BipedEnvState, action: Float[Array, " 1"]) -> tuple[Any, Array, Array]:
        """The state after a step, its reward and whether it terminated."""
        unused = jax.random.key(0)  # an environment that leaves resetting to the caller
        return pure_step(self.env, unused, state, action, self.params)[1:4]

    @property
    def outside(self) -> Array:
        """Less than a state off the grid is worth: a fall, and an episode walked backwards."""
        own = self.params
        return -jnp.asarray(own.fall_penalty + own.tracking_weight * own.time_limit)


def _grid(
    params: BipedEnvParams, further: dict[str, np.ndarray], sheets: int, scale: float
) -> Grid:
    """A grid with further axes, and so many times the usual cells of phase and crank rate."""
    low, high = (share * float(params.mean_rate) for share in RATES)
    if "mean_rate" in further:
        high = RATES[1] * float(further["mean_rate"][-1])

    def axes(name: str) -> list[np.ndarray]:
        turn, rate = (math.ceil(scale * count) + 1 for count in CELLS[name])
        plane = np.linspace(SUPPORT_START, SUPPORT_END, turn), np.linspace(low, high, rate)
        return [*plane, *further.values()]

    slide = (*axes("slide"), np.asarray(SPEEDS))
    return Grid((tuple(axes("rest")), slide, slide)[:sheets], periodic=True)


def _further_axes(params: BipedEnvParams) -> dict[str, np.ndarray]:
    """Nodes of the further axes that a task has."""
    axes = {}
    for name, count in DRAWN.items():
        ends = getattr(params.randomisation, name)
        if ends is not None:
            low, high = (math.sqrt(float(end)) for end in ends)
            axes[name] = np.linspace(low, high, count) ** 2
    floor = params.scene.floor
    if isinstance(floor, Patches):
        edges = np.asarray(floor.edges, float)
        even = np.arange(min(0.0, edges[0]) - SPACING, max(0.0, edges[-1]) + SPACING, SPACING)
        axes["place"] = np.unique(np.concatenate([even, edges - EDGE, edges + EDGE]))
    if params.mark is not None:
        drawn = params.randomisation.mark
        farthest = float(params.mark if drawn is None else drawn[1])
        near = NEAR * 2.0 ** np.arange(1 + math.log2(SPACING / NEAR) // 1)
        ahead = np.append(near, np.arange(near[-1] + SPACING, farthest + SPACING, SPACING))
        axes["to_go"] = np.concatenate([-ahead[ahead < PAST][::-1], [0.0], ahead])
    return axes


class Transitions(NamedTuple):
    """Transitions of each node under each action, [nodes, actions].

    to: the place that is reached; its sheet is STOPS where nothing follows. reward: of the step;
    where it leaves the grid, with what leaving is worth.
    """

    to: Place
    reward: Float[Array, "nodes actions"]


def transitions(process: Any) -> Transitions:
    """Transitions of all nodes of a process, a Walk or like one, under all its actions."""
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


@partial(jax.jit, static_argnums=(2, 3))
def finite_horizon(
    grid: Grid, table: Transitions, steps: int, held: int = 1
) -> Float[Array, " nodes"]:
    """The most that can be earned from each node in `steps` steps, by Bellman's equation; with
    `held` > 1 each node's action is chosen anew every `held` steps only, which takes less time."""

    def worth(value: Array, found: Transitions) -> Array:
        after = grid.read(value, found.to)
        return found.reward + jnp.where(found.to.sheet == STOPS, 0, after)

    def of_node(value: Array, found: Transitions) -> tuple[Array, Transitions]:
        every = jax.vmap(partial(worth, value))(found)
        best = jnp.argmax(every)
        return every[best], jax.tree.map(lambda leaf: leaf[best], found)

    def sweep(_: int, value: Array) -> Array:
        block = max(1, AT_ONCE // table.reward.shape[1])
        value, best = jax.lax.map(partial(of_node, value), table, batch_size=block)
        again = jax.vmap(worth, (None, 0))
        return jax.lax.fori_loop(1, held, lambda _, value: again(value, best), value)

    return jax.lax.fori_loop(0, steps // held, sweep, jnp.zeros(grid.size, table.reward.dtype))


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
        held = env_state.drawn._replace(commands=None)  # later commands are not known
        env_state = replace(env_state, drawn=held)
        return memory, look_ahead(self.walk, self.values, env_state, AHEAD, BEAM)[0]


def solve(walk: Walk) -> ValuePolicy:
    """The policy of about the most that can be earned from each node in an episode's steps."""
    values = finite_horizon(walk.grid, transitions(walk), horizon(walk.params), HELD)
    return ValuePolicy(walk, values)


def planner(task: TaskDefinition) -> ValuePolicy:
    """The policy of a task, whose process takes finer steps than the environment."""
    env, params = cast("tuple[BipedEnv, BipedEnvParams]", task.make())
    if task.cost_limit is not None:
        params = replace(params, slip_weight=MULTIPLIER)
    return solve(Walk.of(replace(env, substeps=FINER * env.substeps), params))


def with_row(task: TaskDefinition, before: dict[str, Any]) -> dict[str, Any]:
    """The task's entry of known.json with the policy among its planners, or as the best known.

    Where the policy loses more than MOST_LOST of its score in finer steps of the environment, the
    row is of these: what the environment's step adds is not earned.
    """
    policy = planner(task)
    env, params = policy.walk.env, task.make()[1]
    places = [replace(env, substeps=env.substeps // FINER * parts) for parts in (1, FINEST)]
    keep, seeds = machine_by_name(task.machine).measures(env).keep, range(before["episodes"])
    rows = [entry(task, VALUE_ITERATION, play(one, policy, params, seeds, keep)) for one in places]
    earned, finely = (row["return"] for row in rows)
    print(f"{task.name}: {earned}, in finer steps {finely}", flush=True)
    lost = (earned - finely) / (earned - before["trivial"]["return"])
    how = f"value iteration over {policy.walk.grid.size} nodes and {ACTIONS} torques on a step in "
    how += f"{FINER} parts, looking {AHEAD} steps ahead; it sees what the reset drew"
    return with_planner(before, rows[lost > MOST_LOST], how)


def main(arguments: list[str]) -> None:
    """Measure the policy on tasks, and put it into the file of what is known of them."""
    parser = options("optimum", __doc__, FILE)
    parser.add_argument("task", nargs="+")
    given = parser.parse_args(arguments)
    for name in given.task:
        put(name, with_row(task_by_name(name), read_known(given.out)[name]), given.out)


if __name__ == "__main__":
    main(sys.argv[1:])
