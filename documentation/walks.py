"""Picture of three steady walks for docs/machines.md: `python -m documentation.walks`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from stickslip.dynamics.biped import BipedParams, inverse_dynamics, reduced_inertia
from stickslip.envs.rendering import sheet, theme
from stickslip.optim import GaitProblem, solve
from stickslip.optim.gait.gait import friction_uses
from stickslip.records.files import write_whole

PICTURE = Path(__file__).parents[1] / "docs" / "walks.png"
RATE = 3.0
"""Mean crank rate [rad/s]."""
MU = 0.06
"""Friction that limits the optimal gait [-]."""


class Walk(NamedTuple):
    """A walk without slip: crank rate [rad/s], momentum P w [kg m/s] and friction ratio [-]."""

    crank_rate: np.ndarray
    momentum: np.ndarray
    friction: np.ndarray


def walk(params: BipedParams, theta: np.ndarray, rate: np.ndarray) -> Walk:
    """The walk with a crank rate [rad/s] at increasing crank angles [rad]."""
    acceleration = rate * np.gradient(rate, theta, edge_order=2)
    forces = jax.vmap(lambda *state: inverse_dynamics(params, *state))(theta, rate, acceleration)
    ratio = np.asarray(friction_uses(forces.friction_force, forces.normal_force))
    return Walk(rate, momenta(params, theta) * rate, ratio)


def momenta(params: BipedParams, theta: np.ndarray) -> np.ndarray:
    """Horizontal momentum P for each rad/s of the crank, at crank angles [rad]."""
    return np.asarray(jax.vmap(lambda angle: reduced_inertia(params, angle).P)(theta))


def walks() -> tuple[np.ndarray, dict[str, Walk]]:
    """Crank angle over a step [rad], and the walks by name, of the same mean crank rate."""
    params = BipedParams.from_bars()
    gait = solve(GaitProblem.periodic(params, "energy", mu=MU, mean_rate=RATE, steps=400))
    theta, best = (np.asarray(row[0]) for row in (gait.theta, gait.crank_rate))
    held = 1 / momenta(params, theta)
    held *= RATE * np.trapezoid(1 / held, theta) / (theta[-1] - theta[0])
    rates = {
        "constant crank rate": np.full_like(theta, RATE),
        "least energy at μ = 0.06": best,
        "constant momentum": held,
    }
    return theta, {name: walk(params, theta, rate) for name, rate in rates.items()}


@sheet.styled
def draw() -> bytes:
    """PNG of the walks, two steps of each."""
    theta, found = walks()
    figure, axes = sheet.make_sheet(3, 1, (sheet.WIDTH, 4.6))
    turn = np.rad2deg(theta - theta[0])
    angle = np.concatenate((turn, turn + turn[-1]))
    labels = ("crank rate [rad/s]", "horizontal momentum P(θ) w [kg m/s]", "friction |f| / N [-]")
    for axis, label, field in zip(axes, labels, Walk._fields, strict=True):
        for (name, one), colour, style in zip(
            found.items(), theme.PLAYERS[1::-1] + theme.PLAYERS[2:3], ("--", "-", "-"), strict=True
        ):
            axis.plot(angle, np.tile(getattr(one, field), 2), style, color=colour, label=name)
        sheet.name_panel(axis, label)
    axes[0].set(xlim=(0, angle[-1]), xticks=range(0, 361, 90))
    axes[-1].set_ylim(-0.005, 0.12)
    axes[-1].set_xlabel("crank angle [°]")
    axes[-1].legend(ncols=3, loc="upper center")
    return sheet.png(figure, f"Steady walks without slip, {RATE:g} rad/s on average")


if __name__ == "__main__":
    with jax.enable_x64(True):
        print(write_whole(PICTURE, draw()))
