"""A vehicle with losses: the same cost by every method; no false bound."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import solve
from stickslip.optim.posture.bounds.branch import bound_every_drive
from tests.optim.posture.helpers import plain_cost, random_x, tiny
from tests.optim.posture.test_dp import every_path

ROLLING = UGVParams(rolling_resistance=0.03)


@pytest.mark.parametrize("name", ["wheel_energy", "grip"])
def test_rolling_resistance_counts_in_dp_and_scp(name):
    """Brute force over all paths of a grid; off it scp finds one that is no worse."""
    problem = replace(tiny(name), params=ROLLING)
    costs = plain_cost(name, every_path(problem)[1], problem.friction)
    found = solve(problem, "dp", angles=3, polish=False)
    assert found.value == pytest.approx(np.min(costs), rel=1e-9)
    assert found.value != solve(tiny(name), "dp", angles=3, polish=False).value
    better = solve(problem, "scp", start=found.x)
    assert better.feasible
    assert better.value <= found.value * (1 + 1e-12)


def test_gradients_of_a_vehicle_with_losses_are_those_of_differences():
    problem = replace(tiny("total_energy"), params=ROLLING)
    x, way, h = random_x(problem), np.random.default_rng(1).standard_normal(problem.n), 1e-6
    change = (problem.objective(x + h * way) - problem.objective(x - h * way)) / (2 * h)
    assert problem.gradient(x) @ way == pytest.approx(change, rel=1e-6)
    margins = (problem.constraints(x + h * way) - problem.constraints(x - h * way)) / (2 * h)
    np.testing.assert_allclose(problem.jacobian(x) @ way, margins, atol=1e-6)


@pytest.mark.parametrize("name", ["rolling_resistance"])
def test_bounds_refuse_what_they_do_not_cover(name):
    problem = replace(tiny(), params=UGVParams(**{name: 0.5}))
    for refused in (bound_every_drive, lambda of: solve(of, "branch")):
        with pytest.raises(ValueError, match=f"bounds do not cover {name.replace('_', ' ')}; "):
            refused(problem)
