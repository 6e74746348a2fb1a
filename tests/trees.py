"""Trees of numbers side by side, and slopes from differences."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np


def assert_same(one: object, other: object, rtol: float = 0.0, atol: float = 0.0) -> None:
    """The same structure, types and numbers; without a tolerance to the last bit."""
    assert jax.tree.structure(one) == jax.tree.structure(other)
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        a, b = np.asarray(a), np.asarray(b)
        assert a.dtype == b.dtype
        np.testing.assert_allclose(a, b, rtol, atol)
        assert rtol or atol or a.tobytes() == b.tobytes()


def differences(function: Callable[[np.ndarray], Any], x: np.ndarray, step: float) -> np.ndarray:
    """Central differences, the last axis over x."""
    ways = step * np.eye(len(x))
    return np.stack([(function(x + d) - function(x - d)) / (2 * step) for d in ways], -1)
