"""The points of a sweep: a grid of its axes times samples of its random axes."""

from __future__ import annotations

import hashlib
import math
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from stickslip.dynamics.checks import require_integer, require_kind, require_number, shown

RANGE = re.compile(r"([^:]+):([^:]+):(\d{1,6}|sobol|latin)(:log)?")
FORMS = (
    "LOW:HIGH:N (even), LOW:HIGH:N:log, values as 0.1,0.2,0.5, or LOW:HIGH:sobol and "
    "LOW:HIGH:latin, either with :log, for random ones"
)
MOST_SAMPLES = 10**7
SAMPLE = "sample"
"""The dimension that all random axes share."""


@dataclass(frozen=True)
class Axis:
    """Values of one parameter.

    kind: "grid" with `values`, or how they are sampled from low to high: "sobol" or "latin".
    log: whether samples are even in the logarithm.
    """

    kind: str
    values: tuple[float, ...] = ()
    low: float = math.nan
    high: float = math.nan
    log: bool = False

    @classmethod
    def of(cls, given: AxisLike) -> Axis:
        """Build an axis from a text (see FORMS), a number or several. ValueError otherwise."""
        if isinstance(given, Axis):
            return given
        if isinstance(given, str) and ":" in given:
            return cls._range(given)
        if isinstance(given, str):
            given = [_number(one, given) for one in given.split(",")]
        values = np.atleast_1d(np.asarray(list(given) if isinstance(given, Iterable) else given))
        require_number("values", values, accepted="finite numbers, at least one")
        if len(set(values.tolist())) < values.size:
            raise ValueError(f"values = {shown(values.tolist())}; accepted: each value once")
        return cls("grid", tuple(map(float, values)))

    @classmethod
    def _range(cls, text: str) -> Axis:
        found = RANGE.fullmatch(text)
        if found is None:
            raise ValueError(f"{shown(text)} is no axis; accepted: {FORMS}")
        low, high, log = _number(found[1], text), _number(found[2], text), bool(found[4])
        count = int(found[3]) if found[3].isdigit() else 2
        if not -math.inf < low < high < math.inf or (log and low <= 0) or count < 2:
            raise ValueError(
                f"{shown(text)}; accepted: finite LOW < HIGH, LOW > 0 with log, 2 values or more"
            )
        if not found[3].isdigit():
            return cls(found[3], low=low, high=high, log=log)
        return cls("grid", tuple((np.geomspace if log else np.linspace)(low, high, count).tolist()))

    @property
    def random(self) -> bool:
        """True if its values are sampled."""
        return self.kind != "grid"

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest value, or the range that is sampled."""
        return (self.low, self.high) if self.random else (min(self.values), max(self.values))

    def scaled(self, unit: np.ndarray) -> np.ndarray:
        """Map samples from [0, 1) to the axis' range."""
        if self.log:
            return np.exp(math.log(self.low) + math.log(self.high / self.low) * unit)
        return self.low + (self.high - self.low) * unit


AxisLike: TypeAlias = "Axis | str | float | Iterable[float]"
"""Accepted forms of an axis: itself, its text, one value or several."""


@dataclass(frozen=True)
class Design:
    """Points by a flat index: gridded axes in their order, the last one fastest, then the samples.

    samples: 0 without random axes. seed: of the samples.
    """

    axes: dict[str, Axis]
    samples: int = 0
    seed: int = 0

    @classmethod
    def of(cls, axes: Mapping[str, AxisLike], samples: int | None, seed: int) -> Design:
        """Check axes and samples. ValueError naming the axis."""
        require_kind("axes", axes, Mapping, 'a dict of axes by name, {"mu": "0.02:0.3:64"} or such')
        found = {}
        for name, given in axes.items():
            try:
                found[str(name)] = Axis.of(given)
            except ValueError as error:
                raise ValueError(f"axis {name}: {error}") from error
        random = [name for name, one in found.items() if one.random]
        if bool(random) != (samples is not None):
            raise ValueError(f"samples = {samples}; accepted: a number with random axes, else None")
        count = 0 if samples is None else require_integer("samples", samples, high=MOST_SAMPLES)
        return cls(found, count, require_integer("design_seed", seed, low=0, high=2**32 - 1))

    @property
    def dims(self) -> dict[str, int]:
        """Length of every dimension."""
        found = {name: len(one.values) for name, one in self.axes.items() if not one.random}
        return found | ({SAMPLE: self.samples} if self.samples else {})

    @property
    def points(self) -> int:
        """Number of points; 1 without axes."""
        return math.prod(self.dims.values())

    def at(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """The axes' values at points by their flat indices, in float64."""
        places = np.unravel_index(points, tuple(self.dims.values()) or (1,))
        where = dict(zip(self.dims, places, strict=False))
        return {
            name: self.drawn[name][where[SAMPLE]]
            if axis.random
            else np.asarray(axis.values)[where[name]]
            for name, axis in self.axes.items()
        }

    @cached_property
    def drawn(self) -> dict[str, np.ndarray]:
        """Samples of the random axes, each [samples]; all axes of a kind are sampled together."""
        from scipy.stats import qmc

        found: dict[str, np.ndarray] = {}
        for kind, sampler in (("sobol", qmc.Sobol), ("latin", qmc.LatinHypercube)):
            names = [name for name, one in self.axes.items() if one.kind == kind]
            if names:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", UserWarning)  # counts that are no power of two
                    unit = sampler(len(names), rng=self.seed).random(self.samples)
                found |= {name: self.axes[name].scaled(unit[:, i]) for i, name in enumerate(names)}
        return found

    def describe(self) -> dict[str, object]:
        """Everything as JSON values; samples by a digest, since the seed makes them again."""
        axes: dict[str, object] = {}
        for name, one in self.axes.items():
            if one.random:
                digest = hashlib.sha256(self.drawn[name].tobytes()).hexdigest()
                axes[name] = {**vars(one), "digest": digest, "values": None}
            else:
                axes[name] = {"kind": one.kind, "values": list(one.values)}
        return {"axes": axes, "samples": self.samples, "design_seed": self.seed}


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{shown(text)} in {shown(whole)} is no number; accepted: {FORMS}"
        ) from None
