"""`stickslip simulate biped`: walk under a torque, print a summary, write rows and a picture."""

from argparse import Namespace
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from stickslip.agents.biped.episodes import walk_panels
from stickslip.agents.biped.task import floor_words
from stickslip.agents.pictures.episodes import draw_panels, write_pictures
from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics import PRESETS, Scene
from stickslip.dynamics.biped import SUPPORT_START, BipedParams, BipedState, EventExact
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.scene import Grip, SceneOptions
from stickslip.envs.biped.picture import BipedFrame, biped_picture, slipping, stretches_of
from stickslip.envs.rendering.scene import paint
from stickslip.envs.rendering.sheet import save_sheet
from stickslip.optim.progress import say_stage
from stickslip.records.table import Column, Content, Table
from stickslip.report import require_files, show, write_simulation
from stickslip.simulate import walk as walks
from stickslip.simulate.torque import Recorded, rate_of, torque_of

SECONDS = 6.0
"""Walked unless something else is said."""
FPS = 25.0
"""Pictures a second of a film."""


def simulate_command(flags: Mapping[str, Any]) -> Content:
    """Walk, print the summary and write the rows; NOTHING_FOUND where the walk ends early."""
    given = Namespace(**flags)
    law = law_of(given)
    setting, state = PRESETS[given.setting], state_of(given)
    with precision(setting.dtype):  # or the floor's and the robot's numbers would be rounded
        scene = scene_of(given)
        robot, motor = BipedParams.with_motor(given.robot, given.changes)
    seconds = given.seconds
    if seconds is None:
        file = law.rate if isinstance(law, walks.Rates) else law
        seconds = file.end if isinstance(file, Recorded) else SECONDS
    count, _ = walks.periods(seconds, given.period)
    require_files(given, seconds)
    if count > 20_000:  # takes seconds
        say_stage(f"walking {count} periods")

    def again(scene: Scene) -> walks.Walk:
        return walks.walked(robot, scene, state, law, seconds, given.period, setting, motor)

    walk = again(scene)
    if not walk.count:
        raise ValueError(
            f"{_law_in_words(given)} is not finite in the first period; accepted: finite numbers"
        )
    held, kinds = walk, {kind for _, kind, _ in walk.trajectory.events()}
    if "slip" in kinds or np.any(walk.trajectory.contacts.slide_distance):
        held = again(replace(scene, floor=Grip()))  # as with a foot that cannot slip
    summary = walks.walk_summary(walk, held, seconds, motor.get("efficiency"))
    show(summary)

    def plot(path: Path) -> None:
        words = _law_in_words(given)[2:].capitalize()
        title = f"{words}, floor: {floor_words(scene)}, status: {walk.status.name}"
        at = frames_of(walk)
        panels = walk_panels(at, walk.along.momentum)
        save_sheet(draw_panels(panels, at.time, "time [s]", title, at.slips), path)

    def film(path: Path) -> None:
        draw = partial(paint, biped_picture(frames_of(walk), walk.robot.params))
        write_pictures(draw, walk.count, walk.period, path, FPS, progress=True)

    written = write_simulation(given, walks.walk_table(walk), plot, film)
    found = {name: repr(getattr(setting, name)) for name in ("fidelity", "integrator")}
    step = None if isinstance(setting.integrator, EventExact) else setting.dt
    about = {"setting": {**found, "step": step, "dtype": setting.dtype}, "files": written}
    heads = [Column("time", "s"), Column("event", words=True), Column("crank_angle", "rad")]
    tables = {"summary": summary, "events": Table(heads, walk.trajectory.events())}
    status = OK if walk.status.name in walks.WHOLE else NOTHING_FOUND
    return Content(tables, about, status=status)


def law_of(given: Namespace) -> walks.Torque | walks.Rates:
    """What moves the crank. ValueError for neither or both of --torque and --rate."""
    if (given.torque is None) == (given.rate is None):
        raise ValueError("accepted: one of --torque TORQUE and --rate RATE")
    if given.torque is not None:
        return torque_of(given.torque)
    if given.crank_rate is not None:
        raise ValueError("--crank-rate with --rate, which begins the walk; accepted: one of them")
    return walks.Rates(rate_of(str(given.rate)))


def _law_in_words(given: Namespace) -> str:
    name = "rate" if given.torque is None else "torque"
    return f"--{name} {shorten(str(getattr(given, name)), 60)}"


def scene_of(given: Namespace) -> Scene:
    """The floor, the load and the outputs. ValueError for flags that contradict each other."""
    static, kinetic, edges = given.mu_static, given.mu_kinetic, given.edges
    options = SceneOptions(payload=given.payload, outputs="joints" if given.joints else "forces")
    if static is None:
        for flag, value in (("--mu-kinetic", kinetic), ("--edges", edges)):
            if value is not None:
                raise ValueError(f"{flag} without --mu-static; accepted: both, or neither")
        return Scene.named(given.scene or "slippery", **options)
    if given.scene is not None:
        raise ValueError(
            f"--scene {given.scene} with --mu-static; accepted: one of them, both say which floor"
        )
    if edges is not None:
        return Scene.patches(edges, static, kinetic, **options)
    if len(static) > 1 or len(kinetic or ()) > 1:
        accepted = "one number, or --edges too, one fewer of them than numbers"
        raise ValueError(f"several numbers of friction without --edges; accepted: {accepted}")
    return Scene.uniform(static[0], kinetic[0] if kinetic else None, **options)


def state_of(given: Namespace) -> BipedState:
    """Initial state of the walk."""
    return BipedState(
        phase=np.float64(SUPPORT_START if given.phase is None else given.phase),
        crank_rate=np.float64(given.crank_rate or 0.0),
        foot_velocity=np.float64(given.foot_velocity),
    ).validate()


def frames_of(walk: walks.Walk) -> BipedFrame:
    """The walk's numbers at every state; at the start there are no forces yet."""
    states, contacts, along = walk.trajectory.states, walk.trajectory.contacts, walk.along
    torques, slid = walk.trajectory.torques, np.asarray(contacts.slide_distance, float)
    names = ("friction_force", "normal_force", "zmp")
    forces: dict[str, Any] = {one: np.append(0.0, getattr(contacts, one)) for one in names}
    return BipedFrame(
        phase=states.phase,
        floor=stretches_of(walk.scene.floor),
        weight=float(walk.robot.total_mass * walk.robot.gravity),
        steps=states.steps,
        floor_position=along.ankle,
        slide=states.foot_position,
        slid=np.append(0.0, np.cumsum(slid)),
        crank_rate=states.crank_rate,
        time=states.time - states.time[0],
        torque=np.append(torques[0], torques),
        **forces,
        mu_static=along.mu_static,
        mu_kinetic=along.mu_kinetic,
        slips=np.append(False, slipping(contacts.mode, slid)),
        walked=along.mass - along.mass[0],
        ended=walk.status.words if walk.status.terminal else "",
    )
