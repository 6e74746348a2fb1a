"""What a controller is; the types named here are the biped's, the UGV's have theirs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import jax.numpy as jnp

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams

Memory = TypeVar("Memory")


@runtime_checkable
class Controller(Protocol[Memory]):
    """Pure functions on a frozen pytree dataclass; both work under jit, vmap and scan.

    A controller's numbers are leaves, so they may be arrays, traced or batched. What it remembers
    from one step to the next is `memory`, a pytree whose structure, shapes and types never change
    (None if it remembers nothing). A baseline reads what it likes of the state; a policy keeps to
    the observation.
    """

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> Memory:
        """The memory at the start of an episode."""
        ...

    def act(
        self,
        memory: Memory,
        obs: Float[Array, " obs"],
        env_state: BipedEnvState,
        env_params: BipedEnvParams,
    ) -> tuple[Memory, Float[Array, " 1"]]:
        """The new memory and the action, torque / torque limit in [-1, 1], for one control step."""
        ...

    def validate(self) -> Any:
        """Return self, or raise ValueError naming the field and what is accepted."""
        ...


class Memoryless:
    """Base of the controllers that remember nothing, of any machine."""

    def init(self, env_params: Any, env_state: Any) -> None:
        """Nothing to remember."""
        return None


def action_of(
    torque: ArrayLike, env_params: BipedEnvParams, env_state: BipedEnvState
) -> Float[Array, " 1"]:
    """The action for a torque [N m], clipped to the motor's limit, in the state's type."""
    dtype = env_state.biped.crank_rate.dtype
    share = jnp.asarray(torque, dtype) / jnp.asarray(env_params.torque_limit, dtype)
    return jnp.clip(share, -1.0, 1.0)[None]
