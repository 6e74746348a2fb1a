"""Choices of speed against accuracy change the numbers a little and the task not at all."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import BipedParams
from tests.envs.helpers import (
    STEPS,
    WALKERS,
    Rollout,
    actions,
    constant,
    lone_walk,
    mapped_rollout,
    rollout,
    task,
)

pytestmark = pytest.mark.long

GENTLE = 0.1


def test_the_table_walks_like_the_exact_functions(float64):
    table = jax.tree.map(lambda leaf: leaf[0], rollout(*task(dtype="float64"), actions(GENTLE)))
    exact = lone_walk(*task(dtype="float64", fidelity="reduced"), actions(GENTLE)[0])
    assert table.info["slid"].sum() > 0.05
    assert 0 < np.abs(table.obs - exact.obs).max() < 1e-5
    np.testing.assert_allclose(table.reward, exact.reward, atol=1e-6)
    assert np.array_equal(table.truncated, exact.truncated)
    assert table.truncated.sum() == 1


def test_more_substeps_refine_the_same_walk(float64):
    one, two, four = (
        lone_walk(*task(dtype="float64", substeps=count), actions(GENTLE)[0]) for count in (1, 2, 4)
    )
    coarse, fine = (np.abs(run.obs - four.obs).max() for run in (one, two))
    assert 0 < coarse < 2e-3  # 5e-9 at 1 ms, and of fourth order
    assert fine < coarse / 10
    assert np.array_equal(one.truncated, four.truncated)


def test_a_one_step_scene_ends_where_support_would_be_exchanged():
    env, params = task("one")
    run = rollout(env, params, constant(0.24, 0.23, 0.25, 0.24))
    for i in range(WALKERS):
        end = np.flatnonzero(run.over[i])[0]
        assert run.info["status"][i, end] == Status.STEP_COMPLETE
        assert run.terminated[i, end]
        walked = run.info["episode_walked"][i, end]
        assert walked == pytest.approx(float(params.robot.step_length), rel=1e-4)
    assert np.all(run.state.biped.steps == 0)


def test_every_walker_of_a_batch_can_have_its_own_parameters(float64):
    env, _ = task(dtype="float64")
    friction, rate = [0.04, 0.06, 0.3, 0.9], [2.0, 3.0, 3.5, 5.0]
    payload, density = [0.0, 0.5, 1.0, 0.2], [1.48, 1.2, 1.8, 1.48]

    def build(mu, mean_rate, extra, bar_density):
        biped = BipedParams.from_bars(bar_density=bar_density, payload=extra, dtype=jnp.float64)
        scene = Scene.uniform(mu, 0.8 * mu)
        return env.make_params(robot=biped, scene=scene, mean_rate=mean_rate)

    columns = [friction, rate, payload, density]
    batch = jax.jit(jax.vmap(build))(*map(jnp.asarray, columns))
    given = actions(0.2)
    run = mapped_rollout(env, batch, given)
    seen = []
    for i, numbers in enumerate(zip(*columns, strict=True)):
        alone = rollout(env, build(*numbers), given)
        for name in ("obs", "reward", "terminated"):
            ours, theirs = getattr(run, name)[i], getattr(alone, name)[i]
            np.testing.assert_allclose(ours, theirs, atol=1e-7, err_msg=name)
        seen.append(alone.info["slid"][i].sum())
    assert seen[0] > seen[1] > seen[2]


def difference(one: Rollout, other: Rollout, steps: int = STEPS) -> float:
    return float(np.abs(one.obs[:, :steps] - other.obs[:, :steps]).max())


def test_single_precision_walks_like_double():
    single = rollout(*task(), actions(GENTLE))
    with jax.enable_x64(True):
        double = rollout(*task(dtype="float64"), actions(GENTLE))
    assert single.obs.dtype == np.float32
    assert double.obs.dtype == np.float64
    assert 0 < difference(single, double, 250) < 5e-3
    assert np.array_equal(single.truncated, double.truncated)
