"""scipy on exact derivatives: the epigraph form is right, and statuses are mapped honestly."""

import numpy as np
import pytest

from stickslip.optim import OptimStatus, Weighted, solve
from stickslip.optim.posture.local.gradient import Epigraph
from stickslip.optim.posture.local.linearise import Near
from tests.optim.posture.helpers import over_bump, random_x

MIXED = Weighted((("total_energy", 1.0), ("peak_torque", 2.0), ("torque_variation", 0.1)))


@pytest.mark.parametrize("criterion", ["grip", MIXED], ids=lambda c: getattr(c, "name", c))
def test_derivatives_are_those_of_the_epigraph_form(criterion):
    problem = over_bump(criterion)
    x = random_x(problem, 1)
    form = Epigraph(Near(problem), x)
    random = np.random.default_rng(4)
    z = form.start(x)
    z += 0.01 * random.standard_normal(z.size)
    z[: problem.n] = np.clip(z[: problem.n], *(side + s for side, s in zip(
        problem.bounds, (1e-3, -1e-3), strict=True)))  # fmt: skip
    way = random.standard_normal(z.size)
    ahead, behind = z + 1e-6 * way, z - 1e-6 * way
    slope = (form.constraints(ahead) - form.constraints(behind)) / 2e-6
    np.testing.assert_allclose(form.jacobian(z) @ way, slope, rtol=1e-5, atol=1e-7)
    slope = (form.objective(ahead) - form.objective(behind)) / 2e-6
    np.testing.assert_allclose(form.gradient(z) @ way, slope, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("criterion", ["grip", MIXED], ids=lambda c: getattr(c, "name", c))
def test_the_least_tops_make_the_form_feasible_and_equal_to_the_objective(criterion):
    problem = over_bump(criterion, leg_rate=None)
    x = random_x(problem, 2, spread=0.1)
    form = Epigraph(Near(problem), x)
    z = form.start(x)
    np.testing.assert_allclose(form.objective(z) * form.scale, problem.objective(x), rtol=1e-12)
    assert problem.is_feasible(x)
    assert np.min(form.constraints(z)) >= 0


@pytest.mark.parametrize("criterion", ["wheel_energy", "peak_torque"])
def test_it_agrees_with_convex_programming_and_improves_on_the_grid(criterion):
    problem = over_bump(criterion)
    grid = solve(problem, "dp", polish=False, angles=9)
    found = solve(problem, "gradient", start=grid.x)
    assert found.status is OptimStatus.FEASIBLE, found.message
    assert found.feasible
    assert found.lower_bound is None
    assert found.value == problem.objective(found.x)
    assert found.value <= grid.value * (1 - 1e-4)
    other = solve(problem, "scp", start=grid.x)
    np.testing.assert_allclose(found.value, other.value, rtol=1e-3)
