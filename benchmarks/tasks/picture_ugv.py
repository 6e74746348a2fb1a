"""The UGV along an episode: the vehicle where it came by, over its ground, and what counts."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.ugv.draw import ground
from stickslip.optimise.vehicle import draw_scene, poses
from stickslip.paper import drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.envs import UGVEnv, UGVEnvParams

VEHICLES = 5
PIECES = 400
"""Of the ground, each in the colour of its friction."""


def draw(top: Axes, below: Axes, env: UGVEnv, params: UGVEnvParams, played: AnyRollout) -> None:
    """The scene above, torque or grip over the way below."""
    at = jax.tree.map(np.asarray, played.state.station)
    shown = np.linspace(0, len(at.x) - 1, VEHICLES).round().astype(int)
    odometer, friction = ground(played.start_state.drawn, params)
    track = odometer.track
    placed = poses(params.vehicle, track, at.x[shown], at.leg_angles[shown], env.solver)
    across = float(params.track.start), float(params.track.end)
    draw_scene(top, params.vehicle, track, placed, across)
    limits = top.get_ylim()
    _colour(top, track, friction, across, limits[0])
    top.set_ylim(limits)
    top.set_xlim(across)
    if env.criterion == "grip":
        looks = (("rear", theme.MOTOR, "-"), ("front", theme.SLIDES, "--"))
        for (name, colour, style), (F, N, mu) in zip(looks, at.wheels, strict=True):
            below.plot(at.x, mu * N - np.abs(F), color=colour, ls=style, lw=1.3, label=name)
        drawing.mark(below, y=float(np.min(at.grip)))
        what = "μ N − |F| of the rear and (dashed) the front wheel: the least counts [N]"
    else:
        below.plot(at.x, at.torque, color=theme.MOTOR, lw=1.3)
        drawing.mark(below, y=0.0)
        of_torque = env.criterion == "torque_variation"
        aim = "as even as can be" if of_torque else "below 0 it drives"
        what = f"torque on each wheel, {aim} [N m]"
    below.set_xlim(top.get_xlim())
    below.set_title(what, loc="left", fontsize=8, color=theme.INK, pad=2)
    below.set_title("front wheel [m]", loc="right", fontsize=8, color=theme.MUTED, pad=2)
    top.set_xticks([])


def _colour(
    axis: Axes, track: Any, friction: Any, across: tuple[float, float], bottom: float
) -> None:
    """The ground in the colours of its friction, with labels where it changes."""
    x = np.linspace(across[0] - 1.0, across[1] + 1.0, PIECES)
    factor = np.ones(PIECES) if track.surface is None else np.asarray(track.surface.at(x))
    mu, height = float(friction) * factor, np.asarray(track.height(x))
    deep = bottom - 5.0
    edges = [0, *(np.flatnonzero(np.abs(np.diff(mu)) > 1e-4) + 1).tolist(), PIECES]
    for a, b in pairwise(edges):
        part = slice(a, min(b + 1, PIECES))
        colour = theme.floor_colour(float(mu[a]))
        axis.fill_between(x[part], height[part], deep, color=colour, lw=0, zorder=1.1)
        middle = (x[a] + x[b - 1]) / 2
        if x[b - 1] - x[a] > 0.4 and across[0] < middle < across[1]:
            low = float(np.min(height[part]))
            text = {"ha": "center", "va": "top", "fontsize": 7, "color": theme.INK, "zorder": 5}
            axis.text(middle, low - 0.05, f"μ {mu[a]:.2g}", **text)
