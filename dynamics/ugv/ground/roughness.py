"""Random rough ground with the spectrum of ISO 8608.

The standard describes road profiles by the one-sided power spectral density of their height over
spatial frequency n [cycles/m], straight in double logarithmic axes:

    G(n) = G(n0) (n / n0)^-2,    n0 = 0.1 cycles/m,

and classes A (very good) to H by G(n0), whose geometric means are 16e-6 x 4^k m^3, k = 0 to 7.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks
from stickslip.dynamics.pytrees import Numeric, float_type, is_key, pytree_dataclass, same_rank
from stickslip.dynamics.ugv.ground.shapes import Closed, as_floats
from stickslip.dynamics.ugv.ground.spline import Spline, hermite_table

if TYPE_CHECKING:
    from jaxtyping import Array, Float


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
"""Pieces of the table for the shortest wave."""


def class_roughness(iso_class: str) -> float:
    """G(n0) [m^3], the geometric mean of an ISO 8608 class "A" to "H"."""
    checks.require_choice("iso_class", iso_class, CLASSES)
    return 16e-6 * 4.0 ** CLASSES.index(iso_class)


@pytree_dataclass
class Waves(Closed):
    """Sum of cosines, y = sum_i amplitude_i cos(2 pi n_i x + phase_i); exact but slow."""

    amplitudes: Float[np.ndarray | Array, "waves"]
    frequencies: Float[np.ndarray | Array, "waves"]
    phases: Float[np.ndarray | Array, "waves"]

    def _near(self, base, u, *waves):
        """Sums over the waves, of amplitudes [m], frequencies [cycles/m] and phases [rad]; whole
        cycles left out of n x."""
        base, u, a, n, phase = same_rank(base[..., None], u[..., None], *waves)
        k = 2 * np.pi * n
        turns = n * base
        angle = 2 * np.pi * (turns - jax.lax.stop_gradient(jnp.round(turns)))
        angle = (angle + phase) + k * u
        cosine, sine = jnp.cos(angle), jnp.sin(angle)
        return ((cosine * a).sum(-1),), -(sine * (a * k)).sum(-1), -(cosine * (a * k * k)).sum(-1)

    def _greatest_bend(self, radius, a, n, phases):
        return jnp.sum(jnp.abs(a) * (2 * np.pi * n) ** 2, axis=-1)


def rough_waves(key: Array, roughness: Numeric, waves: int = WAVES) -> Waves:
    """Draw a ground of roughness G(n0) [m^3], which may be traced. A pure function of the key.

    BAND is cut into `waves` equal intervals [a, b], one cosine each of frequency
    n_i = sqrt(a b) and amplitude sqrt(2 G(n_i) (b - a)): G(n_i) (b - a) is then the integral of G
    over the interval exactly, and the mean square height that of the band. Phases uniform and
    independent, in single precision for either type, so that a key means one ground.
    """
    edges = np.linspace(*BAND, waves + 1)
    checks.require_number("roughness", roughness, low=0.0, accepted="a finite number >= 0 [m^3]")
    variance = REFERENCE_FREQUENCY**2 * (1 / edges[:-1] - 1 / edges[1:])
    amplitudes, frequencies = np.sqrt(2 * variance), np.sqrt(edges[:-1] * edges[1:])
    known = is_key(key) or (getattr(key, "dtype", None) == np.uint32 and np.shape(key) == (2,))
    checks.require_that(known, "key", key, "a JAX key, or for Track.rough a seed")
    phases = jax.random.uniform(key, (waves,), jnp.float32, 0.0, 2 * np.pi)
    if checks.is_concrete(roughness, phases):
        level = np.asarray(roughness, np.float64)[..., None]
        return Waves(np.sqrt(level) * amplitudes, frequencies, np.asarray(phases, np.float64))
    (level,) = as_floats(roughness)
    amplitudes, frequencies = (jnp.asarray(v, level.dtype) for v in (amplitudes, frequencies))
    return Waves(jnp.sqrt(level) * amplitudes, frequencies, phases.astype(level.dtype))


def rough_table(key: Array, roughness: float, start: float, end: float) -> Spline:
    """Draw a ground as `rough_waves` does and tabulate it from start to end [m], for speed.

    With 8 pieces for the shortest wave the largest errors of height, slope and second derivative
    are in class C 7e-9 m, 2e-7 and 1.1e-5 1/m, of root mean squares 7e-3 m, 1e-2 and 4e-2 1/m (in
    single precision 3e-8 m, 7e-7 and 3e-5 1/m). Past the ends the ground goes on straight: let them
    enclose the drive and the vehicle's length.
    """
    pieces = math.ceil((end - start) * BAND[1] * PIECES_PER_WAVE)
    checks.require_memory(
        f"end - start = {end - start:.6g}", "pieces of a table", pieces, 64 * WAVES
    )
    drawn = rough_waves(key, roughness)
    ends: list[Any] = [start, end]
    if not checks.is_concrete(drawn):
        ends = [jnp.asarray(at, float_type(drawn)) for at in ends]
    return hermite_table(drawn.profile, ends[0], ends[1], pieces)
