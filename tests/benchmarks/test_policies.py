"""The policies of the package come out again by their command."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace

import pytest

from benchmarks import policies
from benchmarks.tasks import beside_package
from stickslip.agents.machine import machine_by_name, read_configuration
from stickslip.agents.policy.file import load_policy, read_metadata, record_of
from stickslip.agents.policy.shipped import policy_name
from stickslip.agents.training.configuration import command_of
from stickslip.cli import OK, main
from stickslip.envs import TASKS, known_of
from tests.agents.runs import TINY
from tests.trees import assert_same

NAME = "BipedSprint-v1"


@pytest.mark.long
def test_a_policy_is_trained_measured_and_written_and_comes_out_again(tmp_path, monkeypatch):
    pytest.importorskip("optax")
    kind = machine_by_name("biped").configuration
    tried = [kind.of(task=NAME, seed=seed, timesteps=256, **TINY) for seed in (0, 1)]
    monkeypatch.setattr(policies, "configurations", lambda task: tried)
    runs = [policies.trained(config, tmp_path / "runs") for config in tried]
    run = policies.best_of(TASKS[NAME], tmp_path / "runs")
    assert run.earned == max(one.earned for one in runs)
    path = policies.put_into_package(TASKS[NAME], run, tmp_path)
    assert path.name == f"{policy_name(NAME)}.npz"
    about = read_metadata(path)
    config = read_configuration(json.dumps(about["trained"]["config"]))
    assert config in tried
    words = shlex.split(command_of(config))[1:]
    assert main([*words, "--out", str(tmp_path / "again"), "--no-pictures"]) == OK
    again = load_policy(tmp_path / "again" / "policy.npz")
    assert_same(load_policy(path), again)
    first, second = (load_policy(one.path / "policy.npz") for one in runs)
    with pytest.raises(AssertionError):
        assert_same(first, second)
    assert about["earned"]["episodes"] == 1
    assert about["earned"]["return"] < known_of(TASKS[NAME]).best.value


def test_what_is_shipped_is_trained_by_its_record_and_other_tasks_by_the_usual_settings():
    trained = record_of("biped-steady").trained
    found = policies.configurations(TASKS["BipedSteady-v0"])
    assert [one.seed for one in found] == trained["seeds_tried"]
    wanted = ("BipedSteady-v0", trained["config"]["timesteps"])
    assert (found[0].task, found[0].timesteps) == wanted
    assert [one.seed for one in policies.configurations(TASKS["UGVBump-v1"])] == [0, 1, 2]


def test_a_policy_of_the_package_is_the_best_known_where_it_earned_more():
    record = record_of("biped-payload")
    earned = record.earned["return"]
    row = {"policy": "optimal-gait", "low": None, "high": None, "failures": 0.0}
    for before in (earned - 1.0, earned, earned + 1.0):
        best = row | {"return": before}
        found = {"baselines": [best], "planners": [], "best": best, "how": "by hand"}
        now = beside_package(record.task, found)
        beaten = before < earned
        assert now["best"]["policy"] == ("biped-payload" if beaten else "optimal-gait")
        assert now["best"]["return"] == max(before, earned)
        assert (record.command in now["how"]) == beaten
        assert now["planners"] == []
    best = row | {"policy": "optimal-gait, improved", "return": earned - 1.0}
    found = {"baselines": [], "planners": [], "best": best, "how": "a planner"}
    now = beside_package(record.task, found)
    assert now["planners"] == [best]
    assert beside_package(record.task, now) == now
    lost = now | {"planners": [best | {"return": earned + 1.0}]}
    with pytest.raises(ValueError, match="is the best known of BipedPayload-v0 no more"):
        beside_package(record.task, lost)
    assert beside_package(replace(record.task, stem="BipedNew"), found) == found
