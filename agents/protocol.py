"""Protocols of controllers and planners."""

from __future__ import annotations

from collections.abc import Mapping
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Generic,
    NamedTuple,
    Protocol,
    Self,
    TypeAlias,
    TypeVar,
    runtime_checkable,
)

from stickslip.dynamics.checks import require_integer, require_number

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.envs.functional import AnyEnv, Timed

    Obs: TypeAlias = Float[Array, " obs"]
    Action: TypeAlias = Float[Array, " act"]
    """Numbers in [-1, 1]."""

Memory = TypeVar("Memory")
Env = TypeVar("Env", bound="AnyEnv")
State = TypeVar("State")
Params = TypeVar("Params", bound="Timed")
Env_contra = TypeVar("Env_contra", contravariant=True)
State_co = TypeVar("State_co", covariant=True)
State_contra = TypeVar("State_contra", contravariant=True)
Params_contra = TypeVar("Params_contra", bound="Timed", contravariant=True)


@runtime_checkable
class Controller(Protocol[Memory, State_contra, Params_contra]):
    """Pure functions on a frozen pytree dataclass; both work under jit, vmap and scan.

    A controller's numbers are leaves, so they may be arrays, traced or batched. What it remembers
    from one step to the next is `memory`, a pytree whose structure, shapes and types never change
    (None if it remembers nothing). A baseline reads what it likes of the state; a policy keeps to
    the observation. env_params, env_state: the environment's, of whichever machine.
    """

    def init(self, env_params: Params_contra, env_state: State_contra) -> Memory:
        """The memory at the start of an episode."""
        ...

    def act(
        self, memory: Memory, obs: Obs, env_state: State_contra, env_params: Params_contra
    ) -> tuple[Memory, Action]:
        """The new memory and the action for one control step."""
        ...

    def validate(self) -> Self:
        """Return self, or raise ValueError naming the field and what is accepted."""
        ...


@runtime_checkable
class Planner(Protocol[Env_contra, State_contra, Params_contra]):
    """Planner that knows an episode in advance and computes a controller for all of it."""

    def path(
        self, env: Env_contra, params: Params_contra, state: State_contra
    ) -> Controller[Any, State_contra, Params_contra]:
        """Plan for the episode that begins in `state`."""
        ...

    def validate(self) -> Self:
        """Return self, or raise ValueError naming the field and what is accepted."""
        ...


Player: TypeAlias = Controller[Any, State, Params] | Planner[Any, State, Params]
"""Controller, planner or policy of an environment with such states and parameters."""
Options: TypeAlias = Mapping[str, Any]
"""Parsed flags by name; None for one that is not given."""


class Task(NamedTuple, Generic[Env, Params]):
    """An environment and its parameters."""

    env: Env
    params: Params


class Ruled:
    """Base of the controllers whose numbers have rules, of any machine."""

    RULES: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """Keywords of `require_number` by field."""
    COUNTS: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    """Keywords of `require_integer` by field."""

    def validate(self) -> Self:
        """Return self, or raise ValueError naming the field."""
        for name, rule in self.RULES.items():
            require_number(name, getattr(self, name), **rule)
        for name, limits in self.COUNTS.items():
            require_integer(name, getattr(self, name), **limits)
        return self


class Memoryless(Ruled):
    """Base of the controllers that remember nothing, of any machine."""

    def init(self, env_params: object, env_state: object) -> None:
        """Nothing to remember."""
