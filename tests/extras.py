"""What a test needs of the extras that `make test` leaves out where they are large."""

from importlib.util import find_spec

import pytest

SB3 = pytest.mark.skipif(
    find_spec("stable_baselines3") is None, reason="needs Stable-Baselines3 (extra sb3)"
)
