"""Ten thousand steps, and a million: how far single precision drifts from double."""

import jax
import numpy as np
import pytest

from benchmarks.long_walks import LONG_WALKS, energy, long_walks
from stickslip.dynamics import Status
from tests.dynamics.biped.helpers import default_model

HELD, SLIPPING, FREE = range(3)


def both(calls: int):
    """The same walks in either precision: states and gravest statuses."""
    single, words, _ = long_walks(default_model(dtype="float32"), calls)
    with jax.enable_x64(True):
        double, more, switches = long_walks(default_model(), calls)
    assert list(LONG_WALKS) == [
        "held at 3 rad/s, no slip",
        "held loosely at 4 rad/s, slips each step",
        "free crank, no slip",
    ]
    for word in (words, more):
        assert np.all(word <= Status.SLIP_ONSET)
    return single, double, switches


def angle(states) -> np.ndarray:
    """Of the crank, without wrapping, in double precision whatever the walk's."""
    return np.asarray(states.phase, float) + np.pi * states.steps


def test_ten_thousand_steps_in_single_precision():
    single, double, switches = both(10_000)
    assert np.all(double.steps > 40)
    assert switches[SLIPPING] > 300
    drift = np.abs(angle(single) - angle(double))
    assert drift[HELD] < 1e-4  # of 150 rad
    assert drift[FREE] < 0.2
    with jax.enable_x64(True):
        apart = energy(default_model(), single) - energy(default_model(), double)
    assert abs(apart[FREE]) < 2e-3  # of 38 J
    assert abs(float(single.foot_position[HELD])) == 0.0
    np.testing.assert_allclose(single.time, 10_000 * np.float64(np.float32(0.005)), rtol=6e-8)


@pytest.mark.long
def test_a_million_steps_in_single_precision():
    """What docs/extremes.md says of them."""
    single, double, switches = both(1_000_000)
    assert np.all(double.steps > 4000)
    assert switches[SLIPPING] > 30_000
    turned = angle(double)
    assert np.abs(angle(single) - turned)[HELD] < 1e-6 * turned[HELD]
    assert np.all(np.isfinite(single.crank_rate))
    assert abs(float(single.foot_position[HELD])) == 0.0
