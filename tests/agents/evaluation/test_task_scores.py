"""Scores of a named task: the columns that an evaluation adds, and what is written of baselines."""

from __future__ import annotations

import json
import math

import pytest

from stickslip.agents import Idle, evaluate_task
from stickslip.agents.biped.controllers import ConstantTorque, CrankSpeedPI
from stickslip.agents.machine import machine_by_name
from stickslip.envs import TASKS, known_of, task_by_name

TASK = "BipedSprint-v1"


@pytest.fixture(scope="module")
def table():
    return evaluate_task(TASK, {"idle": Idle(), "pi": CrankSpeedPI()})


def test_the_trivial_policy_scores_nought_and_a_baseline_what_is_known_of_it(table):
    known = known_of(task_by_name(TASK))
    assert known is not None
    rows = {name: table.row(TASK, name).metrics for name in ("idle", "pi")}
    assert rows["idle"]["task_score"].value == pytest.approx(0.0, abs=1e-4)
    (kept,) = (one for one in known.baselines if one.policy == "crank-speed-pi")
    assert rows["pi"]["return"].value == pytest.approx(kept.value, rel=1e-4)
    assert rows["pi"]["task_score"].value == pytest.approx(
        (kept.value - known.trivial.value) / (known.best.value - known.trivial.value), abs=1e-4
    )
    assert rows["pi"]["gap"].value == pytest.approx(known.best.value - kept.value, abs=1e-3)


def test_scores_stand_behind_the_return_in_every_form(table, tmp_path):
    assert [row.count for row in table.rows] == [1, 1]
    assert "±" not in table.to_text()
    assert list(table.columns)[:3] == ["return", "task_score", "gap"]
    assert "score" in table.to_text()
    assert "gap [m]" in table.to_text()
    head = table.write_csv(tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()[0]
    assert "task_score,task_score_low,task_score_high,gap" in head
    content = json.loads(table.write_json(tmp_path / "a.json").read_text(encoding="utf-8"))
    assert content["units"]["gap"] == "m"
    assert math.isfinite(content["rows"][1]["metrics"]["task_score"]["value"])


def test_who_costs_more_than_the_limit_is_not_ranked():
    name, known = "BipedSprintSafe-v0", known_of(TASKS["BipedSprintSafe-v0"])
    who = {"pi": CrankSpeedPI(), "still": ConstantTorque(0.0)}
    table = evaluate_task(name, who, seeds=(10, 21))
    over, kept = (table.row(name, one).metrics for one in ("pi", "still"))
    assert over["return"].value > kept["return"].value
    assert over["cost"].value > known.cost_limit >= kept["cost"].value
    assert math.isnan(over["task_score"].value)
    assert kept["task_score"].value == pytest.approx(0.0, abs=0.1)
    pi, still = table.to_text().splitlines()[-2:]
    assert "over the limit" in pi
    assert "over the limit" not in still
    (gait,) = (one for one in known.baselines if one.policy == "optimal-gait")
    assert known.by_hand.policy != gait.policy
    assert not known.keeps(gait.cost)
    assert math.isnan(known.score_of(gait).value)


@pytest.mark.long
@pytest.mark.parametrize("name", TASKS)
def test_baselines_and_doing_nothing_earn_what_is_written_of_them(name):
    task = TASKS[name]
    known, machine = known_of(task), machine_by_name(task.machine)
    assert known is not None
    env = task.make()[0]
    who = {one.policy: machine.baseline(one.policy, env) for one in known.baselines}
    table = evaluate_task(name, {"idle": Idle(len(env.action_names)), **who})
    for earned in (known.trivial, *known.baselines):
        row = table.row(name, earned.policy)
        assert row.count == known.episodes
        # Falls decide whole episodes, and single precision differs from machine to machine.
        spread = 0.0 if earned.high is None else earned.high - earned.value
        # output-feedback's noise is drawn by the angle's last bits: another machine, another draw.
        rel = 0.03 if earned.policy == "output-feedback" else 0.01
        assert row.metrics["return"].value == pytest.approx(earned.value, rel=rel, abs=spread / 4)
