"""`stickslip tasks` and `stickslip evaluate --task`: what they print, and what they refuse."""

from __future__ import annotations

import json
import re

import pytest

from stickslip.envs import TASKS, known_of
from stickslip.envs.tasks import WITHDRAWN
from tests.asked import prints, tells


def test_the_list_has_a_row_for_every_task_with_what_is_known(capsys, monkeypatch):
    monkeypatch.setitem(WITHDRAWN, "BipedSteady-v99", "it walked through walls")
    lines = prints(capsys, "tasks").splitlines()
    assert lines[-1] == "BipedSteady-v99: withdrawn, refused: it walked through walls"
    for name, task in TASKS.items():
        (line,) = (one for one in lines if one.startswith(f"{name} "))
        known = known_of(task)
        assert known is not None
        assert task.title in line
        assert f"{known.best.value:.4g}" in line
        assert known.score_of(known.by_hand).shown(2) in line


def test_a_task_by_name_tells_its_numbers_and_who_earned_what(capsys):
    said = prints(capsys, "tasks", "BipedSprint-v1", "stickslip/UGVBump-v1")
    for part in ("mean_rate = 15.7", "total_energy", "policy = optimal-gait, value = 4.79"):
        assert part in said
    assert known_of(TASKS["BipedSprint-v1"]).how in said
    assert re.search(r"bound:\n +value = 12\n", said)
    assert re.search(r"assumed:\n +value = 5\.4\d+\n.*the foot neither slips nor tips", said)


def test_json_holds_every_number(capsys):
    (one,) = tells(capsys, "tasks", "BipedFast-v0")["tasks"]
    assert one["parameters"]["mean_rate"] == 6.5
    assert one["digest"] == TASKS["BipedFast-v0"].digest
    known = known_of(TASKS["BipedFast-v0"])
    assert one["known"]["best"]["value"] == known.best.value
    score = one["known"]["scores"][known.by_hand.policy]["value"]
    assert score == pytest.approx(known.scale.score(known.by_hand.value))


def test_evaluate_prints_scores_and_says_what_they_are(capsys, tmp_path):
    arguments = ["evaluate", "--task", "BipedSprint-v1", "constant-torque", "--out", str(tmp_path)]
    said = prints(capsys, *arguments)
    for part in ("how, and what is proved: stickslip tasks BipedSprint-v1", "score", "gap [m]"):
        assert part in said
    content = json.loads((tmp_path / "evaluation.json").read_text(encoding="utf-8"))
    assert "task_score" in content["rows"][0]["metrics"]
    assert "score 0: idle" in content["tasks"]["BipedSprint-v1"]
    told = tells(capsys, *arguments, "--overwrite")
    (row,) = told["evaluation"]
    for name, ends in content["rows"][0]["metrics"].items():
        assert [row[f"{name}{end}"] for end in ("", "_low", "_high")] == list(ends.values())
    assert told["units"]["evaluation"]["mean_speed"] == "m/s"
