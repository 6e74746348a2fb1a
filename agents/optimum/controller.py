"""The policy of a value function: several steps ahead with the environment's own step."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic

import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum.state_map import EnvProcess, StateMap
from stickslip.agents.protocol import Memoryless, Params, State
from stickslip.dynamics.checks import is_concrete, require_kind, require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.functional import FunctionalEnv
from stickslip.optim.dynamic_programming.grid import Grid
from stickslip.optim.dynamic_programming.lookahead import Ahead, Found, look_ahead

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float


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
        require_kind("ahead", self.ahead, Ahead, "an Ahead")
        self.ahead.validate()
        require_kind("grid", self.grid, Grid, "a Grid")
        self.grid.validate()
        names = tuple(tuple(axis.name for axis in sheet.axes) for sheet in self.grid.sheets)
        if names != self.states.axes:
            raise ValueError(f"grid has the axes {names}; accepted: {self.states.axes}")
        wanted = {"values": (self.grid.size,), "actions": (len(self.actions), self._width)}
        for name, shape in wanted.items():
            if np.shape(getattr(self, name)) != shape:
                raise ValueError(
                    f"{name} has shape {np.shape(getattr(self, name))}; accepted: {shape}"
                )
        if is_concrete(self.values):
            require_number("values", self.values, accepted="finite numbers")
            accepted = "numbers in [-1, 1]"
            require_number("actions", self.actions, low=-1.0, high=1.0, accepted=accepted)
            require_number("outside", self.outside, accepted="a finite number")
        return self

    def process(self, env_params: Params) -> EnvProcess[State, Params]:
        """Decision process of the search."""
        actions = jnp.asarray(self.actions)  # a file's may be NumPy's, with all their digits
        return EnvProcess(env_params, actions, self.grid, self.env, self.states)

    def act(
        self, memory: None, obs: Float[Array, " obs"], env_state: State, env_params: Params
    ) -> tuple[None, Float[Array, " act"]]:
        """See Controller."""
        return memory, self.search(env_state, env_params).action

    def search(self, env_state: State, env_params: Params) -> Found:
        """The action, what is expected of it, and whether that lies off the grid."""
        process = self.process(env_params)
        return look_ahead(process, jnp.asarray(self.values), env_state, self.outside, self.ahead)

    def value(self, env_state: State, env_params: Params) -> Float[Array, ""]:
        """The grid's value at a state; at the nearest node of it where it is not covered."""
        place = self.process(env_params).place(env_state)
        return self.grid.read(jnp.asarray(self.values), self.grid.cell(place))

    def covers(self, env_state: State, env_params: Params) -> Bool[Array, ""]:
        """True if the grid covers a state."""
        return ~self.grid.cell(self.process(env_params).place(env_state)).outside

    @property
    def _width(self) -> int:
        return len(self.env.action_names)


def even_actions(count: int, kind: jnp.dtype) -> Float[Array, "count 1"]:
    """So many of one action number, from -1 to 1."""
    return jnp.linspace(-1.0, 1.0, count, dtype=kind)[:, None]
