"""Direct shooting: a row of motor torques through the simulator, stick-slip switch and all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import (
    BipedParams,
    BipedState,
    RK4Split,
    Trajectory,
    prepare,
    simulate,
)
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.optim.function_problem import FunctionProblem

if TYPE_CHECKING:
    from jaxtyping import Array, Float, PyTree

TORQUE_LIMIT = 4.0
DT = 0.02
"""Length of one step of the simulator [s]."""
HELD = 5
"""Steps that a torque is held for."""
TORQUE_WEIGHT, SLIDE_WEIGHT, FALL_WEIGHT = 0.02, 20.0, 5.0
STATE = {"phase": np.pi / 2 + 0.4, "crank_rate": 2.0}
SCENES = {
    "grip": Scene.grip,
    "firm": lambda: Scene.named("firm"),
    "slippery": lambda: Scene.named("slippery"),
    "icy": lambda: Scene.uniform(0.03, 0.025),
    "patch": lambda: Scene.patches([0.05, 0.4], [0.5, 0.05, 0.5], [0.4, 0.04, 0.4]),
}


@dataclass(frozen=True)
class Shooting:
    """The cost of a row of torques [n], each held for HELD steps of DT.

    crank_rate: what is wanted [rad/s]. slide_limit: how far the foot may slide in all [m], as a
    margin; None: any, at a price. integrator: over each DT, None: RK4Split(). The cost is the mean
    squared error of the crank rate in parts of what is wanted, TORQUE_WEIGHT times the mean squared
    torque in parts of the limit, SLIDE_WEIGHT for each metre slid (without a slide_limit), and
    FALL_WEIGHT times the part of the time left when a walk ends early.
    """

    crank_rate: float
    slide_limit: float | None
    integrator: RK4Split | None = None

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1] and margins [0] or [1]."""
        cost, slid = walk_cost(self.walk(data, x), jnp.repeat(x, HELD), self.crank_rate)
        if self.slide_limit is None:
            return (cost + SLIDE_WEIGHT * slid)[None], jnp.zeros(0)
        return cost[None], (1 - slid / self.slide_limit)[None]

    def walk(self, data: PyTree, x: Float[Array, "n"]) -> Trajectory:
        """The walk under the torques."""
        model, scene, state = data
        torques, integrator = jnp.repeat(x, HELD), self.integrator or RK4Split()
        return simulate(model, scene, state, torques, len(torques) * DT, DT, integrator=integrator)


def walk_cost(
    walk: Trajectory, torques: Float[Array, "n"], crank_rate: float
) -> tuple[Array, Array]:
    """Cost of a walk without its slide, and the distance slid [m]; see Shooting."""
    going = walk.contacts.status <= Status.SLIP_ONSET
    error = walk.states.crank_rate[1:] / crank_rate - 1
    effort = (torques / TORQUE_LIMIT) ** 2
    cost = jnp.mean(jnp.where(going, error**2 + TORQUE_WEIGHT * effort, FALL_WEIGHT))
    slid = jnp.sum(jnp.where(going, walk.contacts.slide_distance, 0.0))
    return cost, slid


def shooting_problem(
    scene: str,
    numbers: int,
    crank_rate: float = 3.0,
    slide_limit: float | None = None,
    integrator: RK4Split | None = None,
) -> FunctionProblem:
    """Torques of the reference robot that walks already, numbers x HELD x DT seconds."""
    model = prepare(BipedParams.from_bars(dtype=np.float64), fidelity="table")
    data = (model, SCENES[scene](), BipedState(**STATE).astype(np.float64))
    most = np.full(numbers, TORQUE_LIMIT)
    function = Shooting(crank_rate, slide_limit, integrator)
    return FunctionProblem(function, data, -most, most, forward=True)
