"""Checkpoints: folders that appear whole or not at all, and that run no code when read.

A checkpoint `checkpoints/000262144/` holds `model.pt` (parameters and optimiser states, read with
`torch.load(weights_only=True)`, which builds tensors and plain containers only), for SAC what the
replay buffer holds, `policy.npz` and `state.json`. Random states are not kept: at every checkpoint
the generators and environments start anew from the seed and the number of steps (see train.py).
"""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.agents.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

FORMAT, VERSION = "stickslip checkpoint", 1
MODEL, STATE, POLICY = "model.pt", "state.json", "policy.npz"
PARTIAL = ".part"


@dataclass(frozen=True)
class TrainState:
    """Where a run is. config: digest of the configuration. seconds: trained so far [s]."""

    timesteps: int
    seconds: float
    config: str


def folder_name(timesteps: int) -> str:
    """The checkpoint's folder."""
    return f"{timesteps:012d}"


def write_checkpoint(
    directory: Path, state: TrainState, model: dict[str, Any], save: Callable[[Path], Any]
) -> Path:
    """Write a checkpoint under a temporary name, then rename it; return its folder.

    save: writes the policy to the path that it is given.
    """
    import torch

    final = directory / folder_name(state.timesteps)
    partial = directory / (final.name + PARTIAL)
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    with (partial / MODEL).open("wb") as file:
        torch.save(model, file)
        file.flush()
        os.fsync(file.fileno())
    save(partial / POLICY)
    head = {"format": FORMAT, "version": VERSION}
    write_whole(partial / STATE, json.dumps(head | asdict(state), indent=2) + "\n")
    if final.exists():
        shutil.rmtree(final)
    os.replace(partial, final)
    return final


def list_checkpoints(directory: Path) -> list[Path]:
    """The complete checkpoints, oldest first."""
    found = directory.iterdir() if directory.is_dir() else ()
    return sorted(path for path in found if path.is_dir() and path.name.isdigit())


def drop_checkpoints(directory: Path, keep: Iterable[Path]) -> None:
    """Delete all but those to keep, and what an interrupted run left half written."""
    kept = set(keep)
    for path in list_checkpoints(directory):
        if path not in kept:
            shutil.rmtree(path)
    for path in directory.glob("*" + PARTIAL):
        shutil.rmtree(path)


def read_state(folder: Path) -> TrainState:
    """What a checkpoint says of itself. ValueError if it is not a whole checkpoint."""
    try:
        content = json.loads((folder / STATE).read_text(encoding="utf-8"))
        if content.pop("format") != FORMAT or content.pop("version") != VERSION:
            raise ValueError("of another format or version")
        state = TrainState(**content)
        if type(state.timesteps) is not int or state.timesteps < 0:
            raise ValueError(f"timesteps = {state.timesteps!r}")
        return TrainState(state.timesteps, float(state.seconds), str(state.config))
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError(_refused(folder, f"{STATE} is missing or damaged ({error})")) from error


def read_model(folder: Path) -> dict[str, Any]:
    """The tensors of a checkpoint. ValueError if they are missing, cut short or anything else."""
    import torch

    try:
        content = torch.load(folder / MODEL, map_location="cpu", weights_only=True)
    except Exception as error:
        reason = str(error).partition("\n")[0]
        raise ValueError(_refused(folder, f"{MODEL} is missing or damaged ({reason})")) from error
    if not isinstance(content, dict):
        raise ValueError(_refused(folder, f"{MODEL} holds a {type(content).__name__}"))
    return content


def _refused(folder: Path, reason: str) -> str:
    return (
        f"{folder}: {reason}; accepted: a checkpoint as training wrote it. Delete this folder to "
        "resume from the checkpoint before it"
    )
