"""Values and regret of the UGV's steps, against the optimiser's own drives over the same ground."""

import copy

import gymnasium
import minari
import numpy as np
import pytest

import stickslip  # noqa: F401
from stickslip.agents import Idle, Optimum, RegretInfo, record
from stickslip.agents.ugv.controllers import towards

GROUND = {"track": "bump", "start": 0.6, "end": 2.6, "reward_scale": 0.01}


def made(**changes):
    return RegretInfo(gymnasium.make("stickslip/UGV-v0", **GROUND | changes))


def played(env, act):
    """Infos and rewards of an episode whose reset has been; act: of the state."""
    steps = []
    while not steps or not any(steps[-1][2:4]):
        steps.append(env.step(np.asarray(act(env.unwrapped._envs.state_of(0)))))
    return [step[4] for step in steps], [step[1] for step in steps]


@pytest.mark.parametrize("limit", [None, 12])
def test_regrets_of_an_episode_sum_to_what_it_lost(limit):
    env, random = made(max_episode_steps=limit), np.random.default_rng(0)
    begin = env.reset(seed=0)[1]["value"]
    assert env.reset()[1]["value"] == begin
    infos, rewards = played(env, lambda _: random.uniform(-1, 1, 2))
    lost = sum(info["regret"] for info in infos)
    assert lost == pytest.approx(begin - sum(rewards), abs=1e-4)
    assert lost > 0.1 * abs(begin)
    assert infos[-1]["value"] == 0
    assert env.spec is not None
    assert env.spec.additional_wrappers[-1].name == "RegretInfo"


@pytest.mark.long
@pytest.mark.parametrize("criterion", ["wheel_energy", "grip", "total_energy", "peak_torque"])
def test_the_optimisers_drive_has_no_regret_and_earns_the_value_of_its_start(criterion):
    env = made(criterion=criterion)
    begin, inner = env.reset(seed=0)[1]["value"], env.unwrapped
    place = inner.functional, inner.params, inner._envs.state_of(0)
    best = Optimum(angles=61).solve(*place)
    angles = best.leg_angles
    infos, _ = played(env, lambda at: towards(angles[int(at.elapsed) + 1], at, inner.params))
    assert begin == pytest.approx(-0.01 * best.value, rel=0.01)
    assert max(abs(info["regret"]) for info in infos) < 0.01 * abs(begin)


@pytest.mark.long
def test_a_step_that_fails_costs_the_penalty():
    env = made(criterion="grip")
    env.reset(seed=0)
    env.step([0.5, -0.5])
    assert copy.deepcopy(env).step([0.0, 0.0])[4] == env.step([0.0, 0.0])[4]
    infos, rewards = played(env, lambda _: [-1.0, -1.0])
    assert infos[-1]["cost"] == 1
    assert infos[-1]["value"] == 0
    assert infos[-1]["regret"] > 0.9 * abs(rewards[-1])


@pytest.mark.long
def test_a_recording_holds_them(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    record("UGVRandomBumps-v1", {"idle": Idle(2)}, "own-v0", episodes=2, seed=5, regret=True)
    env = RegretInfo(gymnasium.make("stickslip/UGVRandomBumps-v1"))
    for one, seed in zip(minari.load_dataset("own-v0"), (5, 6), strict=True):
        told = [env.reset(seed=seed)[1], *(env.step(action)[4] for action in one.actions)]
        np.testing.assert_allclose(one.infos["value"], [of["value"] for of in told], rtol=1e-4)
        found = [of.get("regret", 0.0) for of in told]
        np.testing.assert_allclose(one.infos["regret"], found, atol=0.02)


@pytest.mark.parametrize("name", ["stickslip/Biped-v0", "CartPole-v1"])
def test_other_environments_are_refused(name):
    with pytest.raises(ValueError, match="accepted: a "):
        RegretInfo(gymnasium.make(name))
    with pytest.raises(ValueError, match="no vector"):
        RegretInfo(gymnasium.make_vec("stickslip/UGV-v0", num_envs=2))
    with pytest.raises(ValueError, match="regret with the biped"):
        record("BipedSteady-v0", {"idle": Idle()}, "own-v0", regret=True)
