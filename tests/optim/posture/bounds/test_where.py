"""Which waypoints are halved next: however few there are."""

import numpy as np
import pytest

from stickslip.optim.posture.bounds.sweep import BESIDE, bottleneck, lossy


@pytest.mark.parametrize("count", [2, 3, 4, 2 * BESIDE, 2 * BESIDE + 1, 30])
def test_those_where_the_bound_loses_and_four_beside(count: int):
    at = count // 3
    places = np.arange(count)
    costs = np.where(places == at, 1.0, 0.0)
    assert bottleneck(costs, 1.0).tolist() == (np.abs(places - at) <= BESIDE).tolist()
    go = np.where(places <= at, 1.0, 0.0)  # all is paid between at and the next one
    near = (places >= at - BESIDE) & (places <= at + 1 + BESIDE)
    assert lossy(np.zeros(count), go).tolist() == near.tolist()
