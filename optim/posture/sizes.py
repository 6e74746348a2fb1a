"""Memory of methods in bytes, so that a size is refused before anything of it exists.

Measured as the growth of a process's peak with size (compilation, about 0.3 GB, apart); the tests
measure some of it again. Each is meant to be within a factor of two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_memory, shown

if TYPE_CHECKING:
    from stickslip.optim.posture.stations.data import PostureData

WAYPOINT = 24
"""Bytes of a waypoint's place and of what computing it takes."""
STATION = 1_000
"""Bytes of a station while it is evaluated."""
NODE = 360
"""Bytes of a grid's station, kept, and copied by the recursion."""
MOVE = 300
"""Bytes of one of the moves that a leg pair may make on a grid."""
EDGE = 1_800
"""Bytes of an edge of lp's graph, in the linear program."""
CONVEX = 150_000
"""Bytes of a waypoint in scp's convex program, which gradient uses too."""
SPARSE = 300_000
"""Bytes of a waypoint in trust-constr's matrices."""
DENSE = 900
"""Bytes of a pair of waypoints in SLSQP's matrices, which are dense."""
COVARIANCE = 160
"""Bytes of a pair of waypoints in the matrices of cma."""


def require_waypoints(
    spacing: float, start: float, end: float, pieces: float, bytes_each: float
) -> None:
    """Refuse a spacing [m] that makes more waypoints from start to end [m] than fit."""
    given = f"spacing = {spacing!r} m from start = {start:.6g} m to end = {end:.6g} m"
    require_memory(given, "waypoints", pieces + 1, bytes_each)


def require_stations(given: str, count: float, bytes_each: float = STATION) -> None:
    """Refuse to evaluate more stations at once than fit."""
    require_memory(given, "stations", count, bytes_each)


def require_grid(problem: PostureData, rear: int, front: int, chunk: int) -> None:
    """Refuse a grid whose stations do not fit, or not while a chunk of them is evaluated: more go
    through one chunk after another, also those of one waypoint."""
    K, each = len(problem.x), _float(rear) * _float(front)
    given = f"angles = {shown(rear)} x {shown(front)} at {K} waypoints"
    at_once = min(chunk / (K * each), 1.0)
    require_stations(given, K * each, NODE + STATION * at_once)


def _float(count: int) -> float:
    try:
        return float(count)
    except OverflowError:
        return np.inf


def require_waypoint_matrices(
    problem: PostureData, method: str, linear: float = 0.0, square: float = 0.0
) -> None:
    """Refuse more waypoints than a method's matrices have room for: bytes of each, and of each pair
    of waypoints."""
    K = len(problem.x)
    require_memory(f"method = {method!r} with {K} waypoints", "rows", K, linear + square * K)


def require_jacobian(problem: PostureData) -> None:
    """Refuse a dense matrix of all constraints' slopes that does not fit."""
    rows = 13.0 * len(problem.x)
    bytes_each = 8.0 * problem.n
    require_memory(f"a jacobian of {problem.n} angles", "rows", rows, bytes_each)


def require_moves(problem: PostureData, wide: np.ndarray) -> None:
    """Refuse a list of more moves than fit; wide: how many grid steps each leg may turn [2]."""
    count = float(np.prod(2.0 * np.asarray(wide, float) + 1))
    require_memory(f"leg_rate = {problem.leg_rate} rad/m on this grid", "moves", count, MOVE)
