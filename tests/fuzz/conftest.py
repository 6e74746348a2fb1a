"""A machine for sweeps that compiles quickly."""

from collections.abc import Iterator

import pytest

from stickslip.agents.registry import register, unregister
from tests.agents.mass import MassMachine


@pytest.fixture
def mass() -> Iterator[None]:
    register(MassMachine())
    yield
    unregister("mass")
