"""What is known of the tasks: of these definitions, in order, and not from damaged files."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from stickslip.envs.tasks import TASKS, Scale, known, known_of

NAMES = list(TASKS)


@pytest.mark.parametrize("name", NAMES)
def test_every_task_is_measured_and_its_numbers_are_in_order(name):
    found = known_of(TASKS[name])
    assert found is not None
    everybody = (*found.baselines, *found.planners)
    assert found.best.value >= max(one.value for one in everybody)
    assert found.trivial.value < found.best.value
    assert found.how
    for one in (*everybody, found.best, found.trivial):
        assert (one.low is None) == (found.episodes == 1)
        if one.low is not None and one.high is not None:
            assert one.low <= one.value <= one.high
    if found.bound is not None:
        assert found.best.value <= found.bound.value
    if found.assumed is not None:
        assert found.bound is None or found.assumed.value < found.bound.value
        assert "if" in found.assumed.reason


def test_eight_tasks_have_room_above_what_is_made_by_hand():
    scores = {}
    for name, task in TASKS.items():
        found = known_of(task)
        assert found is not None
        scores[name] = found.scale.score(found.by_hand.value)
    assert sum(score < 0.85 for score in scores.values()) >= 8, scores


def test_a_score_is_nought_for_the_trivial_one_for_the_best_and_straight_between():
    scale = Scale(-2.0, 6.0)
    assert [scale.score(one) for one in (-2.0, 6.0, 2.0, 10.0, -4.0)] == [0, 1, 0.5, 1.5, -0.25]
    assert scale.gap(4.0) == 2.0
    for zero, one in ((1.0, 1.0), (2.0, 1.0), (float("nan"), 1.0)):
        with pytest.raises(ValueError, match="zero < one"):
            Scale(zero, one)


def content() -> dict:
    return json.loads(known.FILE.read_text(encoding="utf-8"))


def spoilt(path, monkeypatch, text: str):
    path.write_text(text, encoding="utf-8")
    monkeypatch.setattr(known, "FILE", path)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": "x"}', "\x00", "[" * 50_000])
def test_a_file_that_is_none_is_named(text, tmp_path, monkeypatch):
    spoilt(tmp_path / "known.json", monkeypatch, text)
    with pytest.raises(ValueError, match=r"known\.json: .*accepted: the file as"):
        known_of(TASKS[NAMES[0]])


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("best", None),
        ("best", {"policy": "x", "return": float("nan"), "low": 0, "high": 1, "failures": 0}),
        ("baselines", [3]),
        ("episodes", "many"),
        ("bound", {"value": -1e9, "reason": "none"}),
        ("learned", {"how": "x", "returns": ["y"]}),
        ("assumed", {"value": "many", "reason": "none"}),
    ],
)
def test_a_damaged_entry_is_named_with_its_task(entry, value, tmp_path, monkeypatch):
    whole = content()
    whole["tasks"][NAMES[0]][entry] = value
    spoilt(tmp_path / "known.json", monkeypatch, json.dumps(whole))
    with pytest.raises(ValueError, match=rf"known\.json: {NAMES[0]}: .*accepted"):
        known_of(TASKS[NAMES[0]])
    assert known_of(TASKS[NAMES[1]]) is not None


def test_scores_of_another_definition_are_refused_and_none_are_none():
    task = TASKS[NAMES[0]]
    changed = replace(task, parameters={**task.parameters, "commanded_rate": 3.5})
    with pytest.raises(ValueError, match="measured by another definition"):
        known_of(changed)
    assert known_of(replace(task, version=99)) is None
