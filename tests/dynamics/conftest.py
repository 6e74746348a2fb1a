"""Every test of the dynamics runs under strict promotion, so that compiled functions are shared."""

from collections.abc import Iterator

import jax
import pytest


@pytest.fixture(autouse=True)
def _strict_promotion() -> Iterator[None]:
    """Arrays of different types never mix silently; also one key for all of JAX's caches."""
    with jax.numpy_dtype_promotion("strict"):
        yield
