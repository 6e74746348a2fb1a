"""`stickslip simulate biped`: walk under a torque, print what came of it, write rows, picture."""

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
from stickslip.dynamics.checks import require_number
from stickslip.dynamics.scene import SceneOptions
from stickslip.optim.columns import columns_of
from stickslip.optim.progress import Bar
from stickslip.parser import options_of
from stickslip.records.table import Content
from stickslip.simulate.flags import WalkOptions
from stickslip.simulate.output import output_paths, print_summary, write_table
from stickslip.simulate.torque import Recorded, torque_of
from stickslip.simulate.walk import periods, walked
from stickslip.simulate.walk_table import (
    WHOLE,
    event_table,
    meaning_of,
    walk_summary,
    walk_table,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.dynamics import Setting
    from stickslip.simulate.walk import Walk

SECONDS = 6.0
"""Walked unless something else is said."""


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
    if given.joints:
        scene = replace(scene, outputs="joints")
    seconds = given.seconds
    if seconds is None:
        seconds = torque.end if isinstance(torque, Recorded) else SECONDS
    count, _ = periods(seconds, given.period)
    out, picture = output_paths(given.out, given)
    with Bar("walking", 2 * count, "period", True) as bar:
        walk = walked(robot, scene, state, torque, seconds, given.period, setting, bar)
    if not walk.count:
        raise ValueError(
            f"--torque {given.torque}: {meaning_of(walk)}; accepted: one whose first period is "
            "finite; nothing is written"
        )
    summary, promise = walk_summary(walk, seconds), promise_of(given, setting, walk)
    print_summary(summary, promise)
    written = [write_table(out, walk_table(walk), given.overwrite)]
    if picture is not None:
        from stickslip.simulate.picture import plot_walk

        written.append(plot_walk(walk, scene, picture, _title(given.torque, scene, walk)))
    print(f"Written: {', '.join(map(str, written))}")
    about = {"setting": _in_words(setting), "files": list(map(str, written))}
    about |= {} if promise is None else {"promise": promise}
    status = OK if walk.status.name in WHOLE else NOTHING_FOUND
    return Content({"summary": summary, "events": event_table(walk)}, about, status=status)


def _title(torque: str, scene: Scene, walk: Walk) -> str:
    """Title of the picture: a number with its unit; a file or arithmetic as it was given."""
    try:
        text = f"{float(torque):g} N m"
    except ValueError:
        text = shorten(torque, 60)
    title = f"Torque {text}, floor: {floor_words(scene)}"
    if walk.status.name in WHOLE:
        return title
    gone = float(walk.trajectory.final.time - walk.trajectory.states.time[0])
    return f"{title}: {walk.status.name} after {gone:.3g} s"


def scene_of(given: WalkOptions) -> Scene:
    """The floor and the load. ValueError for flags that contradict each other."""
    static, kinetic, edges = given.mu_static, given.mu_kinetic, given.edges
    ratio = given.kinetic_ratio
    options = SceneOptions(payload=given.payload, steps="one" if given.one_step else "continuous")
    if static is None:
        others = {"--mu-kinetic": kinetic, "kinetic_ratio": ratio, "--edges": edges}
        for flag, value in others.items():
            if value is not None:
                raise ValueError(f"{flag} without --mu-static; accepted: both, or neither")
        return Scene.named(given.scene or "slippery", **options)
    if given.scene is not None:
        raise ValueError(
            f"--scene {given.scene} with --mu-static; accepted: one of them, both say which floor"
        )
    if ratio is not None:
        if kinetic is not None:
            raise ValueError("--mu-kinetic with kinetic_ratio; accepted: one of them")
        require_number("kinetic_ratio", ratio, low=0.0, high=1.0, accepted="a share, 0 to 1")
        kinetic = [ratio * one for one in static]
    if edges is not None:
        return Scene.patches(edges, static, kinetic, **options)
    moving = None if kinetic is None else _one("--mu-kinetic", kinetic)
    return Scene.uniform(_one("--mu-static", static), moving, **options)


def _one(flag: str, values: Sequence[float]) -> float:
    if len(values) == 1:
        return values[0]
    raise ValueError(
        f"{flag} {' '.join(f'{one:g}' for one in values)} without --edges; accepted: one number, "
        "or --edges too, one fewer of them than numbers"
    )


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
    states = walk.trajectory.states
    seconds = float(states.time[-1] - states.time[0])
    ends = f"{found.duration:.3g} s that amplify up to {found.amplification:.3g}-fold"
    covered = (
        "this walk is one"
        if found.covers(walk.amplification, seconds)
        else (f"not this walk, of {seconds:.3g} s and {walk.amplification:.3g}-fold")
    )
    share = f"{100 * found.quantile:g} % of walks"
    return f"within {found.promised_error:.2g} rad/s on {share} up to {ends}: {covered}"


def _in_words(setting: Setting) -> dict[str, str | float | None]:
    return {
        "fidelity": repr(setting.fidelity),
        "integrator": repr(setting.integrator),
        "step": None if isinstance(setting.integrator, EventExact) else setting.dt,
        "dtype": setting.dtype,
    }
