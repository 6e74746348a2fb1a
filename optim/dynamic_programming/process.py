"""Decision process: grid, actions and step of a system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.optim.dynamic_programming.grid import Grid, Place

State = TypeVar("State")


class Transition(NamedTuple, Generic[State]):
    """Result of a step. ended: nothing more is earned."""

    state: State
    reward: Float[Array, ""]
    ended: Bool[Array, ""]


class Process(Protocol[State]):
    """A deterministic system in discrete time; a pytree whose methods work under jit and vmap."""

    @property
    def grid(self) -> Grid:
        """The nodes."""
        ...

    @property
    def actions(self) -> Float[Array, "count act"]:
        """Those among which is chosen."""
        ...

    def state(self, place: Place) -> State:
        """The state at a place of the grid."""
        ...

    def place(self, state: State) -> Place:
        """The inverse: where a state is."""
        ...

    def step(self, state: State, action: Float[Array, " act"]) -> Transition[State]:
        """One step."""
        ...
