"""Plots and pages of the biped's episodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.agents.pictures import episodes
from stickslip.envs.biped.picture import BipedFrame, biped_frames, biped_picture
from stickslip.envs.biped.state import BipedEnvState, Drawn, drawn_robot
from stickslip.envs.rendering.page import Episode, Event, Line, Panel

if TYPE_CHECKING:
    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.tasks.known import Scale

TERMS = ("tracking", "slip", "energy", "fall")
RATE, MOMENTUM, SLIDING = "crank rate", "horizontal momentum P(θ) · crank rate", "sliding"
CEILING = 1.6
"""Friction use beyond this is cut off: nearly nothing presses the foot down."""


def walk_panels(
    at: BipedFrame,
    momentum: np.ndarray,
    limit: float | None = None,
    commanded: np.ndarray | None = None,
    cruise: np.ndarray | None = None,
) -> tuple[Panel, ...]:
    """A walk's torque, power, crank rate, momentum, friction and sliding.

    momentum: [n] kg m/s. limit: of the motor [N m]; commanded: mean crank rate [n] rad/s; cruise:
    momentum at the commanded mean speed; each None for none.
    """
    limits, torque = () if limit is None else (-limit, limit), episodes.from_start(at.torque[1:])
    mu = at.mu_static if np.isfinite(at.mu_static).any() else None
    used = Line("|friction| / normal", np.minimum(at.friction_use, CEILING))
    slides = Line("distance slid, either direction", 1e3 * at.slid)
    moved = Line("momentum", momentum)
    return (
        episodes.panel("motor torque", "N m", torque, limits=limits, steps=True),
        episodes.panel("motor power, torque × crank rate", "W", torque * at.crank_rate),
        episodes.beside(RATE, "rad/s", Line(RATE, at.crank_rate), "commanded mean", commanded),
        episodes.beside(MOMENTUM, "kg m/s", moved, "at the commanded mean speed", cruise),
        episodes.beside("friction used", "-", used, "static friction", mu),
        episodes.beside(SLIDING, "mm", slides, "slide, forwards +", 1e3 * at.slide, dashed=False),
    )


def as_episode(
    rollout: Rollout[BipedEnvState],
    env: BipedEnv,
    params: BipedEnvParams,
    name: str,
    scale: Scale | None = None,
) -> Episode:
    """One episode (not a batch). Forces and power are those at the end of each control step; a step
    in which the foot moved at all counts as slipping. Events are located to the step."""
    rollout = rollout.trimmed()
    states, infos = episodes.samples(rollout)
    frames = biped_frames(states, infos, params)
    robot = drawn_robot(rollout.start_state.drawn, params)
    commanded = np.asarray(states.drawn.mean_rate, float)
    moments = jax.vmap(lambda phase: robot.inertia.at(phase).P)(states.biped.phase)
    momentum = np.asarray(moments * states.biped.crank_rate, float)  # without a slide's
    cruise = float(robot.total_mass * robot.step_length) * commanded / np.pi
    panels = walk_panels(frames, momentum, float(params.torque_limit), commanded, cruise)
    terms = {one: episodes.from_start(rollout.info[f"reward_{one}"]) for one in TERMS}
    last = rollout.info
    whole = [
        ("return", float(last["episode_return"][-1]), "-"),
        ("walked", float(last["episode_walked"][-1]), "m"),
        ("distance slid", 1e3 * float(infos["episode_slid"][-1]), "mm"),
        ("energy", float(last["episode_energy"][-1]), "J"),
    ]
    return Episode(
        **vars(biped_picture(frames, robot.params)),
        name=name,
        period=float(params.control_period),
        panels=(*panels, *episodes.reward_panels(rollout, terms, "-", scale)),
        events=_events(frames),
        facts=episodes.facts([*whole, *_drawn(rollout.start_state.drawn, params)]),
    )


def _drawn(drawn: Drawn, params: BipedEnvParams) -> list[tuple[str, float, str]]:
    """What the reset drew for this episode."""
    units = {"friction": "× the floor's", "mass": "× the robot's", "payload": "kg", "robot": "-"}
    there = [name for name in units if getattr(params.randomisation, name) is not None]
    return [(f"{name}, drawn", float(getattr(drawn, name)), units[name]) for name in there]


def _events(frames: BipedFrame) -> tuple[Event, ...]:
    """Slips, stops and exchanges of support by the control step, and an early end."""
    steps, slide = frames.steps, frames.slide
    at = (np.flatnonzero(np.diff(steps)) + 1).tolist()
    exchanges = (Event(i, "support", f"step {steps[i]}: the legs change support") for i in at)

    def begins(i: int) -> str:
        return f"slips {'forwards' if slide[i] > slide[i - 1] else 'backwards'}"

    return episodes.slip_events(frames.slips, begins, "sticks", frames.ended, *exchanges)
