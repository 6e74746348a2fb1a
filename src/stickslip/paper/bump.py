"""Figs. 24 and 25: the UGV over the soft bump, with its legs held still, and turning."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stickslip.agents.pictures.episodes import panel as curves
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.optim import PostureProblem, Station, solve
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.problem import refined
from stickslip.paper.result import Result

STEP = 10
"""Between the angles of all pairs, over the vehicle's whole range, that are tried [degrees]; those
whose wheels overlap do not count."""
EQUAL = ((75, 75), (90, 90), (105, 105), (120, 120), (150, 150))
UNEQUAL = ((30, 100), (100, 30))
"""Rear and front leg [degrees]. The chapter does not say which are drawn; these are ours."""
FROM, BUMP, TO = 1.5, 4.0, 8.0
"""First place of the front wheel, the bump and the last place [m]: there the bump, f(x) = 0.1
exp(-(x - 4)^2) [m], is below 0.2 mm under both wheels. A longer vehicle has more room."""
FRICTION = 0.8
RATE = 1.0
"""Largest leg rate [rad/m]; the chapter has no limit."""
WHEEL = "front wheel [m]"
HELD, LIMITED, FREE = "legs held", f"up to {RATE:g} rad/m", "no limit"
WAYPOINTS = 66
"""Every 0.1 m."""
BETWEEN = 10
"""Trajectories are evaluated at so many times as many points, legs turning evenly between."""
FINE, COARSE, HELD_ANGLES = 43, 17, 41
"""Angles of each leg: on the grid with the rate limited; without limit, each move to each pair; of
postures that are held, every 3 degrees."""

Pair = tuple[float, float]
"""Angles of the rear and the front leg [degrees]."""


class Drive(NamedTuple):
    """A trajectory of the legs, which turn evenly between its points: stations at BETWEEN times as
    many points; torque variation at its own points and at those [N^2 m]."""

    stations: Station
    variation: float
    between: float


def along_bump(vehicle: UGVParams, waypoints: int, leg_rate: float | None = None) -> PostureProblem:
    """The least variation of torque over the soft bump as a problem; leg_rate [rad/m]."""
    usual = UGVParams()
    longer = float(vehicle.body_length - usual.body_length)
    more = max(0.0, longer + 2 * float(vehicle.leg_length - usual.leg_length))
    track = Track.bump(centre=BUMP + more, end=TO + 2 * more)
    x = np.linspace(FROM + more, TO + 2 * more, waypoints)
    options = {"friction": FRICTION, "leg_rate": leg_rate}
    return PostureProblem(vehicle, track, x, "torque_variation", **options)


def statics(vehicle: UGVParams, samples: int) -> Result:
    """Fig. 24."""
    problem = along_bump(vehicle, samples + 1)
    low, high = (round(float(np.degrees(end[0])), 9) for end in problem.bounds)
    drawn = [pair for pair in (*EQUAL, *UNEQUAL) if low <= min(pair) and max(pair) <= high]
    if not drawn:
        raise ValueError(f"legs from {low:g} to {high:g} degrees; accepted: a range with 90")
    torques = np.asarray(_stations(problem, drawn).torque)
    named = {name_of(pair): torque for pair, torque in zip(drawn, torques, strict=True)}
    panel = curves("torque on each wheel", "N m", named, (0.0,))
    angles = range(round(low), round(high) + 1, STEP)
    at = _stations(problem, [(rear, front) for rear in angles for front in angles])
    fits = np.asarray(at.wheel_clearance)[:, 0] >= 0
    at = at.map(lambda of: of[fits])
    passing = np.all(np.asarray(at.status) == Status.OK, axis=1)
    count = f"{int(np.sum(passing))} of {len(passing)} pairs pass"
    passes = f"{count}: {_needs(at)} above the ground or more"
    return Result(WHEEL, problem.x, [panel], {"passes": passes})


def _stations(problem: PostureProblem, pairs: Sequence[Pair]) -> Station:
    """Stations [pairs, K] with the legs held at pairs of angles [degrees]."""
    angles = np.broadcast_to(np.radians(pairs)[:, None], (len(pairs), len(problem.x), 2))
    return evaluate.stations(problem.posture, angles)


def name_of(pair: Pair) -> str:
    """Rear and front leg as 75/120°."""
    return f"{pair[0]:g}/{pair[1]:g}°"


def _needs(at: Station) -> str:
    """Largest |F| / N, least normal force and least clearance of all stations."""
    use = max(float(np.max(np.abs(F) / N)) for F, N, _ in at.wheels)
    load = min(float(np.min(N)) for _, N, _ in at.wheels)
    clearance = 1e3 * float(np.min(at.clearance))
    return f"|F| / N up to {use:.3f}, normal forces {load:.0f} N or more, {clearance:.0f} mm"


def least_variation(vehicle: UGVParams, samples: int) -> Result:
    """Fig. 25; its points are WAYPOINTS, whatever samples is."""
    limited, free = (along_bump(vehicle, WAYPOINTS, rate) for rate in (RATE, None))
    held, degrees = best_held(limited)
    found = {HELD: held, LIMITED: _solved(limited, FINE), FREE: _solved(free, COARSE)}
    drives = {name: _drive(limited, x) for name, x in found.items()}
    at = {name: drive.stations for name, drive in drives.items()}
    panels = [
        curves(f"{leg} leg", "rad", {name: of.leg_angles[:, i] for name, of in at.items()})
        for i, leg in enumerate(("rear", "front"))
    ]
    torques = {name: of.torque for name, of in at.items()}
    panels.append(curves("torque on each wheel", "N m", torques, (0.0,)))
    panels.append(curves("least grip margin", "N", {name: of.grip for name, of in at.items()}))
    return Result(WHEEL, np.asarray(at[HELD].x), panels, turning(drives, degrees))


def best_held(problem: PostureProblem) -> tuple[np.ndarray, Pair]:
    """The feasible fixed posture of HELD_ANGLES with the least variation; its angles [degrees]."""
    low, high = (float(np.degrees(end[0])) for end in problem.bounds)
    angles = np.linspace(low, high, HELD_ANGLES).round(9)
    pairs = np.stack(np.meshgrid(angles, angles, indexing="ij"), -1).reshape(-1, 2)
    trajectories = np.tile(np.radians(pairs), len(problem.x))
    variation, violation = problem.sample(trajectories)
    if np.all(violation > 0):
        raise ValueError("no posture held passes the bump; accepted: a vehicle that does")
    best = int(np.argmin(np.where(violation > 0, np.inf, variation)))
    rear, front = pairs[best]
    return trajectories[best], (float(rear), float(front))


def _solved(problem: PostureProblem, angles: int) -> np.ndarray:
    """The local optimum off the grid that the best path over it leads to."""
    grid = solve(problem, "dp", polish=False, angles=angles, progress=True)
    return np.asarray(solve(problem, "scp", start=grid.x, progress=True).x)


def _drive(problem: PostureProblem, x: np.ndarray) -> Drive:
    """The trajectory at BETWEEN times as many points."""
    free = replace(problem, leg_rate=None)
    fine, between = refined(free, x, BETWEEN)
    return Drive(fine.stations(between), free.objective(x), fine.objective(between))


def turning(drives: Mapping[str, Drive], degrees: Pair) -> dict[str, str]:
    """Variation at the points and between them, and what holds there. degrees: of the best held."""
    held, *others = drives.values()
    below = " and ".join(f"{100 * (1 - one.variation / held.variation):.0f}" for one in others)
    less = [100 * (1 - one.between / held.between) for one in others]
    shown = " and ".join(f"{abs(of):.0f} % {'below' if of > 0 else 'above'}" for of in less)
    points = ", ".join(f"{one.variation:.0f} ({name})" for name, one in drives.items())
    dense = ", ".join(f"{one.between:.0f} ({name})" for name, one in drives.items())
    at = drives[LIMITED].stations
    fails = int(np.sum(np.asarray(at.status) != Status.OK))
    return {
        "varies_less": f"∫(dM/dx)² dx {points} N² m at the points: {below} % below the best "
        f"posture held ({name_of(degrees)})",
        "between": f"legs turning evenly between the points: {dense} N² m: {shown} the legs held",
        "passes": f"{LIMITED}, between the points, too: {_needs(at)} of clearance or more"
        + f", {fails} of them fail" * (fails > 0),
    }
