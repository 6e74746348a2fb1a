"""A drive as a page shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.reports.course import facts, from_start, panel, reward_panels, samples
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.html.data import Event, Line, Panel, Shown
from stickslip.envs.rendering.ugv.drawn import ugv_drawing
from stickslip.envs.ugv.picture import ugv_frames

if TYPE_CHECKING:
    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.tasks.scale import Scale
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState


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
    slips = np.array([frame.slips for frame in frames])
    at = states.station
    angles = np.degrees(np.asarray(at.leg_angles, float))
    torque, cost = np.asarray(at.torque, float), np.asarray(states.cost, float)
    demand = np.array([frame.demand for frame in frames])
    mu = np.array([frame.mu for frame in frames])
    unit = env.measure.unit
    criterion = env.measure.name.replace("_", " ")
    spacing = float(params.spacing)
    panels = (
        panel("torque on each wheel, negative drives forwards", "N m", torque),
        Panel(
            "work put in, for each metre",
            "J/m",
            (
                Line("motors", from_start(played.info["wheel_work"]) / spacing),
                Line("with the legs", from_start(played.info["total_work"]) / spacing),
            ),
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
            (Line("greater |F| / N", demand), Line("friction there is", mu, dashed=True)),
        ),
        panel("margin of grip", "kN", np.asarray(at.grip, float) / 1000, limits=(0.0,)),
        panel(criterion, unit, cost),
        *reward_panels(played, {}, unit, scale),
    )
    x = np.asarray(at.x, float)
    numbers = (
        ("driven [m]", x - float(params.start), 2),
        ("pitch [°]", np.degrees([frame.pitch for frame in frames]), 1),
        ("torque [N m]", torque, 1),
        ("friction / normal", demand, 2),
        (criterion if unit == "-" else f"{criterion} [{unit}]", cost, 2),
    )
    status = Status(int(played.info["status"][-1]))
    ended = status.name.lower().replace("_", " ") if bool(played.terminated[-1]) else ""
    totals = played.info
    whole = facts(
        [
            ("return", float(totals["episode_return"][-1]), unit),
            ("wheels", float(totals["episode_wheel_energy"][-1]), "J"),
            ("with legs", float(totals["episode_total_energy"][-1]), "J"),
            ("shown at", float(params.speed), "m/s"),
        ]
    )
    return Shown(
        name=name,
        period=float(params.control_period),
        panels=panels,
        events=_events(slips, ended),
        numbers=numbers,
        slips=slips,
        drawing=ugv_drawing(frames, params.vehicle),
        ended=ended,
        facts=whole,
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
