"""Trees of numbers side by side."""

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
