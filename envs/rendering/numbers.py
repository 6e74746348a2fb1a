"""Numbers as words, and round steps of scales."""

from __future__ import annotations

from math import floor, log10


def written(value: float, digits: int) -> str:
    """Format a number with a true minus sign, and none before a zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def brief(value: float) -> str:
    """Format a number with about three figures: two places below 10, one below 100, else none."""
    size = abs(value)
    return written(value, 2 if size < 9.995 else 1 if size < 99.95 else 0)


def nice_step(rough: float) -> float:
    """The least of 1, 2 and 5 times a power of ten that is not below `rough`."""
    power = 10.0 ** floor(log10(rough))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough * 0.999)


def digits_of(step: float) -> int:
    """How many decimals multiples of a round step need."""
    return max(0, -floor(log10(step) + 1e-9))
