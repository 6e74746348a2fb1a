"""A run's directory after a kill at every file operation: resumed or begun anew, nothing lost."""

import os
from pathlib import Path
from typing import ClassVar

import pytest

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.training.directory import (
    TrainState,
    drop_checkpoints,
    list_checkpoints,
    open_run,
    read_config,
    read_model,
    write_checkpoint,
)
from stickslip.agents.training.log import MetricsFile, read_columns
from stickslip.records import files
from stickslip.records.files import write_whole

CONFIG = TrainConfig.of(timesteps=200, num_envs=4, rollout_steps=32, batch_size=64)
OTHER = TrainConfig.of(timesteps=100, num_envs=4, rollout_steps=32, batch_size=64)
OPERATIONS = ("replace", "link", "unlink", "rmdir", "mkdir", "fsync", "rename")


class Killed(BaseException):
    """The process is gone."""


class Disk:
    """Lets so many file operations through; after that the process is dead to the disk.

    after: the last one is still done, but nobody hears of it.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, allowed: int, after: bool):
        self.allowed, self.after = allowed, after
        for name in OPERATIONS:
            monkeypatch.setattr(os, name, self.guarded(getattr(os, name)))
        monkeypatch.setattr(files, "open", self.guarded(open), raising=False)

    def guarded(self, operation):
        def run(*arguments, **options):
            self.allowed -= 1
            if self.allowed == 0 and self.after:
                done = operation(*arguments, **options)
                if hasattr(done, "close"):
                    done.close()
            if self.allowed <= 0:
                raise Killed
            return operation(*arguments, **options)

        return run


def work(path: Path, config: TrainConfig, **how) -> None:
    """Do to the disk what training does, from where it is to the end."""
    run = open_run(path, config, **how)
    at = run.state.timesteps if run.state else 0
    rows = MetricsFile(path / "evaluations.csv", ("return",), upto=at)
    (path / "tensorboard").mkdir(exist_ok=True)
    (path / "tensorboard" / f"events.out.tfevents.{at}").write_text("log")

    def tidy() -> None:
        latest = list_checkpoints(run.checkpoints)[-1:]
        drop_checkpoints(run.checkpoints, latest)
        for folder in latest:
            write_whole(path / "policy.npz", (folder / "policy.npz").read_bytes())

    tidy()
    for steps in range(at + 100, config.timesteps + 1, 100):
        rows.append(steps, {"return": steps / 7})
        state = TrainState(steps, 1.0, config.digest)
        write_checkpoint(
            run.checkpoints, state, {"n": steps}, lambda to, n=steps: write_whole(to, str(n))
        )
        tidy()
    write_whole(path / "table.txt", "done")


def killed_at(count: int, after: bool, monkeypatch, work_to_do) -> bool:
    """True if the work was killed at that file operation."""
    with monkeypatch.context() as patched:
        Disk(patched, count, after)
        try:
            work_to_do()
        except Killed:
            return True
    return False


def assert_whole(path: Path, config: TrainConfig) -> None:
    assert read_config(path) == config
    (last,) = list_checkpoints(path / "checkpoints")
    assert read_model(last) == {"n": config.timesteps}
    expected = list(range(100, config.timesteps + 1, 100))
    assert read_columns(path / "evaluations.csv")["timesteps"] == expected
    assert (path / "policy.npz").read_text() == str(config.timesteps)
    assert not list(path.rglob("*.part"))
    assert (path / "versions.json").exists()


@pytest.fixture(autouse=True)
def _quickly(monkeypatch: pytest.MonkeyPatch):
    """Replace what takes time and is not tested here."""
    monkeypatch.setattr("stickslip.agents.training.directory.versions", lambda: {"python": "3"})
    monkeypatch.setattr(os, "fsync", lambda handle: None)


class TestEveryCrashPoint:
    """after: the operation that the kill meets is done, or it is not."""

    WAYS: ClassVar = pytest.mark.parametrize("after", [False, True])

    @WAYS
    def test_of_a_new_run(self, tmp_path: Path, monkeypatch, after: bool):
        count, neighbour = 1, tmp_path / "mine"
        neighbour.write_text("years of work")
        while True:
            path = tmp_path / f"run-{count}"
            if not killed_at(count, after, monkeypatch, lambda path=path: work(path, CONFIG)):
                break
            if (path / "config.json").exists():
                work(path, CONFIG, resume=True)
                assert_whole(path, CONFIG)
                work(path, OTHER, overwrite=True)
            else:
                work(path, OTHER)
            assert_whole(path, OTHER)
            count += 1
        assert count > 40
        assert neighbour.read_text() == "years of work"
        assert_whole(path, CONFIG)

    @WAYS
    def test_of_overwriting(self, tmp_path: Path, monkeypatch, after: bool):
        count = 1
        while True:
            path = tmp_path / f"run-{count}"
            work(path, CONFIG)
            again = lambda path=path: work(path, OTHER, overwrite=True)  # noqa: E731
            if not killed_at(count, after, monkeypatch, again):
                break
            if (path / "config.json").exists():
                work(path, read_config(path), resume=True)
                assert_whole(path, read_config(path))
                work(path, OTHER, overwrite=True)
            else:
                work(path, OTHER)
            assert_whole(path, OTHER)
            count += 1
        assert count > 40


@pytest.mark.parametrize(
    "place", ["notes.txt", "checkpoints/notes.txt", "checkpoints/000000000200/a.txt", "x.part"]
)
def test_a_users_file_anywhere_in_a_run_keeps_it_from_being_overwritten(tmp_path: Path, place: str):
    work(tmp_path / "run", CONFIG)
    (tmp_path / "run" / place).write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(ValueError, match=rf"also holds {place}, which no run wrote"):
        open_run(tmp_path / "run", OTHER, overwrite=True)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_linked_folder_is_not_emptied(tmp_path: Path):
    path, elsewhere = tmp_path / "run", tmp_path / "elsewhere"
    work(path, CONFIG)
    os.replace(path / "checkpoints", elsewhere)
    (path / "checkpoints").symlink_to(elsewhere)
    with pytest.raises(ValueError, match="also holds checkpoints"):
        open_run(path, OTHER, overwrite=True)
    assert list_checkpoints(elsewhere)


def test_a_directory_of_a_run_that_had_not_begun_is_as_good_as_empty(tmp_path: Path):
    (tmp_path / "versions.json").write_text("{}")
    (tmp_path / ".config.json-a1b2c3d4.part").write_text("{")
    work(tmp_path, CONFIG)
    assert_whole(tmp_path, CONFIG)
