"""The coordinates of tests/agents/mass.py's environment, and a grid of few nodes."""

from dataclasses import dataclass

import jax.numpy as jnp

from stickslip.agents.optimum import Axis, Grid, Sheet
from tests.agents.mass import MassEnv, MassState

ENV = MassEnv()
PARAMS = ENV.default_params


@dataclass(frozen=True)
class MassStates:
    """Place and speed."""

    low: float = -0.6

    @property
    def axes(self):
        return (("place", "speed"),)

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
