"""Fig. 24: the torque that the UGV needs over the soft bump with its legs held still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.envs.rendering import theme
from stickslip.optim import PostureProblem, Station
from stickslip.optim import posture as traced
from stickslip.optimise.vehicle import draw_scene, extent, poses
from stickslip.paper import drawing
from stickslip.paper.result import NOT_STATED, Claim, Result, Setting, verdict_of

TRACK = Track.bump()
"""f(x) = 0.1 exp(-(x - 4)^2) [m]."""
LEAST, MOST = 70, 150
"""Leg angles [degrees]. With both legs steeper than 67 the wheels of this radius would overlap."""
VEHICLE = UGVParams(leg_angle_min=float(np.radians(LEAST)), leg_angle_max=float(np.radians(MOST)))
ALIKE = ((75, 75), (90, 90), (105, 105), (120, 120), (150, 150))
UNLIKE = ((75, 120), (120, 75))
"""Rear and front leg [degrees]. The chapter does not say which are drawn; these are ours."""
STEP = 10
"""Between the angles of all pairs that are tried [degrees]."""
FROM, TO = 1.5, 8.0
"""Of the front wheel [m]: both wheels where the bump is lower than 0.2 mm."""
FRICTION = 0.8
BATCH = 8
"""Postures evaluated in one call."""


def along_bump(
    waypoints: int, criterion: str = "torque_variation", leg_rate: float | None = None
) -> PostureProblem:
    """The drive over the soft bump; leg_rate [rad/m]."""
    x = np.linspace(FROM, TO, waypoints)
    return PostureProblem(VEHICLE, TRACK, x, criterion, friction=FRICTION, leg_rate=leg_rate)


def held(problem: PostureProblem, pairs: Sequence[tuple[float, float]]) -> Station:
    """Stations [pairs, K] of drives with the legs held at pairs of angles [degrees]."""
    posture = replace(problem.posture, criterion=None)
    count = -(-len(pairs) // BATCH) * BATCH
    angles = np.radians([*pairs, *[pairs[-1]] * (count - len(pairs))])[:, None]
    angles = np.broadcast_to(angles, (count, len(problem.x), 2))
    found = [
        traced.stations(posture, angles[i : i + BATCH]).map(np.asarray)
        for i in range(0, count, BATCH)
    ]
    return Station._make(np.concatenate(of)[: len(pairs)] for of in zip(*found, strict=True))


def statics(setting: Setting) -> Result:
    """Fig. 24."""
    problem = along_bump(setting.samples + 1)
    drawn = [*ALIKE, *UNLIKE]
    angles = range(LEAST, MOST + 1, STEP)
    every = [(rear, front) for rear in angles for front in angles]
    setting.say(f"{len(every)} pairs of leg angles")
    found = held(problem, [*drawn, *every])
    shown, tried = (found.map(lambda of, s=s: of[s]) for s in (slice(7), slice(7, None)))
    columns = {"front wheel [m]": problem.x} | {
        f"torque with legs at {_name(pair)} [N m]": torque
        for pair, torque in zip(drawn, shown.torque, strict=True)
    }
    claims = [_passes(tried, len(every)), _peaks(drawn, shown), _work(problem, shown)]
    return Result({"": columns}, lambda: _draw(problem, drawn, np.asarray(shown.torque)), claims)


def _passes(tried: Station, count: int) -> Claim:
    fine = np.all(np.asarray(tried.status) == Status.OK, axis=1)
    demand = max(
        float(np.max(np.abs(F) / N))
        for F, N in ((tried.F_rear, tried.N_rear), (tried.F_front, tried.N_front))
    )
    return Claim(
        "there is a torque function for any static configuration angles passing the bump",
        f"{int(np.sum(fine))} of {count} pairs from {LEAST} to {MOST}° by {STEP}° pass: |F| / N up "
        f"to {demand:.3f} (μ = {FRICTION:g} taken), body and legs "
        f"{1e3 * np.min(tried.clearance):.0f} mm above the ground or more, no wheel lifts",
        verdict_of(np.all(fine), np.any(fine)),
        "a posture has one equilibrium at each place. Radius, friction and the legs' range are not "
        "in the chapter; with both legs below 67° the wheels would overlap",
    )


def _peaks(drawn: Sequence[tuple[float, float]], shown: Station) -> Claim:
    largest = np.max(np.abs(shown.torque), axis=1)
    numbers = ", ".join(f"{peak:.1f} ({_name(p)})" for p, peak in zip(drawn, largest, strict=True))
    return Claim(
        "the angles of the curves",
        f"drawn: rear / front {', '.join(map(_name, drawn))}; largest torque {numbers} N m",
        NOT_STATED,
        "the chapter does not name them. Legs outwards make the wheelbase longer, so that the "
        "wheels are on the steepest places one after the other",
    )


def _work(problem: PostureProblem, shown: Station) -> Claim:
    mean = (shown.torque[:, 1:] + shown.torque[:, :-1]) / 2
    work = mean * np.diff(shown.turn, axis=1)
    put_in = np.sum(np.maximum(work, 0), axis=1)
    left = np.sum(work, axis=1)
    straight = ALIKE.index((90, 90))
    placed = poses(VEHICLE, TRACK, problem.x, np.radians([ALIKE[straight]] * len(problem.x)))
    rise = np.ptp(placed.potential_energy(VEHICLE))
    return Claim(
        "(the curves' work)",
        f"legs straight down: {put_in[straight]:.1f} J up, where the weights rise by {rise:.1f} J; "
        f"all drawn: {np.min(put_in):.0f} to {np.max(put_in):.0f} J up, "
        f"{np.max(np.abs(left)):.2f} J or less left over the whole bump",
        NOT_STATED,
        "a check: with the legs held, the torque times the wheels' turn is the change of potential "
        "energy, so each curve goes down as much as up, but for the trapezoid rule between points "
        "and the bump's last traces at the ends",
    )


def _name(pair: tuple[float, float]) -> str:
    return f"{pair[0]:g}/{pair[1]:g}°"


def _draw(problem: PostureProblem, drawn: Sequence[tuple[float, float]], torques: np.ndarray):
    standing = _standing(drawn)
    left, right, bottom, top = extent(VEHICLE, standing)
    low = 1.3 * 8.3 * (top - bottom) / (right - left)
    figure, axes = drawing.sheet(2, height=2.5, height_ratios=[3.4, low])
    curves, postures = axes[:, 0]
    colours = [*drawing.shades(len(ALIKE)), theme.SLIDES, theme.HIP_EDGE]
    for i, (pair, torque) in enumerate(zip(drawn, torques, strict=True)):
        style = "-" if pair in ALIKE else "--"
        curves.plot(problem.x, torque, color=colours[i], ls=style, lw=1.4, label=_name(pair))
    drawing.legend(curves, title="rear/front", title_fontsize=8.5)
    drawing.mark(curves, x=4.0, y=0.0)
    curves.set_xlim(FROM, TO)
    drawing.name_panel(
        curves,
        "torque on each wheel [N m]",
        "negative: drives forwards; dashed upright: crest",
        "front wheel [m]",
    )
    draw_scene(postures, VEHICLE, Track.flat(), standing)
    postures.set_xticks([float(x) for x in standing.body[:, 0]], [_name(pair) for pair in drawn])
    drawing.name_panel(postures, "the postures", "90°: straight down; more: outwards")
    return figure


def _standing(drawn: Sequence[tuple[float, float]]):
    """The postures on level ground, side by side, a wheel's radius apart."""
    angles = np.radians(drawn)
    alone = poses(VEHICLE, Track.flat(), np.zeros(len(drawn)), angles)
    gap = float(VEHICLE.wheel_radius)
    places, at = [], -inf
    for base in alone.wheelbase:
        at = base if at == -inf else at + 3 * gap + base
        places.append(float(at))
    return poses(VEHICLE, Track.flat(), np.array(places), angles)
