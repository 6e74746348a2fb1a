"""A vehicle with losses: the same cost by every method, and no drive below its bound."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.dynamics.ugv import Track, UGVParams, equilibrium
from stickslip.optim import CRITERIA, PostureProblem, solve
from stickslip.optim.posture.bounds.branch import bound_every_drive
from stickslip.optim.posture.track_file import read_track
from tests.optim.posture.bounds.helpers import SHORT, drives, over
from tests.optim.posture.helpers import plain_cost, random_x, tiny
from tests.optim.posture.test_dp import every_path

LOSSES = {"drive_efficiency": 0.8, "regeneration_efficiency": 0.6, "holding_loss": 2e-3}
LOSSES["rolling_resistance"] = 0.03
LOSSY = UGVParams(**LOSSES)


@pytest.mark.parametrize("name", [pytest.param("wheel_energy", marks=pytest.mark.long), "grip"])
@pytest.mark.long
def test_rolling_resistance_counts_in_dp_and_scp(name):
    """Brute force over all paths of a grid; off it scp finds one that is no worse."""
    problem = replace(tiny(name), params=UGVParams(rolling_resistance=0.03))
    costs = plain_cost(name, every_path(problem)[1], problem.friction)
    found = solve(problem, "dp", angles=3, polish=False)
    assert found.value == pytest.approx(np.min(costs), rel=1e-9)
    assert found.value != solve(tiny(name), "dp", angles=3, polish=False).value
    better = solve(problem, "scp", start=found.x)
    assert better.feasible
    assert better.value <= found.value * (1 + 1e-12)


def electrical(at, legs: bool, params: UGVParams) -> np.ndarray:
    """Energy of drives [..., K] by hand: step by step, motor by motor."""
    total = np.zeros(at.torque.shape[:-1])
    for k in range(1, at.torque.shape[-1]):
        mean = (at.torque[..., k - 1] + at.torque[..., k]) / 2
        work = mean * (at.turn[..., k] - at.turn[..., k - 1])
        driven, braked = work / params.drive_efficiency, work * params.regeneration_efficiency
        total += np.where(work > 0, driven, braked)
        for leg in range(2 * legs):
            turn = at.leg_angles[..., k, leg] - at.leg_angles[..., k - 1, leg]
            mean = (at.leg_torques[..., k - 1, leg] + at.leg_torques[..., k, leg]) / 2
            total += np.maximum(mean * turn, 0)
            squares = at.leg_torques[..., k - 1, leg] ** 2 + at.leg_torques[..., k, leg] ** 2
            total += params.holding_loss * squares / 2 * (at.x[..., k] - at.x[..., k - 1])
    return total


@pytest.mark.long
@pytest.mark.parametrize("name", ["wheel_energy", "total_energy"])
def test_energies_are_electrical_and_heat_of_the_legs_counts(name):
    problem = replace(tiny(name), params=LOSSY)
    costs = electrical(every_path(problem)[1], name == "total_energy", LOSSY)
    found = solve(problem, "dp", angles=3, polish=False)
    assert found.value == pytest.approx(np.min(costs), rel=1e-9)
    better = solve(problem, "scp", start=found.x)
    assert better.feasible
    assert better.value < found.value
    by_hand = electrical(problem.stations(better.x), name == "total_energy", LOSSY)
    assert better.value == pytest.approx(by_hand, rel=1e-9)


def test_a_descent_recovers_its_share_of_the_potential_energy():
    """Legs still, so that the wheels' work is the fall of the weight: m g h, less what is lost."""
    x, params = np.linspace(3.0, 5.0, 5), replace(LOSSY, rolling_resistance=None)
    problems = [PostureProblem(params, Track.incline(slope), x) for slope in (-0.2, 0.2)]
    values = [problem.objective(np.full(10, 1.5)) for problem in problems]
    lift = float(params.weight) * 0.2 * 2.0
    assert values == pytest.approx([-0.6 * lift, lift / 0.8], rel=1e-9)


@pytest.mark.long
def test_the_friction_of_a_tracks_file_is_that_under_each_wheel(tmp_path):
    """Grip by hand at both contacts, dp by brute force, and a bound that no drive is below."""
    path, x = tmp_path / "wet.csv", np.linspace(0.0, 8.0, 81)
    mu = np.where((x > 2.5) & (x < 3.0), 0.2, 0.4)
    rows = np.stack([x, 0.25 * np.exp(-(((x - 4) / 0.5) ** 2)), mu], axis=1)
    path.write_text("x,y,mu\n" + "\n".join(",".join(map(str, row)) for row in rows))
    problem = replace(tiny("grip"), track=read_track(path), friction=0.8)
    drives = every_path(problem)[1]
    worst = []
    for k, front in enumerate(problem.x):
        one = drives.map(lambda of, k=k: of[:, k])
        pose = equilibrium(problem.params, problem.track, front, one.leg_angles).pose
        wheels = (pose.rear.x, one.F_rear, one.N_rear), (pose.front.x, one.F_front, one.N_front)
        worst += [np.abs(F) - np.interp(at, x, mu) * N for at, F, N in wheels]
    found = solve(problem, "dp", angles=3, polish=False)
    assert found.value == pytest.approx(np.min(np.max(worst, axis=0)), rel=1e-4)
    assert bound_every_drive(problem, found.x, tolerance=0.3).value <= found.value
    assert replace(problem, friction=0.1).objective(found.x) == problem.objective(found.x)


@pytest.mark.parametrize(
    "given", [{}, pytest.param({"free_split": True, "friction": 0.08}, marks=pytest.mark.long)]
)
def test_gradients_of_a_vehicle_with_losses_are_those_of_differences(given):
    problem = replace(tiny("total_energy"), params=LOSSY, **given)
    x, way, h = random_x(problem), np.random.default_rng(1).standard_normal(problem.n), 1e-6
    change = (problem.objective(x + h * way) - problem.objective(x - h * way)) / (2 * h)
    assert problem.gradient(x) @ way == pytest.approx(change, rel=1e-6)
    margins = (problem.constraints(x + h * way) - problem.constraints(x - h * way)) / (2 * h)
    np.testing.assert_allclose(problem.jacobian(x) @ way, margins, atol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("name", CRITERIA)
def test_no_drive_of_a_vehicle_with_losses_is_below_the_bound(name):
    problem = replace(over(name, "short"), params=SHORT.replace(**LOSSES))
    value, short = problem.sample(drives(problem, 2048))
    best = np.min(value[(short <= 0) & np.isfinite(value)])
    found = bound_every_drive(problem, cells=10, most_corners=1).value
    assert best - (1.1 if name == "torque_variation" else 0.2) * abs(best) < found <= best
