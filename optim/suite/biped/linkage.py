"""Design of PASIBOT: the lengths and masses of its links, kept able to walk."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, inverse_dynamics, step_length
from stickslip.dynamics.biped.kinematics import (
    SUPPORT_START,
    closing_margin,
    exchange_mismatch,
)
from stickslip.optim.function_problem import FunctionProblem

if TYPE_CHECKING:
    from jaxtyping import Array, Float, PyTree

LENGTHS = {
    "ground_link": 2.0,
    "rod": 5.0,
    "rod_pin": 2.5,
    "rocker": 2.5,
    "tendon_drop": 12.0,
    "upper_tendon": 6.0,
    "lower_tendon": 6.0,
    "femur": 9.0,
    "femur_pin": 3.0,
    "tibia": 18.0,
    "tibia_pin": 6.0,
    "stabiliser": 4.2,
}
"""What a design chooses, in crank lengths, and what the reference robot has."""
MASSES = {"hip_mass": 0.7, "foot_mass": 0.3}
PART = 0.2
"""A design differs from the reference robot by at most this part."""
ANGLES = 64
MISMATCH = 0.05
"""How far the exchange of support may be from impact-free [crank lengths, rad]."""
LEAST_STEP = 0.9
"""Of the reference robot's step."""
COPPER_LOSS = 0.5
CRANK_RATE = 3.0


@dataclass(frozen=True)
class BipedDesign:
    """What a robot needs that walks at CRANK_RATE without slip.

    goal: "friction": the largest |F| / N, or "energy": positive work and copper loss for each metre
    [J/m]. names: of what the vector multiplies. Margins: the linkage closes at ANGLES crank angles;
    the exchange is free of impact within MISMATCH; the step is no shorter than LEAST_STEP of the
    reference; the foot presses on the ground.
    """

    goal: str
    names: tuple[str, ...]

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1] and margins [2 ANGLES + 2]."""
        usual = LENGTHS | MASSES
        chosen = {name: usual[name] * part for name, part in zip(self.names, x, strict=True)}
        robot = BipedParams.from_bars(**chosen, dtype=np.float64)
        theta = SUPPORT_START + np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
        need = jax.vmap(lambda angle: inverse_dynamics(robot, angle, CRANK_RATE, 0.0))(theta)
        length, weight = step_length(robot), robot.total_mass * robot.gravity
        margins = jnp.concatenate(
            [
                jax.vmap(partial(closing_margin, robot))(theta),
                need.normal_force / weight,
                (1 - exchange_mismatch(robot) / MISMATCH)[None],
                (length / (LEAST_STEP * data) - 1)[None],
            ]
        )
        if self.goal == "friction":
            return jnp.max(jnp.abs(need.friction_force) / need.normal_force)[None], margins
        power = jnp.maximum(need.torque, 0) * CRANK_RATE + COPPER_LOSS * need.torque**2
        return (jnp.mean(power) * np.pi / CRANK_RATE / length)[None], margins


def biped_design(goal: str, masses: bool = False) -> FunctionProblem:
    """The lengths of PASIBOT's links, and with masses=True those of hip and feet, in parts of the
    reference robot's."""
    names = (*LENGTHS, *(MASSES if masses else ()))
    usual = np.asarray(step_length(BipedParams.from_bars(dtype=np.float64)))
    ones = np.ones(len(names))
    function = BipedDesign(goal, names)
    return FunctionProblem(function, usual, (1 - PART) * ones, (1 + PART) * ones, forward=True)
