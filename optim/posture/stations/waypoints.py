"""Waypoints of a drive, and checks of a posture problem's arguments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.checks import require_kind, require_number, shown
from stickslip.dynamics.numeric import read_only
from stickslip.dynamics.once import run_once
from stickslip.dynamics.ugv import PoseSolver, UGVParams
from stickslip.dynamics.ugv.track import Track, track_of
from stickslip.optim.options import as_floats, require_scalar
from stickslip.optim.posture.sizes import WAYPOINT, require_stations, require_waypoints
from stickslip.optim.posture.stations.wheels import longest_wheelbase

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.stations.data import PostureData


_slope = run_once(Track.slope)


def waypoints_along(
    track: Track | str,
    params: UGVParams,
    spacing: float,
    start: float | None,
    end: float | None,
    bytes_each: float = WAYPOINT,
) -> Float[np.ndarray, "K"]:
    """Evenly spaced places of the front wheel [m]; see PostureProblem.along.

    By default the first lies in from the track's start by the longest wheelbase and by how far the
    contacts of both wheels can lie off below their centres on the steepest slope there. bytes_each:
    what each will need at least; more waypoints than that leaves room for are refused.
    """
    track = track_of(track)
    require_kind("params", params, UGVParams, "UGVParams, or None")
    params.validate()
    require_scalar("spacing", spacing, low=0.0, strict=True, accepted="a length > 0 [m]")
    for name, value in (("start", start), ("end", end)):
        if value is not None:
            require_scalar(name, value, low=-np.inf, accepted="a finite position [m]")
    first, last = float(np.asarray(track.start)), float(np.asarray(track.end))
    last = last if end is None else float(end)
    if start is None:
        reach, r = longest_wheelbase(params), float(params.wheel_radius)
        with jax.enable_x64(True):
            places = np.linspace(first, first + reach + 2 * r, 64)
            slope = np.asarray(_slope(track.astype(places.dtype), places))
        begin = first + reach + 2 * r * float(np.max(np.abs(np.sin(np.arctan(slope)))))
        why = f" (track from {first:.6g} m, and {begin - first:.6g} m for the rear wheel)"
    else:
        begin, why = float(start), ""
    if not begin < last:
        raise ValueError(
            f"start = {begin:.6g} m{why}, end = {last:.6g} m; accepted: start < end "
            "on a track longer than the longest wheelbase"
        )
    with np.errstate(over="ignore"):
        pieces = np.maximum(np.ceil(np.float64(last - begin) / float(spacing) - 1e-9), 1)
    require_waypoints(float(spacing), begin, last, pieces, bytes_each)
    return np.linspace(begin, last, int(pieces) + 1)


def check_problem(problem: PostureData) -> dict[str, Any]:
    """The fields as arrays, or ValueError naming the field, the value and what is accepted."""
    require_kind("params", problem.params, UGVParams, "a UGVParams")
    require_kind("solver", problem.solver, PoseSolver, "a PoseSolver")
    problem.params.validate()
    for leaf in jax.tree.leaves(problem.params):
        if np.ndim(leaf):
            raise ValueError(f"params has a field of shape {np.shape(leaf)}; accepted: numbers")
    x = _waypoints(problem.x)
    if isinstance(problem.track, Track) and problem.track.surface is not None:
        problem.track.surface.validate()
    require_stations(f"x of {len(x)} waypoints", len(x))
    fields: dict[str, Any] = {"track": track_of(problem.track), "x": x}
    accepted = "a number >= 0, or one for each waypoint"
    require_number("friction", problem.friction, low=0.0, accepted=accepted, dtype=np.float64)
    if np.shape(problem.friction) not in ((), x.shape):
        raise ValueError(
            f"friction has shape {np.shape(problem.friction)}; accepted: a number or one for each "
            f"of the {len(x)} waypoints"
        )
    if isinstance(problem.friction, np.ndarray):
        fields["friction"] = read_only(problem.friction)
    if problem.leg_rate is not None:
        accepted = "None, or a number > 0 [rad/m]"
        require_scalar("leg_rate", problem.leg_rate, low=0.0, strict=True, accepted=accepted)
    for name, unit in (("min_normal", "N"), ("min_grip", "N"), ("min_clearance", "m")):
        require_scalar(name, getattr(problem, name), low=0.0, accepted=f"a number >= 0 [{unit}]")
    if problem.max_torque is not None:
        accepted = "None, or a torque > 0 [N m]"
        require_scalar("max_torque", problem.max_torque, low=0.0, strict=True, accepted=accepted)
    for name in ("start_angles", "end_angles"):
        given = getattr(problem, name)
        if given is not None:
            fields[name] = _pair(name, given, problem.params)
    return fields


def _waypoints(x: Any) -> np.ndarray:
    array = as_floats("x", x, "increasing places, two or more [m]")
    if array.ndim != 1 or len(array) < 2:
        raise ValueError(f"x has shape {array.shape}; accepted: [K] with K >= 2 waypoints")
    falls = np.flatnonzero(np.diff(array) <= 0)
    if falls.size:
        i = int(falls[0]) + 1
        raise ValueError(f"x[{i}] = {array[i]} after {array[i - 1]}; accepted: increasing [m]")
    return read_only(array)


def _pair(name: str, angles: Any, params: UGVParams) -> np.ndarray:
    low, high = float(params.leg_angle_min), float(params.leg_angle_max)
    accepted = f"2 angles, rear and front, from {low:.6g} to {high:.6g} rad"
    array = as_floats(name, angles, accepted)
    if array.shape != (2,) or np.any((array < low - 1e-9) | (array > high + 1e-9)):
        raise ValueError(f"{name} = {shown(array.tolist())} is not accepted; accepted: {accepted}")
    return read_only(np.clip(array, low, high))
