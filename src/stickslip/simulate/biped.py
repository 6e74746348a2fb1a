"""`stickslip simulate biped`: walk under a torque, print a summary, write rows and a picture."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.biped.task import floor_words
from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics import PRESETS, Scene, recommend
from stickslip.dynamics.biped import (
    FIDELITIES,
    INTEGRATORS,
    SUPPORT_START,
    BipedState,
    EventExact,
)
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.scene import SceneOptions
from stickslip.optim.columns import columns_of
from stickslip.optim.progress import say_stage
from stickslip.optimise.machine import robot_of
from stickslip.parser import options_of
from stickslip.records.table import Content
from stickslip.simulate.flags import STATUS, WalkOptions
from stickslip.simulate.output import Files, film_walk, plot_walk, print_summary
from stickslip.simulate.torque import Recorded, torque_of
from stickslip.simulate.walk import (
    WHOLE,
    event_table,
    periods,
    walk_summary,
    walk_table,
    walked,
)

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from stickslip.dynamics import Setting
    from stickslip.dynamics.biped.recommendation import Recommendation
    from stickslip.simulate.walk import Walk

SECONDS = 6.0
"""Walked unless something else is said."""
MANY = 20_000
"""Periods of a walk that takes seconds to compute."""


def simulate_command(flags: Mapping[str, Any]) -> Content:
    """Walk, print the summary and write the rows; NOTHING_FOUND where the walk ends early.

    Whatever is wrong is refused before anything is computed. A walk that ends early is written as
    far as it went.
    """
    given = options_of(WalkOptions, flags)
    torque = torque_of(given.torque, columns_of(given.columns))
    found = None if given.tolerance is None else recommend(given.tolerance, scene_of(given))
    setting, state = setting_of(given, found), state_of(given)
    with precision(setting.dtype):  # or the floor's and the robot's numbers would be rounded
        scene, robot = scene_of(given), robot_of(given)
    seconds = given.seconds
    if seconds is None:
        seconds = torque.end if isinstance(torque, Recorded) else SECONDS
    count, _ = periods(seconds, given.period)
    files = Files.of(given, seconds)
    if count > MANY:
        say_stage(f"walking {count} periods")
    walk = walked(robot, scene, state, torque, seconds, given.period, setting)
    if not walk.count:
        raise ValueError(
            f"--torque {given.torque}: {STATUS[walk.status.name]}; accepted: one whose first "
            "period is finite; nothing is written"
        )
    summary = walk_summary(walk, seconds)
    promise = None if found is None or found.setting != setting else promise_of(found, walk)
    print_summary(summary, promise)

    def plot(path: Path) -> None:
        title = f"Torque {shorten(given.torque, 60)}, floor: {floor_words(scene)}"
        plot_walk(walk, path, title)

    written = files.write(walk_table(walk), plot, partial(film_walk, walk))
    about = {"setting": _content(setting), "files": written}
    about |= {} if promise is None else {"promise": promise}
    status = OK if walk.status.name in WHOLE else NOTHING_FOUND
    return Content({"summary": summary, "events": event_table(walk)}, about, status=status)


def scene_of(given: WalkOptions) -> Scene:
    """The floor, the load and the outputs. ValueError for flags that contradict each other."""
    static, kinetic, edges = given.mu_static, given.mu_kinetic, given.edges
    options = SceneOptions(
        payload=given.payload,
        steps="one" if given.one_step else "continuous",
        outputs="joints" if given.joints else "forces",
    )
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
        raise ValueError(
            "several numbers of friction without --edges; accepted: one number, or --edges too, "
            "one fewer of them than numbers"
        )
    return Scene.uniform(static[0], kinetic[0] if kinetic else None, **options)


def setting_of(given: WalkOptions, recommended: Recommendation | None) -> Setting:
    """Setting of the walk. ValueError for flags that contradict each other."""
    if recommended is not None and given.setting is not None:
        raise ValueError(f"--setting {given.setting} with --tolerance; accepted: one of them")
    found = PRESETS[given.setting or "exact"] if recommended is None else recommended.setting
    if given.fidelity is not None:
        found = replace(found, fidelity=FIDELITIES[given.fidelity])
    if given.integrator is not None:
        found = replace(found, integrator=INTEGRATORS[given.integrator], dt=PRESETS["fast"].dt)
    if given.step is not None:
        if isinstance(found.integrator, EventExact):
            raise ValueError(
                "step with the integrator event_exact, which chooses its own steps; accepted: "
                "another integrator"
            )
        found = replace(found, dt=given.step)
    return found if given.dtype is None else replace(found, dtype=given.dtype)


def state_of(given: WalkOptions) -> BipedState:
    """Initial state of the walk."""
    return BipedState(
        phase=np.float64(SUPPORT_START if given.phase is None else given.phase),
        crank_rate=np.float64(given.crank_rate),
        foot_velocity=np.float64(given.foot_velocity),
    ).validate()


def promise_of(found: Recommendation, walk: Walk) -> str:
    """Promise of the setting for --tolerance, and whether it covers the walk."""
    times = walk.trajectory.states.time
    covered = found.covers(walk.amplification, float(times[-1] - times[0]))
    share = f"within {found.promised_error:.2g} rad/s on {100 * found.quantile:g} % of walks"
    return f"{share}; it {'covers' if covered else 'does not cover'} this one"


def _content(setting: Setting) -> dict[str, str | float | None]:
    exact = isinstance(setting.integrator, EventExact)
    found = {name: repr(getattr(setting, name)) for name in ("fidelity", "integrator")}
    return {**found, "step": None if exact else setting.dt, "dtype": setting.dtype}
