"""The problem as plain arrays: what any optimiser needs, in double precision, with no glue."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.dynamics import Status
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, place
from stickslip.optim import OptimStatus, PostureProblem, solve
from stickslip.optim.posture.problem import evaluate_finer, finer
from stickslip.optim.posture.waypoints import nearer_between
from tests.optim.posture.helpers import HIGH, LOW, TRACK, over_bump, random_x
from tests.trees import differences

DOWN = np.pi / 2


@pytest.mark.parametrize("name", ["total_energy", "grip", "torque_variation"])
def test_gradient_is_the_slope_of_the_objective(name: str):
    problem = over_bump(name)
    x = random_x(problem, seed=4)
    slope = problem.gradient(x)
    scale = np.max(np.abs(slope))
    assert scale > 0
    np.testing.assert_allclose(slope, differences(problem.objective, x, 1e-6), atol=1e-6 * scale)


def test_jacobian_is_the_slope_of_the_constraints():
    problem = over_bump()
    x = random_x(problem, seed=4)
    slopes = problem.jacobian(x)
    assert slopes.shape == (len(problem.constraints(x)), problem.n)
    np.testing.assert_allclose(slopes, differences(problem.constraints, x, 1e-6), atol=1e-7)


@pytest.mark.parametrize("count", [0, 5])
def test_a_batch_is_the_drives_one_by_one(count: int):
    problem = over_bump("total_energy")
    X = np.stack([random_x(problem, seed) for seed in range(8)])[:count]
    values = problem.objectives(X)
    assert values.shape == (count,)
    np.testing.assert_allclose(values, [problem.objective(x) for x in X], rtol=1e-12)


def test_a_batch_of_drives_too_long_for_one_call_is_the_drives_one_by_one():
    problem = PostureProblem.along(Track.flat(), start=3.0, end=7.2, spacing=1e-3)
    X = np.full(problem.n, np.pi / 2) + np.array([[0.0], [0.1]])
    np.testing.assert_array_equal(problem.objectives(X), [problem.objective(x) for x in X])


def test_everything_is_double_precision_while_the_users_switch_is_off():
    problem = over_bump()
    x = random_x(problem)
    assert not jax.config.read("jax_enable_x64")
    arrays = [problem.gradient(x), problem.constraints(x), problem.jacobian(x), *problem.bounds]
    arrays += [problem.objectives(x[None]), *problem.stations(x)[:-1]]
    assert {of.dtype for of in arrays} == {np.dtype("float64")}
    assert all(isinstance(of, np.ndarray) for of in arrays)
    assert isinstance(problem.objective(x), float)
    change = problem.objective(x + 1e-10 * (np.arange(problem.n) == 3)) - problem.objective(x)
    assert 0 < abs(change) < 1e-5
    assert not jax.config.read("jax_enable_x64")
    assert jax.numpy.zeros(1).dtype == np.float32


def test_constraints_and_residuals_agree_on_what_is_broken():
    """Each constraint alone, made too strict for a drive that meets the others."""
    x = random_x(over_bump(), spread=0.05)
    held = over_bump().stations(x)
    rate = np.max(np.abs(np.diff(x.reshape(-1, 2), axis=0))) / 0.6
    for name, value, missed in (
        ("min_normal", 5000.0, 5000.0 - min(held.N_rear.min(), held.N_front.min())),
        ("min_grip", 4000.0, 4000.0 - held.grip.min()),
        ("min_clearance", 2.0, 2.0 - held.clearance.min()),
        ("leg_rate", 0.01, rate - 0.01),
    ):
        group = {"leg_rate": "leg_rate"}.get(name, name.removeprefix("min_"))
        problem = over_bump(**{name: value})
        margins, residuals = problem.constraints(x), problem.residuals(x)
        broken = {of for of, at in problem.constraint_groups.items() if np.any(margins[at] < 0)}
        assert broken == {group}
        assert {of for of, by in residuals.items() if by > 0} == {group}
        np.testing.assert_allclose(residuals[group], missed, rtol=1e-9)
        assert not problem.is_feasible(x)
    assert over_bump().is_feasible(x)


def test_wheels_nearer_than_the_gap_are_a_broken_constraint():
    x = random_x(over_bump(), spread=0.05)
    problem = replace(over_bump(), params=UGVParams(wheel_gap=0.3))
    rear, front = 0.35 * np.exp(1j * x.reshape(-1, 2)).T
    missed = 0.86 + problem.min_wheel_clearance - np.min(np.abs(0.83 - front - rear.conj()))
    broken = np.flatnonzero(problem.constraints(x) < 0)
    wheels = problem.constraint_groups["wheels"]
    assert set(broken) <= set(range(wheels.start, wheels.stop))
    np.testing.assert_allclose(-np.min(problem.constraints(x)[broken]) * 0.35, missed, rtol=1e-9)
    residuals = problem.residuals(x)
    assert {name for name, by in residuals.items() if by > 0} == {"wheels"}
    np.testing.assert_allclose(residuals["wheels"], missed, rtol=1e-9)
    assert problem.stations(x).status.tolist().count(Status.OVERLAP) > 0
    assert "wheels" not in replace(problem, solver=PoseSolver(overlap=True)).constraint_groups


@pytest.mark.parametrize("turn", [0.03, 0.3, 1.2])
@pytest.mark.parametrize(
    "params", [UGVParams(), UGVParams(body_length=1.2, leg_length=0.6, wheel_radius=0.2)]
)
def test_wheels_that_clear_each_other_at_two_waypoints_do_so_between_them(params, turn: float):
    def apart(pair: np.ndarray) -> np.ndarray:
        rear, front = params.leg_length * np.exp(1j * pair)
        return np.abs(params.body_length - front - rear.conj()) - 2 * params.wheel_radius

    random = np.random.default_rng(0)
    low, high = np.full((2, 40_000), LOW), np.full((2, 40_000), HIGH)
    low[0] = high[0] = random.uniform(LOW, HIGH, 40_000)
    touching = (apart(low) < 0) & (apart(high) > 0)
    for _ in range(50):  # the front leg with which the wheels just touch
        middle = (low + high) / 2
        low, high = (np.where(apart(middle) < 0, *of) for of in ((middle, low), (high, middle)))
    way = random.uniform(-1, 1, middle.shape)
    way *= turn / 2 / np.max(np.abs(way), axis=0)
    ends = np.stack([middle - way, middle + way])
    inside = touching & np.all((ends >= LOW) & (ends <= HIGH), axis=(0, 1))
    nearer = np.minimum(apart(ends[0]), apart(ends[1]))
    allowed = nearer_between(params, turn)
    assert np.max(nearer[inside], initial=0.0) <= allowed
    assert turn > 1 or np.max(nearer[inside]) > 0.7 * allowed  # and little more is asked for


def test_range_and_given_ends_are_bounds():
    problem = replace(over_bump(), start_angles=(1.5, 1.6), end_angles=(1.2, 1.3))
    low, high = problem.bounds
    np.testing.assert_array_equal(low[:2], [1.5, 1.6])
    np.testing.assert_array_equal(high[-2:], [1.2, 1.3])
    assert np.all(low[2:-2] == LOW)
    assert np.all(high[2:-2] == HIGH)
    np.testing.assert_array_equal(problem.free.bounds, [low[2:-2], high[2:-2]])
    assert over_bump().free.n == over_bump().n
    residuals = problem.residuals(np.full(problem.n, 3.0))
    assert residuals["leg_range"] == pytest.approx(3.0 - HIGH)
    assert residuals["start_angles"] == pytest.approx(1.5)
    assert residuals["end_angles"] == pytest.approx(1.8)


def test_a_place_without_a_pose_is_infeasible_and_never_nan():
    """Legs crossed until the wheels meet, outside their range: the wheelbase vanishes."""
    crossed = np.arccos(0.83)
    params = UGVParams(leg_length=0.5, leg_angle_min=np.pi / 3, leg_angle_max=2.0)
    problem = replace(over_bump(), params=params)
    x = np.full(problem.n, DOWN)
    x[4:6] = crossed
    assert problem.stations(x).status[2] not in (Status.OK, Status.WHEEL_SLIP)
    assert not np.isnan(problem.objective(x))
    assert problem.objective(x) > 0
    for numbers in (problem.gradient(x), problem.constraints(x), problem.jacobian(x)):
        assert np.all(np.isfinite(numbers))
    assert problem.residuals(x)["pose"] == 1
    assert not problem.is_feasible(x)


def test_waypoints_keep_the_rear_wheel_on_the_track():
    for track in (TRACK, Track.incline(0.4), Track.sinusoid()):
        problem = PostureProblem.along(track, spacing=0.25)
        assert np.all(np.diff(problem.x) <= 0.25 + 1e-12)
        assert problem.x[-1] == 8.0
        angles = np.array([[HIGH, HIGH], [LOW, LOW], [HIGH, LOW], [DOWN, HIGH]])
        rear = np.asarray(rear_contact(problem.params, track, problem.x[0], angles))
        assert np.min(rear) >= -1e-6
        assert np.min(rear) < 0.35  # no farther in than it takes


@jax.jit
def rear_contact(params, track, x, angles):
    return place(params, track, x, angles, PoseSolver(samples=0)).rear.x


def test_bad_decision_vectors_are_refused():
    problem = over_bump()
    with pytest.raises(ValueError, match=r"x = nan .*accepted: 20 finite"):
        problem.gradient(np.full(problem.n, np.nan))
    with pytest.raises(ValueError, match=r"x has shape \(10, 2\); accepted: \(20,\)"):
        problem.constraints(np.ones((10, 2)))
    with pytest.raises(ValueError, match=r"accepted: \(20,\)"):
        problem.objectives(np.ones(problem.n))


@pytest.mark.long
@pytest.mark.parametrize("method", ["dp", "scp", "gradient", "cma"])
def test_where_no_angle_is_free_every_method_returns_the_given_ones(method: str):
    pytest.importorskip("cma")
    ends = {"start_angles": (1.5, 1.6), "end_angles": (1.6, 1.5)}
    only = replace(over_bump("torque_variation", **ends), x=np.array([3.3, 3.7]))
    assert only.free.n == 0
    options = {"angles": 3} if method == "dp" else {}
    found = solve(only, method, **options)
    assert found.status in (OptimStatus.OPTIMAL, OptimStatus.FEASIBLE)
    np.testing.assert_array_equal(found.x, [1.5, 1.6, 1.6, 1.5])


def at(problem, x, **others):
    return problem.result(x, method="guess", status=OptimStatus.FEASIBLE, began=0.0, **others)


@pytest.mark.parametrize("criterion", ["friction_demand", "total_energy"])
def test_it_is_the_value_of_the_finer_problem(criterion):
    ice = np.linspace(0.8, 0.3, 10)
    problem = replace(over_bump(criterion), friction=ice, leg_rate=2.0)
    x = random_x(problem)
    fine = finer(problem, 10)
    np.testing.assert_allclose(fine.x[::10], problem.x, rtol=1e-15)
    np.testing.assert_allclose(np.diff(fine.x), 0.06)
    angles = [np.interp(fine.x, problem.x, leg) for leg in problem.angles(x).T]
    whole = np.stack(angles, -1).ravel()
    np.testing.assert_allclose(fine.friction, np.interp(fine.x, problem.x, ice))
    found = at(problem, x)
    assert found.fine_value == pytest.approx(fine.objective(whole), rel=1e-9)
    assert found.fine_spacing == pytest.approx(0.06)
    assert found.fine_feasible == fine.is_feasible(whole)
    want = fine.residuals(whole)
    assert found.fine_residuals == pytest.approx(want, rel=1e-6, abs=1e-9)
    assert found.value == problem.objective(x)


def test_a_bump_between_two_waypoints_breaks_a_constraint_that_holds_at_both():
    narrow = Track.from_points([0.0, 3.9, 4.0, 4.1, 9.0], [0.0, 0.0, 0.06, 0.0, 0.0], "linear")
    problem = PostureProblem(over_bump().params, narrow, np.array([3.3, 3.7, 5.6, 6.0]),
                             friction=0.15)  # fmt: skip
    found = at(problem, np.full(problem.n, np.pi / 2))
    assert found.feasible
    assert not found.fine_feasible
    assert found.fine_residuals["grip"] > 100


def test_it_has_a_limit_of_its_own():
    x = np.linspace(2.0, 7.0, 40_000)
    problem = PostureProblem(over_bump().params, Track.flat(), x, leg_rate=None)
    found = evaluate_finer(problem, np.full(problem.n, 1.5))
    assert found["fine_spacing"] == pytest.approx(5 / 39_999 / 3)
