"""Settings recommended for an accuracy, from measured samples (docs/drives.md)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import jax
import numpy as np

from stickslip.dynamics.checks import require_choice, require_integer, require_kind, require_number
from stickslip.dynamics.measured import cheapest, measured_beside
from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.ground.shapes import Function
from stickslip.dynamics.ugv.ground.spline import Spline
from stickslip.dynamics.ugv.params import UGVParams
from stickslip.dynamics.ugv.track import Track
from stickslip.dynamics.ugv.wheel import PoseSolver

MEASURED = measured_beside(__file__)
"""Measurements of `python -m benchmarks.ugv --update`: settings without a wrong status in their
sample, not beaten by one of like precision and checks in cost and both promised errors.

settings: solver, dtype. promises: ground, place, index of the setting, poses in the sample; errors
of the torque over weight times radius [-] and of the rear contact in radii, each typical, promised
and worst. costs: ground, index of the setting, poses at once, processor seconds for each pose
and its equilibrium.
"""
GROUNDS = ("closed", "waves", "spline", "function")
"""Kinds of ground: a closed form, a sum of waves, a spline or table, a user's function."""
NEAR, FAR = 100.0, 20_000.0
"""Limits of near and far ground, in wheel radii from the origin: beyond FAR nothing is measured.
Rounding grows with the coordinates."""
DTYPES = ("float32", "float64")


@dataclass(frozen=True)
class Recommendation:
    """The cheapest measured solver and precision whose promise meets a tolerance.

    dtype: of the track (`Track.astype`) and of the numbers. promised_error [-]: the worse of the
    torque's (over weight times wheel radius) and the rear contact's (in wheel radii): with
    `confidence`, at most a part 1 - `quantile` of the poses of the population has a larger one.
    typical_error: the median; worst_error: the largest that was seen. poses: in the sample, each
    with a vehicle and ground of its own; none had a wrong status, so that with 95 % confidence a
    part of at most 3 / poses has. docs/drives.md says where the poses were drawn from: for others
    nothing is promised. cost: processor seconds for each pose and its equilibrium, `batch` of them
    at once. ground, place: of the sample.
    """

    solver: PoseSolver
    dtype: str
    typical_error: float
    promised_error: float
    worst_error: float
    poses: int
    cost: float
    batch: int
    ground: str
    place: str
    quantile: float = MEASURED["quantile"]
    confidence: float = MEASURED["confidence"]


def promises() -> Iterator[Recommendation]:
    """Every measured setting, all without a wrong status in their sample."""
    settings = [(PoseSolver(**of), dtype) for of, dtype in MEASURED["settings"]]
    for ground, place, index, poses, torque, contact in MEASURED["promises"]:
        typical, promised, worst = map(max, torque, contact)
        solver, dtype = settings[index]
        known = solver, dtype, typical, promised, worst, poses
        for priced, of, batch, cost in MEASURED["costs"]:
            if (priced, of) == (ground, index):
                yield Recommendation(*known, cost, batch, ground, place)


def recommend(
    tolerance: float,
    batch: int = 1,
    track: Track | str = "closed",
    *,
    params: UGVParams | None = None,
    checks: bool = True,
    dtype: str | None = None,
) -> Recommendation:
    """The cheapest measured setting that promises the tolerance on ground of this kind.

    tolerance: error of the torque over weight times wheel radius and of the rear contact in wheel
    radii [-]. batch: poses computed together; the nearest measured number stands for it. track: a
    Track, or one of GROUNDS for one within NEAR wheel radii of the origin. params: the vehicle, by
    default the default one. checks: only settings that look for hollow ground and compute the
    clearance; without, they are several times cheaper and a pose on hollow ground may pass for a
    good one. dtype: only settings of this precision.

    A promise is a quantile over random vehicles, ground and postures, no bound on every pose.
    Raises ValueError with the best promise if none meets the tolerance, and for ground that nothing
    was measured on.
    """
    rule = {"low": 0.0, "strict": True, "accepted": "a finite error > 0", "dtype": np.float64}
    require_number("tolerance", tolerance, **rule)
    params = UGVParams() if params is None else params
    require_kind("params", params, UGVParams, "UGVParams, or None for the default vehicle")
    batch = require_integer("batch", batch)
    if dtype is not None:
        require_choice("dtype", dtype, DTYPES)
    ground = ground_of(track)
    place = place_of(track, float(np.min(np.asarray(params.wheel_radius))))
    points = (
        point
        for point in promises()
        if (point.ground, point.place) == (ground, place)
        and dtype in (None, point.dtype)
        and (point.solver.samples > 0 or not checks)
    )
    refusal = f"no measured setting promises it on ground {ground!r}, {place} the origin"
    return cheapest(points, batch, tolerance, refusal)


def ground_of(track: Track | str) -> str:
    """The kind of ground that stands for `track`; ValueError where nothing was measured."""
    if isinstance(track, str):
        require_choice("track", track, GROUNDS)
        return track
    require_kind("track", track, Track, f"a Track, or {', '.join(map(repr, GROUNDS))}")
    shape = track.shape
    if isinstance(shape, Spline):
        if shape.coefficients.shape[-1] < 3:
            given = "track has straight pieces with kinks, for which nothing is promised"
            raise ValueError(f"{given}; accepted: smooth ground")
        return "spline"
    if isinstance(shape, Waves):
        return "waves"
    return "function" if isinstance(shape, Function) else "closed"


def place_of(track: Track | str, radius: float) -> str:
    """Distance class of the track: within NEAR wheel radii of the origin, or FAR."""
    if isinstance(track, str):
        return "near"
    with jax.enable_x64(True):
        ends = (float(np.min(np.asarray(track.start))), float(np.max(np.asarray(track.end))))
        heights = np.asarray(track.astype("float64").height(np.linspace(*ends, 65)))
    size = float(max(np.max(np.abs(ends)), np.max(np.abs(heights)))) / radius
    if not size <= FAR:
        raise ValueError(
            f"track reaches {size:.3g} wheel radii from the origin, {ends[0]:g} to {ends[1]:g} m; "
            f"accepted: up to {FAR:g}"
        )
    return "near" if size <= NEAR else "far"
