"""Means, ratios and fractions over episodes, with 95 % confidence intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.tasks.known import CONFIDENCE, UNKNOWN, Interval

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def mean_interval(values: ArrayLike) -> Interval:
    """Mean of independent episodes with Student's t interval; none from a single episode."""
    values = np.asarray(values, float)
    return _student(float(values.mean()), values - values.mean())


def ratio_interval(above: ArrayLike, below: ArrayLike, least: float) -> Interval:
    """Sum over sum, undefined (NaN) unless the mean of `below` is at least `least`.

    The interval is Student's t on the linearised residuals (above - ratio x below) / mean(below),
    the usual one for a ratio estimator (Cochran, Sampling Techniques, ch. 6): unlike the mean of
    the episodes' own ratios it is not upset by an episode that went nowhere.
    """
    above, below = np.asarray(above, float), np.asarray(below, float)
    if not below.mean() >= least:
        return Interval(UNKNOWN)
    ratio = float(above.sum() / below.sum())
    return _student(ratio, (above - ratio * below) / below.mean())


def fraction_interval(happened: ArrayLike) -> Interval:
    """Share of episodes in which something happened, with Wilson's score interval."""
    happened = np.asarray(happened, bool)
    share = float(happened.mean())
    if happened.size < 2:
        return Interval(share)
    from scipy.stats import binomtest

    test = binomtest(int(happened.sum()), happened.size)
    low, high = test.proportion_ci(CONFIDENCE, "wilson")
    return Interval(share, float(low), float(high))


def _student(value: float, residuals: np.ndarray) -> Interval:
    n = residuals.size
    if n < 2 or not np.isfinite(value):
        return Interval(value)
    from scipy.special import stdtrit

    spread = np.sqrt(float(np.sum(residuals**2)) / (n - 1) / n)
    half = float(stdtrit(n - 1, (1 + CONFIDENCE) / 2)) * spread
    return Interval(value, value - half, value + half)
