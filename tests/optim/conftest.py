"""Every test of the optimisation runs under strict promotion, and with the user's switch off."""

from collections.abc import Iterator

import jax
import pytest


@pytest.fixture(autouse=True)
def _strict_promotion() -> Iterator[None]:
    """Arrays of different types never mix silently; also one key for all of JAX's caches."""
    with jax.numpy_dtype_promotion("strict"):
        yield
