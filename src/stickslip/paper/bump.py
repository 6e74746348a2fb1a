"""Fig. 24: the torque that the UGV needs over the soft bump with its legs held still."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.envs.rendering import theme
from stickslip.optim import PostureProblem, Station
from stickslip.optim.posture.stations import evaluated
from stickslip.optimise.vehicle import draw_scene, extent, poses
from stickslip.paper import bump_claims, drawing
from stickslip.paper.bump_claims import Pair, Tried
from stickslip.paper.result import Columns, Result, Setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TRACK = Track.bump()
"""f(x) = 0.1 exp(-(x - 4)^2) [m]."""
VEHICLE = UGVParams()
STEP = 10
"""Between the angles of all pairs that are tried, over the vehicle's whole range [degrees]."""
ALIKE = ((75, 75), (90, 90), (105, 105), (120, 120), (150, 150))
UNLIKE = ((30, 100), (100, 30))
"""Rear and front leg [degrees]. The chapter does not say which are drawn; these are ours."""
FROM, TO = 1.5, 8.0
"""Of the front wheel [m]: both wheels where the bump is lower than 0.2 mm."""
FRICTION = 0.8


def along_bump(
    waypoints: int,
    criterion: str = "torque_variation",
    leg_rate: float | None = None,
) -> PostureProblem:
    """The drive over the soft bump; leg_rate [rad/m]."""
    x = np.linspace(FROM, TO, waypoints)
    return PostureProblem(VEHICLE, TRACK, x, criterion, friction=FRICTION, leg_rate=leg_rate)


def held(problem: PostureProblem, pairs: Sequence[Pair]) -> Station:
    """Stations [pairs, K] of drives with the legs held at pairs of angles [degrees]."""
    angles = np.broadcast_to(np.radians(pairs)[:, None], (len(pairs), len(problem.x), 2))
    return evaluated.stations(problem.posture, angles)


def all_pairs() -> list[Pair]:
    """Every pair of the vehicle's range by STEP degrees, wheels that overlap among them."""
    low, high = (
        round(float(np.degrees(end))) for end in (VEHICLE.leg_angle_min, VEHICLE.leg_angle_max)
    )
    angles = range(low, high + 1, STEP)
    return [(rear, front) for rear in angles for front in angles]


def statics(setting: Setting) -> Result:
    """Fig. 24."""
    problem = along_bump(setting.samples + 1)
    every, drawn = all_pairs(), [*ALIKE, *UNLIKE]
    setting.say(f"{len(every)} pairs of leg angles")
    shown, found = held(problem, drawn), held(problem, every)
    apart = np.asarray(found.wheel_clearance)[:, 0]
    fits = apart >= 0
    radius = float(VEHICLE.wheel_radius)
    tried = Tried(
        [pair for pair, clear in zip(every, fits, strict=True) if clear],
        problem.x,
        apart[fits] + 2 * radius,
        found.map(lambda of: of[fits]),
        radius,
        int(np.sum(~fits)),
    )
    curves = {"front wheel [m]": problem.x} | {
        f"torque with legs at {bump_claims.name_of(pair)} [N m]": torque
        for pair, torque in zip(drawn, shown.torque, strict=True)
    }
    claims = [
        bump_claims.exists(tried),
        bump_claims.passes(tried),
        bump_claims.drawn(drawn, np.asarray(shown.torque)),
        bump_claims.extremes(tried),
        _work(problem, shown),
    ]
    return Result(
        {"": curves, "-pairs": _table(tried)},
        lambda: _draw(tried, drawn, np.asarray(shown.torque)),
        claims,
    )


def _work(problem: PostureProblem, shown: Station):
    """The work of the curves drawn beside what the weights rise by with the legs straight down."""
    straight = ALIKE.index((90, 90))
    placed = poses(VEHICLE, TRACK, problem.x, np.radians([ALIKE[straight]] * len(problem.x)))
    rise = float(np.ptp(placed.potential_energy(VEHICLE)))
    return bump_claims.work(shown, straight, rise)


def _table(tried: Tried) -> Columns:
    at, largest = tried.stations, tried.largest
    where = np.argmax(np.abs(at.torque), axis=1)
    return {
        "rear leg [deg]": [rear for rear, _ in tried.pairs],
        "front leg [deg]": [front for _, front in tried.pairs],
        "wheelbase [m]": tried.wheelbase,
        "largest torque [N m]": largest,
        "front wheel there [m]": tried.x[where],
        "largest |F| / N [-]": bump_claims.demand(at),
        "least normal force [N]": bump_claims.load(at),
        "least clearance [m]": np.min(np.asarray(at.clearance), axis=1),
        "status": [Status(int(np.max(of))).name for of in np.asarray(at.status)],
    }


def _draw(tried: Tried, drawn: Sequence[Pair], torques: np.ndarray):
    standing = _standing(drawn)
    left, right, bottom, top = extent(VEHICLE, standing)
    low = 1.3 * 8.3 * (top - bottom) / (right - left)
    figure, axes = drawing.sheet(3, height=2.5, height_ratios=[3.4, 2.1, low])
    curves, largest, postures = axes[:, 0]
    colours = [*drawing.shades(len(ALIKE)), theme.SLIDES, theme.HIP_EDGE]
    curves.plot(tried.x, tried.stations.torque.T, color=theme.MUTED, lw=0.5, alpha=0.25)
    for i, (pair, torque) in enumerate(zip(drawn, torques, strict=True)):
        style = "-" if pair in ALIKE else "--"
        curves.plot(
            tried.x, torque, color=colours[i], ls=style, lw=1.6, label=bump_claims.name_of(pair)
        )
    drawing.legend(curves, title="rear/front", title_fontsize=8.5)
    drawing.mark(curves, x=4.0, y=0.0)
    curves.set_xlim(FROM, TO)
    drawing.name_panel(
        curves,
        "torque on each wheel [N m]",
        f"negative: drives forwards; dashed upright: crest; thin: all {len(tried.pairs)} pairs",
        "front wheel [m]",
    )
    _draw_largest(largest, tried)
    draw_scene(postures, VEHICLE, Track.flat(), standing)
    names = [bump_claims.name_of(pair) for pair in drawn]
    postures.set_xticks([float(x) for x in standing.body[:, 0]], names)
    drawing.name_panel(postures, "the postures", "90°: straight down; more: outwards")
    return figure


def _draw_largest(axis: Axes, tried: Tried) -> None:
    """Every pair's largest torque by its wheelbase, mixed angles apart from equal ones."""
    mixed = np.array([rear != front for rear, front in tried.pairs])
    looks: dict[str, tuple[np.ndarray, dict[str, Any]]] = {
        "unlike angles": (mixed, {"facecolors": "none", "edgecolors": theme.SLIDES}),
        "equal angles": (~mixed, {"color": theme.INK}),
    }
    for label, (which, look) in looks.items():
        x, y = tried.wheelbase[which], tried.largest[which]
        axis.scatter(x, y, s=18, lw=0.9, label=label, **look)
    drawing.legend(axis)
    drawing.mark(axis, x=2 * tried.radius)
    note = "dashed: the wheels touch"
    drawing.name_panel(axis, "largest torque over the bump [N m]", note, "wheelbase [m]")


def _standing(drawn: Sequence[Pair]):
    """The postures on level ground, side by side, a wheel's radius apart."""
    angles = np.radians(drawn)
    alone = poses(VEHICLE, Track.flat(), np.zeros(len(drawn)), angles)
    gap = float(VEHICLE.wheel_radius)
    places, at = [], -inf
    for base in alone.wheelbase:
        at = base if at == -inf else at + 3 * gap + base
        places.append(float(at))
    return poses(VEHICLE, Track.flat(), np.array(places), angles)
