"""Fig. 24: the torque that the UGV needs over the soft bump with its legs held still."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.envs.rendering import theme
from stickslip.optim import PostureProblem, Station
from stickslip.optim.posture import evaluate
from stickslip.paper import drawing
from stickslip.paper.figure import NOT_STATED, Claim, Columns, Result, by_construction, share_of

TRACK = Track.bump()
"""f(x) = 0.1 exp(-(x - 4)^2) [m]."""
VEHICLE = UGVParams()
STEP = 10
"""Between the angles of all pairs, over the vehicle's whole range [degrees]."""
EQUAL = ((75, 75), (90, 90), (105, 105), (120, 120), (150, 150))
UNEQUAL = ((30, 100), (100, 30))
"""Rear and front leg [degrees]. The chapter does not say which are drawn; these are ours."""
FROM, TO = 1.5, 8.0
"""Of the front wheel [m]: both wheels where the bump is lower than 0.2 mm."""
FRICTION = 0.8

Pair = tuple[float, float]
"""Angles of the rear and the front leg [degrees]."""


class Held(NamedTuple):
    """Pairs of leg angles held over the bump. wheelbase [pairs, m]; stations [pairs, K]."""

    pairs: Sequence[Pair]
    wheelbase: np.ndarray
    stations: Station

    @property
    def largest(self) -> np.ndarray:
        """Largest torque of each pair, in either direction [pairs, N m]."""
        return np.max(np.abs(self.stations.torque), axis=1)


def along_bump(
    waypoints: int, criterion: str = "torque_variation", leg_rate: float | None = None
) -> PostureProblem:
    """The trajectory over the soft bump as an optimisation problem; leg_rate [rad/m]."""
    x = np.linspace(FROM, TO, waypoints)
    return PostureProblem(VEHICLE, TRACK, x, criterion, friction=FRICTION, leg_rate=leg_rate)


def statics(samples: int) -> Result:
    """Fig. 24."""
    problem = along_bump(samples + 1)
    drawn = [*EQUAL, *UNEQUAL]
    shown = _stations(problem, drawn)
    every = all_pairs(problem)
    curves = {
        f"torque with legs at {name_of(pair)} [N m]": torque
        for pair, torque in zip(drawn, np.asarray(shown.torque), strict=True)
    }
    return Result(
        {"": {"front wheel [m]": problem.x, **curves}, "-pairs": _table(every)},
        lambda: _draw(problem.x, every, drawn, np.asarray(shown.torque)),
        [exists(every), passes(every), extremes(every)],
    )


def all_pairs(problem: PostureProblem) -> Held:
    """Every pair of the vehicle's range by STEP degrees whose wheels do not overlap."""
    ends = (VEHICLE.leg_angle_min, VEHICLE.leg_angle_max)
    low, high = (round(float(np.degrees(end))) for end in ends)
    angles = range(low, high + 1, STEP)
    pairs = [(rear, front) for rear in angles for front in angles]
    found = _stations(problem, pairs)
    clearance = np.asarray(found.wheel_clearance)[:, 0]
    fits = clearance >= 0
    return Held(
        [pair for pair, clear in zip(pairs, fits, strict=True) if clear],
        clearance[fits] + 2 * float(VEHICLE.wheel_radius),
        found.map(lambda of: of[fits]),
    )


def _stations(problem: PostureProblem, pairs: Sequence[Pair]) -> Station:
    """Stations [pairs, K] with the legs held at pairs of angles [degrees]."""
    angles = np.broadcast_to(np.radians(pairs)[:, None], (len(pairs), len(problem.x), 2))
    return evaluate.stations(problem.posture, angles)


def name_of(pair: Pair) -> str:
    """Rear and front leg as 75/120°."""
    return f"{pair[0]:g}/{pair[1]:g}°"


def friction_needed(at: Station) -> np.ndarray:
    """Largest |F| / N of both wheels [pairs]."""
    wheels = ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    return np.max([np.max(np.abs(F) / N, axis=-1) for F, N in wheels], axis=0)


def least_load(at: Station) -> np.ndarray:
    """Least normal force of both wheels [pairs, N]."""
    return np.min(np.minimum(np.asarray(at.N_rear), np.asarray(at.N_front)), axis=-1)


def exists(held: Held) -> Claim:
    """Every posture has a torque."""
    finite = np.all(np.isfinite(held.stations.torque), axis=1)
    return Claim(
        "there is a torque function for any static configuration angles",
        f"{int(np.sum(finite))} of {len(held.pairs)} pairs have one",
        by_construction(np.all(finite)),
        "a vehicle held still has one equilibrium: three equations for three unknowns",
    )


def passes(held: Held) -> Claim:
    """The ground can give what these torques need."""
    at = held.stations
    fine = np.all(np.asarray(at.status) == Status.OK, axis=1)
    return Claim(
        "(the same, passing the bump)",
        f"{int(np.sum(fine))} of {len(held.pairs)} pairs pass: |F| / N up to "
        f"{np.max(friction_needed(at)):.3f}, normal forces {np.min(least_load(at)):.0f} N or more, "
        f"{1e3 * np.min(at.clearance):.0f} mm above the ground or more",
        share_of(fine),
        f"wheel radius, friction {np.max(at.friction):g} and the legs' range are ours",
    )


def extremes(held: Held) -> Claim:
    """The pairs with the largest and the smallest of all largest torques."""
    largest = held.largest
    unequal = np.array([rear != front for rear, front in held.pairs])

    def shown(which: int) -> str:
        return f"{largest[which]:.1f} N m ({name_of(held.pairs[which])})"

    equal = int(np.argmax(np.where(unequal, -np.inf, largest)))
    return Claim(
        "(the extremes over all pairs)",
        f"largest torque from {shown(int(np.argmax(largest)))} to "
        f"{shown(int(np.argmin(largest)))}; of equal angles {shown(equal)} is the largest",
        NOT_STATED,
        "a longer wheelbase has the wheels on the steepest places one after the other",
    )


def _table(held: Held) -> Columns:
    at = held.stations
    rear, front = zip(*held.pairs, strict=True)
    return {
        "rear leg [deg]": rear,
        "front leg [deg]": front,
        "wheelbase [m]": held.wheelbase,
        "largest torque [N m]": held.largest,
        "largest |F| / N [-]": friction_needed(at),
        "least normal force [N]": least_load(at),
        "least clearance [m]": np.min(np.asarray(at.clearance), axis=1),
        "status": [Status(int(np.max(of))).name for of in np.asarray(at.status)],
    }


def _draw(x: np.ndarray, held: Held, drawn: Sequence[Pair], torques: np.ndarray):
    figure, axes = drawing.sheet(2, height=2.8, height_ratios=[3.4, 2.1])
    curves, largest = axes[:, 0]
    colours = [*drawing.shades(len(EQUAL)), theme.SLIDES, theme.HIP_EDGE]
    curves.plot(x, np.asarray(held.stations.torque).T, color=theme.MUTED, lw=0.5, alpha=0.25)
    for pair, torque, colour in zip(drawn, torques, colours, strict=True):
        style = "-" if pair in EQUAL else "--"
        curves.plot(x, torque, color=colour, ls=style, lw=1.6, label=name_of(pair))
    drawing.legend(curves, title="rear/front", title_fontsize=8.5)
    drawing.mark(curves, x=4.0, y=0.0)
    curves.set_xlim(FROM, TO)
    note = f"negative: drives forwards; dashed upright: crest; thin: all {len(held.pairs)} pairs"
    drawing.name_panel(curves, "torque on each wheel [N m]", note, "front wheel [m]")
    unequal = np.array([rear != front for rear, front in held.pairs])
    for label, which, edge in (("unequal", unequal, theme.SLIDES), ("equal", ~unequal, theme.INK)):
        look = {"s": 18, "facecolors": "none", "edgecolors": edge, "label": f"{label} angles"}
        largest.scatter(held.wheelbase[which], held.largest[which], **look)
    drawing.legend(largest)
    drawing.mark(largest, x=2 * float(VEHICLE.wheel_radius))
    note = "dashed: the wheels touch"
    drawing.name_panel(largest, "largest torque over the bump [N m]", note, "wheelbase [m]")
    return figure
