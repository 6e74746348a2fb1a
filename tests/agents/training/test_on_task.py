"""Training on a named task: exactly that, with its scores, and nothing of it said twice."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from stickslip.agents import evaluate_task, load_policy
from stickslip.agents.biped import task as biped_task
from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.evaluation.rollout import VALIDATION_SEEDS
from stickslip.agents.machine import read_configuration
from stickslip.agents.training.directory import read_columns
from stickslip.agents.training.run import train
from stickslip.agents.ugv import task as ugv_task
from stickslip.agents.ugv.machine import UGVTrainConfig
from stickslip.envs import TASKS, known_of, task_by_name
from tests.agents.runs import TINY
from tests.trees import assert_same

NAME = "BipedSteady-v0"


def test_the_biped_trains_on_exactly_the_task():
    env, params = task_by_name("BipedIce-v0").make("same_step")
    made = biped_task.training_task(TrainConfig.of(task="BipedIce-v0"))
    assert made.env == env
    for one in (made.training, made.tested):
        assert_same(one, params)


def test_the_ugv_trains_on_exactly_the_task_but_for_a_factor_on_its_rewards():
    env, params = task_by_name("UGVLowGrip-v1").make("same_step")
    made = ugv_task.training_task(UGVTrainConfig.of(task="UGVLowGrip-v1", reward_scale=0.25))
    assert made.env == env
    assert_same(made.tested, params)
    assert float(made.training.reward_scale) == 0.25
    assert_same(made.training.replace(reward_scale=params.reward_scale), params, 1e-6)


def test_training_episodes_alone_are_changed_where_a_flag_asks_for_it():
    _, params = task_by_name("BipedPayload-v0").make("same_step")
    given = {"start_rate": 4.0, "episode_time": 1.5, "tracking_weight": 2.0, "fall_penalty": 0.0}
    made = biped_task.training_task(TrainConfig.of(task="BipedPayload-v0", **given))
    assert_same(made.tested, params)
    drawn, own = made.training.randomisation, params.randomisation
    assert drawn.crank_rate == (0.0, 4.0)
    assert (drawn.mass, drawn.payload) == (own.mass, own.payload)
    changed = {"time_limit": 1.5, "tracking_weight": 2.0, "fall_penalty": 0.0}
    assert_same(made.training, params.replace(randomisation=drawn, **changed))
    assert float(made.training.slip_weight) == float(params.slip_weight)

    ground = UGVTrainConfig.of(task="UGVRough-v1", random_start=(60.0, 120.0), failure=3.0)
    ugv, tested = ugv_task.training_task(ground), task_by_name("UGVRough-v1").make("same_step")[1]
    assert_same(ugv.tested, tested)
    np.testing.assert_allclose(ugv.training.randomisation.start_angles, np.radians([60, 120]))
    scaled = ugv.training.failure_penalty * ugv.training.reward_scale
    np.testing.assert_allclose(scaled, 3.0, rtol=1e-6)


@pytest.mark.long
def test_a_run_says_scores_of_episodes_that_it_never_trains_on(tmp_path):
    pytest.importorskip("optax")
    kept = {"checkpoint_interval": 256, "keep_checkpoints": 9, "evaluation_episodes": 2}
    config = TrainConfig.of(task=NAME, timesteps=512, **TINY | kept)
    calls = iter(range(10**9))
    path = tmp_path / "run"
    assert not train(config, path, bar=False, stop=lambda: next(calls) == 5).finished
    trained = train(None, path, resume=True, bar=False)
    assert trained.finished
    assert trained.config == config
    rows = read_columns(path / "evaluations.csv")
    assert rows["timesteps"] == [256, 512]
    scale = known_of(task_by_name(NAME)).scale
    expected = [scale.score(one) for one in rows["return"]]
    assert rows["task_score"] == pytest.approx(expected, abs=1e-4)
    low, high = np.asarray(rows["task_score_low"]), np.asarray(rows["task_score_high"])
    assert np.all((low <= rows["task_score"]) & (rows["task_score"] <= high))
    last = load_policy(path / "checkpoints" / "000000000512" / "policy.npz")
    table = evaluate_task(NAME, {"it": last}, seeds=range(VALIDATION_SEEDS, VALIDATION_SEEDS + 2))
    metrics = table.row(NAME, "it").metrics
    assert metrics["return"].value == pytest.approx(rows["return"][1], rel=1e-6)
    assert metrics["task_score"].value == pytest.approx(rows["task_score"][1], abs=1e-5)


@pytest.mark.parametrize(("name", "task"), [(task.machine, task) for task in TASKS.values()][::12])
def test_a_configuration_keeps_its_task_and_writes_nothing_that_it_decides(name: str, task):
    kind = {"biped": TrainConfig, "ugv": UGVTrainConfig}[name]
    config = kind.of(task=f"stickslip/{task.name}", seed=3)
    content = json.loads(config.to_json())
    assert content["task"] == config.task == task.name
    assert not {"scene", "friction", "tracks", "mean_rate", *kind.fixed()} & content.keys()
    assert read_configuration(config.to_json()) == config
    assert config.digest not in {kind.of(seed=3).digest, kind.of(task=config.task).digest}


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: TrainConfig(task="UGVBump-v1"), "of the ugv, this configuration of the biped"),
        (lambda: TrainConfig(task=NAME, scene="wet", payload=1.0), "^scene, payload with task"),
        (lambda: replace(UGVTrainConfig.of(task="UGVBump-v1"), friction=0.1), "^friction with"),
    ],
)
def test_what_does_not_go_with_a_task_is_refused_by_name(build, said: str):
    with pytest.raises(ValueError, match=said):
        build()
