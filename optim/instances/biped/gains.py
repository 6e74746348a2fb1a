"""A walking controller's numbers, judged by walks of which each evaluation draws others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, prepare, simulate
from stickslip.dynamics.scene import Scene
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.instances.biped.shooting import (
    DT,
    SLIDE_WEIGHT,
    TORQUE_LIMIT,
    walk_cost,
)

if TYPE_CHECKING:
    from jaxtyping import Array, Float, PyTree

    from stickslip.dynamics.biped import Trajectory

SECONDS = 3.0
FRICTION = (0.05, 0.3)
"""Static friction is drawn evenly in its logarithm; kinetic friction is KINETIC of it."""
KINETIC = 0.85
GAIN_RANGE, TORQUE_RANGE = (0.0, 4.0), (-2.0, 2.0)


@dataclass(frozen=True)
class Gains:
    """The mean cost of `walks` walks of SECONDS under a feedback, by `Shooting`'s measure.

    The torque is x[0] (crank_rate - rate) + x[1] and, in the angle of the support phase, harmonics
    with the coefficients x[2:] (sine and cosine in turn), within TORQUE_LIMIT. Each walk draws its
    friction, its phase and its crank rate at the beginning, up to the one wanted.
    """

    crank_rate: float
    walks: int
    integrator: RK4Split | None = None

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1]; no margins."""
        costs = jax.vmap(partial(self.one, data, x))(self.keys(draw))
        return jnp.mean(costs)[None], jnp.zeros(0)

    def keys(self, draw: Array | int) -> Array:
        """Random keys of a draw's walks."""
        return jax.random.split(jax.random.key(draw), self.walks)

    def one(self, model: PyTree, x: Float[Array, "n"], key: Array) -> Array:
        """The cost of one walk."""
        walk, _ = self.walk(model, x, key)
        cost, slid = walk_cost(walk, walk.torques, self.crank_rate)
        return cost + SLIDE_WEIGHT * slid

    def walk(self, model: PyTree, x: Float[Array, "n"], key: Array) -> tuple[Trajectory, Scene]:
        """One walk, and what it is on."""
        low, high = np.log(FRICTION)
        of_floor, of_phase, of_rate = jax.random.uniform(key, (3,), x.dtype)
        mu = jnp.exp(low + (high - low) * of_floor)
        state = BipedState(
            phase=np.pi * (0.5 + of_phase), crank_rate=self.crank_rate * of_rate
        ).astype(x.dtype)
        scene = Scene.uniform(mu, KINETIC * mu)
        law, integrator = partial(self.torque, x), self.integrator or RK4Split()
        return simulate(model, scene, state, law, SECONDS, DT, integrator=integrator), scene

    def torque(self, x: Float[Array, "n"], state: BipedState) -> Array:
        """The feedback law [N m]."""
        turns = 2.0 * np.arange(1, (len(x) - 2) // 2 + 1)
        angle = turns * (jnp.asarray(state.phase) - np.pi / 2)
        waves = jnp.stack([jnp.sin(angle), jnp.cos(angle)], -1).ravel()
        asked = x[0] * (self.crank_rate - state.crank_rate) + x[1] + waves @ x[2:]
        return jnp.clip(asked, -TORQUE_LIMIT, TORQUE_LIMIT)


def gains_problem(
    numbers: int, crank_rate: float, walks: int, integrator: RK4Split | None = None
) -> FunctionProblem:
    """2 + 2 h numbers with h harmonics."""
    model = prepare(BipedParams.from_bars(dtype=np.float64), fidelity="table")
    low = np.array([GAIN_RANGE[0], *[TORQUE_RANGE[0]] * (numbers - 1)])
    high = np.array([GAIN_RANGE[1], *[TORQUE_RANGE[1]] * (numbers - 1)])
    return FunctionProblem(Gains(crank_rate, walks, integrator), model, low, high, forward=True)
