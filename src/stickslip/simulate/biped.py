"""`stickslip simulate biped`: walk under a torque, print a summary, write rows and a picture."""

from __future__ import annotations

from dataclasses import replace
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
    BipedParams,
    BipedState,
    EventExact,
)
from stickslip.dynamics.biped.settings import precision
from stickslip.dynamics.scene import SceneOptions
from stickslip.optim.columns import columns_of
from stickslip.optim.progress import say_stage
from stickslip.parser import options_of
from stickslip.records.table import Content
from stickslip.simulate.flags import WalkOptions
from stickslip.simulate.output import STATUS, output_paths, print_summary, write_table
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

    from stickslip.dynamics import Setting
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
    setting, state = setting_of(given), state_of(given)
    with precision(setting.dtype):  # or the floor's and the robot's numbers would be rounded
        scene, robot = scene_of(given), BipedParams.from_bars()
    seconds = given.seconds
    if seconds is None:
        seconds = torque.end if isinstance(torque, Recorded) else SECONDS
    count, _ = periods(seconds, given.period)
    out, picture, film = output_paths(given.out, given, seconds)
    if count > MANY:
        say_stage(f"walking {count} periods")
    walk = walked(robot, scene, state, torque, seconds, given.period, setting)
    if not walk.count:
        raise ValueError(
            f"--torque {given.torque}: {STATUS[walk.status.name]}; accepted: one whose first "
            "period is finite; nothing is written"
        )
    summary, promise = walk_summary(walk, seconds), promise_of(given, setting, walk)
    print_summary(summary, promise)
    written = [write_table(out, walk_table(walk), given.overwrite)]
    if picture is not None:
        from stickslip.simulate.picture import plot_walk

        title = f"Torque {shorten(given.torque, 60)}, floor: {floor_words(scene)}"
        written.append(plot_walk(walk, scene, picture, title))
    if film is not None:
        from stickslip.simulate.picture import film_walk

        written.append(film_walk(walk, scene, film))
    print(f"Written: {', '.join(map(str, written))}")
    about = {"setting": _content(setting), "files": list(map(str, written))}
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


def setting_of(given: WalkOptions) -> Setting:
    """Setting of the walk. ValueError for flags that contradict each other."""
    if given.tolerance is not None:
        if given.setting is not None:
            raise ValueError(f"--setting {given.setting} with --tolerance; accepted: one of them")
        found = recommend(given.tolerance, scene_of(given)).setting
    else:
        found = PRESETS[given.setting or "exact"]
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


def promise_of(given: WalkOptions, setting: Setting, walk: Walk) -> str | None:
    """Promise of the setting for --tolerance, and whether it covers the walk; None without."""
    if given.tolerance is None:
        return None
    found = recommend(given.tolerance, scene_of(given))
    if setting != found.setting:
        return None
    times = walk.trajectory.states.time
    covered = found.covers(walk.amplification, float(times[-1] - times[0]))
    share = f"within {found.promised_error:.2g} rad/s on {100 * found.quantile:g} % of walks"
    return f"{share}; it {'covers' if covered else 'does not cover'} this one"


def _content(setting: Setting) -> dict[str, str | float | None]:
    exact = isinstance(setting.integrator, EventExact)
    found = {name: repr(getattr(setting, name)) for name in ("fidelity", "integrator")}
    return {**found, "step": None if exact else setting.dt, "dtype": setting.dtype}
