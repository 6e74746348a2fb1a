"""Trees of numbers side by side."""

import jax
import numpy as np


def assert_same(one: object, other: object, rtol: float = 0.0, atol: float = 0.0) -> None:
    """The same structure, types and numbers."""
    assert jax.tree.structure(one) == jax.tree.structure(other)
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        assert np.asarray(a).dtype == np.asarray(b).dtype
        np.testing.assert_allclose(a, b, rtol, atol)
