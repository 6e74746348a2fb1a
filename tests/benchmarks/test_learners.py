"""What the page says of learners that were raced, and what each race gives them."""

from __future__ import annotations

import pytest

from benchmarks.learners import tables
from benchmarks.learners.__main__ import LEARNERS, measure
from benchmarks.learners.race import Race, evaluations
from stickslip.agents import Idle, OptimalGait
from stickslip.envs import task_by_name


def entry(reached: int | None, *points: list[float]) -> dict:
    return {"reached": reached, "points": [list(one) for one in points]}


SLOW = entry(2, [100, 11.0, 12.0, 0.1], [200, 12.0, 14.0, 0.5], [300, 13.0, 16.0, 0.91])
NEVER = entry(None, [100, 1.0, 1.0, 0.1], [200, 2.0, 2.0, 0.2])


def test_the_first_stretch_holds_what_is_compiled():
    assert tables.before_learning(SLOW) == pytest.approx(10.0)
    assert tables.before_learning(NEVER) == 0.0


def test_who_reaches_the_goal_stands_before_who_does_not():
    content = {
        "tasks": {"T": {"never": {"0": NEVER}, "slow": {"0": SLOW}}},
        "machine": {"processor": "P", "cores": 2},
        "versions": {"jax": "1"},
        "commit": "c",
        "measured": "2026-01-01T",
    }
    rows = [line.split("|")[2:] for line in tables.body(content).splitlines() if "`T`" in line]
    first, second = ([cell.strip() for cell in row] for row in rows)
    assert first[:6] == ["slow", "1", "1 of 1", "0.0003 M", "13.0", "16.0"]
    assert second[:3] == ["never", "1", "0 of 1"]
    assert second[-2] == "0.20"


def test_evaluations_are_equal_stretches_of_whole_updates():
    assert list(evaluations(100, 30, most=2)) == [60, 120]
    found = evaluations(8_000_000, 32_768)
    assert len(found) <= 64
    assert found[0] % 32_768 == 0
    assert found[-1] >= 8_000_000


@pytest.mark.long
def test_a_race_scores_policies_on_the_tasks_own_episodes_and_ends_at_the_goal():
    race = Race(task_by_name("BipedSteady-v0"), 0, limit=1e9)
    assert float(race.params.time_limit) < float(race.task.make()[1].time_limit)
    race.start()
    assert not race.tell(1, Idle(1))
    assert race.tell(2, OptimalGait())
    found = race.entry()
    assert found["reached"] == 1
    scores = [point[3] for point in found["points"]]
    assert scores[0] == pytest.approx(0.0, abs=1e-4)
    assert scores[1] == pytest.approx(1.0, abs=0.02)


def test_what_is_not_installed_is_left_out(monkeypatch, tmp_path, capsys):
    one = next(iter(LEARNERS.values()))._replace(package="not_a_package")
    monkeypatch.setitem(LEARNERS, "ours", one)
    measure([("BipedSteady-v0", "ours", 0)], 1.0, False, tmp_path / "out.json")
    assert "not_a_package is not installed" in capsys.readouterr().out
    assert not (tmp_path / "out.json").exists()
