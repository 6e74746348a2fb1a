"""A run's directory after a kill at every file operation: resumed or begun, nothing lost."""

import os
from pathlib import Path

import pytest

from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.training import directory
from stickslip.records import files
from stickslip.records.files import write_whole

CONFIG = TrainConfig.of(timesteps=200, num_envs=4, rollout_steps=32, batch_size=64)
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


def work(path: Path, resume: bool = False) -> None:
    """Do to the disk what training does, from where it is to the end."""
    config, run = CONFIG, directory.open_run(path, CONFIG, resume=resume)
    at = run.state.timesteps if run.state else 0
    rows = directory.MetricsFile(path / "evaluations.csv", ("return",), upto=at)

    def tidy() -> None:
        latest = directory.list_checkpoints(run.checkpoints)[-1:]
        directory.drop_checkpoints(run.checkpoints, latest)
        for folder in latest:
            write_whole(path / "policy.npz", (folder / "policy.npz").read_bytes())

    tidy()
    for steps in range(at + 100, config.timesteps + 1, 100):
        rows.append(steps, {"return": steps / 7})
        state = directory.TrainState(steps, 1.0, config.digest)
        directory.write_checkpoint(
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


def assert_whole(path: Path) -> None:
    config = directory.read_config(path)
    assert config == CONFIG
    (last,) = directory.list_checkpoints(path / "checkpoints")
    assert directory.read_model(last) == {"n": config.timesteps}
    expected = list(range(100, config.timesteps + 1, 100))
    assert directory.read_columns(path / "evaluations.csv")["timesteps"] == expected
    assert (path / "policy.npz").read_text() == str(config.timesteps)
    assert not list(path.rglob("*.part"))


@pytest.fixture(autouse=True)
def _quickly(monkeypatch: pytest.MonkeyPatch):
    """Replace what takes time and is not tested here."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)


@pytest.mark.parametrize("after", [False, True])
def test_a_run_is_resumed_or_begun_from_every_crash_point(tmp_path: Path, monkeypatch, after: bool):
    """after: the operation that the kill meets is done, or it is not."""
    count, neighbour = 1, tmp_path / "mine"
    neighbour.write_text("years of work")
    while True:
        path = tmp_path / f"run-{count}"
        if not killed_at(count, after, monkeypatch, lambda path=path: work(path)):
            break
        work(path, resume=(path / "config.json").exists())
        assert_whole(path)
        count += 1
    assert count > 40
    assert neighbour.read_text() == "years of work"
    assert_whole(path)


def test_a_directory_of_a_run_that_had_not_begun_is_as_good_as_empty(tmp_path: Path):
    (tmp_path / ".config.json-a1b2c3d4.part").write_text("{")
    work(tmp_path)
    assert_whole(tmp_path)
