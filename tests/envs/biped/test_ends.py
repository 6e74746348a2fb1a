"""How the biped's episodes end: falls are terminations, the time limit is a truncation."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.dynamics import Scene, Setting, Status
from stickslip.dynamics.biped import BipedParams, EventExact
from stickslip.dynamics.pytrees import rebuilt
from stickslip.envs import BipedEnv
from tests.envs.helpers import STEPS, actions, constant, rollout, task

HASTY = Setting("table", EventExact(rtol=1e-6, max_steps=2))
"""Gives up in its first control step."""
STILL, PUSH, BACK = constant(0, 0, 0, 0), constant(1, 1, 1, 1), constant(-1, -1, -1, -1)


def ending(status: Status):
    """Task, parameters and actions that lead to a terminal status."""
    env, params = task()
    long = env.make_params(robot=BipedParams.from_bars(heel=800.0, toe=800.0))
    strong = {"torque_limit": 30.0, "max_crank_rate": 1e6}
    sticky = Scene.uniform(5.0, 5.0)
    cases = {
        Status.TOPPLE: (env, params, PUSH),
        Status.LIFT_OFF: (env, replace(long, torque_limit=100.0), PUSH),
        Status.RUNAWAY: (env, replace(params, max_crank_rate=1.0), constant(0.1, 0.1, 0.2, -0.2)),
        Status.NO_SOLUTION: (env, replace(long, scene=sticky, **strong), BACK),
        Status.NON_FINITE: (env, params, np.full_like(PUSH, np.nan)),
        Status.STEP_COMPLETE: (*task("one"), constant(0.24, 0.24, 0.23, 0.25)),
        Status.NO_EXCHANGE: (
            env,
            rebuilt(params, scene=sticky, robot=rebuilt(params.robot, symmetric=np.asarray(False))),
            constant(0.24, 0.24, 0.23, 0.25),
        ),
        Status.NOT_CONVERGED: (BipedEnv(setting=HASTY), params, STILL),
    }
    return cases[status]


UGV = {Status[name] for name in ("HOLLOW_GROUND", "ROLLOVER", "GROUNDED")}
UGV |= {Status.WHEEL_SLIP, Status.OVERLOAD, Status.OVERLAP}
TERMINAL = [
    pytest.param(status, marks=[pytest.mark.long] * (status == Status.NOT_CONVERGED))
    for status in Status
    if status.terminal and status not in UGV
]
"""NOT_CONVERGED needs a program of its own."""


@pytest.mark.parametrize("status", TERMINAL)
def test_every_terminal_status_ends_the_episode_as_a_termination(status):
    env, params, given = ending(status)
    run = rollout(env, params, given)
    ends = run.info["status"] == status
    assert ends.any(axis=1).all(), np.unique(run.info["status"])
    assert run.terminated[ends].all()
    assert not run.truncated[ends].any()
    assert run.info["autoreset"][ends].all()
    assert np.all(run.state.elapsed[ends] == 0)
    for leaf in jax.tree.leaves((run.obs, run.state, run.reward, run.info)):
        assert np.all(np.isfinite(leaf))


@pytest.mark.parametrize(
    "name",
    ["default", "one", *(pytest.param(n, marks=pytest.mark.long) for n in ("random", "patches"))],
)
def test_terminated_means_a_terminal_status_and_nothing_else(name):
    env, params = task(name)
    run = rollout(env, params, actions(0.3))
    assert np.array_equal(run.terminated, run.info["status"] > Status.SLIP_ONSET)
    assert not np.any(run.terminated & run.truncated)
    assert np.array_equal(run.info["autoreset"], run.over)


@pytest.mark.parametrize(
    ("period", "limit", "steps"),
    [(0.02, 10.0, 500), (0.02, 0.6, 30), (0.05, 10.0, 200), (0.01, 0.333, 33), (0.02, 0.001, 1)],
)
def test_the_time_limit_is_met_to_the_nearest_control_step(period, limit, steps):
    env, params = task()
    run = rollout(env, params.replace(control_period=period, time_limit=limit), STILL)
    ends = np.arange(1, STEPS + 1) % steps == 0
    assert np.array_equal(run.truncated, np.broadcast_to(ends, run.truncated.shape))
    assert not run.terminated.any()
    assert np.all(run.info["episode_length"][:, ends] == steps)
    since = period * (np.arange(1, STEPS + 1) % steps)
    np.testing.assert_allclose(run.state.biped.time, np.tile(since, (4, 1)), rtol=1e-5)


def test_a_fall_on_the_last_step_is_a_termination():
    env, params = task()
    given = np.array(STILL)
    given[:, 9] = 1.0
    run = rollout(env, params.replace(time_limit=0.2), given)
    assert run.info["status"][0, 9] == Status.TOPPLE
    assert run.terminated[0, 9]
    assert not run.truncated[0, 9]
    assert run.truncated[0, 19]


def test_runaway_is_the_first_step_beyond_the_greatest_crank_rate():
    env, params = task()
    run = rollout(env, params.replace(max_crank_rate=1.0), constant(0.1, 0.1, -0.2, -0.2))
    free = rollout(env, params, constant(0.1, 0.1, -0.2, -0.2))
    for i in range(4):
        beyond = np.flatnonzero(np.abs(free.state.biped.crank_rate[i]) > 1.0)[0]
        assert np.flatnonzero(run.terminated[i])[0] == beyond
        assert run.info["status"][i, beyond] == Status.RUNAWAY
