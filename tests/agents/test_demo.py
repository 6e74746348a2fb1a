"""The demo: what is unfinished says so everywhere, and the time to go is right."""

import csv
import json
import re
from pathlib import Path

import pytest

from stickslip.agents import demo as module
from stickslip.agents.biped import demo as biped_demo
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.biped.controllers import ConstantTorque
from stickslip.agents.biped.demo import BipedDemonstration
from stickslip.agents.biped.machine import BipedMachine
from stickslip.agents.demo import demo, find_directory
from stickslip.agents.pictures import plots
from stickslip.agents.pictures import training as plots_training
from stickslip.agents.registry import register, unregister
from stickslip.agents.training.configuration import Trained
from stickslip.agents.training.log import MetricsFile, read_columns
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.agents.ugv.demo import UGVDemonstration
from stickslip.cli import WRONG_INPUT, main
from tests.agents.mass import MassMachine
from tests.agents.runs import clock_until_kept

SMALL = TrainConfig.of(
    timesteps=768,
    rollout_steps=32,
    batch_size=64,
    epochs=2,
    checkpoint_interval=256,
    num_envs=4,
    hidden=8,
    evaluation_episodes=2,
    episode_time=0.4,
    mu_static=0.06,
    mu_kinetic=0.05,
)


def test_an_unfinished_training_is_called_one(tmp_path, monkeypatch):
    trained = Trained(tmp_path, tmp_path / "policy.npz", SMALL, 767, 1.0, False)
    assert (trained.percent, trained.name) == (99, "policy after 99 % of its training")
    assert trained._replace(timesteps=768, finished=True).name == "trained policy"
    pytest.importorskip("matplotlib")
    titles: list[str] = []
    make = plots_training.make_sheet
    monkeypatch.setattr(
        plots_training,
        "make_sheet",
        lambda rows, columns, size, title: titles.append(title) or make(rows, columns, size, title),
    )
    rows = MetricsFile(tmp_path / "metrics.csv", ("seconds", "noise"))
    for steps in (384, 768):
        rows.append(steps, {"seconds": steps / 100, "noise": 0.2})
        plots_training.plot_learning(tmp_path, SMALL)
    assert titles == [
        "PPO on the biped: 4 s of training, evaluations aside, unfinished: 384 of 768 steps",
        "PPO on the biped: 8 s of training, evaluations aside",
    ]


@pytest.mark.long
def test_a_demo_that_was_cut_short_says_so_in_table_and_titles(tmp_path, monkeypatch):
    pytest.importorskip("tensorboard")
    titles: list[str] = []
    for place in (plots, plots_training):
        make = place.make_sheet
        monkeypatch.setattr(
            place,
            "make_sheet",
            lambda *how, make=make: titles.append(how[3]) or make(*how),
        )
    monkeypatch.setattr(BipedMachine, "film_time", 0.04)
    monkeypatch.setattr(biped_demo, "CONTROLLERS", {"constant-torque": ConstantTorque})
    said: list[str] = []
    monkeypatch.setattr(module, "monotonic", clock_until_kept(tmp_path))
    path = demo(tmp_path, config=SMALL, time_limit=110.0, say=said.append)
    name = "policy after 33 % of its training"
    assert "Time is up after 256 of 768 steps (33 %)" in "\n".join(said)
    table = (path / "table.txt").read_text()
    assert table in "\n".join(said)
    assert name in table
    assert "NOT finished: 256 of 768 steps (33 %)" in table
    assert "trained policy" not in table
    rows = list(csv.DictReader((path / "table.csv").read_text().splitlines()))
    assert [row["controller"] for row in rows] == ["constant-torque", name]
    content = json.loads((path / "table.json").read_text())
    assert content["training"] == {"timesteps": 256, "of": 768, "finished": False}
    assert [title for title in titles if name not in title] == [
        title for title in titles if "unfinished: 256 of 768 steps" in title
    ]
    assert len(titles) == 3


@pytest.mark.parametrize("limit", ["0", "-1", "nan", "inf"])
def test_a_time_limit_is_a_time(capsys, tmp_path, limit: str):
    assert main(["demo", "--out", str(tmp_path), f"--time-limit={limit}"]) == WRONG_INPUT
    assert "time_limit = " in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_what_has_no_demo_is_refused_before_anything_is_written(tmp_path: Path):
    register(MassMachine())
    try:
        with pytest.raises(ValueError, match="'mass' has no demo; accepted: biped, ugv"):
            demo(tmp_path, machine="mass")
    finally:
        unregister("mass")
    with pytest.raises(ValueError, match=r"machine = 'uvg' is unknown.*'ugv'"):
        demo(tmp_path, machine="uvg")
    assert not list(tmp_path.iterdir())


def test_each_machine_has_a_directory_of_its_own(tmp_path: Path):
    name = UGVDemonstration().directory
    assert name != BipedDemonstration().directory
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "config.json").write_text(TrainConfig.of().to_json())
    config = UGVTrainConfig.of()
    assert find_directory(tmp_path, config, False, name) == (tmp_path / name, False)
    (tmp_path / name).mkdir()
    (tmp_path / name / "config.json").write_text(config.to_json())
    assert find_directory(tmp_path, config, False, name) == (tmp_path / name, True)
    assert find_directory(tmp_path, config, True, name) == (tmp_path / f"{name}-2", False)


@pytest.mark.long
def test_the_demos_policy_comes_near_the_optimum_on_bumps_that_it_has_not_seen(tmp_path: Path):
    path = demo(tmp_path, machine="ugv")
    assert path == tmp_path / "demo-ugv"
    rows = {row["controller"]: row for row in json.loads((path / "table.json").read_text())["rows"]}
    found = {name: {k: v["value"] for k, v in r["metrics"].items()} for name, r in rows.items()}
    policy, posture = found["trained policy"], found["fixed-posture"]
    assert policy["failures"] == 0
    assert 0.99 < policy["score"] < 1.12
    assert policy["score"] - 1 < 0.4 * (posture["score"] - 1)
    shown = (path / "table.txt").read_text()
    costs = dict(re.findall(r"^  ([a-z -]+?) +(\d+\.\d) J", shown, re.MULTILINE))
    assert float(costs["optimum"]) < 1.01 * float(costs["trained policy"])
    assert float(costs["trained policy"]) < 0.9 * float(costs["fixed-posture"])
    for name in UGVDemonstration.files:
        assert (path / name).stat().st_size > 500
    steps = read_columns(path / "metrics.csv")["timesteps"]
    assert demo(tmp_path, machine="ugv") == path
    assert read_columns(path / "metrics.csv")["timesteps"] == steps
