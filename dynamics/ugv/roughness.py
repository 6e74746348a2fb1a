"""Random rough ground with the spectrum of ISO 8608.

The standard describes road profiles by the one-sided power spectral density of their height over
spatial frequency n [cycles/m], straight in double logarithmic axes:

    G(n) = G(n0) (n / n0)^-2,    n0 = 0.1 cycles/m,

and classes A (very good) to H by G(n0), whose geometric means are 16e-6 x 4^k m^3, k = 0 to 7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_choice, require_number
from stickslip.dynamics.numeric import Numeric, float_type
from stickslip.dynamics.ugv.shapes import as_floats
from stickslip.dynamics.ugv.spline import Spline, hermite_table

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.ugv.shapes import Profile

REFERENCE_FREQUENCY = 0.1
"""n0 [cycles/m]."""

CLASSES = tuple("ABCDEFGH")

BAND = (0.05, 1.0)
"""Spatial frequencies drawn by default [cycles/m].

Longer waves than 20 m hardly tilt a vehicle of 1 m. Waves shorter than 1 m make the ground
hollower than a wheel: the root mean square of y'' is 0.037 1/m in class C and 1.2 1/m in class H,
and grows with the upper end to the power 3/2, against 1 / r = 3.6 1/m of a wheel of 0.28 m.
"""

WAVES = 64
PIECES_PER_WAVE = 8
"""Of the table, for the shortest wave."""


def class_roughness(iso_class: str) -> float:
    """G(n0) [m^3], the geometric mean of an ISO 8608 class "A" to "H"."""
    require_choice("iso_class", iso_class, CLASSES)
    return 16e-6 * 4.0 ** CLASSES.index(iso_class)


def band_variance(roughness: Numeric, band: tuple[float, float] = BAND) -> Numeric:
    """Integral of G over the band [m^2]: the mean square height of the ground drawn from it."""
    low, high = band
    return roughness * REFERENCE_FREQUENCY**2 * (1 / low - 1 / high)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Waves:
    """Sum of cosines, y = sum_i amplitude_i cos(2 pi n_i x + phase_i); exact but slow."""

    amplitudes: Float[Array, "waves"]
    frequencies: Float[Array, "waves"]
    phases: Float[Array, "waves"]

    def profile(self, x: Numeric) -> Profile:
        """Sums over the waves, of amplitudes [m], frequencies [cycles/m] and phases [rad]."""
        x, a, n, phase = as_floats(x, self.amplitudes, self.frequencies, self.phases)
        k = 2 * np.pi * n
        angle = k * x[..., None] + phase
        cosine, sine = jnp.cos(angle), jnp.sin(angle)
        return (cosine * a).sum(-1), -(sine * (a * k)).sum(-1), -(cosine * (a * k * k)).sum(-1)


def rough_waves(
    key: Array, roughness: Numeric, *, band: tuple[float, float] = BAND, waves: int = WAVES
) -> Waves:
    """Draw a ground of roughness G(n0) [m^3], which may be traced. A pure function of the key.

    The band is cut into `waves` equal intervals [a, b], one cosine each of frequency
    n_i = sqrt(a b) and amplitude sqrt(2 G(n_i) (b - a)): G(n_i) (b - a) is then the integral of G
    over the interval exactly, and the mean square height that of the band. Phases uniform and
    independent, in single precision for either type, so that a key means one ground.
    """
    edges = _checked_edges(band, waves)
    require_number("roughness", roughness, low=0.0, accepted="a finite number >= 0 [m^3]")
    (level,) = as_floats(roughness)
    dtype = level.dtype
    variance = REFERENCE_FREQUENCY**2 * (1 / edges[:-1] - 1 / edges[1:])
    phases = jax.random.uniform(key, (waves,), jnp.float32, 0.0, 2 * np.pi)
    return Waves(
        jnp.sqrt(level) * jnp.asarray(np.sqrt(2 * variance), dtype),
        jnp.asarray(np.sqrt(edges[:-1] * edges[1:]), dtype),
        phases.astype(dtype),
    )


def rough_shape(
    key: Array,
    roughness: Numeric,
    start: Numeric = -2.0,
    end: Numeric = 22.0,
    *,
    band: tuple[float, float] = BAND,
    waves: int = WAVES,
    pieces: int | None = None,
) -> Spline:
    """Draw a ground as `rough_waves` does and tabulate it from start to end [m], for speed.

    pieces: of the table (see hermite_table), by default 8 for the shortest wave: in class C the
    largest errors of height, slope and second derivative are then 7e-9 m, 2e-7 and 1.1e-5 1/m, of
    root mean squares 7e-3 m, 1e-2 and 4e-2 1/m; with twice the pieces 64, 32 and 16 times less
    (in single precision not: 3e-8 m, 7e-7 and 3e-5 1/m). Needed when start or end is traced. Past
    the ends the ground goes on straight: let them enclose the drive and the vehicle's length.
    """
    drawn = rough_waves(key, roughness, band=band, waves=waves)
    if pieces is None:
        if not is_concrete(start, end):
            raise ValueError("pieces = None with traced ends; accepted: an integer >= 1")
        longest = float(np.max(np.asarray(end, float) - np.asarray(start, float)))
        accepted = "start < end, finite [m]"
        require_number("end - start", longest, low=0.0, strict=True, accepted=accepted)
        pieces = max(1, math.ceil(longest * band[1] * PIECES_PER_WAVE))
    dtype = float_type(drawn)
    first, last = jnp.asarray(start, dtype), jnp.asarray(end, dtype)
    return hermite_table(drawn.profile, first, last, pieces)


def _checked_edges(band: tuple[float, float], waves: int) -> np.ndarray:
    """Edges of the waves' intervals of spatial frequency [cycles/m]."""
    if isinstance(waves, bool) or not isinstance(waves, int) or waves < 1:
        raise ValueError(f"waves = {waves!r}; accepted: an integer >= 1")
    low, high = band
    if not 0 < low < high < math.inf:
        raise ValueError(f"band = {band!r}; accepted: (low, high), 0 < low < high [cycles/m]")
    return np.linspace(low, high, waves + 1)
