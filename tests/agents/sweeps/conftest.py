"""The mass is a machine in every test of sweeps."""

import pytest


@pytest.fixture(autouse=True)
def _registered(mass: None) -> None:
    """See the fixture `mass`."""
