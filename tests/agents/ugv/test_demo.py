"""The UGV's demo: found by its name, honest about drives that fail and unfinished training."""

import csv
import json
import re
from pathlib import Path

import jax
import numpy as np
import pytest

from stickslip.agents import demo as module
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.biped.demo import BipedDemonstration
from stickslip.agents.demo import demo, find_directory
from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures import plots, training
from stickslip.agents.registry import register, unregister
from stickslip.agents.training.log import read_columns
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.agents.ugv.controllers import LevelBody
from stickslip.agents.ugv.demo import UGVDemonstration, _lines
from stickslip.cli import make_parser
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Track
from stickslip.envs import UGVEnv
from tests.agents.mass import MassMachine
from tests.agents.runs import clock_until_kept

SMALL = UGVTrainConfig.of(
    timesteps=384,
    num_envs=4,
    rollout_steps=32,
    batch_size=64,
    epochs=1,
    hidden=8,
    checkpoint_interval=128,
    evaluation_episodes=1,
    preview=3,
)


@pytest.fixture(scope="module")
def drives():
    """Two drives of random numbers, the second one ending in a slip; environment, parameters."""
    env, steps, rng = UGVEnv(preview=0), 6, np.random.default_rng(7)
    params = env.make_params(track=Track.bump(end=4.0))
    shapes = jax.eval_shape(lambda: rollout(env, LevelBody(), params, 0, steps))

    def drive(status: Status) -> Rollout:
        filled = jax.tree.map(lambda at: rng.uniform(1, 9, at.shape).astype(at.dtype), shapes)
        filled.info["status"][-1] = status
        return filled._replace(length=np.int32(steps))

    return {"optimum": drive(Status.OK), "level-body": drive(Status.WHEEL_SLIP)}, env, params


def test_a_machine_is_named_or_that_of_its_configuration_or_the_first():
    found = module._demonstration
    assert isinstance(found(None, None), BipedDemonstration)
    assert isinstance(found("ugv", None), UGVDemonstration)
    assert isinstance(found(None, SMALL), UGVDemonstration)
    assert isinstance(found("biped", TrainConfig.of()), BipedDemonstration)
    assert make_parser(["demo"]).parse_args(["demo"]).machine == "biped"
    assert make_parser(["demo"]).parse_args(["demo", "ugv"]).machine == "ugv"


def test_what_has_no_demo_is_refused_before_anything_is_written(tmp_path: Path):
    register(MassMachine())
    try:
        with pytest.raises(ValueError, match="'mass' has no demo; accepted: biped, ugv"):
            demo(tmp_path, machine="mass")
    finally:
        unregister("mass")
    with pytest.raises(ValueError, match=r"machine = 'uvg' is unknown.*'ugv'"):
        demo(tmp_path, machine="uvg")
    with pytest.raises(ValueError, match="'biped' with a configuration of the ugv"):
        demo(tmp_path, machine="biped", config=SMALL)
    assert not list(tmp_path.iterdir())


def test_each_machine_has_a_directory_of_its_own(tmp_path: Path):
    name = UGVDemonstration().directory
    assert name != BipedDemonstration().directory
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "config.json").write_text(TrainConfig.of().to_json())
    assert find_directory(tmp_path, SMALL, False, name) == (tmp_path / name, False)
    (tmp_path / name).mkdir()
    (tmp_path / name / "config.json").write_text(SMALL.to_json())
    assert find_directory(tmp_path, SMALL, False, name) == (tmp_path / name, True)
    assert find_directory(tmp_path, SMALL, True, name) == (tmp_path / f"{name}-2", False)


def test_a_line_has_the_drives_own_numbers_and_says_where_it_failed(drives):
    played, env, params = drives
    for (name, one), line in zip(played.items(), _lines(*drives), strict=True):
        last, least = one.state, float(played["optimum"].state.cost[-1])
        cost, ratio, legs = (float(word) for word in re.findall(r"\d+\.\d+", line)[:3])
        assert line.startswith(f"  {name} ")
        assert cost == pytest.approx(float(last.cost[-1]), abs=0.051)
        assert ratio == pytest.approx(float(last.cost[-1]) / least, abs=6e-4)
        assert legs == pytest.approx(float(last.totals.total_energy[-1]), abs=0.051)
    way = float(played["level-body"].info["episode_distance"][-1])
    assert line.endswith(f"failed after {way:.1f} m: WHEEL_SLIP")
    backwards = {"optimum": played["level-body"], "level-body": played["optimum"]}
    assert all("nan of the optimum" in line for line in _lines(backwards, env, params))


@pytest.mark.long
def test_a_demo_that_was_cut_short_says_so_in_table_and_titles(tmp_path, monkeypatch):
    pytest.importorskip("tensorboard")
    titles: list[str] = []
    for place in (plots, training):
        make = place.make_sheet
        monkeypatch.setattr(
            place, "make_sheet", lambda *how, make=make: titles.append(how[3]) or make(*how)
        )
    said: list[str] = []
    monkeypatch.setattr(module, "monotonic", clock_until_kept(tmp_path))
    path = demo(tmp_path, config=SMALL, time_limit=35.0, say=said.append)
    done = read_columns(path / "evaluations.csv")["timesteps"][-1]
    assert 0 < done < SMALL.timesteps
    name = f"policy after {int(100 * done // SMALL.timesteps)} % of its training"
    table = (path / "table.txt").read_text()
    assert table in "\n".join(said)
    assert f"NOT finished: {done:.0f} of 384 steps" in table
    assert f"\n  {name} " in table
    assert "trained policy" not in table
    rows = list(csv.DictReader((path / "table.csv").read_text().splitlines()))
    assert [row["controller"] for row in rows] == ["fixed-posture", "level-body", name]
    assert sum(name in title for title in titles) == 2
    assert sum(f"unfinished: {done:.0f} of 384 steps" in title for title in titles) == 1


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
    assert float(costs["trained policy"]) < 0.9 * float(costs["fixed posture"])
    for name in UGVDemonstration.files:
        assert (path / name).stat().st_size > 500
    steps = read_columns(path / "metrics.csv")["timesteps"]
    assert demo(tmp_path, machine="ugv") == path
    assert read_columns(path / "metrics.csv")["timesteps"] == steps
