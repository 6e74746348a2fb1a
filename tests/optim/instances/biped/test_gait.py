"""A gait of few numbers keeps its limits between its nodes, too."""

import jax
import numpy as np
import pytest

from stickslip.optim import GaitProblem
from stickslip.optim.instances.biped.gait import Interpolated, gait_problem


def test_a_straight_acceleration_is_the_same_motion_on_the_finer_grid():
    with jax.enable_x64(True):
        few, coarse = gait_problem("time", 10, 4, mu=0.3), gait_problem("time", 10, mu=0.3)
    assert isinstance(few, Interpolated)
    assert isinstance(coarse, GaitProblem)
    x = np.r_[20.0, np.linspace(1.0, -1.0, 9)]
    own, whole = coarse.gait(x), few.fine.gait(few.matrix @ x)
    np.testing.assert_allclose(whole.b[:, ::4], own.b, rtol=1e-12)
    np.testing.assert_allclose(whole.a[:, ::4], own.a, atol=1e-12)
    assert few.objective(x) == pytest.approx(coarse.objective(x), rel=1e-3)
    assert np.min(few.constraints(x)) <= np.min(coarse.constraints(x)) + 1e-9
    moved = [few.objective(x + d) - few.objective(x - d) for d in 1e-4 * np.eye(10)]
    np.testing.assert_allclose(few.gradient(x), np.array(moved) / 2e-4, rtol=1e-5, atol=1e-9)
    at = np.stack([few.constraints(x + d) - few.constraints(x - d) for d in 1e-4 * np.eye(10)], 1)
    np.testing.assert_allclose(few.jacobian(x), at / 2e-4, rtol=1e-4, atol=1e-6)


def test_its_program_in_cvxpy_keeps_accelerations_straight_and_limits_everywhere():
    with jax.enable_x64(True):
        few, coarse = gait_problem("time", 10, 4, mu=0.3), gait_problem("time", 10, mu=0.3)
    values = []
    for problem in (few, coarse):
        program, found = problem.in_cvxpy()
        program.solve(solver="CLARABEL")
        x = found()
        assert problem.is_feasible(x)
        values.append(problem.objective(x))
    assert values[0] > 1.01 * values[1]  # what the few nodes did not see
