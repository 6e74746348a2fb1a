"""Which setting for which accuracy: recommendations out of measured points.

Nothing is measured here. `python -m benchmarks.ugv --update` measures and writes measured.py;
docs/ugv_tradeoff.md says how. Errors are the largest of random postures, costs are seconds for each
pose and its equilibrium on the machine named in `Recommendation.measured_on`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import jax

from stickslip.dynamics.checks import require_choice, require_number
from stickslip.dynamics.ugv import measured
from stickslip.dynamics.ugv.pose_solver import PoseSolver
from stickslip.dynamics.ugv.roughness import Waves
from stickslip.dynamics.ugv.shapes import Function
from stickslip.dynamics.ugv.spline import Spline
from stickslip.dynamics.ugv.track import Track

DTYPES = ("float32", "float64")

WHEEL_RADIUS = 0.28
"""Of the measured vehicle [m]: errors of the rear contact are counted in it."""

MARGIN = 2.0
"""How far a table reaches beyond the track's ends [m]: farther than the vehicle."""


@dataclass(frozen=True)
class Setting:
    """How a batch of poses is computed: solver, precision, table. Static, hashable.

    dtype: of the track and the numbers. pieces: of a table of quintics for each metre of the
    track; None: the ground as it is.
    """

    solver: PoseSolver = field(default=PoseSolver())
    dtype: str = "float64"
    pieces: int | None = None

    def __post_init__(self):
        if not isinstance(self.solver, PoseSolver):
            raise ValueError(f"solver = {self.solver!r}; accepted: a PoseSolver")
        require_choice("dtype", self.dtype, DTYPES)
        if self.pieces is not None and (
            isinstance(self.pieces, bool) or not isinstance(self.pieces, int) or self.pieces < 1
        ):
            raise ValueError(f"pieces = {self.pieces!r}; accepted: None, or an integer >= 1")

    def prepared(self, track: Track) -> Track:
        """The track in this precision, and as a table where the setting has one.

        The table reaches MARGIN beyond the track's ends and is computed in float64, whatever its
        numbers become. Ground that is a table or a spline stays what it is. Not for use inside a
        trace. ValueError for float64 without jax_enable_x64.
        """
        if jax.dtypes.canonicalize_dtype(self.dtype) != self.dtype:
            raise ValueError("dtype = 'float64' without jax_enable_x64; accepted: 'float32'")
        if self.pieces is None or isinstance(track.shape, Spline):
            return track.astype(self.dtype)
        first, last = float(track.start) - MARGIN, float(track.end) + MARGIN
        with jax.enable_x64(True):
            wide = track.astype("float64")
            table = wide.resampled(first, last, math.ceil(self.pieces * (last - first)))
            return table.astype(self.dtype)


@dataclass(frozen=True)
class Measurement:
    """One setting on one measured track and batch.

    torque_error: largest error of the torque over weight times wheel radius [-]. contact_error: of
    the rear contact [m]. cost: processor seconds for each pose.
    """

    track: str
    setting: Setting
    batch: int
    torque_error: float
    contact_error: float
    cost: float

    @property
    def error(self) -> float:
        """The worse of both [-], the contact's in wheel radii."""
        return max(self.torque_error, self.contact_error / WHEEL_RADIUS)


@dataclass(frozen=True)
class Recommendation:
    """The cheapest measured setting that meets a tolerance.

    error [-]: measured, the worse of the torque's and the contact's. cost: processor seconds for
    each pose and its equilibrium, `batch` of them at once. track: the measured one.
    """

    setting: Setting
    error: float
    cost: float
    track: str
    batch: int
    measured_on: str


MEASUREMENTS = tuple(
    Measurement(track, Setting(*measured.SETTINGS[index]), batch, torque, contact, cost)
    for track, index, batch, torque, contact, cost in measured.ROWS
)
"""Every measured point that could be the cheapest for some tolerance, precision and checks."""

TRACKS = tuple(dict.fromkeys(point.track for point in MEASUREMENTS))


def recommend(
    tolerance: float,
    batch: int = 1,
    track: Track | str = "bump",
    *,
    contact_tolerance: float | None = None,
    checks: bool = True,
    dtype: str | None = None,
) -> Recommendation:
    """The cheapest measured setting whose error on such a track was within the tolerance.

    tolerance: error of the torque over weight times wheel radius [-]. contact_tolerance: of the
    rear contact [m], by default tolerance times the wheel's radius. batch: poses computed together;
    the nearest measured number stands for it. track: a Track, or the name of a measured one: "bump"
    stands for ground in a short closed form, "rough" for what is dear to evaluate (sums of waves,
    functions) and for tables of it. checks: only settings that look for hollow ground and compute
    the clearance; without, they are several times cheaper and a pose on hollow ground may pass for
    a good one. dtype: only settings of this precision.

    Measured on gentle ground with the default vehicle: errors on other ground differ, most with a
    fixed number of iterations. Raises ValueError with the best reachable error if nothing meets the
    tolerance.
    """
    accepted = "a finite error > 0"
    require_number("tolerance", tolerance, low=0.0, strict=True, accepted=accepted)
    if contact_tolerance is None:
        contact_tolerance = tolerance * WHEEL_RADIUS
    require_number("contact_tolerance", contact_tolerance, low=0.0, strict=True, accepted=accepted)
    if isinstance(batch, bool) or not isinstance(batch, int) or batch < 1:
        raise ValueError(f"batch = {batch!r}; accepted: an integer >= 1")
    if dtype is not None:
        require_choice("dtype", dtype, DTYPES)
    name = track_class(track)
    points = [point for point in MEASUREMENTS if point.track == name]
    nearest = min({p.batch for p in points}, key=lambda b: abs(math.log(b / batch)))
    points = [
        p
        for p in points
        if p.batch == nearest
        and dtype in (None, p.setting.dtype)
        and (p.setting.solver.samples > 0 or not checks)
    ]
    good = [
        point
        for point in points
        if point.torque_error <= tolerance and point.contact_error <= contact_tolerance
    ]
    if not good:
        best = min(points, key=lambda point: point.error)
        raise ValueError(
            f"tolerance = {tolerance:g} and {contact_tolerance:.3g} m: no measured setting meets "
            f"it on the track {name!r}, {nearest} poses at once; accepted: from "
            f"{best.torque_error:.2g} and {best.contact_error:.2g} m ({best.setting})"
        )
    found = min(good, key=lambda point: (point.cost, point.error))
    return Recommendation(
        found.setting, found.error, found.cost, name, nearest, measured.MEASURED_ON
    )


def track_class(track: Track | str) -> str:
    """The measured track that stands for `track`; ValueError for one that none stands for."""
    if isinstance(track, str):
        require_choice("track", track, TRACKS)
        return track
    if not isinstance(track, Track):
        raise ValueError(f"track = {track!r}; accepted: a Track, or {', '.join(map(repr, TRACKS))}")
    return "rough" if isinstance(track.shape, Spline | Waves | Function) else "bump"
