"""Evolution keeps within constraints, budget and seed, and touches nothing global."""

import numpy as np
import pytest

from stickslip.optim import OptimStatus, solve
from tests.optim.posture.helpers import over_bump

pytestmark = pytest.mark.long

BUDGET = {"population": 8, "evaluations": 400}


def start(problem):
    return solve(problem, "dp", polish=False, angles=9).x


def test_it_improves_on_the_grid_within_the_constraints_and_its_budget():
    problem = over_bump("torque_variation")
    begin = start(problem)
    found = solve(problem, "cma", start=begin, **BUDGET)
    assert found.feasible
    assert found.value < problem.objective(begin) * (1 - 1e-4)
    assert found.value == problem.objective(found.x)
    assert found.status is OptimStatus.LIMIT
    assert found.lower_bound is None
    assert BUDGET["evaluations"] <= found.evaluations <= BUDGET["evaluations"] + 17


def test_a_seed_decides_and_nothing_global_is_read_written_or_left_in_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    problem = over_bump("wheel_energy")
    begin = start(problem)
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    one = solve(problem, "cma", start=begin, seed=3, **BUDGET)
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002
    np.random.seed(99)  # noqa: NPY002
    again = solve(problem, "cma", start=begin, seed=3, **BUDGET)
    np.testing.assert_array_equal(again.x, one.x)
    other = solve(problem, "cma", start=begin, seed=4, **BUDGET)
    assert np.any(other.x != one.x)
    assert list(tmp_path.iterdir()) == []
