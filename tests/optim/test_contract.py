"""`solve` and its results are for every problem; each offers the methods that it fits."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip import optim
from stickslip.dynamics.ugv import Track
from stickslip.optim.problem import GENERAL

TARGET = np.array([3.0, 4.0])


class Nearest(optim.Problem[optim.Result]):
    """The point of a disc and a box nearest to a target: a convex problem in the plane.

    With `given`, the first number is that.
    """

    def __init__(self, target, radius: float, given: float | None = None):
        self.target, self.radius, self.given = np.asarray(target, float), radius, given
        self.looked_at = 0

    @property
    def structure(self):
        return frozenset({optim.Structure.SMOOTH, optim.Structure.CONVEX})

    @property
    def n(self):
        return 2

    @property
    def bounds(self):
        low, high = np.array([-2.0, -2.0]), np.array([2.0, 2.0])
        if self.given is not None:
            low[0] = high[0] = self.given
        return low, high

    def evaluate(self, x):
        self.looked_at += 1
        x = self.batch(np.asarray(x)[None])[0]
        margins = np.array([1 - x @ x / self.radius**2])
        missed = max(np.sqrt(x @ x) - self.radius, 0.0)
        value = float(np.sum((x - self.target) ** 2))
        return optim.Evaluation(value, margins, self.meets(x, margins), {"disc": missed})

    def gradient(self, x):
        return 2 * (np.asarray(x) - self.target)

    def jacobian(self, x):
        return -2 * np.asarray(x)[None] / self.radius**2


class Steps(Nearest):
    """The same, known by its values alone, and without any outside the right half."""

    @property
    def structure(self):
        return frozenset()

    def evaluate(self, x):
        found = super().evaluate(x)
        value = found.value if np.asarray(x)[0] >= 0 else np.inf
        return optim.Evaluation(value, found.margins, found.feasible, found.residuals)


@pytest.fixture(params=["gradient", "cma"])
def method(request) -> str:
    if request.param == "cma":
        pytest.importorskip("cma")
    return request.param


def test_methods_find_the_nearest_point_of_a_disc(method):
    problem = Nearest(TARGET, 1.5)
    found = optim.solve(problem, method, start=[0.5, -0.5])
    assert type(found) is optim.Result
    assert found.status is optim.OptimStatus.FEASIBLE
    assert found.method == method
    assert found.feasible
    near = 1e-6 if method == "gradient" else 1e-3
    np.testing.assert_allclose(found.x, TARGET / 5 * 1.5, atol=near)
    assert found.value == pytest.approx(3.5**2, rel=near)
    assert found.lower_bound is None
    assert found.residuals["disc"] <= 1e-6
    assert found.seconds > 0


def test_a_given_number_stays(method):
    problem = Nearest(TARGET, 1.5, given=0.9)
    found = optim.solve(problem, method)
    np.testing.assert_allclose(found.x, [0.9, 1.2], atol=1e-4)
    view = optim.solve(problem.free, method)
    np.testing.assert_allclose(view.x, [1.2], atol=1e-4)
    assert view.value == pytest.approx(found.value, rel=1e-3)


def test_a_point_that_breaks_a_constraint_is_violated_however_the_method_ended():
    kept = (optim.OptimStatus.FAILED, optim.OptimStatus.INFEASIBLE)
    for ended in optim.OptimStatus:
        for x, expected in (
            (0.0, ended),
            (3.0, ended if ended in kept else optim.OptimStatus.VIOLATED),
        ):
            problem = Nearest(TARGET, 1.5)
            found = problem.result([x, 0.0], method="by hand", status=ended, began=0.0)
            assert found.status is expected
            assert problem.looked_at == 1


def test_a_problem_without_a_feasible_point_ends_violated_and_says_how(method):
    options = {"evaluations": 60} if method == "cma" else {}
    found = optim.solve(Nearest(TARGET, 1.5, given=1.8), method, **options)
    assert found.status is optim.OptimStatus.VIOLATED
    assert not found.feasible
    ended = "stopped by maxfevals" if method == "cma" else "SLSQP: "
    assert found.message.startswith(ended)
    assert "misses disc by 0.3" in found.message


def test_a_problem_is_offered_what_it_fits():
    assert set(optim.methods_of(Nearest(TARGET, 1))) == {"gradient", "cma"}
    assert set(optim.methods_of(Steps(TARGET, 1))) == {"cma"}
    with pytest.raises(ValueError, match=r"method = 'gradient' is unknown; accepted: 'cma'"):
        optim.solve(Steps(TARGET, 1), "gradient")
    with pytest.raises(ValueError, match="problem = 3"):
        optim.solve(3)  # type: ignore[arg-type]


def test_values_alone_will_do_with_holes_in_them():
    pytest.importorskip("cma")
    found = optim.solve(Steps([-1.0, 1.0], 1.5), "cma", start=[1.0, 0.0], seed=2)
    np.testing.assert_allclose(found.x, [0.0, 1.0], atol=1e-3)
    none = optim.solve(Steps([1.0, 1.0], 1.5), "cma", start=[-1.0, 0.0])
    assert none.status is optim.OptimStatus.FAILED
    assert "no value" in none.message


def test_batches_and_samples_are_the_points_one_by_one():
    problem = Nearest(TARGET, 1.5)
    X = np.random.default_rng(0).uniform(-2, 2, (7, 2))
    values, missed = problem.sample(X)
    np.testing.assert_array_equal(values, [problem.objective(x) for x in X])
    np.testing.assert_array_equal(values, problem.objectives(X))
    short = [max(-problem.constraints(x)[0], 0) for x in X]
    np.testing.assert_array_equal(missed, short)
    assert [problem.is_feasible(x) for x in X] == [of < 1e-6 for of in short]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"start": [1.0]}, r"start has shape \(1,\)"),
        ({"tolerance": -1.0}, "tolerance = -1.0"),
        ({"angles": 3}, "'angles' is no option of 'gradient'; accepted: start, iterations"),
    ],
)
def test_bad_options_are_refused_by_name(options, said):
    with pytest.raises(ValueError, match=said):
        optim.solve(Nearest(TARGET, 1), "gradient", **options)


def test_a_posture_problem_is_one_of_them():
    problem = optim.PostureProblem.along(Track.bump(), spacing=1.0)
    assert isinstance(problem, optim.Problem)
    assert list(optim.METHODS) == list(optim.methods_of(problem))
    assert not set(GENERAL) - set(optim.METHODS)
    assert optim.Structure.SMOOTH in problem.structure
    found = optim.solve(problem, angles=5, polish=False)
    assert isinstance(found, optim.PostureResult)
    assert (found.method, found.lower_bound, found.gap) == ("dp", None, np.inf)
    assert found.leg_angles is not None
    evaluation = problem.evaluate(found.x)
    assert evaluation.value == found.value == problem.objective(found.x)
    np.testing.assert_array_equal(evaluation.margins, problem.constraints(found.x))
    assert evaluation.residuals == problem.residuals(found.x) == found.residuals
    X = np.stack([found.x, problem.bounds[0], problem.bounds[1]])
    values, missed = problem.sample(X)
    np.testing.assert_array_equal(values, problem.objectives(X))
    assert [bool(of <= 1e-12) for of in missed] == [problem.is_feasible(x, 1e-12) for x in X]


LOW, HIGH = np.full(2, -2.0), np.full(2, 2.0)


def line(unit, x, draw):
    """Least -0.5, on the limit; 0 in the middle."""
    return unit * (x[0] + x[1]), x[0] + x[1] + 0.5


def bowl(unit, x, draw):
    """Least 0.1875 at (0.375, 0.125), on the limit; value and slope 0 in the middle."""
    return unit * (x[0] ** 2 + 3 * x[1] ** 2), x[0] + x[1] - 0.5


def raised(unit, x, draw):
    """Least 0.125 above a million, on the limit."""
    return unit * (1e6 + (x[0] - 1) ** 2 + (x[1] - 1) ** 2), 1.5 - x[0] - x[1]


@pytest.mark.parametrize("start", [None, [1e-7, 0.0]], ids=["zero", "tiny"])
@pytest.mark.parametrize(("function", "low"), [(line, -0.5), (bowl, 0.1875), (raised, 1e6 + 0.125)])
def test_the_optimum_is_found_in_any_unit_from_any_value(method, function, low, start):
    for unit in (1e-9, 1e9):
        found = optim.solve(optim.FunctionProblem(function, unit, LOW, HIGH), method, start=start)
        assert found.status is optim.OptimStatus.FEASIBLE
        assert found.value / unit == pytest.approx(low, rel=1e-12, abs=2e-6)
