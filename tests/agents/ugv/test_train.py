"""Training runs of the UGV, their policies, and the commands that read them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import FixedPosture, evaluate, load_policy, read_metadata
from stickslip.agents.machine import read_configuration
from stickslip.agents.training.configuration import Trained
from stickslip.agents.training.directory import read_columns
from stickslip.agents.training.run import train
from stickslip.agents.ugv.machine import LEGS, TRACK_NAMES, UGVTrainConfig
from stickslip.agents.ugv.task import ground_by_name, training_task
from stickslip.cli import OK, main
from stickslip.dynamics.ugv import UGVParams
from stickslip.envs import UGVEnv
from tests.agents.runs import TINY
from tests.asked import prints

pytestmark = pytest.mark.usefixtures("empty_directory")

pytest.importorskip("optax")

CONFIG = UGVTrainConfig.of(timesteps=256, checkpoint_interval=128, tracks="bump", preview=3, **TINY)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Trained:
    """A finished run. Not to be written to."""
    return train(CONFIG, tmp_path_factory.mktemp("runs") / "ugv", bar=False)


@pytest.mark.long
def test_a_run_leaves_its_configuration_metrics_evaluations_and_policy(run: Trained):
    path = run.directory
    assert run.finished
    assert read_configuration((path / "config.json").read_text()) == CONFIG
    tests, metrics = read_columns(path / "evaluations.csv"), read_columns(path / "metrics.csv")
    assert tests["timesteps"] == [128, 256]
    assert np.all(np.asarray(tests["cost"]) > 0)
    assert np.allclose(tests["return"], np.negative(tests["cost"]), rtol=1e-4)
    assert len(metrics["timesteps"]) == 2
    about = read_metadata(run.policy)
    assert about["environment"] == "UGVEnv"
    assert about["choices"]["criterion"] == "wheel_energy"
    policy = load_policy(run.policy)
    assert policy.layer_sizes[-1] == 2
    assert policy(np.zeros(about["observation_size"], np.float32)).shape == (2,)


def test_the_training_reward_is_the_criterion_scaled():
    task = training_task(UGVTrainConfig.of(reward_scale=0.01, failure=5.0))
    assert float(task.training.reward_scale) == pytest.approx(0.01)
    assert float(task.training.failure_penalty) == pytest.approx(500.0)
    assert float(task.tested.reward_scale) == 1.0
    drawn = training_task(UGVTrainConfig.of(random_start=(60, 120))).training
    assert np.allclose(drawn.randomisation.start_angles, np.radians([60, 120]))
    widest = training_task(UGVTrainConfig.of(start_angle=30.0, random_start=(30, 150)))
    assert np.allclose(widest.training.randomisation.start_angles, np.radians([30, 150]))


def test_every_named_ground_makes_a_task():
    for name in TRACK_NAMES:
        drawn = UGVEnv().make_params(track=ground_by_name(name)).randomisation.track
        assert (drawn is not None) == name.startswith("random")
    with pytest.raises(ValueError, match="unknown; accepted: random-bump"):
        ground_by_name("bumps")


def test_start_angles_are_those_that_the_vehicle_takes():
    vehicle = UGVParams()
    ends = np.degrees([vehicle.leg_angle_min, vehicle.leg_angle_max])
    np.testing.assert_allclose(ends, [*LEGS.values()])


def test_a_configuration_of_an_unknown_machine_is_refused():
    strange = CONFIG.to_json().replace('"ugv"', '"boat"')
    with pytest.raises(ValueError, match="its machine is 'boat', not one of biped, ugv"):
        read_configuration(strange)


@pytest.mark.long
def test_evaluate_and_view_read_policies_of_the_ugv(
    run: Trained, capsys: pytest.CaptureFixture[str]
):
    policy = str(run.policy)
    said = prints(capsys, "evaluate", policy, "level-body", "--scene", "bump", "--out", "table")
    assert "level-body" in said
    assert "friction used" in said
    rows = json.loads(Path("table/evaluation.json").read_text())["rows"]
    assert [row["controller"] for row in rows] == [policy, "level-body"]
    drawn = ["--out", "drive.gif", "--seconds", "0.3"]
    assert main(["view", policy, *drawn]) == OK
    assert Path("drive.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.long
def test_a_policy_drives_well_below_the_best_posture_on_bumps_that_it_has_not_seen(tmp_path: Path):
    config = UGVTrainConfig.of(timesteps=327_680, discount=0.95)
    trained, task = train(config, tmp_path / "run", bar=False), training_task(config)
    who = {"policy": load_policy(trained.policy), "posture": FixedPosture(task.env)}
    table = evaluate(task.env, who, {"bumps": task.tested}, episodes=config.evaluation_episodes)
    policy, posture = (table.row("bumps", name).metrics for name in who)
    assert policy["failures"].value == 0
    assert policy["cost"].value < 0.85 * posture["cost"].value
