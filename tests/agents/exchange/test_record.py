"""Recorded data sets: Minari reads them, and the environment plays the same from the same seeds."""

import gymnasium
import minari
import numpy as np
import pytest

from stickslip.agents import LevelBody, evaluate_task, record
from stickslip.envs import known_of, task_by_name
from tests.asked import refusal

TASK, NAME = "UGVRandomBumps-v1", "mine/level-v3"
LEVEL = {"level": LevelBody()}


def numbered(played, seed):
    return {"seed": np.full(len(played.reward) + 1, seed)}


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data sets"))
    return tmp_path / "data sets"


def test_a_recording_is_what_the_environment_plays_from_the_same_seeds():
    table = record(TASK, LEVEL, NAME, noise=[0, 1], episodes=2, seed=3)
    data = minari.load_dataset(NAME)
    episodes, about = list(data), list(data.storage.get_episode_metadata(range(4)))
    assert [(one["policy"], one["noise"], one["seed"]) for one in about] == [
        ("level", noise, 3 + i) for i, noise in enumerate((0, 0, 1, 1))
    ]
    assert data.total_steps == sum(row["steps"] for row in table.records())
    env = data.recover_environment()
    assert env.spec == gymnasium.spec(f"stickslip/{TASK}")
    for one, its in zip(episodes, about, strict=True):
        met = [env.reset(seed=int(its["seed"]))[0]]
        steps = [env.step(action) for action in one.actions]
        met += [step[0] for step in steps]
        np.testing.assert_allclose(one.observations, met, atol=1e-5)
        np.testing.assert_allclose(one.rewards, [step[1] for step in steps], rtol=1e-4, atol=1e-3)
        assert [bool(step[2]) for step in steps] == one.terminations.tolist()
        assert [bool(step[3]) for step in steps] == one.truncations.tolist()
        assert one.infos["cost"].tolist() == [0.0, *(step[4]["cost"] for step in steps)]
        assert np.abs(one.actions).max() <= 1
    assert not np.array_equal(episodes[2].actions[:9], episodes[3].actions[:9])


@pytest.mark.long
def test_without_noise_returns_and_normalised_scores_are_those_of_evaluate():
    table = record(TASK, LEVEL, NAME, episodes=2, seed=0, infos=numbered)
    row = evaluate_task(TASK, LEVEL, episodes=2).row(TASK, "level")
    assert table.records()[0]["return"] == pytest.approx(row.metrics["return"].value, rel=1e-6)
    data, known = minari.load_dataset(NAME), known_of(task_by_name(TASK))
    returns = np.array([one.rewards.sum() for one in data])
    found = minari.get_normalized_score(data, returns)
    np.testing.assert_allclose(found, known.scale.score(returns), rtol=1e-5)
    assert [one.infos["seed"][0] for one in data] == [0, 1]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"task": "UGVRandomBump-v1"}, "UGVRandomBumps-v1"),
        ({"dataset": "no spaces"}, "no spaces"),
        ({"dataset": "../out-v0"}, "out-v0"),
        ({"dataset": "mine/level"}, r"dataset = 'mine/level'; accepted: name-v0"),
        ({"dataset": 3}, "dataset = 3; accepted: name-v0"),
        ({"noise": [[0, 1]]}, r"noise has shape \(1, 2\)"),
        ({"infos": 3}, "infos = 3"),
        ({"infos": lambda played, seed: {"cost": np.zeros(3)}}, r"'cost' of shape \(3,\)"),
        (
            {"infos": lambda played, _: {"regret": np.zeros(1 + played.length)}, "regret": True},
            "new",
        ),
        ({"noise": [0.5, 1.5]}, "1.5"),
        ({"noise": []}, "no number"),
        ({"controllers": {}}, "at least one"),
        ({"controllers": {"level": 3}}, "a controller"),
        ({"episodes": 0}, "episodes = 0"),
        ({"seed": 2**31 - 1}, "seed = 2147483647"),
    ],
)
def test_what_is_refused(changed, message, root):
    given = {"task": TASK, "controllers": LEVEL, "dataset": NAME, "episodes": 2, **changed}
    with pytest.raises(ValueError, match=message):
        record(**given)
    assert not list(root.rglob("*.hdf5"))


def test_a_data_set_is_there_whole_or_not_at_all_and_is_not_replaced(root, monkeypatch, capsys):
    def broken(*_):
        raise OSError("no space left")

    with monkeypatch.context() as within:
        within.setattr(minari.dataset.minari_storage.MinariStorage, "update_metadata", broken)
        with pytest.raises(OSError, match="no space"):
            record(TASK, LEVEL, NAME, episodes=2)
    assert [one.name for one in (root / "mine").iterdir()] == ["namespace_metadata.json"]
    record(TASK, LEVEL, NAME, episodes=2)
    with pytest.raises(ValueError, match="level-v3 exists"):
        record(TASK, LEVEL, f"{NAME}/inside-v0")
    given = ["record", "level-body", "--task", TASK, "--dataset", NAME]
    assert "exists; accepted" in refusal(capsys, *given)
