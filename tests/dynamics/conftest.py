"""Every test of the dynamics runs under strict promotion, so that compiled functions are shared."""

from collections.abc import Iterator

import jax
import pytest

from stickslip.dynamics import batch_axes, fused, jax_versions


@pytest.fixture(autouse=True)
def _strict_promotion() -> Iterator[None]:
    """Arrays of different types never mix silently; also one key for all of JAX's caches."""
    with jax.numpy_dtype_promotion("strict"):
        yield


@pytest.fixture
def untried(monkeypatch) -> Iterator[None]:
    """As if the JAX at hand were newer than any that was tried."""
    monkeypatch.setattr(jax_versions, "TRIED", (0, 0))
    answers = batch_axes._refused, fused._works
    for one in answers:
        one.cache_clear()
    yield
    for one in answers:
        one.cache_clear()
