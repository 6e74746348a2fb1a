"""Settings for a batch of poses: solver, precision, and a table of the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import jax
import numpy as np

from stickslip.dynamics.checks import (
    require_choice,
    require_integer,
    require_kind,
    require_memory,
)
from stickslip.dynamics.ugv.ground.spline import Spline
from stickslip.dynamics.ugv.params import UGVParams
from stickslip.dynamics.ugv.pose_solver import PoseSolver
from stickslip.dynamics.ugv.track import Track, track_of

DTYPES = ("float32", "float64")

NEAR, FAR = 100.0, 20_000.0
"""Limits of near and far ground, in wheel radii from the origin: beyond FAR nothing is measured.
Rounding grows with the coordinates."""

PIECE_BYTES = 512
"""Working memory of a table for each piece while it is computed, about [bytes]."""


@dataclass(frozen=True)
class Setting:
    """Solver, precision and table for a batch of poses. Static, hashable.

    dtype: of the track and the numbers. pieces: of a table of quintics for each metre of the
    track; None: the ground as it is.
    """

    solver: PoseSolver = field(default=PoseSolver())
    dtype: str = "float64"
    pieces: int | None = None

    def __post_init__(self):
        require_kind("solver", self.solver, PoseSolver, "a PoseSolver")
        require_choice("dtype", self.dtype, DTYPES)
        if self.pieces is not None:
            accepted = "None, or an integer >= 1"
            pieces = require_integer("pieces", self.pieces, accepted=accepted)
            object.__setattr__(self, "pieces", pieces)

    def prepared(self, track: Track | str, params: UGVParams | None = None) -> Track:
        """The track in this precision, and as a table where the setting has one.

        The table reaches beyond the track's ends by the length of the vehicle (by default, the
        default one) and is computed in float64, whatever its numbers become. Ground that is a
        table or a spline stays what it is. Not for use inside a trace. ValueError for float64
        without jax_enable_x64, and for a table that would not fit the memory limit.
        """
        track = track_of(track)
        if jax.dtypes.canonicalize_dtype(self.dtype) != self.dtype:
            raise ValueError("dtype = 'float64' without jax_enable_x64; accepted: 'float32'")
        if self.pieces is None or isinstance(track.shape, Spline):
            return track.astype(self.dtype)
        margin = reach(UGVParams() if params is None else params)
        first, last = float(track.start) - margin, float(track.end) + margin
        # An integer may be too large for a float.
        count = self.pieces * (last - first) if self.pieces < 2**53 else math.inf
        require_memory(f"pieces = {self.pieces}", "pieces of a table", count, PIECE_BYTES)
        with jax.enable_x64(True):
            wide = track.astype("float64")
            table = wide.resampled(first, last, math.ceil(count))
            return table.astype(self.dtype)


def reach(params: UGVParams) -> float:
    """Greatest distance from the front contact at which a vehicle needs the ground [m]."""
    lengths = (params.body_length, params.leg_length, params.wheel_radius)
    body, leg, radius = (float(np.max(np.asarray(length))) for length in lengths)
    return body + 2 * (leg + radius)
