"""Checkpoints: folders that appear whole or not at all, and that run no code when read.

A checkpoint `checkpoints/000262144/` holds `model.npz` (parameters and optimiser states, for SAC
what the replay buffer holds, for PPO in JAX the episodes, as arrays), `policy.npz` and
`state.json`. Other random states are not kept: at every checkpoint such generators and environments
start anew from the seed and the number of steps (see run.py).
"""

from __future__ import annotations

import io
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.agents.policy.file import read_policy
from stickslip.agents.untrusted import (
    RefusedError,
    Rule,
    arrays_in,
    parse_json,
    read_bytes,
    read_text,
    refusing,
    require_entries,
    require_head,
)
from stickslip.dynamics.checks import memory_limit, shown
from stickslip.records.files import PARTIAL, discard, is_remains, put_aside, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from stickslip.agents.untrusted import Json


FORMAT, VERSION = "stickslip checkpoint", 2
MODEL, STATE, POLICY = "model.npz", "state.json", "policy.npz"
CONTENTS = (MODEL, STATE, POLICY, "model.pt")
"""All that a checkpoint holds, the last one of version 1."""
RULES = {
    "timesteps": Rule(int, "so far", low=0),
    "seconds": Rule(float, "trained so far", low=0),
    "config": Rule(str, "digest of the configuration"),
}
"""Of a TrainState's entries."""


@dataclass(frozen=True)
class TrainState:
    """State of a run. config: digest of the configuration. seconds: trained so far [s]."""

    timesteps: int
    seconds: float
    config: str


def folder_name(timesteps: int) -> str:
    """The checkpoint's folder."""
    return f"{timesteps:012d}"


def write_checkpoint(
    directory: Path, state: TrainState, model: ModelState, save: Callable[[Path], object]
) -> Path:
    """Write a checkpoint under a temporary name, then rename it; return its folder.

    save: writes the policy to the path that it is given.
    """
    final = directory / folder_name(state.timesteps)
    partial = directory / (final.name + PARTIAL)
    if partial.exists():
        discard(partial)
    partial.mkdir(parents=True)
    write_whole(partial / MODEL, pack(model))
    save(partial / POLICY)
    head = {"format": FORMAT, "version": VERSION}
    write_whole(partial / STATE, json.dumps(head | asdict(state), indent=2) + "\n")
    if final.exists():
        before = final.with_name(final.name + ".old" + PARTIAL)
        os.replace(final, before)
        os.replace(partial, final)
        discard(before)
    else:
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
            discard(put_aside(path))
    for path in directory.glob("*" + PARTIAL):
        if _is_checkpoints(path.name):
            discard(path)


def foreign_to(directory: Path) -> list[Path]:
    """Files in a folder of checkpoints, or in one of them, that no run wrote; links always."""
    if directory.is_symlink() or not directory.is_dir():
        return [directory]
    foreign = []
    for path in directory.iterdir():
        if path.is_symlink() or not path.is_dir() or not _is_checkpoints(path.name):
            foreign.append(path)
            continue
        inside = (one for one in path.iterdir() if one.name not in CONTENTS or not one.is_file())
        foreign += [one for one in inside if not is_remains(one.name, CONTENTS)]
    return foreign


def _is_checkpoints(name: str) -> bool:
    stem = name.removesuffix(PARTIAL).removesuffix(".old")
    return stem.isascii() and stem.isdigit()


def read_state(folder: Path) -> TrainState:
    """Metadata of a checkpoint. ValueError if it is not a whole checkpoint."""
    try:
        with refusing("it"):
            content = parse_json(read_text(folder / STATE), "it")
            content = require_head(content, FORMAT, VERSION, "the state of a checkpoint")
            return TrainState(**require_entries(content, RULES))
    except RefusedError as error:
        raise ValueError(_refused(folder, STATE, error)) from error


def read_model(folder: Path) -> ModelState:
    """The tensors of a checkpoint. ValueError if they are missing, cut short or anything else."""
    try:
        largest = int(min(memory_limit(), 2**62))
        return unpack(read_bytes(folder / MODEL, largest), largest)
    except RefusedError as error:
        raise ValueError(_refused(folder, MODEL, error)) from error


def require_policy(folder: Path) -> bytes:
    """The policy's file of a checkpoint, as it is. ValueError if it is missing or damaged."""
    try:
        read_policy(folder / POLICY)
        return (folder / POLICY).read_bytes()
    except (ValueError, OSError) as error:
        raise ValueError(_refused(folder, POLICY, error)) from error


def _refused(folder: Path, name: str, reason: Exception) -> str:
    return (
        f"{folder}: {name} is missing or damaged ({reason}); accepted: a checkpoint as training "
        "wrote it. Delete this folder to resume from the checkpoint before it"
    )


Container: TypeAlias = "dict[str, Plain] | dict[int, Plain] | list[Plain] | tuple[Plain, ...]"
Plain: TypeAlias = "Container | np.ndarray | str | float | bool | None"
"""Arrays in plain containers."""
ModelState: TypeAlias = "dict[str, Plain]"
"""All that learning goes on from."""
STRUCTURE = "structure"


def pack(content: ModelState) -> bytes:
    """The file's bytes. ValueError for what it cannot keep."""
    found: list[np.ndarray] = []
    text = json.dumps(_plain(content, found), allow_nan=False)
    arrays = {f"tensor_{index}": array for index, array in enumerate(found)}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays, **{STRUCTURE: np.array(text)})
    return file.getvalue()


def unpack(raw: bytes, largest: int) -> ModelState:
    """Inverse of `pack`. ValueError, without a path, for anything else.

    largest: bytes that the file and its contents may have.
    """
    with refusing("it"):
        arrays = arrays_in(raw, largest)
        text = arrays.pop(STRUCTURE, None)
        if text is None or text.shape != () or text.dtype.kind != "U":
            raise RefusedError(f"no {STRUCTURE} among its entries")
        content = _whole(parse_json(str(text), f"its {STRUCTURE}"), arrays)
        if arrays or not isinstance(content, dict):
            raise RefusedError(f"its {STRUCTURE} does not fit its {len(arrays)} other entries")
        return content


def _plain(value: Plain, arrays: list[np.ndarray]) -> Json:
    """JSON values: what holds others, and arrays, as a list that begins with its kind."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return ["tensor", len(arrays) - 1, list(value.shape)]
    if isinstance(value, dict):
        pairs: Json = [[_plain(key, arrays), _plain(one, arrays)] for key, one in value.items()]
        return ["dict", pairs]
    if isinstance(value, list | tuple):
        kind = "list" if isinstance(value, list) else "tuple"
        return [kind, [_plain(one, arrays) for one in value]]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ValueError(f"{shown(value)} cannot be kept; accepted: arrays, numbers and texts")


def _whole(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    """The inverse; takes every array out of `arrays` once."""
    if not isinstance(value, list):
        if isinstance(value, dict):
            raise RefusedError(f"its {STRUCTURE} holds an object")
        return value
    kind, content, *shape = value
    if kind == "tensor":
        return np.array(arrays.pop(f"tensor_{int(content)}").reshape(shape[0]))
    if kind == "dict":
        return {_whole(key, arrays): _whole(one, arrays) for key, one in content}
    if kind not in ("list", "tuple"):
        raise RefusedError(f"its {STRUCTURE} holds {shown(kind)}")
    parts = [_whole(one, arrays) for one in content]
    return parts if kind == "list" else tuple(parts)
