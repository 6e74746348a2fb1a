"""The mass is a machine in every test of sweeps."""

from collections.abc import Iterator

import pytest

from stickslip.agents.machine import _MACHINES, register
from tests.agents.mass import MassMachine


@pytest.fixture(autouse=True)
def _registered() -> Iterator[None]:
    register(MassMachine())
    yield
    del _MACHINES["mass"]
