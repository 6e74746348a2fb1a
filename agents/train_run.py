"""The directory of a training run: what stands where, who may write there, where it resumes."""

from __future__ import annotations

import json
import os
import platform
import shutil
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.agents.checkpoint import list_checkpoints, read_state
from stickslip.agents.files import write_whole
from stickslip.agents.foreign import RefusedError, read_text, refusing
from stickslip.agents.machines import read_configuration

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stickslip.agents.checkpoint import TrainState

CONFIG = "config.json"
PACKAGES = (
    "stickslip",
    "jax",
    "jaxlib",
    "numpy",
    "gymnasium",
    "stable-baselines3",
    "torch",
    "matplotlib",
)
FOLDERS = ("checkpoints", "tensorboard")
FILES = (
    CONFIG,
    "versions.json",
    "metrics.csv",
    "evaluations.csv",
    "policy.npz",
    "table.csv",
    "table.json",
    "table.txt",
    "learning.png",
    "comparison.png",
    "episode.png",
    "walk.gif",
    "drive.gif",
)
"""All that a run writes; `overwrite` deletes these and nothing else."""


class Run(NamedTuple):
    """A run that may be written to. latest: the checkpoint to go on from, None at the beginning."""

    path: Path
    config: Any
    latest: Path | None
    state: TrainState | None

    @property
    def checkpoints(self) -> Path:
        """Their folder."""
        return self.path / "checkpoints"


def open_run(
    path: Path, config: Any | None, *, resume: bool = False, overwrite: bool = False
) -> Run:
    """Make the directory, or take up the one that is there.

    ValueError if it holds something and neither `resume` nor `overwrite` is asked for, if there is
    nothing to resume, or if its configuration is another one. config: may be None to resume.
    """
    if resume and overwrite:
        raise ValueError("resume and overwrite exclude each other; accepted: one of them")
    if resume:
        return _resumed(path, config)
    if config is None:
        raise ValueError("config is missing; accepted: a TrainConfig, or resume=True")
    if path.exists() and any(path.iterdir()):
        if not overwrite:
            raise ValueError(
                f"{path} exists and is not empty; accepted: a new directory, --resume to go on "
                "with the run in it, or --overwrite to begin it anew"
            )
        _clear(path)
    path.mkdir(parents=True, exist_ok=True)
    write_whole(path / "versions.json", json.dumps(versions(), indent=2) + "\n")
    write_whole(path / CONFIG, config.to_json())
    return Run(path, config, None, None)


def read_config(path: Path) -> Any:
    """The configuration of the run in a directory. ValueError if there is none."""
    try:
        text = read_text(path / CONFIG)
    except RefusedError as error:
        raise ValueError(
            f"{path} holds no training run ({CONFIG}: {error}); accepted: the directory of a run "
            "that was begun"
        ) from error
    try:
        with refusing("it"):
            return read_configuration(text)
    except ValueError as error:
        raise ValueError(f"{path / CONFIG}: {error}; accepted: as training wrote it") from error


def versions() -> dict[str, str]:
    """What the run is computed with."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


@contextmanager
def only_writer(path: Path) -> Iterator[None]:
    """Hold the run's lock, or raise ValueError while another process holds it.

    The system lets go of it when the process ends, however it ends. Without such locks (Windows)
    nothing is checked. Makes the directory if there is none.
    """
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; accepted: a directory for the run")
    path.mkdir(parents=True, exist_ok=True)
    try:
        import fcntl
    except ModuleNotFoundError:
        yield
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(
                f"{path}: another process is training there; accepted: another directory"
            ) from None
        yield
    finally:
        os.close(handle)


def _resumed(path: Path, config: Any | None) -> Run:
    found = read_config(path)
    if config is not None and config != found:
        raise ValueError(
            f"{path} was begun with another configuration; accepted: to resume without changing "
            "it, or a new directory"
        )
    checkpoints = list_checkpoints(path / "checkpoints")
    if not checkpoints:
        return Run(path, found, None, None)
    state = read_state(checkpoints[-1])
    if state.config != found.digest:
        raise ValueError(
            f"{checkpoints[-1]} belongs to another configuration than {path / CONFIG}; accepted: "
            "the configuration that it was made with"
        )
    return Run(path, found, checkpoints[-1], state)


def _clear(path: Path) -> None:
    """Delete what a run wrote, and refuse a directory that holds anything else."""
    read_config(path)  # raises for a directory that is no run
    foreign = {one.name for one in path.iterdir()} - {*FILES, *FOLDERS}
    foreign = {name for name in foreign if not name.endswith(".part")}
    if foreign:
        raise ValueError(
            f"{path} also holds {', '.join(sorted(foreign)[:5])}, which no run wrote; accepted: a "
            "directory with a run alone"
        )
    for name in (*FOLDERS, *FILES):
        target = path / name
        shutil.rmtree(target) if target.is_dir() else target.unlink(missing_ok=True)
