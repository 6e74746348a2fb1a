"""Pictures and films of simulations. Needs the extra `viz`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.agents.biped.pictures import LEAST_SLID, Course
from stickslip.agents.pictures.film import write_pictures
from stickslip.agents.pictures.plots import plot_panels
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.biped import BipedFrame, BipedRenderer
from stickslip.envs.rendering.ugv import UGVRenderer
from stickslip.envs.ugv.picture import station_frames
from stickslip.optim.posture.problem import refined

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.envs.rendering.ugv import UGVFrame
    from stickslip.optim import PostureProblem
    from stickslip.simulate.walk import Walk

FPS = 25.0
"""Pictures a second."""
SPEED = 1.0
"""At which a drive is shown [m/s]; its statics know no time."""


def plot_walk(walk: Walk, path: Path, title: str) -> Path:
    """Plot torque, crank rate, P w, friction used and distance slid; return the path."""
    states = jax.tree.map(lambda leaf: leaf[1:], walk.trajectory.states)
    contacts, time = walk.trajectory.contacts, np.asarray(states.time)
    course = Course(
        torque=np.asarray(walk.trajectory.torques),
        rate=np.asarray(states.crank_rate),
        momentum=walk.along.momentum[1:],
        friction=np.asarray(contacts.friction_force),
        normal=np.asarray(contacts.normal_force),
        mu_static=walk.along.mu_static[1:],
        slide=np.asarray(states.foot_position),
        slid=np.cumsum(contacts.slide_distance, dtype=np.float64),
    )
    slips = np.asarray(contacts.slide_distance) > LEAST_SLID
    return plot_panels(course.panels(), time, "time [s]", path, title, slips)


def film_walk(walk: Walk, path: Path) -> Path:
    """Write a film of the walk in real time; return the path."""
    states, contacts = walk.trajectory.states, walk.trajectory.contacts
    time = np.asarray(states.time - states.time[0])
    turned = np.asarray(states.crank_angle) - np.asarray(states.crank_angle)[0]

    def frame(i: int) -> BipedFrame:
        ended = i == walk.count and walk.status.terminal
        row = max(i - 1, 0)  # at the start there are no forces yet
        names = ("friction_force", "normal_force", "zmp")
        forces: dict[str, Any] = {
            one: float(getattr(contacts, one)[row]) * (i > 0) for one in names
        }
        return BipedFrame(
            phase=states.phase[i],
            steps=states.steps[i],
            floor_position=walk.along.ankle[i],
            slide=states.foot_position[i],
            crank_rate=states.crank_rate[i],
            time=time[i],
            torque=walk.trajectory.torques[row],
            **forces,
            mu_static=walk.along.mu_static[i],
            mu_kinetic=walk.along.mu_kinetic[i],
            sticking=i == 0 or contacts.mode[row] == 0,
            mean_crank_rate=turned[i] / time[i] if time[i] > 0 else states.crank_rate[0],
            status=walk.status.name if ended else Status.OK.name,
            walked=walk.along.mass[i] - walk.along.mass[0],
        )

    renderer = BipedRenderer(walk.robot.params, walk.scene)
    return write_pictures(renderer, frame, walk.count, walk.period, path, FPS, progress=True)


def film_drive(problem: PostureProblem, x: np.ndarray, path: Path) -> Path:
    """Write a film of the drive at SPEED, legs turning evenly between waypoints; return the path.

    The header has the largest torque so far.
    """
    length, last = float(problem.x[-1] - problem.x[0]), len(problem.x) - 1
    fine, angles = refined(problem, x, max(1, round(FPS * length / SPEED / last)))
    stations, last = fine.stations(angles), len(fine.x) - 1
    largest = np.maximum.accumulate(np.abs(stations.torque))
    friction = np.broadcast_to(fine.posture.friction, len(fine.x))

    def frame(i: int) -> UGVFrame:
        at = stations.map(lambda of: np.asarray(of)[i : i + 1])
        about = fine.posture.odometer, friction[i : i + 1], fine.posture.params, fine.solver
        with jax.enable_x64(True):
            found = station_frames(at, largest[i : i + 1], *about)
        return replace(found, start=float(fine.x[0]))

    renderer = UGVRenderer(problem.params, "largest torque", "N m")
    period = length / SPEED / last
    return write_pictures(renderer, frame, last, period, path, FPS, progress=True)
