"""Training runs: what they leave, how they go on after a kill, what they refuse."""

import errno
import json
import pickle
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents import read_metadata
from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.training.configuration import Trained
from stickslip.agents.training.directory import (
    STATE,
    list_checkpoints,
    only_writer,
    read_columns,
    read_model,
)
from stickslip.agents.training.run import best_evaluation, train
from stickslip.agents.untrusted import pack
from tests.agents.runs import TINY, assert_same_run
from tests.asked import refusal
from tests.documents import ROOT
from tests.extras import SB3

SHORT = TINY | {"evaluation_episodes": 2, "episode_time": 0.4, "keep_checkpoints": 9, "seed": 3}
SHORT |= {"timesteps": 768, "epochs": 2, "history": 2, "checkpoint_interval": 256}
PPO, JAX = (TrainConfig.of(trainer=trainer, **SHORT) for trainer in ("sb3", "jax"))
CONFIGS = {"sb3": PPO, "jax": JAX}
TRAINERS = [pytest.param("sb3", marks=SB3), "jax"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory):
    """Uninterrupted runs by trainer, each made at first use. Not to be written to."""
    made: dict[str, Trained] = {}

    def run(trainer: str = "jax") -> Trained:
        if trainer not in made:
            path = tmp_path_factory.mktemp("runs") / trainer
            made[trainer] = train(CONFIGS[trainer], path, bar=False)
        return made[trainer]

    return run


@pytest.fixture
def copy(runs, tmp_path: Path):
    """A finished run's directory to spoil."""
    return Path(shutil.copytree(runs().directory, tmp_path / "copy"))


@pytest.mark.parametrize("trainer", TRAINERS)
def test_a_run_leaves_everything_it_promises(runs, trainer: str):
    trained, config = runs(trainer), CONFIGS[trainer]
    path = trained.directory
    assert trained.finished
    assert trained.timesteps == config.timesteps
    assert TrainConfig.from_json((path / "config.json").read_text()) == config
    about = read_metadata(path / "policy.npz")
    assert (about["history"], about["layer_sizes"][0]) == (2, 6 + 2 * 7)
    used = about["versions"].keys()
    assert {"jax", "python", *(() if config is JAX else ("torch",))} <= used
    metrics, tests = read_columns(path / "metrics.csv"), read_columns(path / "evaluations.csv")
    assert metrics["timesteps"] == sorted(set(metrics["timesteps"]))
    assert metrics["timesteps"][-1] == config.timesteps
    steps = range(config.checkpoint_interval, config.timesteps + 1, config.checkpoint_interval)
    assert tests["timesteps"] == list(steps)
    assert [int(p.name) for p in list_checkpoints(path / "checkpoints")] == list(steps)
    assert read_metadata(path / "policy.npz")["trained"]["timesteps"] == best_evaluation(path)[0]
    assert not list(path.rglob("*.part*"))


@pytest.mark.parametrize("trainer", TRAINERS)
def test_what_follows_a_checkpoint_depends_on_nothing_else(runs, tmp_path: Path, trainer: str):
    whole = runs(trainer).directory
    path = Path(shutil.copytree(whole, tmp_path / "run"))
    for folder in list_checkpoints(path / "checkpoints")[1:]:
        shutil.rmtree(folder)
    assert train(None, path, resume=True, bar=False).finished
    assert_same_run(whole, path)


ASKED = {"sb3": 32, "jax": 2}
"""Calls of `stop` an update."""


@pytest.mark.parametrize("trainer", TRAINERS)
def test_a_stopped_run_keeps_what_it_learnt_and_goes_on(tmp_path: Path, trainer: str):
    path, calls, config = tmp_path / "run", iter(range(10**9)), CONFIGS[trainer]
    stopped = train(config, path, bar=False, stop=lambda: next(calls) == 3 * ASKED[trainer] + 1)
    assert not stopped.finished
    assert stopped.timesteps == 384  # the fourth update is given up
    assert [int(p.name) for p in list_checkpoints(path / "checkpoints")] == [256, 384]
    again = train(config, path, resume=True, bar=False)
    assert again.finished
    assert again.seconds > stopped.seconds
    assert read_columns(path / "metrics.csv")["timesteps"] == [128, 256, 384, 512, 640, 768]
    assert read_columns(path / "evaluations.csv")["timesteps"] == [256, 512, 768]


def test_a_run_that_is_stopped_before_its_first_evaluation_has_the_policy_it_learnt(tmp_path):
    calls = iter(range(10**9))
    train(JAX, tmp_path / "run", bar=False, stop=lambda: next(calls) == ASKED["jax"] + 1)
    about = read_metadata(tmp_path / "run" / "policy.npz")["trained"]
    assert about["timesteps"] == 128


def test_only_the_latest_and_the_best_checkpoint_are_kept(tmp_path: Path):
    trained = train(replace(JAX, keep_checkpoints=1), tmp_path / "run", bar=False)
    kept = [int(p.name) for p in list_checkpoints(trained.directory / "checkpoints")]
    assert kept == sorted({best_evaluation(trained.directory)[0], JAX.timesteps})


def test_an_existing_directory_is_refused_and_stays_as_it_was(copy: Path, tmp_path: Path, capsys):
    before = {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    with pytest.raises(ValueError, match=r"exists and is not empty; accepted: .*--resume"):
        train(JAX, copy)
    with pytest.raises(ValueError, match="another configuration"):
        train(replace(JAX, seed=4), copy, resume=True)
    assert "is a run of the biped" in refusal(capsys, "train", "ugv", "--resume", f"--out={copy}")
    foreign = tmp_path / "home"
    foreign.mkdir()
    (foreign / "thesis.tex").write_text("years of work")
    for resume in (False, True):
        with pytest.raises(ValueError, match="accepted"):
            train(JAX, foreign, resume=resume)
    assert before == {path: path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    assert [path.name for path in foreign.iterdir()] == ["thesis.tex"]


def test_one_writer_holds_a_directory_and_leaves_no_file(tmp_path: Path):
    pytest.importorskip("fcntl")
    for _ in range(2):
        with only_writer(tmp_path):
            assert not list(tmp_path.iterdir())
            with (
                pytest.raises(ValueError, match="another process is training there"),
                only_writer(tmp_path),
            ):
                pytest.fail("both hold it")


class Trap:
    """Unpickling this would leave a file behind."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def spoil_model(folder: Path, content: bytes):
    (folder / "model.npz").write_bytes(content)


def with_arrays(folder: Path, **changes: np.ndarray):
    state = read_model(folder)
    first = changes.pop("first", None)
    state = {**state, **changes}
    spoil_model(folder, pack(state if first is None else state | {next(iter(state)): first}))


SPOILED = {
    "cut short": lambda f: spoil_model(f, (f / "model.npz").read_bytes()[:3000]),
    "a pickle": lambda f: spoil_model(f, pickle.dumps(Trap(f.parent / "sprung"))),
    "another shape": lambda f: with_arrays(f, first=np.zeros((3, 3), np.float32)),
    "another array": lambda f: with_arrays(f, another=np.zeros(1)),
    "no state": lambda f: (f / STATE).unlink(),
    "state of another run": lambda f: (f / STATE).write_text(
        (f / STATE).read_text().replace(JAX.digest, PPO.digest)
    ),
}


@pytest.mark.parametrize("damage", SPOILED)
def test_a_damaged_checkpoint_is_refused_by_name(copy: Path, damage: str):
    folder = list_checkpoints(copy / "checkpoints")[-1]
    SPOILED[damage](folder)
    with pytest.raises(ValueError, match=rf"{folder.name}.*accepted: "):
        train(None, copy, resume=True)
    assert not (folder.parent / "sprung").exists()


def test_a_checkpoints_damaged_policy_is_refused_and_spoils_no_other(copy: Path):
    before = (copy / "policy.npz").read_bytes()
    for folder in list_checkpoints(copy / "checkpoints"):
        (folder / "policy.npz").write_bytes(before[:300])
    with pytest.raises(ValueError, match=r"\d+.policy.npz: .*accepted: "):
        train(None, copy, resume=True)
    assert (copy / "policy.npz").read_bytes() == before


def test_parameters_that_are_no_numbers_end_the_run_by_name(tmp_path: Path):
    config = replace(JAX, learning_rate=1e30, final_learning_rate=1e30)
    with pytest.raises(ValueError, match="training diverged before step 256: the policy's"):
        train(config, tmp_path / "run", bar=False)
    assert not list_checkpoints(tmp_path / "run" / "checkpoints")


def test_a_disk_that_cannot_be_written_is_said_before_anything_is_computed(tmp_path, monkeypatch):
    def refused(dir):
        raise OSError(errno.EROFS, "Read-only file system", f"{dir}/tmpab12cd34")

    monkeypatch.setattr("stickslip.records.files.tempfile.TemporaryFile", refused)
    with pytest.raises(OSError, match=r"cannot be written \(Read-only file system\): '.*/run'"):
        train(JAX, tmp_path / "run", bar=False)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_the_commands_of_make_demo_train_a_walk_without_slips(tmp_path: Path, monkeypatch):
    """A second time, they neither train nor fail."""
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\ndemo: ")[2]
    lines = text.partition("\n\n")[0].replace("\\\n", " ").splitlines()[1:]
    program = f"{sys.executable} -m stickslip.cli"
    for _ in range(2):
        for line in lines:
            command = line.strip().lstrip("@").replace("$(VENV)/bin/stickslip", program)
            subprocess.run(command.replace("$$", "$"), shell=True, check=True)
    path = Path("runs/demo")
    assert read_columns(path / "metrics.csv")["timesteps"][-1] == 245 * 32768
    evaluated = json.loads((path / "evaluation.json").read_text())["rows"]
    rows = {row["controller"]: row for row in evaluated}
    found = {name: {k: v["value"] for k, v in r["metrics"].items()} for name, r in rows.items()}
    policy, servo = found["runs/demo"], found["crank-speed-pi"]
    assert policy["falls"] == 0
    assert policy["mean_crank_rate"] == pytest.approx(3.0, abs=0.15)
    assert policy["slip_per_metre"] < 0.5 * servo["slip_per_metre"]
    assert policy["energy_per_metre"] < servo["energy_per_metre"]
    assert policy["return"] > found["computed-torque"]["return"] - 0.3
    for name in ("learning.png", "episode.png", "episode.gif", "evaluation.csv", "policy.npz"):
        assert (path / name).stat().st_size > 500
