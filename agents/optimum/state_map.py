"""An environment of few continuous states as a process that dynamic programming can work on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

import jax

from stickslip.agents.protocol import Params, Params_contra, State
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.functional import FunctionalEnv, pure_step
from stickslip.optim.dynamic_programming.grid import Grid, Place
from stickslip.optim.dynamic_programming.process import Transition

if TYPE_CHECKING:
    from jaxtyping import Array, Float

State_of_map = TypeVar("State_of_map")


class StateMap(Protocol[State_of_map, Params_contra]):
    """Coordinates of an environment's state, as far as later rewards depend on it.

    Static and hashable. It leaves out what only counts or adds up (time, totals): the environment's
    step must not read it but for the time limit, which dynamic programming counts itself. The
    reward must be that of the step, and nothing in a step may be drawn.
    """

    @property
    def axes(self) -> tuple[tuple[str, ...], ...]:
        """The names of every sheet's axes."""
        ...

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
