"""The ranges that a reset of the UGV environment draws from, and the ground drawn from them."""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.names import RANDOM_TRACKS, TRACKS
from stickslip.dynamics.pytrees import Number, Numeric, pytree_dataclass
from stickslip.dynamics.ugv import Odometer, Track, UGVParams
from stickslip.dynamics.ugv.ground.roughness import rough_waves
from stickslip.dynamics.ugv.ground.shapes import Bump
from stickslip.dynamics.ugv.ground.spline import hermite_table
from stickslip.dynamics.ugv.ground.surface import Surface, pairs
from stickslip.dynamics.ugv.track import track_of
from stickslip.envs.functional import Range, require_range, uniform

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Real


CLASS_A, CLASS_C, CLASS_D = 16e-6, 256e-6, 1024e-6
"""Roughness of ISO 8608 [m^3]."""
RAMP = 0.05
"""Length of the transition between the frictions of two patches [m]."""
BYTES = 256
"""About what a wave, a piece or a cell of a drawn track takes in one environment."""


@pytree_dataclass
class RandomTrack:
    """Ground drawn for every episode: a bump, roughness, or both.

    bump_height, bump_width, bump_centre: of `Bump`, each uniform in (low, high) [m]; no bump where
    bump_height is None. roughness: G(n0) of `rough_waves` [m^3], uniform in its logarithm; class C
    of ISO 8608 is 2.56e-4, each class 4 times the one before. grip: factors on the friction
    coefficient of `patches` patches, each uniform in (low, high), as long as one length, uniform in
    patch_length [m], and laid from a place up to one such length before the start, see Surface;
    None: friction is the same everywhere. waves, pieces: of the drawn spectrum
    and of the table that holds the sum (see `hermite_table`), from the params' track.start to
    track.end, straight beyond. cells: of the odometer. The last four are static.
    """

    bump_height: Range | None = None
    bump_width: Range = (0.8, 1.6)
    bump_centre: Range = (3.5, 5.5)
    roughness: Range | None = None
    waves: int = field(default=32, metadata={"static": True})
    pieces: int = field(default=96, metadata={"static": True})
    cells: int = field(default=48, metadata={"static": True})
    grip: Range | None = None
    patch_length: Range | None = None
    patches: int = field(default=16, metadata={"static": True})

    @classmethod
    def named(cls, name: str) -> RandomTrack:
        """One of RANDOM_TRACKS by its name.

        random-bump: bumps of 2 to 20 cm. random-rough: classes A to D of ISO 8608. random-mixed:
        bumps up to 15 cm on classes A to C.
        """
        checks.require_choice("track", name, RANDOM_TRACKS)
        if name == "random-bump":
            return cls((0.02, 0.2))
        if name == "random-rough":
            return cls(roughness=(CLASS_A, CLASS_D))
        return cls((0.0, 0.15), roughness=(CLASS_A, CLASS_C))

    def validate(self) -> RandomTrack:
        """Return self, or raise ValueError naming the field."""
        if self.bump_height is None and self.roughness is None:
            raise ValueError(
                "bump_height and roughness are None; accepted: a range (low, high) for one or both"
            )
        require_range("bump_height", self.bump_height, -np.inf)
        require_range("bump_width", self.bump_width, 0.0, strict=True, optional=False)
        require_range("bump_centre", self.bump_centre, optional=False)
        require_range("roughness", self.roughness, 0.0, strict=True)
        require_range("grip", self.grip, 0.0)
        require_range("patch_length", self.patch_length, RAMP, strict=True)
        checks.require_both(grip=self.grip, patch_length=self.patch_length)
        for name in ("waves", "pieces", "cells", "patches"):
            value = checks.require_integer(name, getattr(self, name))
            checks.require_memory(
                f"{name} = {checks.shown(value)}", f"{name} of a ground", value, BYTES
            )
        given = f"pieces = {self.pieces}, waves = {self.waves}"
        checks.require_memory(given, "waves at knots", self.pieces * self.waves, 64)
        return self

    def draw(self, key: Array, start: Numeric, end: Numeric, dtype: DTypeLike) -> Odometer:
        """The ground from start to end [m] and its arc length. Pure; `key` decides."""
        keys = jax.random.split(key, 5)
        bump = Bump(
            uniform(keys[0], self.bump_height or (0.0, 0.0), dtype),
            uniform(keys[1], self.bump_centre, dtype),
            uniform(keys[2], self.bump_width, dtype),
        )
        shape: Any = bump
        if self.roughness is not None:
            low, high = (jnp.log(jnp.asarray(end_, dtype)) for end_ in self.roughness)
            level = jnp.exp(uniform(keys[3], (low, high), dtype))
            waves = rough_waves(keys[4], level, waves=self.waves)

            def both(x: Array) -> Any:
                return jax.tree.map(jnp.add, waves.profile(x), bump.profile(x))

            shape = hermite_table(both, start, end, self.pieces)
        track = Track(shape, start, end, self._surface(key, start, dtype))
        odometer = Odometer.along(track, start, end, self.cells)
        return cast(odometer, dtype)

    def _surface(self, key: Array, start: Real[Number, ""], dtype: DTypeLike) -> Surface | None:
        """Surface from a key of its own, so that the ground is the same with and without it."""
        if self.grip is None or self.patch_length is None:
            return None
        keys = jax.random.split(jax.random.fold_in(key, 5), 3)
        length = uniform(keys[0], self.patch_length, dtype)
        first = start - length * uniform(keys[1], (0.0, 1.0), dtype)
        edges = first + length * jnp.arange(1, self.patches, dtype=dtype)
        factors = uniform(keys[2], self.grip, dtype, (self.patches,))
        return Surface(*pairs(edges, factors, RAMP))


@pytree_dataclass
class UGVRandomisation:
    """Ranges of a reset's draws; what is None stays as it is and is not compiled in.

    track: the ground. friction: mu itself, uniform in (low, high) [-]. start_angles: each leg's,
    uniform in (low, high) [rad].
    """

    track: RandomTrack | None = None
    friction: Range | None = None
    start_angles: Range | None = None

    def validate(self, vehicle: UGVParams) -> UGVRandomisation:
        """Return self, or raise ValueError naming the range."""
        if self.track is not None:
            checks.require_kind("track", self.track, RandomTrack, "None or a RandomTrack")
            self.track.validate()
        require_range("friction", self.friction, 0.0)
        require_range("start_angles", self.start_angles, 0.0)
        if self.start_angles is not None:
            ends = jnp.stack([jnp.asarray(end) for end in self.start_angles], -1)
            vehicle.check_leg_angles(ends, "start_angles")
        return self


def ground_of(track: Any, drawn: UGVRandomisation) -> tuple[Track, UGVRandomisation]:
    """The ground and what is drawn, where the ground may be a name: of TRACKS, or of RANDOM_TRACKS,
    which is drawn anew for every episode in place of level ground. ValueError for another one."""
    if isinstance(track, str):
        checks.require_choice("track", track, (*TRACKS, *RANDOM_TRACKS), also="a Track")
        if track in RANDOM_TRACKS:
            if drawn.track is not None:
                raise ValueError(
                    f"track = {track!r} beside a track in randomisation; accepted: one of them"
                )
            return Track.flat(), replace(drawn, track=RandomTrack.named(track))
    elif not isinstance(track, Track):
        names = ", ".join((*TRACKS, *RANDOM_TRACKS))
        raise ValueError(f"track = {checks.shown(track)}; accepted: a Track, or {names}")
    return track_of(track), drawn


T = TypeVar("T")


def covering(odometer: Odometer, start: Numeric, end: Numeric) -> Odometer:
    """The odometer, or one that reaches from start to end where it does not, or may not."""
    ends = (odometer.start, odometer.end, start, end)
    if checks.is_concrete(*ends):
        first, last, start, end = map(np.asarray, ends)
        slack = 1e-6 * (1 + np.abs(last - first))  # it may be of another precision
        if np.all((first <= start + slack) & (end <= last + slack)) or not np.all(start < end):
            return odometer
    if any(np.ndim(given) for given in (odometer.start, start, end)):
        raise ValueError(
            "start, end: beyond the odometers of a batch; accepted: parameters made within vmap"
        )
    return odometer_over(odometer.track, start, end, jnp.result_type(odometer.start))


def odometer_over(track: Track, start: Numeric, end: Numeric, dtype: DTypeLike) -> Odometer:
    """Odometer over the track and the drive, whichever reaches farther; of the rounded numbers,
    so that it comes out the same from those of a file."""
    track.require_resolved(dtype)
    track, start, end = (cast(tree, dtype) for tree in (track, start, end))
    known = checks.is_concrete(track, start, end)
    least, greatest = (np.minimum, np.maximum) if known else (jnp.minimum, jnp.maximum)
    first, last = least(track.start, start), greatest(track.end, end)
    return cast(Odometer.along(track, first, last), dtype)


def cast(tree: T, dtype: DTypeLike) -> T:
    """Every number as an array of the type."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), tree)
