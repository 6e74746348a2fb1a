"""Design of PASIBOT: the lengths and masses of its links, kept able to walk."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, inverse_dynamics, step_length
from stickslip.dynamics.biped.links import (
    SUPPORT_END,
    SUPPORT_START,
    closing_margin,
    exchange_mismatch,
)
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.problem import FEASIBLE

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
"""Design variables in crank lengths, with the reference robot's values."""
MASSES = {"hip_mass": 0.7, "foot_mass": 0.3}
PART = 0.2
"""A design differs from the reference robot by at most this part."""
ANGLES = 64
MISMATCH = 0.05
"""Tolerance of an impact-free exchange of support [crank lengths, rad]."""
LEAST_STEP = 0.9
"""Least step, in parts of the reference robot's."""
COPPER_LOSS = 0.5
CRANK_RATE = 3.0
VALUE_ROOM, MARGIN_ROOM = 1e3, 1e2
"""Beyond these, values and margins grow by the logarithm alone: robots that walk stay far within,
and the forces of a linkage that does not close mean nothing (1e20 weights)."""


@dataclass(frozen=True)
class BipedDesign:
    """Design problem of a robot that walks at CRANK_RATE without slip.

    goal: "friction": the largest |F| / N, or "energy": positive work and copper loss for each metre
    [J/m]. names: of what the vector multiplies. angles: how many crank angles, None: ANGLES; both
    ends of the step are among those of "friction", which is greatest there. Margins: the linkage
    closes there; the exchange is free of impact within MISMATCH; the step is no shorter than
    LEAST_STEP of the reference; the foot presses on the ground.

    A design that misses any of them has a value, too, that is no lower for it: a step counts as
    half the reference's at least, and a foot that does not press as one that hardly does. All is
    finite; where the linkage ceases to close, forces jump.
    """

    goal: str
    names: tuple[str, ...]
    angles: int | None = None

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1] and margins [2 angles + 2]."""
        angles = ANGLES if self.angles is None else self.angles
        usual = LENGTHS | MASSES
        chosen = {name: usual[name] * part for name, part in zip(self.names, x, strict=True)}
        robot = BipedParams.from_bars(**chosen, dtype=np.float64)
        theta = SUPPORT_START + np.pi * (np.arange(angles) + 0.5) / angles
        if self.goal == "friction":
            theta = np.linspace(SUPPORT_START, SUPPORT_END, angles)
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
            pressed = jnp.maximum(need.normal_force, FEASIBLE * weight)
            value = jnp.max(jnp.abs(need.friction_force) / pressed)
        else:
            power = jnp.maximum(need.torque, 0) * CRANK_RATE + COPPER_LOSS * need.torque**2
            value = jnp.mean(power) * np.pi / CRANK_RATE / length
            value = value * jnp.where(length > data / 2, 1.0, length / (data / 2))
        return within(value, VALUE_ROOM)[None], within(margins, MARGIN_ROOM)


def within(x: Float[Array, "*any"], room: float) -> Float[Array, "*any"]:
    """x where |x| <= room; beyond, +-room (1 + log(|x| / room)): one goes on where the other ends,
    and so does its slope."""
    size = jnp.maximum(jnp.abs(x) / room, 1.0)
    return jnp.where(size > 1, jnp.sign(x) * room * (1 + jnp.log(size)), x)


def biped_design(goal: str, masses: bool = False) -> FunctionProblem:
    """The lengths of PASIBOT's links, and with masses=True those of hip and feet, in parts of the
    reference robot's."""
    names = (*LENGTHS, *(MASSES if masses else ()))
    usual = np.asarray(step_length(BipedParams.from_bars(dtype=np.float64)))
    ones = np.ones(len(names))
    function = BipedDesign(goal, names)
    return FunctionProblem(function, usual, (1 - PART) * ones, (1 + PART) * ones, forward=True)
