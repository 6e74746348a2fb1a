"""Waypoints of a drive, checks of a posture problem's arguments, and memory of its methods."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.pytrees import Numeric, read_only, run_once
from stickslip.dynamics.ugv import PoseSolver, UGVParams
from stickslip.dynamics.ugv.track import Track, track_of
from stickslip.optim.problem import COUNT, as_floats, require_scalar

if TYPE_CHECKING:
    from jaxtyping import Float, Int


STATION = 1_000
"""Bytes of a station while it is evaluated."""
NODE = 4
"""Bytes of what is kept of a grid's station: the node before."""
MOVE = 300
"""Bytes of one of the moves that a leg pair may make on a grid."""
CONVEX = 150_000
"""Bytes of a waypoint in scp's convex program."""

_slope = run_once(Track.slope)


@dataclass(frozen=True)
class PostureData:
    """The fields of PostureProblem; see there."""

    params: UGVParams
    track: Track
    x: Float[np.ndarray, "K"]
    criterion: Any = "wheel_energy"
    friction: Numeric = 0.8
    leg_rate: float | None = 1.0
    min_normal: float = 0.0
    min_grip: float = 0.0
    min_clearance: float = 0.02
    max_torque: float | None = None
    start_angles: Float[np.ndarray, "2"] | None = None
    end_angles: Float[np.ndarray, "2"] | None = None
    solver: PoseSolver = field(default=PoseSolver())
    free_split: bool = False
    apart_between: bool = True

    @property
    def n(self) -> int:
        """Length of the decision vector, 2K."""
        return 2 * len(self.x)

    def given_at(self, k: int) -> Float[np.ndarray, "2"] | None:
        """The pair of angles that is given at waypoint k [rad]; None where it is to be chosen."""
        return {0: self.start_angles, len(self.x) - 1: self.end_angles}.get(k)

    @cached_property
    def longest_moves(self) -> Float[np.ndarray, "K-1"]:
        """The longest move of a leg in each step [rad]; infinite without a leg_rate."""
        rate = np.inf if self.leg_rate is None else float(self.leg_rate)
        return read_only(rate * np.diff(self.x))

    @cached_property
    def min_wheel_clearance(self) -> float:
        """Least distance of the wheels at a waypoint, less wheel_gap [m]: so much that they stay
        apart between waypoints, too, the legs turning evenly. 0 where that is not asked for."""
        if self.leg_rate is None or not self.apart_between:
            return 0.0
        return nearer_between(self.params, float(np.max(self.longest_moves)))


def waypoints_along(
    track: Track | str, params: UGVParams, spacing: float, start: float | None, end: float | None
) -> Float[np.ndarray, "K"]:
    """Evenly spaced places of the front wheel [m]; see PostureProblem.along.

    By default the first lies in from the track's start by the longest wheelbase and by how far the
    contacts can lie off below the wheels' centres there. More than memory holds are refused.
    """
    track = track_of(track)
    checks.require_kind("params", params, UGVParams, "UGVParams, or None")
    params.validate()
    require_scalar("spacing", spacing, low=0.0, strict=True, accepted="a length > 0 [m]")
    for name, value in (("start", start), ("end", end)):
        if value is not None:
            require_scalar(name, value, low=-np.inf, accepted="a finite position [m]")
    first, last = float(np.asarray(track.start)), float(np.asarray(track.end))
    last = last if end is None else float(end)
    if start is None:
        reach, r = longest_wheelbase(params), float(params.wheel_radius)
        slope = slopes_at(track, np.linspace(first, first + reach + 2 * r, 64))
        begin = first + reach + 2 * r * float(np.max(np.abs(np.sin(np.arctan(slope)))))
        why = f" (track from {first:.6g} m, and {begin - first:.6g} m for the rear wheel)"
    else:
        begin, why = float(start), ""
    if not begin < last:
        accepted = "start < end on a track longer than the longest wheelbase"
        raise ValueError(f"start = {begin:.6g} m{why}, end = {last:.6g} m; accepted: {accepted}")
    with np.errstate(over="ignore"):
        pieces = np.maximum(np.ceil(np.float64(last - begin) / float(spacing) - 1e-9), 1)
    given = f"spacing = {float(spacing)!r} m from start = {begin:.6g} m to end = {last:.6g} m"
    checks.require_memory(given, "waypoints", pieces + 1, STATION)
    return np.linspace(begin, last, int(pieces) + 1)


def slopes_at(track: Track, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """The ground's slope at each x [m], in double precision."""
    with jax.enable_x64(True):
        return np.asarray(_slope(track.astype(np.float64), x))


def check_problem(problem: PostureData) -> dict[str, Any]:
    """The fields as arrays, or ValueError naming the field, the value and what is accepted."""
    checks.require_kind("params", problem.params, UGVParams, "a UGVParams")
    checks.require_kind("solver", problem.solver, PoseSolver, "a PoseSolver")
    for name in ("free_split", "apart_between"):
        checks.require_kind(name, getattr(problem, name), bool, "True or False")
    problem.params.validate()
    for leaf in jax.tree.leaves(problem.params):
        if np.ndim(leaf):
            raise ValueError(f"params has a field of shape {np.shape(leaf)}; accepted: numbers")
    x = _waypoints(problem.x)
    if isinstance(problem.track, Track) and problem.track.surface is not None:
        problem.track.surface.validate()
    checks.require_memory(f"x of {len(x)} waypoints", "stations", len(x), STATION)
    fields: dict[str, Any] = {"track": track_of(problem.track), "x": x}
    accepted = "a number >= 0, or one for each waypoint"
    checks.require_number(
        "friction", problem.friction, low=0.0, accepted=accepted, dtype=np.float64
    )
    if np.shape(problem.friction) not in ((), x.shape):
        raise ValueError(
            f"friction has shape {np.shape(problem.friction)}; accepted: a number or one for each "
            f"of the {len(x)} waypoints"
        )
    if isinstance(problem.friction, np.ndarray):
        fields["friction"] = read_only(problem.friction)
    for name, unit in (("leg_rate", "rad/m"), ("max_torque", "N m")):
        if (value := getattr(problem, name)) is not None:
            accepted = f"None, or a number > 0 [{unit}]"
            require_scalar(name, value, low=0.0, strict=True, accepted=accepted)
    for name, unit in (("min_normal", "N"), ("min_grip", "N"), ("min_clearance", "m")):
        require_scalar(name, getattr(problem, name), low=0.0, accepted=f"a number >= 0 [{unit}]")
    for name in ("start_angles", "end_angles"):
        given = getattr(problem, name)
        if given is not None:
            fields[name] = _pair(name, given, problem.params)
    return fields


def _waypoints(x: Any) -> np.ndarray:
    array = as_floats("x", x, "increasing places, two or more [m]")
    if array.ndim != 1 or len(array) < 2:
        raise ValueError(f"x has shape {array.shape}; accepted: [K] with K >= 2 waypoints")
    checks.require_increasing("x", array, "increasing [m]")
    return read_only(array)


def _pair(name: str, angles: Any, params: UGVParams) -> np.ndarray:
    low, high = float(params.leg_angle_min), float(params.leg_angle_max)
    accepted = f"2 angles, rear and front, from {low:.6g} to {high:.6g} rad"
    array = as_floats(name, angles, accepted)
    good = array.shape == (2,) and np.all((low - 1e-9 <= array) & (array <= high + 1e-9))
    checks.require_that(good, name, array.tolist(), accepted)
    return read_only(np.clip(array, low, high))


FINE = 181
"""Sampled angles of a leg."""
ALLOWED = 1.05
"""Times what `nearer_between` finds to second order, for the rest."""


def longest_wheelbase(params: UGVParams) -> float:
    """The greatest distance of the wheels' centres over all leg angles in the range [m]."""
    angles = np.linspace(float(params.leg_angle_min), float(params.leg_angle_max), FINE)
    return float(np.max(wheelbase(params, angles[:, None], angles)))


def wheelbase(params: UGVParams, rear: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Distance of the wheels' centres at these angles [rad], broadcast [m]."""
    l, L = float(params.leg_length), float(params.body_length)
    return np.hypot(L - l * (np.cos(rear) + np.cos(front)), l * (np.sin(rear) - np.sin(front)))


def nearer_between(params: UGVParams, turn: float) -> float:
    """Greatest approach of the wheels between two waypoints, below their distance at both [m].

    turn: the most that a leg turns from one to the next, evenly [rad]. Of the postures with wheels
    that just touch, one for each angle of the rear leg, the moves along which the distance is
    stationary are looked at: the most that it grows towards both ends.
    """
    l, L = float(params.leg_length), float(params.body_length)
    low, high = float(params.leg_angle_min), float(params.leg_angle_max)
    least = 2 * float(params.wheel_radius) + float(params.wheel_gap)
    rear = np.linspace(low, high, FINE)
    across, up = l * np.cos(rear) - L, -l * np.sin(rear)
    cos = (least**2 - L**2 - 2 * l**2 + 2 * L * l * np.cos(rear)) / (2 * l * np.hypot(across, up))
    swing = np.arccos(np.where(np.abs(cos) <= 1, cos, np.nan))
    front = (np.arctan2(up, across) + np.stack([swing, -swing])) % (2 * np.pi)
    pairs = np.stack(np.broadcast_arrays(rear, front)).reshape(2, -1)
    pairs = pairs[:, (pairs[1] >= low) & (pairs[1] <= high)]
    direction = (L * np.sin(pairs) - l * np.sin(np.sum(pairs, axis=0)))[::-1] * [[1.0], [-1.0]]
    direction *= turn / 2 / np.max(np.abs(direction), axis=0)
    grown = np.zeros(pairs.shape[1])
    for move in (direction, -direction):
        room = np.where(move > 0, high - pairs, pairs - low)
        share = np.min(room / np.maximum(np.abs(move), room + 1e-300), axis=0)
        grown += (wheelbase(params, *(pairs + share * move)) - least) / 2
    return ALLOWED * float(np.max(grown, initial=0.0))


def require_grid(problem: PostureData, rear: int, front: int, chunk: int) -> None:
    """Refuse a grid whose stations do not fit, or not while a chunk of them is evaluated: more go
    through one chunk after another, also those of one waypoint."""
    K, each = len(problem.x), float(min(rear, 10**150)) * min(front, 10**150)
    given = f"angles = {checks.shown(rear)} x {checks.shown(front)} at {K} waypoints"
    checks.require_memory(
        given, "stations", K * each, NODE + STATION * min(chunk / (K * each), 1.0)
    )


LEAST = 31
"""Default least number of angles of each leg in a grid."""
FINEST = 96
"""Angles of each leg that a fitting grid has at most."""
USED = 0.95
"""Share of the legs' rate that moves over the grid should be able to use."""
ROUNDING = 1e-9
"""Part of a grid step, or of an allowed move, by which a move may seem too long."""


def grid_angles(
    problem: PostureData, angles: Any, least: Any, chunk: int
) -> tuple[Float[np.ndarray, "R"], Float[np.ndarray, "F"]]:
    """The angles of each leg on a grid [rad]: see `build_grid`; ValueError for bad counts, or more
    stations than fit, evaluated so many at a time."""
    least = checks.require_integer("least", least, low=2, high=COUNT)
    if angles is None:
        rear, front = fitting_grid(problem, least)
        require_grid(problem, len(rear), len(front), chunk)
        return rear, front
    accepted = "None, or an integer >= 2, or one for each leg"
    both = angles if isinstance(angles, tuple | list) else (angles, angles)
    checks.require_that(len(both) == 2, "angles", angles, accepted)
    R, F = (checks.require_integer("angles", of, low=2, accepted=accepted) for of in both)
    require_grid(problem, R, F, chunk)
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    rear, front = (np.linspace(low, high, of if low < high else 1) for of in (R, F))
    return rear, front


def fitting_grid(
    problem: PostureData, least: int = LEAST
) -> tuple[Float[np.ndarray, "R"], Float[np.ndarray, "F"]]:
    """Evenly spaced angles of the rear and of the front leg [rad], at least so many each.

    On a grid a leg moves by whole steps: with steps of 70 % of what the rate allows between
    waypoints, 30 % of it lie idle. So the step is a whole part of leg_rate times the shortest
    spacing, and the angles run through the given start and end (the start alone where no such step
    leads from one to the other; the middle of the range where neither is given). Where FINEST are
    too few, only those within reach of the given ends are taken; and where even these are
    too many, or the rate has no limit, `least` over the whole range.
    """
    ends = [of for of in (problem.start_angles, problem.end_angles) if of is not None]
    rear, front = (_of_leg(problem, [float(at[leg]) for at in ends], least) for leg in (0, 1))
    return rear, front


def _of_leg(problem: PostureData, ends: list[float], least: int) -> np.ndarray:
    """One leg's angles; ends: its angles where the first or the last pair is given."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    if low == high:
        return np.array([low])
    whole = np.linspace(low, high, least)
    if problem.leg_rate is None:
        return whole
    limit = float(np.min(problem.longest_moves))
    reach = float(problem.leg_rate) * float(np.sum(np.diff(problem.x)))
    near = max([low, *(at - reach for at in ends)]), min([high, *(at + reach for at in ends)])
    most = max(FINEST, least)
    for below, above in ((low, high), near):
        width = above - below
        if not 0 < width <= limit * (most - 1) * (1 + ROUNDING):
            continue
        parts = max(int(np.ceil(limit * least / width - ROUNDING)), 1)
        finest = max(int(limit * (most - 1) / width + ROUNDING), parts)
        step = _step(limit, range(parts, finest + 1), ends)
        at = ends[0] if ends else (below + above) / 2
        first, last = -int((at - below) / step + ROUNDING), int((above - at) / step + ROUNDING)
        return np.clip(at + step * np.arange(first, last + 1), below, above)
    return whole


def _step(limit: float, parts: range, ends: list[float]) -> float:
    """The longest step that uses the rate well and leads from the one given angle to the other;
    or the longest that uses the rate."""
    between = abs(ends[-1] - ends[0]) if ends else 0.0
    for part in parts:
        longest = limit / part
        if between <= ROUNDING * longest:
            return longest
        step = between / np.ceil(between / longest - ROUNDING)
        if step >= USED * longest:
            return float(step)
    return limit / parts[0]


def step_of(angles: Float[np.ndarray, "n"]) -> float:
    """The distance of neighbouring angles [rad]; 0 for one angle."""
    return float(angles[-1] - angles[0]) / max(len(angles) - 1, 1)


def windows_of(
    angles: Float[np.ndarray, "n"], limits: Float[np.ndarray, "k"]
) -> Int[np.ndarray, "k"]:
    """Grid steps that a leg may move in each step of the drive; limits: the longest [rad]."""
    most = len(angles) - 1
    if most == 0:
        return np.zeros(limits.shape, int)
    return np.minimum(np.floor(limits / step_of(angles) + ROUNDING), most).astype(int)
