"""The policy of a value function: several steps ahead with the environment's own step.

Where states from which there is no way out are thinner than a cell, the grid does not see them and
its greedy action leads there. The environment's own step sees them, as many steps ahead as it
takes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.grid import Grid, Place
from stickslip.agents.optimum.value_iteration import Transition
from stickslip.agents.protocol import Memoryless, Params, Params_contra, State
from stickslip.dynamics.checks import is_concrete, require_integer, require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.functional import FunctionalEnv, pure_step

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.agents.optimum.value_iteration import Process

State_of_map = TypeVar("State_of_map")


class StateMap(Protocol[State_of_map, Params_contra]):
    """Coordinates of an environment's state, as far as later rewards depend on it.

    Static and hashable. It leaves out what only counts or adds up (time, totals): the environment's
    step must not read it but for the time limit, which dynamic programming counts itself. The
    reward must be that of the step, and nothing in a step may be drawn.
    """

    def grid(self, params: Params_contra, fineness: float = 1.0) -> Grid:
        """Grid over the likely states; fineness: factor on the cells along every axis."""
        ...

    def state(self, params: Params_contra, place: Place) -> State_of_map:
        """The state of an episode's start at a place."""
        ...

    def place(self, grid: Grid, state: State_of_map) -> Place:
        """Coordinates of a state."""
        ...

    def leaving(self, params: Params_contra) -> float:
        """Value of leaving the grid: less than a policy gets that stays on it."""
        ...

    def most(self, params: Params_contra) -> float:
        """No step earns more, whatever is done: proved from the reward's definition."""
        ...


@register_pytree
@dataclass(frozen=True)
class EnvProcess(Generic[State, Params]):
    """An environment's own step as a Process."""

    params: Params
    actions: Float[Array, "count act"]
    grid: Grid
    env: FunctionalEnv[State, Params] = field(metadata={"static": True})
    states: StateMap[State, Params] = field(metadata={"static": True})

    def state(self, place: Place) -> State:
        """See Process."""
        return self.states.state(self.params, place)

    def place(self, state: State) -> Place:
        """See Process."""
        return self.states.place(self.grid, state)

    def step(self, state: State, action: Float[Array, " act"]) -> Transition[State]:
        """See Process."""
        unused = jax.random.key(0)  # an environment that leaves resetting to the caller
        found = pure_step(self.env, unused, state, action, self.params)
        return Transition(found[1], found[2], found[3])


@register_pytree
@dataclass(frozen=True)
class Ahead:
    """A beam search: all actions in each of `depth` steps, after each the `beam` best paths kept.

    Another depth compiles nothing anew; beam is static.
    """

    depth: int | Int[Array, ""] = 1
    beam: int = field(default=1, metadata={"static": True})

    def validate(self) -> Ahead:
        """Return self, or raise ValueError naming the field."""
        if is_concrete(self.depth):
            require_integer("depth", np.asarray(self.depth)[()], high=1000)
        require_integer("beam", self.beam, high=10**5)
        return self


class _Paths(NamedTuple):
    """Paths that are followed together; every leaf [paths]."""

    state: object
    first: Int[Array, " paths"]
    """Number of the action they began with."""
    earned: Float[Array, " paths"]
    worth: Float[Array, " paths"]
    """Reward so far, and the value at the end."""
    over: Bool[Array, " paths"]


def look_ahead(
    process: Process[State],
    values: Float[Array, " nodes"],
    state: State,
    outside: Float[Array, ""] | float,
    ahead: Ahead,
) -> tuple[Float[Array, " act"], Float[Array, ""]]:
    """The best first action from a state, and the reward of the best sequence plus the grid's value
    at its end. outside: what a state off the grid is worth."""
    size = (ahead.beam,)
    one = jnp.arange(ahead.beam) == 0  # the others are copies, which are not counted
    nothing, false = jnp.where(one, 0, -jnp.inf).astype(values.dtype), jnp.zeros(size, bool)
    begun = jax.tree.map(
        lambda leaf: jnp.broadcast_to(jnp.asarray(leaf), size + jnp.shape(leaf)), state
    )
    paths = _Paths(begun, jnp.zeros(size, jnp.int32), nothing, nothing, false)

    def further(depth: Int[Array, ""], paths: _Paths) -> _Paths:
        found = _further(process, values, paths, outside)
        count = len(process.actions)
        begins = jnp.tile(jnp.arange(count, dtype=jnp.int32), ahead.beam)
        found = found._replace(first=jnp.where(depth == 0, begins, found.first))
        kept = jax.lax.top_k(found.worth, ahead.beam)[1]
        return jax.tree.map(lambda leaf: leaf[kept], found)

    best = jax.lax.fori_loop(0, ahead.depth, further, paths)
    return process.actions[best.first[0]], best.worth[0]


def _further(
    process: Process[State],
    values: Float[Array, " nodes"],
    paths: _Paths,
    outside: Float[Array, ""] | float,
) -> _Paths:
    """Each path under each action, one step on."""
    count = len(process.actions)
    paths = jax.tree.map(lambda leaf: jnp.repeat(leaf, count, 0), paths)
    actions = jnp.tile(process.actions, (len(paths.over) // count, 1))

    def one(path: _Paths, action: Float[Array, " act"]) -> _Paths:
        after, reward, ended = process.step(path.state, action)  # pyright: ignore[reportArgumentType]
        earned = path.earned + jnp.where(path.over, 0, reward)
        over = path.over | ended
        cell = process.grid.cell(process.place(after))
        off = jnp.asarray(outside, values.dtype)
        beyond = jnp.where(cell.outside, off, process.grid.read(values, cell))
        worth = earned + jnp.where(over, 0, beyond)
        return _Paths(after, path.first, earned, worth, over)

    return jax.vmap(one)(paths, actions)


@register_pytree
@dataclass(frozen=True)
class ValuePolicy(Memoryless, Generic[State, Params]):
    """The action that earns most in the steps that are looked ahead, the value at their end added.

    Deterministic; reads the environment's true state and steps the environment itself, with the
    parameters of the episode. values: of the grid's nodes. actions: those that are tried. outside:
    what a state off the grid is worth. env: without resets.
    """

    values: Float[Array, " nodes"]
    actions: Float[Array, "count act"]
    outside: float | Float[Array, ""]
    grid: Grid
    env: FunctionalEnv[State, Params] = field(metadata={"static": True})
    states: StateMap[State, Params] = field(metadata={"static": True})
    ahead: Ahead = field(default_factory=Ahead)

    def validate(self) -> ValuePolicy[State, Params]:
        """Return self, or raise ValueError naming what does not fit."""
        self.ahead.validate()
        self.grid.validate()
        width = len(self.env.action_names)
        wanted = {"values": (self.grid.size,), "actions": (len(self.actions), width)}
        for name, shape in wanted.items():
            if (given := np.shape(getattr(self, name))) != shape:
                raise ValueError(f"{name} has shape {given}; accepted: {shape}")
            require_number(name, getattr(self, name), accepted="finite numbers")
        return self

    def process(self, env_params: Params) -> EnvProcess[State, Params]:
        """Decision process of the search."""
        return EnvProcess(env_params, self.actions, self.grid, self.env, self.states)

    def act(
        self, memory: None, obs: Float[Array, " obs"], env_state: State, env_params: Params
    ) -> tuple[None, Float[Array, " act"]]:
        """See Controller."""
        process = self.process(env_params)
        return memory, look_ahead(process, self.values, env_state, self.outside, self.ahead)[0]

    def value(self, env_state: State, env_params: Params) -> Float[Array, ""]:
        """The grid's value at a state; at the nearest node of it where it is not covered."""
        place = self.process(env_params).place(env_state)
        return self.grid.read(self.values, self.grid.cell(place))
