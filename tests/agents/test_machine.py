"""A machine that nobody foresaw is used like the others."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip import agents
from stickslip.agents.biped.machine import BipedMachine
from stickslip.agents.machine import machine_by_name
from stickslip.agents.training.directory import read_columns
from stickslip.cli import OK, WRONG_INPUT, main
from tests.agents.mass import MassEnv, MassMachine, Pull
from tests.asked import prints, refusal

pytestmark = pytest.mark.usefixtures("empty_directory", "mass")


def test_a_third_machine_is_short():
    lines = Path(__file__).with_name("mass.py").read_text(encoding="utf-8").splitlines()
    assert len(lines) < 150


def test_it_is_trained_compared_and_viewed_by_the_same_commands(capsys):
    pytest.importorskip("optax")
    assert main(["train", "mass", "--out", "a run", "--set", "batch_size=32"]) == OK
    said = capsys.readouterr()
    assert "stickslip evaluate 'a run' pull" in said.out  # as a shell takes it
    lines = said.err.splitlines()
    stages = ("compiling the update ...", "compiling the evaluation ...", "       128 steps  ")
    assert all(line.startswith(stage) for line, stage in zip(lines, stages, strict=False))
    Path("a run").rename("run")
    names = ("policy.npz", "learning.png", "episode.png", "episode.gif", "config.json")
    assert all((Path("run") / name).stat().st_size > 100 for name in names)
    assert json.loads(Path("run/config.json").read_text())["machine"] == "mass"
    tests, metrics = (read_columns(Path(f"run/{of}.csv")) for of in ("evaluations", "metrics"))
    assert tests["timesteps"] == [128, 256]
    assert np.all(np.isfinite(tests["return"]))
    assert {"duration", "policy_loss"} <= metrics.keys()
    assert main(["train", "mass", "--out", "run", "--resume", "--no-pictures"]) == OK
    command = ["evaluate", "run", "pull", "--scene", "patchy,even", "--set", "mu=0.2"]
    shown = prints(capsys, *command, "--episodes", "4", "--out", "table")
    assert "patchy: the own task of run with --scene patchy --set mu=0.2" in shown
    assert "mu 0.2, mu patch 0.05" in shown
    rows = json.loads(Path("table/evaluation.json").read_text())["rows"]
    pairs = [(row["scene"], row["controller"]) for row in rows]
    assert pairs == [(scene, who) for scene in ("patchy", "even") for who in ("run", "pull")]
    assert main(["view", "run", "--seconds", "1", "--out", "run.gif"]) == OK
    assert Path("run.gif").read_bytes()[:3] == b"GIF"


def test_its_task_is_kept_in_a_policys_file_and_read_again():
    env = MassEnv()
    params = replace(env.default_params, mass=3.0)
    size = np.zeros((2, 1), np.float32)
    policy = agents.MLPPolicy((size,), (size[0],), size[:, 0], size[:, 0] + 1)
    about = agents.describe_environment(env, params)
    agents.save_policy(policy, "policy.npz", about)
    task = machine_by_name("mass").read_task(agents.read_metadata("policy.npz"))
    assert task is not None
    assert (task.env, task.params) == (env, params)
    about["task"]["values"]["kind"] = "BipedParams"
    with pytest.raises(ValueError, match="its task is damaged"):
        machine_by_name("mass").read_task(about)
    assert machine_by_name("biped").read_task({}) is None
    assert agents.load_policy("policy.npz").layer_sizes == (2, 1)


def test_it_is_evaluated_in_python_and_pulls_its_mass_to_the_place():
    env = MassEnv()
    table = agents.evaluate(env, {"pull": Pull()}, {"patchy": env.default_params}, episodes=8)
    episodes = table.row("patchy", "pull").episodes
    assert episodes.reward.shape == (8,)
    assert np.all(episodes.reward > 0.6 * 30)
    assert not episodes.fell.any()
    with pytest.raises(ValueError, match="env is a int; accepted: BipedEnv, UGVEnv, MassEnv"):
        agents.evaluate(3, {"pull": Pull()}, {})


def test_names_belong_to_one_machine(capsys):
    class Other(MassMachine):
        name, environment, baselines = "other", "OtherEnv", ("computed-torque",)

    with pytest.raises(ValueError, match="computed-torque is known from the biped"):
        agents.register(Other())
    agents.register(MassMachine())  # the same one again
    assert [machine.name for machine in agents.machines()] == ["biped", "ugv", "mass"]
    assert type(machine_by_name("biped")) is BipedMachine
    assert "--start is for the biped" in refusal(capsys, "evaluate", "pull", "--start", "rest")
    assert main(["evaluate", "pull", "--scene", "wet"]) == WRONG_INPUT
