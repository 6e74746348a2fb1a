"""What a controller is, of any machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

if TYPE_CHECKING:
    from jaxtyping import Array, Float

Memory = TypeVar("Memory")


@runtime_checkable
class Controller(Protocol[Memory]):
    """Pure functions on a frozen pytree dataclass; both work under jit, vmap and scan.

    A controller's numbers are leaves, so they may be arrays, traced or batched. What it remembers
    from one step to the next is `memory`, a pytree whose structure, shapes and types never change
    (None if it remembers nothing). A baseline reads what it likes of the state; a policy keeps to
    the observation. env_params, env_state: the environment's, of whichever machine.
    """

    def init(self, env_params: Any, env_state: Any) -> Memory:
        """The memory at the start of an episode."""
        ...

    def act(
        self,
        memory: Memory,
        obs: Float[Array, " obs"],
        env_state: Any,
        env_params: Any,
    ) -> tuple[Memory, Float[Array, " act"]]:
        """The new memory and the action, numbers in [-1, 1], for one control step."""
        ...

    def validate(self) -> Any:
        """Return self, or raise ValueError naming the field and what is accepted."""
        ...


class Memoryless:
    """Base of the controllers that remember nothing, of any machine."""

    def init(self, env_params: Any, env_state: Any) -> None:
        """Nothing to remember."""
        return None
