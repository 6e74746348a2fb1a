"""Bounds of quantiles from samples, whatever the distribution: order statistics."""

from __future__ import annotations


def rank(count: int, quantile: float, confidence: float) -> int:
    """Which of `count` sorted values is an upper bound of the quantile with this confidence.

    The least k with P(Binomial(count, quantile) <= k - 1) >= confidence: the k-th smallest value
    is below the true quantile with a chance of at most 1 - confidence. count + 1 where so few
    values bound nothing.
    """
    from scipy.stats import binom

    return int(binom.ppf(confidence, count, quantile)) + 1
