"""The directory of a training run: what stands where, who may write there, where it resumes."""

from __future__ import annotations

import json
import os
import platform
import re
import sys
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from stickslip.agents.registry import machines, read_configuration
from stickslip.agents.training.checkpoint import foreign_to, list_checkpoints, read_state
from stickslip.agents.untrusted import RefusedError, read_text, refusing
from stickslip.records.files import PARTIAL, discard, is_remains, put_aside, write_whole

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stickslip.agents.training.checkpoint import TrainState
    from stickslip.agents.training.configuration import Configuration

CONFIG, VERSIONS = "config.json", "versions.json"
FILM = re.compile(r"\.(?:walk|drive)-[^-]{1,16}\.gif")
"""How earlier versions named an animation that was being written."""
LOGS = "events.out.tfevents"
"""How TensorBoard's files begin."""
PACKAGES = (
    "stickslip",
    "jax",
    "jaxlib",
    "numpy",
    "gymnasium",
    "optax",
    "stable-baselines3",
    "torch",
    "matplotlib",
)
FOLDERS = ("checkpoints", "tensorboard")
PRODUCTS = (
    CONFIG,
    VERSIONS,
    "metrics.csv",
    "evaluations.csv",
    "policy.npz",
    "table.csv",
    "table.json",
    "table.txt",
    "learning.png",
    "comparison.png",
    "episode.png",
)
"""Files of every machine's run; each machine's film is among them, too."""


class Run(NamedTuple):
    """A run that may be written to. latest: the checkpoint to go on from, None at the beginning."""

    path: Path
    config: Configuration
    latest: Path | None
    state: TrainState | None

    @property
    def checkpoints(self) -> Path:
        """Their folder."""
        return self.path / "checkpoints"


def open_run(
    path: Path, config: Configuration | None, *, resume: bool = False, overwrite: bool = False
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
    if path.exists() and not _is_bare(path):
        if not overwrite:
            raise ValueError(
                f"{path} exists and is not empty; accepted: a new directory, --resume to go on "
                "with the run in it, or --overwrite to begin it anew"
            )
        _clear(path)
    path.mkdir(parents=True, exist_ok=True)
    _sweep(path)
    write_whole(path / CONFIG, config.to_json())  # from here on it is a run
    _write_versions(path)
    return Run(path, config, None, None)


def read_config(path: Path) -> Configuration:
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
def only_writer(path: Path, doing: str = "training") -> Iterator[None]:
    """Hold the run's lock, or raise ValueError while another process holds it. doing: in its words.

    It lies on the directory itself: no file is left behind, and the system lets go of it when the
    process ends, however it ends. Windows cannot lock directories; there nothing is checked. Makes
    the directory if there is none.
    """
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; accepted: a directory for the run")
    path.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":
        yield
        return
    from filelock import lock_descriptor

    handle = os.open(path, os.O_RDONLY)
    try:
        if not lock_descriptor(handle, blocking=False):
            raise ValueError(
                f"{path}: another process is {doing} there; accepted: another directory"
            )
        yield
    finally:
        os.close(handle)


def _resumed(path: Path, config: Configuration | None) -> Run:
    found = read_config(path)
    if config is not None and config != found:
        raise ValueError(
            f"{path} was begun with another configuration; accepted: to resume without changing "
            "it, or a new directory"
        )
    _sweep(path)
    if not (path / VERSIONS).exists():  # killed before it was written
        _write_versions(path)
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


def _write_versions(path: Path) -> None:
    write_whole(path / VERSIONS, json.dumps(versions(), indent=2) + "\n")


def _is_bare(path: Path) -> bool:
    """Whether a directory holds at most what a run leaves that was killed as it began."""
    return all(
        one.is_file() and not one.is_symlink() and (one.name == VERSIONS or _is_left(one.name))
        for one in path.iterdir()
    )


def _clear(path: Path) -> None:
    """Delete what a run wrote, and refuse a directory that holds anything else.

    The configuration goes last: until then it is a run, and can be cleared again.
    """
    read_config(path)  # raises for a directory that is no run
    if foreign := _foreign(path):
        names = ", ".join(sorted(str(one.relative_to(path)) for one in foreign)[:5])
        raise ValueError(
            f"{path} also holds {names}, which no run wrote; accepted: a directory with a run alone"
        )
    _sweep(path)
    for name in FOLDERS:
        if (path / name).exists():
            discard(put_aside(path / name))
    for name in sorted(written_files(), key=lambda name: name == CONFIG):
        (path / name).unlink(missing_ok=True)


def _sweep(path: Path) -> None:
    """Delete what a killed process left half written or half deleted."""
    for one in path.iterdir():
        if one.is_file() and not one.is_symlink() and _is_left(one.name):
            one.unlink()
    for name in FOLDERS:
        if (aside := path / (name + PARTIAL)).is_dir():
            discard(aside)


def written_files() -> tuple[str, ...]:
    """All that runs write beside their folders; `overwrite` deletes these and nothing else."""
    return (*PRODUCTS, *(machine.film for machine in machines()))


def _is_left(name: str) -> bool:
    return is_remains(name, written_files()) or FILM.fullmatch(name) is not None


def _foreign(path: Path) -> list[Path]:
    """What is in a run's directory that no run wrote; links always."""
    found: list[Path] = []
    for one in path.iterdir():
        name = one.name.removesuffix(PARTIAL)
        if one.is_symlink():
            found.append(one)
        elif name == "checkpoints":
            found += foreign_to(one)
        elif name == "tensorboard" and one.is_dir():
            found += [log for log in one.iterdir() if not log.name.startswith(LOGS)]
        elif not one.is_file() or (one.name not in written_files() and not _is_left(one.name)):
            found.append(one)
    return found
