"""Processes with a known optimum, and the coordinates of tests/agents/mass.py's environment."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.optimum import Axis, Grid, Sheet
from stickslip.agents.optimum.value_iteration import Transition
from stickslip.dynamics.pytrees import register_pytree
from tests.agents.mass import MassEnv, MassState


@register_pytree
@dataclass(frozen=True)
class Chain:
    """Places 0 to 5 on a line; one step left or right, or none. The right end pays and ends, the
    left end has nothing beyond it. Each move costs."""

    actions: jax.Array
    grid: Grid
    cost: float = 0.125
    prize: float = 2.0

    @classmethod
    def of(cls, dtype=jnp.float32):
        grid = Grid((Sheet("line", (Axis.even("place", 0.0, 5.0, 5),)),))
        return cls(jnp.asarray([[-1.0], [0.0], [1.0]], dtype), grid)

    def state(self, place):
        return place.coordinates[0]

    def place(self, state):
        return self.grid.place(0, state)

    def step(self, state, action):
        after = state + action[0]
        ended = after > 4.5
        reward = jnp.where(ended, self.prize, 0.0) - self.cost * jnp.abs(action[0])
        return Transition(after, reward.astype(state.dtype), ended)


@register_pytree
@dataclass(frozen=True)
class DoubleIntegrator:
    """x' = x + h v, v' = v + h u; reward -h (x^2 + v^2 + u^2 / 4)."""

    actions: jax.Array
    grid: Grid
    h: float = 0.2

    @classmethod
    def of(cls, cells, dtype=jnp.float32):
        axes = (Axis.even("x", -3.0, 3.0, cells), Axis.even("v", -4.0, 4.0, cells))
        return cls(jnp.linspace(-6, 6, 81, dtype=dtype)[:, None], Grid((Sheet("plane", axes),)))

    def state(self, place):
        return place.coordinates

    def place(self, state):
        return self.grid.place(0, state[0], state[1])

    def step(self, state, action):
        x, v = state
        reward = -self.h * (x**2 + v**2 + action[0] ** 2 / 4)
        after = jnp.stack([x + self.h * v, v + self.h * action[0]])
        return Transition(after, reward, jnp.zeros((), bool))

    def riccati(self, steps):
        """The matrix of -value of so many steps, in NumPy."""
        A, B = np.array([[1, self.h], [0, 1]]), np.array([[0], [self.h]])
        Q, R = self.h * np.eye(2), np.array([[self.h / 4]])
        S = np.zeros((2, 2))
        for _ in range(steps):
            gain = np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A)
            S = Q + A.T @ S @ (A - B @ gain)
        return S


@register_pytree
@dataclass(frozen=True)
class Balance:
    """A pole without swing: x' = 1.5 x + u / 4, |u| <= 1. It earns 1 + x', so leaning to the right
    pays, and falls where |x'| > 1, for -9. From |x| > 0.5 no action keeps it up: a border that lies
    inside a cell, and close to where most is earned."""

    actions: jax.Array
    grid: Grid

    @classmethod
    def of(cls, cells, actions=5, dtype=jnp.float32):
        grid = Grid((Sheet("lean", (Axis.even("x", -1.0, 1.0, cells),)),))
        return cls(jnp.linspace(-1, 1, actions, dtype=dtype)[:, None], grid)

    def state(self, place):
        return place.coordinates[0]

    def place(self, state):
        return self.grid.place(0, state)

    def step(self, state, action):
        after = 1.5 * state + action[0] / 4
        fell = jnp.abs(after) > 1
        return Transition(after, jnp.where(fell, -9.0, 1 + after), fell)


ENV = MassEnv()
PARAMS = ENV.default_params


@dataclass(frozen=True)
class MassStates:
    """Place and speed."""

    low: float = -0.6

    def grid(self, params, fineness=1.0):
        place = Axis.even("place", self.low, 1.8, round(48 * fineness), unit="m")
        speed = Axis.even("speed", -2.0, 2.0, round(40 * fineness), unit="m/s")
        return Grid((Sheet("floor", (place, speed)),))

    def state(self, params, place):
        x, v = place.coordinates
        none = jnp.zeros((), jnp.int32)
        return MassState(x, v, none, jnp.zeros((), bool), jnp.zeros_like(x))

    def place(self, grid, state):
        return grid.place(0, state.place, state.speed)

    def leaving(self, params):
        return -35.0

    def most(self, params):
        return 1.0
