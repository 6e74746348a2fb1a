"""A walk to a mark: what is drawn, seen and paid for, and what is refused."""

import jax
import numpy as np
import pytest

from stickslip.agents.biped.controllers import StopAtMark
from stickslip.agents.biped.prediction import GaitTable, OptimalGait
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.machine import machine_by_name
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import floor_position
from stickslip.envs import BipedEnv, Randomisation, task_by_name

BIPED = machine_by_name("biped")
ENV = BipedEnv(autoreset="disabled")
MARK = {"mark": 0.5, "mark_width": 0.07}
GAITS = GaitTable(np.array([2.0]), np.zeros((1, 9)), np.full((1, 9), 4.0))
SERVO = StopAtMark(cruise=2.0, gait=OptimalGait(gaits=GAITS))
"""Its gait is a constant crank rate, which takes no solver."""


def params_of(**changes):
    return ENV.make_params(**{"scene": Scene.uniform(0.5, 0.4), **MARK, **changes})


def centre(params, biped) -> np.ndarray:
    """Of mass, along the floor [m]."""

    def one(biped):
        ahead = params.robot.inertia.moment_at(biped.phase).X / params.robot.total_mass
        return floor_position(params.robot, biped) + ahead

    return np.asarray(jax.vmap(one)(biped))


@pytest.fixture(scope="module")
def walk():
    params = params_of(randomisation=Randomisation(mark=(0.3, 0.6)))
    return params, rollout(ENV, SERVO, params, 3, 500)


@pytest.mark.long
def test_nearness_pays_and_the_way_to_the_mark_is_seen(walk):
    params, played = walk
    before = jax.tree.map(lambda one: one[None], played.start_state.biped)
    walked = centre(params, played.state.biped) - centre(params, before)
    mark = float(played.start_state.drawn.mark)
    assert 0.3 <= mark <= 0.6
    to_go = mark - walked
    paid = 0.02 * 0.07 / (0.07 + np.abs(to_go))
    np.testing.assert_allclose(played.info["reward_tracking"], paid, rtol=1e-3)
    np.testing.assert_allclose(np.asarray(played.obs)[:, 6], to_go, atol=2e-5)
    speed = 3.0 * float(params.robot.step_length) / np.pi
    slip = -5.0 * np.asarray(played.info["slid"]) / speed
    np.testing.assert_allclose(played.info["reward_slip"], slip, atol=1e-7)


@pytest.mark.long
def test_the_servo_stops_at_the_mark_and_stands(walk):
    played = walk[1]
    assert not np.asarray(played.terminated).any()
    assert np.abs(np.asarray(played.state.to_go)[-100:]).max() < 0.01
    assert np.abs(np.asarray(played.state.biped.crank_rate))[-100:].max() < 0.1
    assert np.abs(np.asarray(played.state.to_go)[0]) > 0.29


def test_a_reset_draws_the_mark_and_an_option_says_where_it_lies():
    params = params_of(randomisation=Randomisation(mark=(1.0, 3.0)))
    marks = jax.vmap(lambda key: ENV.reset_env(key, params)[1].drawn.mark)(
        jax.random.split(jax.random.key(0), 64)
    )
    assert 1.0 <= float(marks.min()) < 1.4
    assert 2.6 < float(marks.max()) <= 3.0
    obs, state = ENV.reset_env(jax.random.key(0), ENV.episode_params(params, {"mark": 1.75}))
    assert float(state.to_go) == pytest.approx(1.75)
    assert float(obs[6]) == pytest.approx(1.75)
    assert len(ENV.observation_bounds(params)[0]) == len(obs) == 7


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"mark_width": None}, r"mark = .* with mark_width = None; accepted: both"),
        ({"mark": 0.0}, r"mark = 0.*accepted: None, or a finite way > 0"),
        ({"mark": "far"}, "mark"),
        ({"randomisation": Randomisation(mark=(0.0, 1.0))}, "mark = "),
        (
            {"mark": None, "mark_width": None, "randomisation": Randomisation(mark=(1.0, 2.0))},
            "mark is drawn in a task without one",
        ),
    ],
)
def test_half_a_mark_and_bad_ones_are_refused(changes, named):
    with pytest.raises(ValueError, match=named):
        params_of(**changes)


def test_a_policy_file_keeps_the_mark_and_files_without_one_are_read():
    params = params_of(randomisation=Randomisation(mark=(0.3, 0.6)))
    again = BIPED.read_task(BIPED.describe(ENV, params)).params
    assert jax.tree.structure(again) == jax.tree.structure(params)
    assert float(again.mark) == pytest.approx(0.5)
    assert BIPED.read_task(BIPED.describe(ENV, ENV.make_params())).params.mark is None


@pytest.mark.long
def test_stop_at_mark_brakes_late_without_a_slide():
    env, params = task_by_name("BipedStop-v0").make("disabled")
    keys = jax.random.split(jax.random.key(0), 4)
    played = jax.vmap(lambda key: rollout(env, StopAtMark(), params, key, 500))(keys)
    assert not np.asarray(played.terminated).any()
    assert np.asarray(played.info["episode_slid"]).max() < 1e-9
    assert np.abs(np.asarray(played.state.to_go)[:, -1]).max() < 0.01
    assert np.asarray(played.state.biped.crank_rate).max() > 4.5
