"""A walk as a page shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.reports.course import facts, from_start, panel, reward_panels, samples
from stickslip.dynamics.status import Status
from stickslip.envs.biped.draw import drawn_robot, drawn_scene
from stickslip.envs.biped.picture import biped_frames
from stickslip.envs.rendering.biped import biped_drawing
from stickslip.envs.rendering.html.data import Event, Line, Panel, Shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.biped.draw import Drawn
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState
    from stickslip.envs.ranges import Range
    from stickslip.envs.rendering.biped import BipedFrame
    from stickslip.envs.tasks.known import Scale

LEAST_SLID = 1e-7
"""A foot that moved less in a control step stuck all the while [m]."""
TERMS = ("tracking", "slip", "energy", "fall")


class Course(NamedTuple):
    """What a walk's curves are drawn from, every entry but the last [n], forces in N, torque and
    `limit` in N m, rates in rad/s. slide: of the foot, forwards +; slid: either way, so far [m]."""

    torque: np.ndarray
    rate: np.ndarray
    commanded: np.ndarray
    friction: np.ndarray
    normal: np.ndarray
    slide: np.ndarray
    slid: np.ndarray
    limit: float

    @property
    def use(self) -> np.ndarray:
        """Friction in parts of the normal force; NaN where nothing is carried."""
        return np.abs(self.friction) / np.where(self.normal > 0, self.normal, np.nan)

    def panels(self, frames: Sequence[BipedFrame]) -> tuple[Panel, ...]:
        """Torque, power, crank rate, friction and sliding. frames: [n], for the friction below."""
        mu = np.array([np.nan if one.mu_static is None else one.mu_static for one in frames])
        friction = [Line("|friction| / normal", self.use)]
        friction += [Line("static friction", mu, dashed=True)] if np.isfinite(mu).any() else []
        limits = (-self.limit, self.limit)
        return (
            panel("motor torque", "N m", self.torque, limits=limits, steps=True),
            panel("motor power, torque × crank rate", "W", self.torque * self.rate),
            Panel(
                "crank rate",
                "rad/s",
                (
                    Line("crank rate", self.rate),
                    Line("commanded mean", self.commanded, dashed=True),
                ),
            ),
            Panel("friction used", "-", tuple(friction)),
            Panel(
                "sliding of the feet",
                "mm",
                (
                    Line("distance slid, either way", 1e3 * self.slid),
                    Line("slide, forwards +", 1e3 * self.slide),
                ),
            ),
        )

    def numbers(self, walked: np.ndarray) -> tuple[tuple[str, np.ndarray, int], ...]:
        """What stands above the picture; walked: so far [n] m."""
        return (
            ("walked [m]", walked, 2),
            ("crank rate [rad/s]", self.rate, 2),
            ("torque [N m]", self.torque, 2),
            ("friction / normal", self.use, 2),
            ("distance slid [mm]", 1e3 * self.slid, 1),
        )


def shown(
    played: Rollout[BipedEnvState],
    env: BipedEnv,
    params: BipedEnvParams,
    name: str,
    scale: Scale | None,
) -> Shown:
    """One episode (not a batch). Forces and power are those at the end of each control step; a step
    in which the foot moved at all counts as slipping. Events are told by the step."""
    played = played.trimmed()
    states, infos = samples(played)
    frames = biped_frames(states, infos, params)
    slips = (infos["slid"] > LEAST_SLID) | (np.asarray(states.mode) != 0)
    slips[0] = states.mode[0] != 0
    robot = drawn_robot(played.start_state.drawn, params)
    scene = drawn_scene(played.start_state.drawn, params)
    drawing, _ = biped_drawing(frames, robot.params, scene, slips)
    course = Course(
        torque=from_start(played.info["torque"]),
        rate=np.asarray(states.biped.crank_rate, float),
        commanded=np.asarray(states.drawn.commanded_rate, float),
        friction=infos["friction_force"],
        normal=infos["normal_force"],
        slide=np.asarray(states.biped.foot_position, float),
        slid=infos["episode_slid"],
        limit=float(params.torque_limit),
    )
    terms = {one: from_start(played.info[f"reward_{one}"]) for one in TERMS}
    last = played.info
    whole = facts(
        [
            ("return", float(last["episode_return"][-1]), "-"),
            ("walked", float(last["episode_walked"][-1]), "m"),
            ("distance slid", 1e3 * float(infos["episode_slid"][-1]), "mm"),
            ("energy", float(last["episode_energy"][-1]), "J"),
        ]
    )
    status = Status(int(last["status"][-1]))
    ended = status.name.lower().replace("_", " ") if bool(played.terminated[-1]) else ""
    return Shown(
        name=name,
        period=float(params.control_period),
        panels=(*course.panels(frames), *reward_panels(played, terms, "-", scale)),
        events=_events(frames, slips, ended),
        numbers=course.numbers(infos["episode_walked"]),
        slips=slips,
        drawing=drawing,
        ended=ended,
        facts=(*whole, *_drawn(played.start_state.drawn, params)),
    )


def _drawn(drawn: Drawn, params: BipedEnvParams) -> tuple[tuple[str, str], ...]:
    """What the reset drew of floor and load for this episode; pictures show it."""
    ranges = params.randomisation
    return facts(
        [
            ("friction, drawn", _or_none(ranges.friction, drawn.friction), "× the floor's"),
            ("masses, drawn", _or_none(ranges.mass, drawn.mass), "× the robot's"),
            ("payload, drawn", _or_none(ranges.payload, drawn.payload), "kg"),
        ]
    )


def _or_none(drawn_from: Range | None, value: Array) -> float:
    return np.nan if drawn_from is None else float(value)


def _events(frames: Sequence[BipedFrame], slips: np.ndarray, ended: str) -> tuple[Event, ...]:
    """Slips, stops and exchanges of support by the control step, and an early end."""
    events = []
    for i in range(1, len(frames)):
        before, now = frames[i - 1], frames[i]
        if now.steps != before.steps:
            events.append(Event(i, "support", f"step {now.steps}: the legs change support"))
        if slips[i] and not slips[i - 1]:
            way = "forwards" if now.slide > before.slide else "backwards"
            events.append(Event(i, "slip", f"slips {way}"))
        if slips[i - 1] and not slips[i]:
            events.append(Event(i, "stick", "sticks"))
    if ended:
        events.append(Event(len(frames) - 1, "end", f"ended: {ended}"))
    return tuple(events)
