"""Checks of what methods and problems are given, in double precision."""

from __future__ import annotations

from typing import Any

import numpy as np

from stickslip.dynamics.checks import require_number
from stickslip.dynamics.numeric import require_one

COUNT = 10**12
"""The greatest number of iterations, edges and the like that may be asked for."""


def require_scalar(name: str, value: Any, **rule: Any) -> None:
    """`require_one` in double precision, whatever jax_enable_x64 says."""
    require_one(name, value, dtype=np.float64, **rule)


def as_floats(name: str, value: Any, accepted: str) -> np.ndarray:
    """Numbers in double precision, or ValueError for what is none, or not finite there."""
    usual = type(value) is np.ndarray and value.dtype == float and value.size > 0
    if usual and np.isfinite(value).all():  # what optimisers ask with, again and again
        return value
    require_number(name, value, accepted=accepted, dtype=np.float64)
    return np.asarray(value, dtype=float)
