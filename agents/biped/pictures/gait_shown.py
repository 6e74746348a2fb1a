"""A gait as an episode of a page: walked as it is on the grid, the foot at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.reports.course import panel
from stickslip.dynamics.scene import Scene
from stickslip.envs.rendering import BipedFrame
from stickslip.envs.rendering.biped import biped_drawing
from stickslip.envs.rendering.html.data import Event, Line, Panel, Shown

if TYPE_CHECKING:
    from stickslip.optim import Gait, GaitProblem

PERIOD = 0.02
"""Between samples of a page, at most [s]."""
FEWEST = 400
"""Samples of a page: a quick step takes less than a quarter of a second."""
WALKED = 3
"""Steps that a periodic gait is shown for."""
LONGEST = 60.0
"""A gait that takes longer is shown so far [s]."""


def gait_shown(
    problem: GaitProblem,
    gait: Gait,
    name: str,
    steps: int = WALKED,
    floor: float | None = None,
) -> Shown:
    """A problem's gait; name: what it is called, steps: that a periodic one is repeated for.
    Nothing is simulated: rate, torque and forces are those of the grid, over its own time.
    floor: friction of the floor that is drawn, None: the limit that the gait keeps to."""
    course = _course(gait, steps if problem.is_periodic else 1)
    limits = problem.on_grid.limits.mu
    mu = None if limits is None else float(np.min(limits))
    floor = mu if floor is None else floor
    frames = _frames(course, gait.nodes.robot.step_length, gait.mean_rate, floor)
    scene = Scene.grip() if floor is None else Scene.uniform(floor, floor)
    drawing, walked = biped_drawing(frames, problem.params, scene, np.zeros(len(frames), bool))
    torque, rate = course["torque"], course["rate"]
    use = np.abs(course["friction"]) / course["normal"]
    friction = [Line("|friction| / normal", use)]
    friction += [] if mu is None else [Line("limit", np.full(len(use), mu), dashed=True)]
    most = problem.torque_limit
    exchanges = np.flatnonzero(np.diff(course["step"])) + 1
    return Shown(
        name=name,
        period=float(course["time"][1]),
        panels=(
            panel("motor torque", "N m", torque, () if most is None else (-most, most)),
            panel("motor power, torque × crank rate", "W", torque * rate),
            Panel(
                "crank rate",
                "rad/s",
                (
                    Line("crank rate", rate),
                    Line("mean", np.full(len(rate), gait.mean_rate), dashed=True),
                ),
            ),
            Panel("friction used", "-", tuple(friction)),
        ),
        events=tuple(
            Event(int(i), "support", f"step {n}: the legs change support")
            for n, i in enumerate(exchanges, 1)
        ),
        numbers=(
            ("walked [m]", walked, 2),
            ("crank rate [rad/s]", rate, 2),
            ("torque [N m]", torque, 2),
            ("friction / normal", use, 3),
        ),
        slips=np.zeros(len(frames), bool),
        drawing=drawing,
    )


def _course(gait: Gait, repeats: int) -> dict[str, np.ndarray]:
    """The gait at equal intervals of time."""
    count = gait.grid.steps * repeats
    again = min(gait.duration, 1e3) * np.arange(repeats)[:, None, None]
    time = (gait.clock + again).reshape(count, -1)
    turned = np.tile(gait.theta, (repeats, 1)) - np.pi / 2 + np.pi * np.arange(count)[:, None]
    last = min(float(time[-1, -1]), LONGEST)
    at = np.linspace(0.0, last, max(FEWEST, int(np.ceil(last / PERIOD)) + 1))

    def over(values: np.ndarray) -> np.ndarray:
        return np.interp(at, time.ravel(), np.tile(values, (repeats, 1)).ravel())

    angle = np.interp(at, time.ravel(), turned.ravel())
    return {
        "time": at,
        "angle": angle,
        "step": np.minimum(np.floor(angle / np.pi + 1e-9), count - 1).astype(int),
        "rate": over(gait.crank_rate),
        "torque": over(gait.torque),
        "friction": over(gait.friction_force),
        "normal": over(gait.normal_force),
        "zmp": over(gait.zmp),
    }


def _frames(
    course: dict[str, np.ndarray], step_length: float, mean_rate: float, mu: float | None
) -> list[BipedFrame]:
    frames = []
    for i, time in enumerate(course["time"]):
        step = int(course["step"][i])
        frames.append(
            BipedFrame(
                phase=float(course["angle"][i] - np.pi * step + np.pi / 2),
                steps=step,
                floor_position=step * float(step_length),
                slide=0.0,
                crank_rate=float(course["rate"][i]),
                foot_velocity=0.0,
                time=float(time),
                torque=float(course["torque"][i]),
                friction_force=float(course["friction"][i]),
                normal_force=float(course["normal"][i]),
                zmp=float(course["zmp"][i]),
                mu_static=mu,
                mu_kinetic=mu,
                sticking=True,
                mean_crank_rate=mean_rate,
                commanded_rate=None,
            )
        )
    return frames
