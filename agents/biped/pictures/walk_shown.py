"""A simulated walk as a page shows it: one of the suite's, under torques or a feedback."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.pictures.shown import LEAST_SLID, Course, events_of
from stickslip.agents.biped.pictures.switching import Switch, accuracy_of, sliding_spans
from stickslip.agents.reports.course import from_start
from stickslip.dynamics.biped.stepping.integrators import RK4Split
from stickslip.dynamics.status import EventKind, Status
from stickslip.envs.biped.picture import under_foot
from stickslip.envs.rendering import BipedFrame
from stickslip.envs.rendering.biped.drawn import biped_drawing
from stickslip.envs.rendering.html.data import Shown
from stickslip.optim.instances.biped.gains import Gains
from stickslip.optim.instances.biped.shooting import DT, TORQUE_LIMIT, Shooting
from stickslip.optim.instances.instance import DRAWS_FROM

if TYPE_CHECKING:
    from stickslip.dynamics.biped import BipedModel, Trajectory
    from stickslip.dynamics.scene import Scene
    from stickslip.optim.function_problem import FunctionProblem


class Walked(NamedTuple):
    """A walk of the suite. commanded: the crank rate that it is to have [rad/s]."""

    walk: Trajectory
    robot: BipedModel
    scene: Scene
    commanded: float
    integrator: RK4Split
    facts: tuple[tuple[str, str], ...] = ()


def walk_of(problem: FunctionProblem, x: np.ndarray) -> Walked | None:
    """The walk that a decision vector makes; None where the problem is about none.

    Of a feedback that is judged by many walks it is the first one.
    """
    function = problem.function
    if not isinstance(function, Shooting | Gains):
        return None
    integrator = replace(function.integrator or RK4Split(), record_events=True)
    recording = replace(function, integrator=integrator)
    with jax.enable_x64(True):
        if isinstance(recording, Shooting):
            robot, scene, _ = problem.data
            walk = recording.walk(problem.data, jnp.asarray(x))
            return Walked(walk, robot, scene, recording.crank_rate, integrator)
        key = recording.keys(DRAWS_FROM)[0]
        walk, scene = recording.walk(problem.data, jnp.asarray(x), key)
        facts = (("shown", "one of the walks that the value is the mean of"),)
        return Walked(walk, problem.data, scene, recording.crank_rate, integrator, facts)


def walk_shown(walked: Walked, name: str) -> Shown:
    """The walk, from control step to control step as far as the model goes."""
    walk, robot, scene, commanded, integrator, facts = walked
    with jax.enable_x64(True):
        places, friction = jax.vmap(lambda state: under_foot(robot, scene.floor, state))(
            walk.states
        )
        switches = _switches(walk)
    walk, places, friction = jax.tree.map(np.asarray, (walk, places, friction))
    over = np.flatnonzero(walk.contacts.status > Status.SLIP_ONSET)
    count = int(over[0]) + 1 if len(over) else len(walk.torques)
    contacts = jax.tree.map(lambda leaf: from_start(leaf[:count]), walk.contacts)
    states = jax.tree.map(lambda leaf: leaf[: count + 1], walk.states)
    slid = np.cumsum(np.nan_to_num(contacts.slide_distance), dtype=np.float64)
    slips = np.nan_to_num(contacts.slide_distance) > LEAST_SLID
    slips |= np.nan_to_num(contacts.mode) != 0
    torque = from_start(walk.torques[:count])
    rate = np.asarray(states.crank_rate, float)
    mean = np.cumsum(rate) / np.arange(1, count + 2)
    frames = [
        BipedFrame(
            phase=float(states.phase[i]),
            steps=int(states.steps[i]),
            floor_position=float(places[i]),
            slide=float(states.foot_position[i]),
            crank_rate=float(rate[i]),
            foot_velocity=float(states.foot_velocity[i]),
            time=i * DT,
            torque=float(torque[i]) if i else 0.0,
            friction_force=float(contacts.friction_force[i]) if i else 0.0,
            normal_force=float(contacts.normal_force[i]) if i else 0.0,
            zmp=float(contacts.zmp[i]) if i else 0.0,
            mu_static=None if friction[0] is None else float(friction[0][i]),
            mu_kinetic=None if friction[1] is None else float(friction[1][i]),
            sticking=not slips[i],
            mean_crank_rate=float(mean[i]),
            commanded_rate=commanded,
        )
        for i in range(count + 1)
    ]
    with jax.enable_x64(True):
        drawing, hip = biped_drawing(frames, robot.params, scene, slips)
    way = hip - hip[0]
    course = Course(
        torque=torque,
        rate=rate,
        commanded=np.full(count + 1, commanded),
        friction=contacts.friction_force,
        normal=contacts.normal_force,
        slide=np.asarray(states.foot_position, float),
        slid=slid,
        limit=TORQUE_LIMIT,
    )
    status = Status(int(walk.contacts.status[count - 1]))
    ended = status.name.lower().replace("_", " ") if len(over) else ""
    switches = [one for one in switches if one.step <= count]
    return Shown(
        name=name,
        period=DT,
        panels=course.panels(frames),
        events=events_of(switches, frames, slips, ended),
        numbers=course.numbers(way),
        slips=slips,
        spans=sliding_spans(switches, frames[-1].time),
        drawing=drawing,
        ended=ended,
        facts=(
            ("walked", f"{way[-1]:.4g} m"),
            ("distance slid", f"{1e3 * slid[-1]:.4g} mm"),
            *facts,
        ),
        timing=f"Times of events {accuracy_of(integrator, DT)}.",
    )


def _switches(walk: Trajectory) -> list[Switch]:
    """What its integrator wrote down."""
    velocity = np.asarray(walk.states.foot_velocity, float)
    slide = np.asarray(walk.states.foot_position, float)
    found = []
    for time, name, _ in walk.events():
        kind = EventKind[name.upper()]
        step = min(max(int(np.ceil(time / DT - 1e-9)), 1), len(velocity) - 1)
        moved = velocity[step] or slide[step] - slide[step - 1]
        way = int(np.sign(moved)) if kind == EventKind.SLIP else 0
        turns = int(walk.states.steps[step]) - int(walk.states.steps[step - 1])
        found.append(
            Switch(time, kind, step, int(np.sign(turns)) if kind == EventKind.EXCHANGE else way)
        )
    return found
