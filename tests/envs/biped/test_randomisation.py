"""What a reset draws: within the ranges, new every time, the same for the same key."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.envs import BipedEnv, Randomisation
from tests.envs.helpers import RANGES, actions, rollout, task

NAMES = [one.name for one in fields(Randomisation) if getattr(RANGES, one.name) is not None]


@lru_cache
def many_resets(seed: int = 0):
    """Observations and states of 500 resets of the task that draws everything."""
    env, params = task("random")
    keys = jax.random.split(jax.random.key(seed), 500)
    return jax.tree.map(np.asarray, jax.vmap(env.reset, (0, None))(keys, params))


def drawn(state) -> dict[str, np.ndarray]:
    values = {name: one for name, one in state.drawn._asdict().items() if one is not None}
    return values | {"phase": state.biped.phase, "crank_rate": state.biped.crank_rate}


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_draws_fill_their_range_and_stay_inside_it(name):
    low, high = getattr(RANGES, name)
    values = drawn(many_resets()[1])[name]
    assert np.all(values >= np.float32(low))
    assert np.all(values <= np.float32(high))
    assert values.min() < low + 0.02 * (high - low)
    assert values.max() > high - 0.02 * (high - low)
    assert values.mean() == pytest.approx((low + high) / 2, abs=0.05 * (high - low))
    assert len(np.unique(values)) > 490


@pytest.mark.long
def test_every_episode_of_a_walker_draws_anew():
    env, params = task("random")
    run = rollout(env, params, actions(0.3))
    for i in range(2):
        resets = np.flatnonzero(run.info["autoreset"][i])
        assert len(resets) > 5
        for name, values in drawn(run.state).items():
            assert len(np.unique(values[i, resets])) == len(resets), name


@pytest.mark.long
def test_nothing_is_drawn_and_nothing_compiled_for_it_unless_asked_for():
    env, params = task()
    program = str(jax.make_jaxpr(env.reset_env)(jax.random.key(0), params))
    assert "random_bits" not in program
    assert "random_bits" in str(jax.make_jaxpr(env.reset_env)(jax.random.key(0), task("random")[1]))
    one, other = (env.reset(jax.random.key(seed), params)[1] for seed in (0, 1))
    assert jax.tree.all(jax.tree.map(np.array_equal, one, other))
    assert float(one.biped.phase) == np.float32(np.pi / 2)
    assert float(one.biped.crank_rate) == 0.0
    assert params.unit_payload is None


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_one_range_alone_draws_one_thing_alone(name):
    env = BipedEnv()
    chosen = Randomisation(**{name: getattr(RANGES, name)})
    params = replace(task()[1], randomisation=chosen)
    states = [env.reset(jax.random.key(seed), params)[1] for seed in (0, 1)]
    one, other = map(drawn, states)
    assert {key for key in one if one[key] != other[key]} == {name}


CRANKS = (0.027, 0.030, 0.033)


@lru_cache
def drawn_task(mass: float, payload: float, place: int, fidelity: str):
    """Every reset draws exactly this load, and the robot at this place."""
    ranges = Randomisation(mass=(mass, mass), payload=(payload, payload), robot=(place, place))
    env, robots = BipedEnv(fidelity=fidelity), BipedParams.from_bars(CRANKS)  # type: ignore[arg-type]
    return env, env.make_params(robot=robots, randomisation=ranges, dtype=jnp.float64)


def rebuilt_task(mass: float, payload: float, place: int, fidelity: str):
    """That robot alone, built with these masses from the start."""
    bare = BipedParams.from_bars(CRANKS[place], dtype=jnp.float64)
    heavy = bare.replace(mass=bare.mass * mass, inertia=bare.inertia * mass, payload=payload)
    env = BipedEnv(fidelity=fidelity)  # type: ignore[arg-type]
    return env, env.make_params(robot=heavy, dtype=jnp.float64)


LOADS = [(1.3, 0.0, 1, "table"), (1.0, 1.0, 0, "reduced"), (1.2, 2.0, 1, "chebyshev")]


@pytest.mark.parametrize(
    ("mass", "payload", "place", "fidelity"),
    [*(pytest.param(*one, marks=pytest.mark.long) for one in LOADS), (0.9, 1.0, 2, "table")],
)
def test_what_is_drawn_walks_as_a_robot_built_so(float64, mass, payload, place, fidelity):
    given = actions(0.2)[:, :]
    one = rollout(*drawn_task(mass, payload, place, fidelity), given)
    other = rollout(*rebuilt_task(mass, payload, place, fidelity), given)
    assert one.info["slid"].any()
    for name in ("obs", "reward", "terminated", "truncated"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-7)
    for name in one.info:
        np.testing.assert_allclose(one.info[name], other.info[name], atol=1e-5, err_msg=name)


PERIOD, RANGE = 0.02, (1.0, 3.0)


def ranges(interval: tuple[float, float] | None) -> Randomisation:
    return Randomisation(mean_rate=RANGE, command_interval=interval)


def test_the_command_changes_after_each_interval_and_only_then():
    env = BipedEnv(autoreset="disabled")
    params = env.make_params(scene="firm", randomisation=ranges((0.3, 0.3)))
    obs, state = env.reset(jax.random.key(0), params)
    seen = []
    for _ in range(60):
        seen.append(float(obs[5]))
        obs, state, *_ = env.step(jax.random.key(0), state, [0.0], params)
    seen = np.asarray(seen)
    changes = 1 + np.flatnonzero(np.diff(seen))
    assert changes.tolist() == [15, 30, 45]  # 0.3 s are 15 control periods
    assert len(set(seen)) == 4
    assert np.all((seen >= RANGE[0]) & (seen <= RANGE[1]))


def test_a_step_is_judged_by_the_command_that_was_observed_before_it():
    env = BipedEnv(autoreset="disabled")
    params = env.make_params(scene="firm", randomisation=ranges((PERIOD, PERIOD)))
    key = jax.random.key(5)
    obs, state = env.reset(key, params)
    seen = float(obs[5])
    obs, state, _, _, _, info = env.step(key, state, [0.2], params)
    speed = seen / np.pi * float(params.robot.step_length)
    expected = PERIOD * max(-1.0, 1 - abs(float(info["walking_speed"]) - speed) / speed)
    assert float(info["reward_tracking"]) == pytest.approx(expected, rel=1e-4)
    assert float(obs[5]) != seen
