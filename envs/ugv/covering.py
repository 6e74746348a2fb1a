"""The arc length along as much of the ground as a drive needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete
from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.ugv import Odometer, Track

if TYPE_CHECKING:
    from jax.typing import DTypeLike

T = TypeVar("T")


def covering(odometer: Odometer, start: Numeric, end: Numeric) -> Odometer:
    """The odometer, or one that reaches from start to end where it does not, or may not."""
    ends = (odometer.start, odometer.end, start, end)
    if is_concrete(*ends):
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
    known = is_concrete(track, start, end)
    least, greatest = (np.minimum, np.maximum) if known else (jnp.minimum, jnp.maximum)
    first, last = least(track.start, start), greatest(track.end, end)
    return cast(Odometer.along(track, first, last), dtype)


def cast(tree: T, dtype: DTypeLike) -> T:
    """Every number as an array of the type."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), tree)
