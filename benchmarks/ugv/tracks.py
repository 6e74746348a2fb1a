"""The ground of the measurements: one bump, one rough track, and twelve tracks to choose on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.ugv import Track
from stickslip.dynamics.ugv.ground.roughness import Waves, class_roughness, rough_waves

START, END = 0.0, 8.0
"""Of every track [m]."""
PIECES = 512
"""Of every table that is measured, however long it is: so all of them share one program."""
MIDDLE = (START + END) / 2
ISO_CLASS, SEED = "D", 0
"""Of the rough track: medium to bad ground, whose heights have a root mean square of 13 mm."""


def bump() -> Track:
    """The chapter's bump in closed form."""
    return Track.bump(start=START, end=END)


def waves() -> Track:
    """The rough ground in closed form, a sum of 64 cosines: exact but slow."""
    shape: Waves = rough_waves(jax.random.key(SEED), class_roughness(ISO_CLASS))
    return Track(shape, START, END)


def three_sines(x):
    """Heights of a ground given as a function."""
    return 0.05 * jnp.sin(2 * x + 0.3) + 0.02 * jnp.sin(5 * x + 1) + 0.006 * jnp.sin(9 * x + 2)


def sines() -> Track:
    """Ground whose slopes come from differentiating a function."""
    return Track.from_function(three_sines, START, END)


EXACT: dict[str, Callable[[], Track]] = {"bump": bump, "rough": waves}
"""The two grounds without a table."""


def extent(density: float) -> tuple[float, float]:
    """Ends of a table of PIECES pieces with `density` of them for each metre [m]."""
    return MIDDLE - PIECES / density / 2, MIDDLE + PIECES / density / 2


def tabulated(track: Track, density: float) -> Track:
    """The ground as quintics that hold its height, slope and second derivative at the knots."""
    return track.resampled(*extent(density), PIECES)


def through_points(track: Track, density: float, interpolation: str) -> Track:
    """The ground through points of itself."""
    x = np.linspace(*extent(density), PIECES + 1)
    return Track.from_points(x, np.asarray(track.height(jnp.asarray(x))), interpolation)


@dataclass(frozen=True)
class Named:
    """One of the twelve: a name and what makes it."""

    name: str
    make: Callable[..., Track]
    numbers: dict[str, Any]

    def track(self) -> Track:
        """As a table of 16 pieces a metre from -2 to 10 m, so that all twelve share programs."""
        ground = self.make(start=START, end=END, **self.numbers)
        return ground.resampled(START - 2, END + 2, 192)


def twelve() -> list[Named]:
    """Three each of rough ground, bumps, sinusoids and steps; sizes and places from one seed."""
    random = np.random.default_rng(12)

    def drawn(low: float, high: float) -> float:
        return round(float(random.uniform(low, high)), 3)

    listed = [Named(f"rough {c}", Track.rough, {"key": i, "iso_class": c})
              for i, c in enumerate("CDE")]  # fmt: skip
    for i in range(3):
        numbers = {"height": drawn(0.1, 0.3), "centre": drawn(3, 6), "width": drawn(0.8, 1.4)}
        listed.append(Named(f"bump {i}", Track.bump, numbers))
    for i in range(3):
        numbers = {"amplitude": drawn(0.03, 0.1), "wavelength": drawn(2.0, 4.0)}
        listed.append(Named(f"sinusoid {i}", Track.sinusoid, numbers))
    for i in range(3):
        numbers = {"height": drawn(0.08, 0.25), "position": drawn(3, 6), "length": drawn(1.0, 2.0)}
        listed.append(Named(f"step {i}", Track.step, numbers))
    return listed
