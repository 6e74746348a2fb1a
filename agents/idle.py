"""Doing nothing: what a score of 0 is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.agents.protocol import Memoryless
from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

MOST = 10**4


@register_pytree
@dataclass(frozen=True)
class Idle(Memoryless):
    """Every action is 0: no torque, or legs held. width: numbers in an action (static)."""

    width: int = field(default=1, metadata={"static": True})

    def validate(self) -> Idle:
        """Return self, or raise ValueError naming the field."""
        require_integer("width", self.width, high=MOST)
        return self

    def act(
        self, memory: None, obs: Float[Array, " obs"], env_state: object, env_params: object
    ) -> tuple[None, Float[Array, " act"]]:
        """See Controller."""
        return memory, jnp.zeros(self.width, obs.dtype)
