"""A feedback on floors that are drawn."""

import jax
import numpy as np
import pytest

from stickslip.optim.instances.biped import gains


@pytest.mark.long
def test_gains_draw_floors_and_falls_cost():
    with jax.enable_x64(True):
        problem = gains.gains_problem(2, 3.0, 4)
    good, none = np.array([1.0, 0.3]), np.array([0.0, -2.0])
    drawn = [problem.drawn(i).objective(good) for i in range(3)]
    assert len(set(drawn)) == 3
    assert max(drawn) < problem.objective(none)
