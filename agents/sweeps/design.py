"""The points of a sweep: a grid of its axes, and beside it samples of its random ones."""

from __future__ import annotations

import hashlib
import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.sweeps.axis import axis_of
from stickslip.agents.sweeps.names import RANDOM
from stickslip.dynamics.checks import require_integer, require_kind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.sweeps.axis import Axis, AxisLike
    from stickslip.agents.sweeps.definition import AxisEntry
    from stickslip.agents.sweeps.definition import Design as Described

MOST_POINTS = 10**9
MOST_SAMPLES = 10**7
SAMPLE = "sample"
"""The name of the dimension that random axes share."""


@dataclass(frozen=True)
class Design:
    """Points by a flat index: gridded axes in their order, the last one fastest, and behind them
    the samples. samples: 0 where no axis is random. seed: of the samples."""

    axes: dict[str, Axis]
    samples: int = 0
    seed: int = 0

    @property
    def gridded(self) -> tuple[str, ...]:
        """The axes whose values are not drawn."""
        return tuple(name for name, one in self.axes.items() if not one.random)

    @property
    def dims(self) -> dict[str, int]:
        """Length of every dimension."""
        found = {name: len(self.axes[name].values) for name in self.gridded}
        return found | ({SAMPLE: self.samples} if self.samples else {})

    @property
    def points(self) -> int:
        """How many there are; 1 without axes."""
        return math.prod(self.dims.values())

    def at(self, first: int, last: int) -> dict[str, np.ndarray]:
        """The axes' values at points first to last - 1, each [last - first], in float64."""
        places = np.unravel_index(np.arange(first, last), tuple(self.dims.values()) or (1,))
        where = dict(zip(self.dims, places, strict=False))
        drawn = self.drawn
        return {
            name: drawn[name][where[SAMPLE]]
            if axis.random
            else np.asarray(axis.values)[where[name]]
            for name, axis in self.axes.items()
        }

    @cached_property
    def drawn(self) -> dict[str, np.ndarray]:
        """The samples of the random axes, each [samples]."""
        found: dict[str, np.ndarray] = {}
        for kind in RANDOM:
            names = [name for name, one in self.axes.items() if one.kind == kind]
            if names:
                shares = _shares(kind, len(names), self.samples, self.seed)
                found |= {
                    name: self.axes[name].scaled(shares[:, i]) for i, name in enumerate(names)
                }
        return found

    def describe(self) -> Described:
        """All of it as JSON values; random values by a digest, since seeds make them again."""
        axes: dict[str, AxisEntry] = {}
        for name, one in self.axes.items():
            if one.random:
                axes[name] = {
                    "kind": one.kind,
                    "log": one.logarithmic,
                    "low": one.low,
                    "high": one.high,
                    "digest": hashlib.sha256(self.drawn[name].tobytes()).hexdigest(),
                }
            else:
                axes[name] = {"kind": one.kind, "log": one.logarithmic, "values": list(one.values)}
        return {"axes": axes, "samples": self.samples, "design_seed": self.seed}


def design_of(axes: Mapping[str, AxisLike], samples: int | None, seed: int) -> Design:
    """The design. ValueError for a bad axis, too many points, samples without random axes."""
    require_kind("axes", axes, dict, "a dict of axes by name")
    found = {str(name): axis_of(str(name), given) for name, given in axes.items()}
    random = [name for name, one in found.items() if one.random]
    if not random and samples is not None:
        raise ValueError(f"samples = {samples} without a random axis; accepted: with one")
    if random and samples is None:
        raise ValueError(
            f"axis {random[0]} is random; accepted: with samples, how many points all random axes "
            "draw together"
        )
    count = 0 if samples is None else require_integer("samples", samples, high=MOST_SAMPLES)
    made = Design(found, count, require_integer("design_seed", seed, low=0, high=2**32 - 1))
    if made.points > MOST_POINTS:
        lengths = " x ".join(map(str, made.dims.values()))
        raise ValueError(f"{lengths} makes {made.points:.3g} points; accepted: {MOST_POINTS:.0e}")
    return made


def _shares(kind: str, dimensions: int, count: int, seed: int) -> np.ndarray:
    """Shares [count, dimensions] in [0, 1)."""
    from scipy.stats import qmc

    made = qmc.Sobol if kind == "sobol" else qmc.LatinHypercube
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # counts that are no powers of two
        return made(dimensions, rng=seed).random(count)
