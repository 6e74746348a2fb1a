"""The biped along an episode: the robot where it came by, over its floor, and its speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.biped import floor_position
from stickslip.envs.biped.draw import drawn_scene
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.biped.floor import patches_of
from stickslip.envs.rendering.biped.linkage import Mechanism
from stickslip.optimise.gait_picture import draw_robot
from stickslip.paper import drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.envs import BipedEnvParams

MOST, APART = 10, 0.5
"""Robots at most, and how far apart at least [m]."""
FLOOR = 0.1
"""Thickness of the drawn floor [m]."""
ACROSS = 6.5
"""Width of the scene in its heights."""
WINDOW = 25
"""Control steps over which the speed is averaged."""


def draw(top: Axes, below: Axes, env: Any, params: BipedEnvParams, played: AnyRollout) -> None:
    """The scene above, what counts over time below."""
    del env
    state = jax.tree.map(np.asarray, played.state)
    place = np.asarray(jax.vmap(lambda at: floor_position(params.robot, at))(played.state.biped))
    _scene(top, params, played, place)
    time = np.asarray(state.biped.time)
    walked = np.asarray(state.totals.walked)
    line = {"color": theme.MOTOR, "lw": 1.3}
    if state.drawn.mark is not None:
        below.plot(time, np.asarray(played.state.to_go), **line)
        drawing.mark(below, y=0.0)
        _named(below, "way to the mark [m]")
        return
    if float(params.slip_weight) == 0:
        below.plot(time, walked, **line)
        _named(below, "way walked [m]")
        return
    steps = np.minimum(np.arange(1, len(time) + 1), WINDOW)
    before = np.concatenate([np.zeros(WINDOW), walked])[: len(walked)]
    speed = (walked - before) / (steps * float(params.control_period))
    wanted = state.drawn.commanded_rate / np.pi * float(params.robot.step_length)
    below.plot(time, speed, **line)
    below.plot(time, np.broadcast_to(wanted, time.shape), color=theme.MUTED, lw=1.0, ls="--")
    _named(below, "speed over half a second, dashed: commanded [m/s]")


def _scene(axis: Axes, params: BipedEnvParams, played: AnyRollout, place: np.ndarray) -> None:
    mechanism = Mechanism(params.robot.bare)
    floor = drawn_scene(played.start_state.drawn, params)
    left, right = float(place.min()) - 0.45, float(place.max()) + 0.55
    spare = ACROSS * (1.1 * mechanism.top + FLOOR) - (right - left)
    left, right = left - max(spare, 0.0) / 2, right + max(spare, 0.0) / 2
    for patch in patches_of(jax.tree.map(np.asarray, floor)):
        begin, end = max(patch.start, left), min(patch.end, right)
        if begin < end:
            colour = theme.floor_colour(patch.mu_static)
            axis.fill_between([begin, end], -FLOOR, 0.0, color=colour, lw=0, zorder=1)
            if end - begin > 0.25:
                look = {"ha": "center", "va": "center", "fontsize": 7, "color": theme.INK}
                axis.text((begin + end) / 2, -FLOOR / 2, f"μ {patch.mu_static:.2g}", **look)
    axis.axhline(0.0, color=theme.INK, lw=1.0, zorder=2)
    mark = played.start_state.drawn.mark
    if mark is not None:
        start = played.start_state.biped
        ahead = params.robot.inertia.moment_at(start.phase).X / params.robot.total_mass
        x = float(floor_position(params.robot, start) + ahead + mark)
        axis.plot([x, x], [0.0, 1.05 * mechanism.top], color=theme.SLIDES, lw=1.4, zorder=2)
    count = int(min(MOST, max(2, (place.max() - place.min()) / APART + 1)))
    wanted = np.linspace(place[0], place[-1], count)
    for i in sorted({int(np.argmax(place >= x - 1e-6)) for x in wanted}):
        phase = float(played.state.biped.phase[i]) % (2 * np.pi)
        draw_robot(axis, mechanism, phase, float(place[i]))
    axis.set_aspect("equal")
    axis.set_xlim(left, right)
    axis.set_ylim(-FLOOR, 1.1 * mechanism.top)
    axis.set_xticks([])
    axis.set_yticks([])
    axis.grid(visible=False)


def _named(axis: Axes, what: str) -> None:
    axis.set_xlim(left=0)
    axis.set_title(what, loc="left", fontsize=8, color=theme.INK, pad=2)
    axis.set_title("time [s]", loc="right", fontsize=8, color=theme.MUTED, pad=2)
