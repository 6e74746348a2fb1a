"""A drive as a page shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.reports.course import facts, from_start, panel, reward_panels, samples
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.html.data import Event, Line, Panel, Shown
from stickslip.envs.rendering.ugv import ugv_drawing
from stickslip.envs.ugv.picture import ugv_frames

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.rendering.ugv import UGVFrame
    from stickslip.envs.tasks.known import Scale
    from stickslip.envs.ugv.draw import UGVDrawn
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState
    from stickslip.optim.posture.criteria import Criterion
    from stickslip.optim.posture.station import Station


STATES = "GRIP", "SLIP"
"""Of a wheel."""


def shown(
    played: Rollout[UGVEnvState],
    env: UGVEnv,
    params: UGVEnvParams,
    name: str,
    scale: Scale | None,
) -> Shown:
    """One episode (not a batch), waypoint by waypoint. Time is that of pictures (params.speed):
    nothing else of the model knows of it, so there is power for a metre and none for a second."""
    played = played.trimmed()
    states, infos = samples(played)
    frames = ugv_frames(states, infos, params, env.solver, env.preview)
    work = [from_start(played.info[name]) for name in ("wheel_work", "total_work")]
    totals, unit = played.info, env.measure.unit
    drive = drive_panels(
        frames, states.station, states.cost, work, float(params.spacing), env.measure
    )
    whole = facts(
        [
            ("return", float(totals["episode_return"][-1]), unit),
            ("wheels", float(totals["episode_wheel_energy"][-1]), "J"),
            ("with legs", float(totals["episode_total_energy"][-1]), "J"),
            ("shown at", float(params.speed), "m/s"),
        ]
    )
    status = Status(int(totals["status"][-1]))
    ended = status.name.lower().replace("_", " ") if bool(played.terminated[-1]) else ""
    slips = np.array([frame.slips for frame in frames])
    return Shown(
        name=name,
        period=float(params.control_period),
        panels=(*drive, *reward_panels(played, {}, unit, scale)),
        events=_events(slips, ended),
        numbers=drive_numbers(frames, env.measure),
        slips=slips,
        drawing=ugv_drawing(frames, params.vehicle),
        ended=ended,
        facts=(*whole, *_drawn(played.start_state.drawn)),
        states=STATES,
    )


def _drawn(drawn: UGVDrawn) -> tuple[tuple[str, str], ...]:
    """What the reset drew for this episode; pictures show it."""
    rows = [] if drawn.friction is None else [("friction, drawn", float(drawn.friction), "-")]
    ground = () if drawn.odometer is None else (("ground", "drawn"),)
    return (*ground, *facts(rows))


def drive_panels(
    frames: Sequence[UGVFrame],
    at: Station,
    cost: Array | np.ndarray,
    work: Sequence[np.ndarray],
    spacing: float,
    measure: Criterion,
) -> tuple[Panel, ...]:
    """Torque, work, legs, friction, grip and the criterion so far, station by station.

    work: of the motors, and with the legs' actuators, put in since the station before [J].
    """
    angles = np.degrees(np.asarray(at.leg_angles, float))
    motors, legs = (each / spacing for each in work)
    return (
        panel(
            "torque on each wheel, negative drives forwards", "N m", np.asarray(at.torque, float)
        ),
        Panel(
            "work put in, for each metre",
            "J/m",
            (Line("motors", motors), Line("with the legs", legs)),
            steps=True,
        ),
        Panel(
            "leg angles, 90 straight down",
            "°",
            (Line("rear", angles[:, 0]), Line("front", angles[:, 1])),
        ),
        Panel(
            "friction used",
            "-",
            (
                Line("greater |F| / N", np.array([frame.demand for frame in frames])),
                Line("friction there is", np.array([frame.mu for frame in frames]), dashed=True),
            ),
        ),
        panel("margin of grip", "kN", np.asarray(at.grip, float) / 1000, limits=(0.0,)),
        panel(measure.name.replace("_", " "), measure.unit, np.asarray(cost, float)),
    )


def drive_numbers(
    frames: Sequence[UGVFrame], measure: Criterion
) -> tuple[tuple[str, np.ndarray, int], ...]:
    """What stands above the picture."""
    criterion = measure.name.replace("_", " ") + (
        "" if measure.unit == "-" else f" [{measure.unit}]"
    )
    return (
        ("driven [m]", np.array([frame.x - frame.start for frame in frames]), 2),
        ("pitch [°]", np.degrees([frame.pitch for frame in frames]), 1),
        ("torque [N m]", np.array([frame.torque for frame in frames]), 1),
        ("friction / normal", np.array([frame.demand for frame in frames]), 2),
        (criterion, np.array([frame.cost for frame in frames]), 2),
    )


def _events(slips: np.ndarray, ended: str) -> tuple[Event, ...]:
    found = []
    for i in range(1, len(slips)):
        if slips[i] != slips[i - 1]:
            kind = "slip" if slips[i] else "stick"
            found.append(Event(i, kind, "a wheel slips" if slips[i] else "both wheels grip"))
    if ended:
        found.append(Event(len(slips) - 1, "end", f"ended: {ended}"))
    return tuple(found)
