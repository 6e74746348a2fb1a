"""Friction by place and a limit on the motors: one meaning in the environment and the optimiser."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.agents.machine import machine_by_name
from stickslip.dynamics import Status
from stickslip.dynamics.ugv import Surface, Track
from stickslip.envs import RandomTrack, UGVEnv
from stickslip.optim import solve
from stickslip.optim.posture.bounds.branch import bound_every_drive
from tests.envs.ugv.helpers import QUICK, actions, drive, path_of

PATCHES = Surface.patches([1.7, 2.3, 2.9], [1, 0.4, 0.8, 0.5])
GROUND = replace(Track.bump(centre=2.5, end=3.5), surface=PATCHES)
ENV = UGVEnv("grip", 4, QUICK, "disabled", see_friction=True)


@pytest.mark.long
def test_on_patches_the_return_is_minus_the_objective_and_friction_ahead_is_seen(float64):
    params = ENV.make_params(track=GROUND, friction=0.7, dtype=np.float64)
    run = drive(ENV, params, actions(int(params.steps), scale=0.5))
    assert run.truncated[-1]
    problem = ENV.problem(run.first_state, params)
    path = path_of(run)
    assert run.reward.sum() == pytest.approx(-problem.objective(path), rel=1e-11)
    even = replace(problem, track=Track.bump(centre=2.5, end=3.5))
    assert even.objective(path) < problem.objective(path)
    ahead = run.state.station.x[4] + 2.0 * np.arange(1, 5) / 4
    np.testing.assert_allclose(run.obs[4][-4:], 0.7 * np.asarray(GROUND.surface.at(ahead)))
    assert len(ENV.observation_bounds(params)[0]) == run.first_obs.shape[-1] == 13 + 4


def test_drawn_patches_leave_the_ground_as_it_was_and_differ_by_episode():
    drawn = RandomTrack((0.05, 0.1), waves=4, pieces=8, cells=4)
    patchy = replace(drawn, grip=(0.3, 1.0), patch_length=(0.5, 1.5), patches=6)
    grounds = [one.draw(jax.random.key(1), 0.0, 4.0, np.float32).track for one in (drawn, patchy)]
    assert grounds[0].surface is None
    for one, other in zip(*(jax.tree.leaves(of.shape) for of in grounds), strict=True):
        np.testing.assert_array_equal(one, other)
    surface = grounds[1].surface
    assert np.all((surface.factors >= 0.3) & (surface.factors <= 1.0))
    assert np.all(np.diff(surface.knots) > 0)
    other = patchy.draw(jax.random.key(2), 0.0, 4.0, np.float32).track.surface
    assert not np.array_equal(surface.factors, other.factors)
    for bad in ({"grip": (0.3, 1.0)}, {"patch_length": (0.5, 1.0)}):
        with pytest.raises(ValueError, match=r"grip = .*accepted: both, or None"):
            replace(drawn, **bad).validate()


@pytest.mark.long
def test_the_optimiser_and_the_environment_stop_at_the_same_torque(float64):
    env = UGVEnv("wheel_energy", 0, QUICK, "disabled")
    free = env.make_params(track=Track.bump(centre=2.5, end=3.5), dtype=np.float64)
    given = np.zeros((int(free.steps), 2))
    run = drive(env, free, given)
    most = np.abs(run.state.station.torque)
    limit = float(most.max()) - 0.5
    limited = free.replace(max_torque=limit)
    stopped = drive(env, limited, given)
    end = int(np.argmax(stopped.over))
    assert stopped.info["status"][end] == Status.OVERLOAD
    assert end == int(np.argmax(most > limit))
    problem = env.problem(stopped.first_state, limited)
    assert problem.residuals(path_of(run))["torque"] == pytest.approx(0.5, rel=1e-6)
    assert not problem.is_feasible(path_of(run))
    found = solve(problem, "dp", polish=False)
    assert found.status.solved
    assert np.abs(problem.stations(found.x).torque).max() <= limit
    machine = machine_by_name("ugv")
    again = machine.read_task(machine.describe(env, limited)).params
    assert float(again.max_torque) == limit


@pytest.mark.long
def test_slopes_of_the_limits_are_those_of_differences(float64):
    params = ENV.make_params(track=GROUND)
    problem = ENV.problem(ENV.reset_env(jax.random.key(0), params)[1], params)
    problem = replace(problem, max_torque=40.0)
    x = np.clip(np.pi / 2 + 0.1 * np.random.default_rng(0).standard_normal(problem.n), 0.6, 2.5)
    rows, h = problem.jacobian(x), 1e-6
    way = np.random.default_rng(1).standard_normal(problem.n)
    change = (problem.constraints(x + h * way) - problem.constraints(x - h * way)) / (2 * h)
    for name in ("torque", "grip"):
        at = problem.constraint_groups[name]
        np.testing.assert_allclose(rows[at] @ way, change[at], rtol=1e-4, atol=1e-6)


@pytest.mark.long
def test_no_drive_over_patches_is_below_its_bound(float64):
    params = ENV.make_params(track=GROUND, friction=0.7)
    problem = ENV.problem(ENV.reset_env(jax.random.key(0), params)[1], params)
    found = solve(problem, "dp", angles=9)
    bound = bound_every_drive(problem, found.x, tolerance=0.2)
    assert bound.value <= found.value
    limited = replace(problem, max_torque=1e3)
    assert bound_every_drive(limited, found.x, tolerance=0.2).value == bound.value


def test_a_route_in_the_coordinates_of_a_map_has_all_of_its_steps_or_is_refused():
    """Far from 0 a digit of x in single precision is a good part of a step."""
    x = np.linspace(0, 9, 40)
    env, heights = UGVEnv(), 0.05 * np.sin(x)
    here, near, far = (Track.from_points(away + x, heights) for away in (0.0, 5e4, 5e5))
    count = int(env.make_params(track=here).steps)
    assert int(env.make_params(track=near).steps) == count
    assert int(env.default_params.replace(track=near, start=5e4 + 2, end=5e4 + 9).steps) == 70
    with pytest.raises(ValueError, match=r"x = 50000\d.*float32.*0\.031 m; accepted: x nearer 0"):
        env.make_params(track=far)
    with pytest.raises(ValueError, match="x nearer 0"):
        env.default_params.replace(track=far, start=5e5 + 2, end=5e5 + 9)
    assert int(env.make_params(track=far, spacing=0.5).steps) == -(-count // 5)
