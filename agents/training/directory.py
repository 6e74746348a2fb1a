"""The directory of a training run: configuration, lock, checkpoints, tables.

A checkpoint `checkpoints/000262144/` holds `model.npz` (parameters, optimiser states,
for JAX the episodes, as arrays), `policy.npz` and `state.json`. It appears whole or
not at all, and reading it runs no code. `config.json` is written first: once it is there, the
directory is a run, which can be resumed.
"""

import csv
import io
import json
import math
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from stickslip.agents import untrusted
from stickslip.agents.machine import read_configuration
from stickslip.agents.policy.file import read_policy
from stickslip.agents.training.configuration import Configuration, digest_of
from stickslip.agents.training.trainer import ModelState
from stickslip.dynamics.checks import memory_limit, reraise, shown
from stickslip.records import files
from stickslip.records.table import cell_text, csv_line

CONFIG = "config.json"
FORMAT, VERSION = "stickslip checkpoint", 3
MODEL, STATE, POLICY = "model.npz", "state.json", "policy.npz"
CHECKPOINT = (
    "a checkpoint as training wrote it. Delete its folder to resume from the checkpoint before it"
)
RULES = {
    "timesteps": untrusted.Rule(int, "so far", low=0),
    "seconds": untrusted.Rule(float, "trained so far", low=0),
    "config": untrusted.Rule(str, "digest of the configuration"),
}
"""Rules of a TrainState's entries."""


@dataclass(frozen=True)
class TrainState:
    """State of a run. config: digest of the configuration. seconds: trained so far [s]."""

    timesteps: int
    seconds: float
    config: str


class Run(NamedTuple):
    """A run that may be written to. latest: the checkpoint to go on from, None at the beginning;
    state: what it holds."""

    path: Path
    config: Configuration
    latest: Path | None
    state: TrainState

    @property
    def checkpoints(self) -> Path:
        """Their folder."""
        return self.path / "checkpoints"


def open_run(path: Path, config: Configuration | None, *, resume: bool = False) -> Run:
    """Make the directory, or resume the run in it.

    ValueError if it holds something and `resume` is not asked for, if there is nothing to resume,
    or if its configuration is another one. config: may be None to resume.
    """
    if resume:
        return _resumed(path, config)
    if config is None:
        raise ValueError("config is missing; accepted: a TrainConfig, or resume=True")
    if path.exists() and not all(_is_left(one) for one in path.iterdir()):
        accepted = "a new directory, or --resume to go on with the run in it"
        raise ValueError(f"{path} exists and is not empty; accepted: {accepted}")
    path.mkdir(parents=True, exist_ok=True)
    _sweep(path)
    files.write_whole(path / CONFIG, config.to_json())  # from here on it is a run
    return Run(path, config, None, TrainState(0, 0.0, config.digest))


def read_config(path: Path) -> Configuration:
    """The configuration of the run in a directory. ValueError if there is none."""
    accepted = "the directory of a run that was begun"
    with reraise(f"{path} holds no training run ({CONFIG}: ", f"); accepted: {accepted}"):
        text = untrusted.read_text(path / CONFIG)
    with untrusted.reading(path / CONFIG, "as training wrote it"):
        return read_configuration(text)


@contextmanager
def only_writer(path: Path, doing: str = "training") -> Iterator[None]:
    """Lock the directory, which is made if needed. ValueError while another process holds the lock.

    The lock lies on the directory itself, and ends with the process. Windows cannot lock
    directories; there nothing is checked. doing: for the message.
    """
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path} is a file; accepted: a directory for the run")
    files.require_makeable(path)
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
    found, digest = read_config(path), digest_of(untrusted.read_text(path / CONFIG))
    if config is not None and config != found:
        given = f"{path} was begun with another configuration"
        raise ValueError(f"{given}; accepted: to resume without changing it, or a new directory")
    _sweep(path)
    checkpoints = list_checkpoints(path / "checkpoints")
    if not checkpoints:
        return Run(path, found, None, TrainState(0, 0.0, digest))
    state = read_state(checkpoints[-1])
    if state.config != digest:
        given = f"{checkpoints[-1]} belongs to another configuration than {path / CONFIG}"
        raise ValueError(f"{given}; accepted: the configuration that it was made with")
    return Run(path, found, checkpoints[-1], state)


def _is_left(path: Path) -> bool:
    """True for a file that a killed process left half written."""
    return path.is_file() and not path.is_symlink() and files.is_remains(path.name)


def _sweep(path: Path) -> None:
    """Delete what a killed process left half written."""
    for one in filter(_is_left, path.iterdir()):
        one.unlink()


def write_checkpoint(
    directory: Path, state: TrainState, model: ModelState, save: Callable[[Path], object]
) -> Path:
    """Write a checkpoint under a temporary name, then rename it; return its folder.

    save: writes the policy to the path that it is given.
    """
    final = directory / f"{state.timesteps:012d}"
    partial = directory / (final.name + files.PARTIAL)
    if partial.exists():
        shutil.rmtree(partial)
    partial.mkdir(parents=True)
    files.write_whole(partial / MODEL, untrusted.pack(model))
    save(partial / POLICY)
    head = {"format": FORMAT, "version": VERSION}
    files.write_whole(partial / STATE, json.dumps(head | asdict(state), indent=2) + "\n")
    os.replace(partial, final)
    return final


def list_checkpoints(directory: Path) -> list[Path]:
    """The complete checkpoints, oldest first."""
    found = directory.iterdir() if directory.is_dir() else ()
    return sorted(path for path in found if path.is_dir() and path.name.isdigit())


def drop_checkpoints(directory: Path, keep: Iterable[Path]) -> None:
    """Delete all but those to keep, and what an interrupted run left half written."""
    for path in directory.glob("[0-9]*" + files.PARTIAL):
        shutil.rmtree(path)
    for path in set(list_checkpoints(directory)).difference(keep):
        shutil.rmtree(path.replace(path.with_name(path.name + files.PARTIAL)))  # gone at once


def read_state(folder: Path) -> TrainState:
    """Metadata of a checkpoint. ValueError if it is not a whole checkpoint."""
    with untrusted.reading(folder / STATE, CHECKPOINT):
        content = untrusted.parse_json(untrusted.read_text(folder / STATE), "it")
        content = untrusted.require_head(content, FORMAT, VERSION, "the state of a checkpoint")
        return TrainState(**untrusted.require_entries(content, RULES))


def read_model(folder: Path) -> ModelState:
    """The arrays of a checkpoint. ValueError if they are missing, cut short or anything else."""
    with untrusted.reading(folder / MODEL, CHECKPOINT):
        largest = int(min(memory_limit(), 2**62))
        return untrusted.unpack(untrusted.read_bytes(folder / MODEL, largest), largest)


def require_policy(folder: Path) -> bytes:
    """The policy's file of a checkpoint. ValueError if it is missing or damaged."""
    with untrusted.reading(folder / POLICY, CHECKPOINT):
        read_policy(folder / POLICY)
        return (folder / POLICY).read_bytes()


class MetricsFile:
    """Rows in order of their `timesteps`, each on the disk once `append` returns.

    Rows past `upto` are dropped when it is opened, as is a last line that was cut short. Numbers
    that are not finite are left empty. ValueError for a file of other columns or of no numbers.
    """

    def __init__(self, path: Path, columns: tuple[str, ...], upto: int = 0):
        self.path, self.columns = path, ("timesteps", *columns)
        found = read_columns(path)
        if found and tuple(found) != self.columns:
            given = f"{path}: its columns are {shown(list(found))}"
            raise ValueError(f"{given}; accepted: those of this run, {', '.join(self.columns)}")
        rows = (row for row in zip(*found.values(), strict=True) if row[0] <= upto)
        files.write_whole(path, csv_line(self.columns) + "".join(map(_line, rows)))

    def append(self, timesteps: int, values: Mapping[str, float]) -> None:
        """Add a row; columns without a value stay empty."""
        row = [timesteps, *(values.get(name, math.nan) for name in self.columns[1:])]
        with self.path.open("a", encoding="utf-8", newline="") as file:
            file.write(_line(row))


def _line(row: Sequence[float]) -> str:
    cells = (cell_text(float(one), 7) if math.isfinite(one) else "" for one in row[1:])
    return csv_line([int(row[0]), *cells])


def read_columns(path: Path) -> dict[str, list[float]]:
    """The columns of a CSV file as numbers, NaN where empty; none if there is no file.

    Lines of another length than the head's are left out, and a last one without its end, which was
    being written. ValueError, naming the file, for cells that are no numbers.
    """
    if not path.exists():
        return {}
    with untrusted.reading(path, "a table as training wrote it", "the table"):
        text = untrusted.read_text(path, untrusted.LARGEST_TABLE)
        head, *rows = list(csv.reader(io.StringIO(text[: text.rfind("\n") + 1]))) or [[]]
        table = [[float(cell or "nan") for cell in row] for row in rows if len(row) == len(head)]
        if not all(row[0] == int(row[0]) for row in table):
            raise untrusted.RefusedError(f"its {head[0]} are no whole numbers")
        return {name: [row[i] for row in table] for i, name in enumerate(head)}
