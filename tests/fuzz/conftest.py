"""A third machine for sweeps."""

from collections.abc import Iterator

import pytest

from stickslip.agents.machine import _MACHINES, register
from tests.agents.mass import MassMachine


@pytest.fixture
def mass() -> Iterator[None]:
    """Register the mass."""
    register(MassMachine())
    yield
    del _MACHINES["mass"]
