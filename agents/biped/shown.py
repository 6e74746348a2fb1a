"""A walk as a page shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.reports.course import facts, from_start, panel, reward_panels, samples
from stickslip.dynamics.status import Status
from stickslip.envs.biped.draw import drawn_robot, drawn_scene
from stickslip.envs.biped.picture import biped_frames
from stickslip.envs.rendering.biped.drawn import biped_drawing
from stickslip.envs.rendering.html.data import Event, Line, Panel, Shown

if TYPE_CHECKING:
    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState
    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.tasks.scale import Scale

LEAST_SLID = 1e-7
"""A foot that moved less in a control step stuck all the while [m]."""
TERMS = ("tracking", "slip", "energy", "fall")


def shown(
    played: Rollout[BipedEnvState], params: BipedEnvParams, name: str, scale: Scale | None
) -> Shown:
    """One episode (not a batch). Forces and power are those at the end of each control step; a step
    in which the foot moved at all counts as slipping."""
    played = played.trimmed()
    states, infos = samples(played)
    frames = biped_frames(states, infos, params)
    slips = (infos["slid"] > LEAST_SLID) | (np.asarray(states.mode) != 0)
    slips[0] = states.mode[0] != 0
    robot = drawn_robot(played.start_state.drawn, params)
    scene = drawn_scene(played.start_state.drawn, params)
    drawing, walked = biped_drawing(frames, robot.params, scene, slips)
    torque, rate = from_start(played.info["torque"]), np.asarray(states.biped.crank_rate, float)
    carried = np.where(infos["normal_force"] > 0, infos["normal_force"], np.nan)
    use = np.abs(infos["friction_force"]) / carried
    limit = float(params.torque_limit)
    mu = np.array([np.nan if one.mu_static is None else one.mu_static for one in frames])
    commanded = np.asarray(states.drawn.commanded_rate, float)
    terms = {one: from_start(played.info[f"reward_{one}"]) for one in TERMS}
    friction = [Line("|friction| / normal", use)]
    friction += [Line("static friction", mu, dashed=True)] if np.isfinite(mu).any() else []
    slide = 1e3 * np.asarray(states.biped.foot_position, float)
    slid = 1e3 * infos["episode_slid"]
    panels = (
        panel("motor torque", "N m", torque, limits=(-limit, limit), steps=True),
        panel("motor power, torque × crank rate", "W", torque * rate),
        Panel(
            "crank rate",
            "rad/s",
            (Line("crank rate", rate), Line("commanded mean", commanded, dashed=True)),
        ),
        Panel("friction used", "-", tuple(friction)),
        Panel(
            "slid by the feet",
            "mm",
            (Line("slid, either direction", slid), Line("slide, signed", slide)),
        ),
        *reward_panels(played, terms, "-", scale),
    )
    numbers = (
        ("walked [m]", walked, 2),
        ("crank rate [rad/s]", rate, 2),
        ("torque [N m]", torque, 2),
        ("friction / normal", use, 2),
        ("slid [mm]", slid, 1),
    )
    last = played.info
    whole = facts(
        [
            ("return", float(last["episode_return"][-1]), "-"),
            ("walked", float(last["episode_walked"][-1]), "m"),
            ("slid, either direction", float(slid[-1]), "mm"),
            ("energy", float(last["episode_energy"][-1]), "J"),
        ]
    )
    status = Status(int(last["status"][-1]))
    ended = status.name.lower().replace("_", " ") if bool(played.terminated[-1]) else ""
    return Shown(
        name=name,
        period=float(params.control_period),
        panels=panels,
        events=_events(frames, slips, ended),
        numbers=numbers,
        slips=slips,
        drawing=drawing,
        ended=ended,
        facts=whole,
    )


def _events(frames: list[BipedFrame], slips: np.ndarray, ended: str) -> tuple[Event, ...]:
    """Switches between sticking and slipping, exchanges of support and the end, to the step."""
    found = []
    for i in range(1, len(frames)):
        if frames[i].steps != frames[i - 1].steps:
            found.append(Event(i, "support", f"step {frames[i].steps}: the legs change support"))
        if slips[i] and not slips[i - 1]:
            way = frames[i].slide - frames[i - 1].slide
            found.append(Event(i, "slip", f"slips {'forwards' if way > 0 else 'backwards'}"))
        elif slips[i - 1] and not slips[i]:
            found.append(Event(i, "stick", "sticks"))
    if ended:
        found.append(Event(len(frames) - 1, "end", f"ended: {ended}"))
    return tuple(found)
