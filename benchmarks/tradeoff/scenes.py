"""The walks on which everything is measured: floor, start, torque law, duration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import SUPPORT_START, BipedState

if TYPE_CHECKING:
    from collections.abc import Callable

PERIOD = 0.02
"""The torque is held for this long [s]; every step size divides it."""
ROWS = 512
"""The most samples of a walk that are kept."""


@dataclass(frozen=True)
class Walk:
    """A walk in periods of PERIOD: torque = gain (wanted_rate - crank rate) at each one's start.

    rate: at the start [rad/s]; phase there [rad]. gain [N m s], wanted_rate [rad/s]: 0 and 0 for a
    walk without a motor. duration [s]. stride: periods between the samples that are compared.
    """

    name: str
    floor: Callable[[], Scene]
    structure: str
    rate: float
    gain: float
    wanted_rate: float
    duration: float
    phase: float = SUPPORT_START
    stride: int = 1

    @property
    def periods(self) -> int:
        """How many control periods it lasts."""
        return round(self.duration / PERIOD)

    @property
    def samples(self) -> int:
        """How many of them are compared with the reference."""
        return self.periods // self.stride

    def law(self, dtype: str) -> tuple:
        """What the torque depends on, as arrays."""
        return tuple(jnp.asarray(value, dtype) for value in (self.gain, self.wanted_rate))

    def scene(self, dtype: str) -> Scene:
        """The floor, its numbers in the working precision; no zero-moment point is computed."""
        import jax

        return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), self.floor())

    def start(self, dtype: str) -> BipedState:
        """The initial state, as arrays."""
        zero = jnp.zeros((), dtype)
        return BipedState(
            phase=jnp.asarray(self.phase, dtype),
            steps=jnp.zeros((), jnp.int32),
            crank_rate=jnp.asarray(self.rate, dtype),
            foot_position=zero,
            foot_velocity=zero,
            time=zero,
        )


def _grip() -> Scene:
    return Scene.grip(outputs="state")


def _slippery(mu_static: float, mu_kinetic: float) -> Callable[[], Scene]:
    return lambda: Scene.uniform(mu_static, mu_kinetic, outputs="state")


def _ice() -> Scene:
    return Scene.patches([0.23, 0.475], [0.5, 0.05, 0.5], outputs="state")


_LISTED = (
    # after the floor's structure: rate, gain, wanted_rate, duration
    Walk("smooth", _grip, "grip", 3.0, 1.0, 4.0, 2.0),
    Walk("stick-slip", _slippery(0.06, 0.05), "uniform", 4.0, 0.5, 5.0, 2.0),
    # so fast that the ground's force falls to a sixth
    Walk("lift-off", _slippery(0.4, 0.3), "uniform", 8.4, 1.0, 9.0, 2.0),
    Walk("ice", _ice, "patches", 3.0, 1.0, 4.0, 4.0),
    # no motor and so no loss: 1011 steps
    Walk("long", _grip, "grip", 4.5, 0.0, 0.0, 400.0, phase=np.pi, stride=40),
)
WALKS = {walk.name: walk for walk in _LISTED}
"""By name. "smooth", "stick-slip" and "ice" stand for the floors Grip, Uniform and Patches."""
