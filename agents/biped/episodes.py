"""What is measured of the biped's episodes, and their plots and pages."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.table import (
    Column,
    Columns,
    Measures,
    fraction_interval,
    mean_interval,
    ratio_interval,
)
from stickslip.agents.pictures import episodes
from stickslip.envs.biped.picture import BipedFrame, biped_frames, biped_picture
from stickslip.envs.biped.state import BipedEnvState, Drawn, cost_of, drawn_robot, fell
from stickslip.envs.rendering.page import Episode, Event, Line, Panel

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.tasks.known import Scale

MIN_DISTANCE = 0.1
"""Mean distance per episode below which nothing is said per metre (NaN) [m]."""
KEPT = {
    "reward": "-",
    "duration": "s",
    "turned": "rad",
    "walked": "m",
    "slid": "m",
    "energy": "J",
    "weight": "N",
}
"""Units of what is kept of an episode."""


class Episodes(NamedTuple):
    """Kept data of each episode in the units of KEPT; every entry [episodes].

    reward: sum. duration: control steps times control period. turned: crank angle. walked: way of
    the hip, forwards positive. slid: way of the feet over the floor, either direction. energy:
    positive motor work and copper loss. status: of the last step.
    """

    reward: Array | np.ndarray
    duration: Array | np.ndarray
    turned: Array | np.ndarray
    walked: Array | np.ndarray
    slid: Array | np.ndarray
    energy: Array | np.ndarray
    weight: Array | np.ndarray
    status: Array | np.ndarray

    @property
    def fell(self) -> Array | np.ndarray:
        """Ended by a status outside the model (topple, lift-off, runaway, ...)."""
        return fell(jnp.asarray(self.status))

    @property
    def cost(self) -> Array | np.ndarray:
        """Sum of info["cost"] [m]."""
        return cost_of(jnp.asarray(self.slid), jnp.asarray(self.status))


COLUMNS: Columns[Episodes] = {
    "return": (Column("return", "-", 2), lambda e: mean_interval(e.reward)),
    "mean_speed": (Column("speed", "m/s", 3), lambda e: mean_interval(e.walked / e.duration)),
    "mean_crank_rate": (
        Column("crank rate", "rad/s", 2),
        lambda e: mean_interval(e.turned / e.duration),
    ),
    "slip_per_metre": (
        Column("slip", "m/m", 4),
        lambda e: ratio_interval(e.slid, e.walked, MIN_DISTANCE),
    ),
    "energy_per_metre": (
        Column("energy", "J/m", 1),
        lambda e: ratio_interval(e.energy, e.walked, MIN_DISTANCE),
    ),
    "cost_of_transport": (
        Column("transport", "-", 3),
        lambda e: ratio_interval(
            e.energy, e.weight * e.walked, MIN_DISTANCE * float(np.mean(e.weight))
        ),
    ),
    "falls": (Column("falls", "%", 0, percent=True), lambda e: fraction_interval(e.fell)),
    "duration": (Column("length", "s", 1), lambda e: mean_interval(e.duration)),
}


def keep_of(played: Rollout[BipedEnvState], params: BipedEnvParams) -> Episodes:
    """Kept data of an episode."""
    last = jax.tree.map(lambda leaf: leaf[-1], played.state)
    robot = drawn_robot(last.drawn, params)
    totals = last.totals
    return Episodes(
        **totals._asdict(),
        duration=last.elapsed * jnp.asarray(params.control_period, totals.reward.dtype),
        weight=robot.total_mass * robot.gravity,
        status=played.info["status"][-1],
    )


def measures(env: BipedEnv) -> Measures[BipedEnvState, BipedEnvParams, Episodes]:
    """See Machine; the same of every environment."""
    cost = Column("cost", "m", 3), lambda e: mean_interval(e.cost)
    return Measures(keep_of, COLUMNS, KEPT, cost)


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
    use = np.minimum(at.friction_use, CEILING)
    slides = Line("distance slid, either direction", 1e3 * at.slid)
    return (
        episodes.panel("motor torque", "N m", torque, limits=limits, steps=True),
        episodes.panel("motor power, torque × crank rate", "W", torque * at.crank_rate),
        episodes.beside(RATE, "rad/s", Line(RATE, at.crank_rate), "commanded mean", commanded),
        episodes.beside(
            MOMENTUM, "kg m/s", Line("momentum", momentum), "at the commanded mean speed", cruise
        ),
        episodes.beside(
            "friction used", "-", Line("|friction| / normal", use), "static friction", mu
        ),
        episodes.beside(SLIDING, "mm", slides, "slide, forwards +", 1e3 * at.slide, dashed=False),
    )


@jax.jit
def momentum_of(robot: BipedModel, states: BipedState) -> Array:
    """P(theta) x crank rate [n]: horizontal momentum without a slide's [kg m/s]."""
    return jax.vmap(lambda one: robot.inertia.at(one.phase).P * one.crank_rate)(states)


def as_episode(
    played: Rollout[BipedEnvState],
    env: BipedEnv,
    params: BipedEnvParams,
    name: str,
    scale: Scale | None = None,
) -> Episode:
    """One episode (not a batch). Forces and power are those at the end of each control step; a step
    in which the foot moved at all counts as slipping. Events are located to the step."""
    played = played.trimmed()
    states, infos = episodes.samples(played)
    frames = biped_frames(states, infos, params)
    robot = drawn_robot(played.start_state.drawn, params)
    commanded = np.asarray(states.drawn.mean_rate, float)
    panels = walk_panels(
        frames,
        np.asarray(momentum_of(robot, states.biped), float),
        float(params.torque_limit),
        commanded,
        float(robot.total_mass * robot.step_length) * commanded / np.pi,
    )
    terms = {one: episodes.from_start(played.info[f"reward_{one}"]) for one in TERMS}
    last = played.info
    whole = episodes.facts(
        [
            ("return", float(last["episode_return"][-1]), "-"),
            ("walked", float(last["episode_walked"][-1]), "m"),
            ("distance slid", 1e3 * float(infos["episode_slid"][-1]), "mm"),
            ("energy", float(last["episode_energy"][-1]), "J"),
        ]
    )
    return Episode(
        **vars(biped_picture(frames, robot.params)),
        name=name,
        period=float(params.control_period),
        panels=(*panels, *episodes.reward_panels(played, terms, "-", scale)),
        events=_events(frames),
        facts=(*whole, *_drawn(played.start_state.drawn, params)),
    )


def _drawn(drawn: Drawn, params: BipedEnvParams) -> tuple[tuple[str, str], ...]:
    """Floor and load that the reset drew for this episode, as pictures show them."""
    ranges, rows = params.randomisation, []
    if ranges.friction is not None:
        rows.append(("friction, drawn", float(drawn.friction), "× the floor's"))
    if ranges.mass is not None:
        rows.append(("masses, drawn", float(drawn.mass), "× the robot's"))
    if ranges.payload is not None:
        rows.append(("payload, drawn", float(drawn.payload), "kg"))
    return episodes.facts(rows)


def _events(frames: BipedFrame) -> tuple[Event, ...]:
    """Slips, stops and exchanges of support by the control step, and an early end."""
    steps, slide = frames.steps, frames.slide
    exchanges = (
        Event(i, "support", f"step {steps[i]}: the legs change support")
        for i in (np.flatnonzero(np.diff(steps)) + 1).tolist()
    )

    def begins(i: int) -> str:
        return f"slips {'forwards' if slide[i] > slide[i - 1] else 'backwards'}"

    return episodes.slip_events(frames.slips, begins, "sticks", frames.ended, *exchanges)
