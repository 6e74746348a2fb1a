"""Normalised scores: 0 = zero action, 1 = best known."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import ArrayLike

CONFIDENCE = 0.95
RESAMPLES = 2000
UNKNOWN = float("nan")


class Interval(NamedTuple):
    """An estimate and its confidence interval; NaN where there is none."""

    value: float
    low: float = UNKNOWN
    high: float = UNKNOWN

    def shown(self, decimals: int) -> str:
        """The value and half the width of its interval, if it has one."""
        half = (self.high - self.low) / 2
        return f"{self.value:.{decimals}f}" + (f" ± {half:.{decimals}f}" if isfinite(half) else "")


@dataclass(frozen=True)
class Scale:
    """The two returns that a task's scores lie between. ValueError unless zero < one."""

    zero: float
    one: float

    def __post_init__(self):
        if not self.zero < self.one:
            raise ValueError(
                f"zero = {self.zero}, one = {self.one}; accepted: finite returns, zero < one"
            )

    def score(self, earned: float) -> float:
        """(earned - zero) / (one - zero); above 1 where more is earned than was known."""
        return (earned - self.zero) / (self.one - self.zero)

    def earned(self, score: float) -> float:
        """The return of a score."""
        return self.zero + score * (self.one - self.zero)


def bootstrapped(
    statistic: Callable[..., np.ndarray],
    returns: ArrayLike,
    zero: ArrayLike,
    one: ArrayLike,
    *,
    paired: bool,
) -> Interval:
    """A statistic of three mean returns with its percentile bootstrap interval over episodes.

    returns: of a policy [n]; zero, one: of the trivial policy and the best known [m], exact where
    m = 1. paired: all three were earned on the same episodes, n = m, which are drawn together, so
    that what the episodes differ by cancels. Deterministic; no interval from a single episode.
    """
    import numpy as np

    earned, low, high = (np.asarray(of, float) for of in (returns, zero, one))
    value = float(statistic(earned.mean(), low.mean(), high.mean()))
    n, m = earned.size, low.size
    if n < 2:
        return Interval(value)
    rng = np.random.default_rng(0)
    drawn = rng.integers(n, size=(RESAMPLES, n))
    known = drawn if paired else rng.integers(m, size=(RESAMPLES, m))
    means = earned[drawn].mean(1), low[known].mean(1), high[known].mean(1)
    ends = np.quantile(statistic(*means), [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(value, *map(float, ends))
