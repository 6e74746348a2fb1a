"""Methods ranked over the tasks: aggregates, results files, `stickslip evaluate --task all`."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.evaluation import ranking
from stickslip.agents.evaluation.results import (
    Method,
    Result,
    measured,
    read_methods,
    read_results,
    write_results,
)
from stickslip.agents.policy.file import named_task_entry
from stickslip.envs import TASKS
from stickslip.envs.tasks.known import episodes_digest
from tests.agents.networks import still
from tests.asked import refusal, tells
from tests.documents import every_block

SPRINT, SAFE, STEADY, BUMP = (
    *("BipedSprint-v1", "BipedSprintSafe-v0", "BipedSteady-v0"),
    "UGVBump-v1",
)
pytestmark = pytest.mark.usefixtures("empty_directory")


def result(task: str, score: float, **more) -> Result:
    """A result of that score in each episode's mean."""
    return Result(task, (measured(task).scale.earned(score),), **more)


def sprint(path: str, push: float = 0.0) -> None:
    """A policy of the sprint that never moves its torque."""
    still(path, 6, named_task_entry(TASKS[SPRINT]), push, squash="clip")


def test_aggregates_are_those_of_rliable():
    """rliable 1.2.0 with arch 7.2.0, 5000 resamples with NumPy's seed 0, on the same scores."""
    random = np.random.default_rng(3)
    scores = random.uniform(-0.5, 1.1, (5, 11)), random.uniform(0.5, 1.1, (10, 6))
    values = (0.33992614, 0.316651, 0.68494108), (0.79769646, 0.79712839, 0.2091018)
    low = (0.20055716, 0.21977156, 0.58866518), (0.74214717, 0.75796775, 0.17332311)
    high = (0.47367351, 0.41327875, 0.78169401), (0.84605922, 0.83591762, 0.24593909)
    for ours, *theirs in zip(scores, values, low, high, strict=True):
        found = [ranking.aggregate(one, ours) for one in ranking.AGGREGATES.values()]
        np.testing.assert_allclose([one[0] for one in found], theirs[0], atol=1e-8)
        for end, known in zip((1, 2), theirs[1:], strict=True):
            np.testing.assert_allclose([one[end] for one in found], known, atol=8e-3)
    value, low, high = ranking.aggregate(ranking.profile, scores[0])
    assert value[0] == np.mean(scores[0] > 0)
    assert np.all((low <= value) & (value <= high))
    assert math.isnan(ranking.aggregate(ranking.iqm, scores[0][:1])[1])


def test_methods_are_compared_on_common_tasks_and_over_the_limit_counts_nought():
    both = [result(STEADY, 0.5), result(SAFE, 1.0, cost=9.0), result(SAFE, 1.0, cost=0.0)]
    one = Method("one", (*both, result(STEADY, 0.7), result(BUMP, 0.1)))
    other = Method("other", (result(SAFE, 0.4, cost=0.0), result(STEADY, 0.6), result(SPRINT, 1)))
    found = ranking.comparisons([one, other])
    assert [(each.machine, each.tasks) for each in found] == [
        ("biped", (STEADY, SAFE)),
        ("ugv", (BUMP,)),
    ]
    np.testing.assert_allclose(found[0].scores["one"], [[0.5, 0.0], [0.7, 1.0]], atol=1e-12)
    np.testing.assert_allclose(found[0].scores["other"], [[0.6, 0.4]], atol=1e-12)
    assert list(found[0].aggregates) == ["one", "other"]
    assert ranking.score_of(both[1:]) == "1 of 2 over the limit"
    assert list(ranking.comparisons([one, other], least=[SPRINT])[0].scores) == ["other"]


def test_results_come_back_from_their_file():
    sprint("runs/a.npz")
    returns = tuple(np.linspace(1.0, 9.0, measured(STEADY).episodes))
    method = Method(
        "mine",
        (
            Result(STEADY, returns, failures=0.25, seed=3, steps=1000, seconds=2.5),
            Result(SPRINT, (12.01,), policy="runs/a.npz"),
            Result(SPRINT, (0.5,), policy="biped-sprint"),
        ),
        "of nothing",
    )
    path = write_results(method, Path("out/mine.json"))
    assert json.loads(path.read_text())["results"][1]["policy"] == "../runs/a.npz"
    (back,) = read_methods([str(path)])
    assert back == replace(
        method,
        results=(
            method.results[0],
            replace(method.results[1], policy="out/../runs/a.npz"),
            method.results[2],
        ),
    )
    assert back.results[0].score == measured(STEADY).score(returns, range(len(returns)))
    Path("runs/a.npz").unlink()
    assert read_results(path).results[1].policy is None  # its return is the bound, rounded
    with pytest.raises(ValueError, match="3 results on BipedSteady-v0 have seed 3"):
        read_results(write_results(replace(method, results=method.results[:1] * 3), path))


def test_the_file_on_the_page_is_read():
    (block,) = (one for one in every_block() if one.language == "json")
    digest = episodes_digest(TASKS[STEADY])
    Path("mine.json").write_text(block.code.replace("DIGEST", digest))
    method = read_results(Path("mine.json"))
    assert method.results == (Result(STEADY, (8.1,), seed=0, steps=1_000_000, seconds=900.0),)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"method": "../up"}, "letters"),
        ({"version": 2}, "version"),
        ({"results": []}, "no list"),
        ({"episodes": "0" * 16}, "another version"),
        ({"task": "BipedSted-v0"}, "BipedSteady-v0"),
        ({"returns": [1.0, 2.0]}, "episodes"),
        ({"returns": ["much"]}, "returns"),
        ({"returns": [10.02]}, "on BipedSteady-v0 is 10.02, .* the proved bound of 10;"),
        ({"seconds": -1.0}, "seconds"),
        ({"policy": 3}, "policy"),
        ({"policy": "no.npz", "returns": []}, "'no.npz' is neither a baseline nor a file"),
        ({"policy": "mine.json"}, "on BipedSteady-v0: mine.json: .*damaged"),
        ({"policy": "ugv-bump"}, "is a policy of the UGV; accepted: constant-torque"),
        ({"mood": "good"}, "'mood' is no field; accepted: .*, policy, returns"),
        ({"methods": "all"}, "'methods' is no field; accepted: method, about, results"),
    ],
)
def test_a_damaged_results_file_is_refused_by_name(change, said):
    path = write_results(Method("mine", (result(STEADY, 1.0),)), Path("mine.json"))
    content = json.loads(path.read_text())
    head = change.keys() & {*content, "methods"}
    (content if head else content["results"][0]).update(change)
    path.write_text(json.dumps(content))
    with pytest.raises(ValueError, match=said) as refused:
        read_results(path)
    assert str(refused.value).startswith("mine.json: ")


def test_the_command_plays_ranks_and_writes_and_tells_a_false_score(capsys):
    sprint("mine/a.npz")
    sprint("mine/b.npz", 0.2)
    liar = Method("liar", (result(SPRINT, 0.9, policy="mine/a.npz", steps=7),))
    write_results(liar, Path("liar.json"))
    asked = ["evaluate", "--task", "all", "mine", "liar.json", "--out", "out"]
    content = tells(capsys, *asked)
    (said,) = content["differences"]
    assert said.endswith("scores 0.900 by its file and 0.000 in the replay, which counts")
    assert content["aggregates"]["biped"]["liar"]["IQM"]["value"] == pytest.approx(0, abs=1e-4)
    assert [len(one["results"]) for one in content["methods"]] == [2, 1]
    assert sorted(path.name for path in Path("out").iterdir()) == [
        *("liar.json", "mine.json", "ranking.md", "ranking.png")
    ]
    assert "optimality gap" in Path("out/ranking.md").read_text()
    back = read_results(Path("out/liar.json")).results[0]
    assert (back.steps, back.score.value) == (7, pytest.approx(0.0, abs=1e-4))
    for arguments, why in {
        tuple(asked): "exists",
        (*asked, "--episodes", "3"): "--episodes",
        (*asked[:3], "mine", "mine/../mine"): "two methods",
        (*asked[:3], "out"): "no policy",
    }.items():
        assert why in refusal(capsys, *arguments)
