"""Keeping what value iteration has found so far, so that a run that was stopped goes on."""

from __future__ import annotations

import hashlib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.training.checkpoint import pack, unpack
from stickslip.agents.untrusted import LARGEST, RefusedError, Rule, read_bytes
from stickslip.dynamics.checks import shown
from stickslip.optim.dynamic_programming.sweeps import Values
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.optim.dynamic_programming.sweeps import Report

FORMAT, VERSION = "stickslip values", 1
SWEEPS = Rule(int, "done", low=0)


def digest_of(*parts: object) -> str:
    """Of static things by their repr and of pytrees by structure and numbers, to the last bit."""
    found = hashlib.sha256()
    for part in parts:
        leaves, structure = jax.tree.flatten(part)
        found.update(repr(structure).encode())
        for leaf in leaves:
            if isinstance(leaf, jax.Array | np.ndarray | np.generic | float | int):
                array = np.asarray(leaf)
                found.update(f"{array.dtype} {array.shape}".encode())
                found.update(array.tobytes())
            else:
                found.update(repr(leaf).encode())
    return found.hexdigest()


def keeper(path: Path, definition: str) -> Report:
    """Callback that writes the values to a file atomically."""
    return partial(_write, path, definition)


def kept_values(path: Path, definition: str, nodes: int) -> Values | None:
    """Values of the file; None where there is none.

    ValueError, naming the file, for one that is damaged or of another definition.
    """
    if not path.exists():
        return None
    try:
        content = unpack(read_bytes(path, max(LARGEST, 16 * nodes)), max(LARGEST, 16 * nodes))
        return _values(content, definition, nodes)
    except ValueError as error:
        raise ValueError(
            f"{path}: {error}; accepted: what an earlier run of the same task, grid and actions "
            "wrote there, or a new path"
        ) from error


def _write(path: Path, definition: str, now: Values) -> None:
    content = {
        "format": FORMAT,
        "version": VERSION,
        "definition": definition,
        "sweeps": now.sweeps,
        "value": np.asarray(now.value),
        "bounds": np.asarray([now.low, now.high], np.float64),
    }
    write_whole(path, pack(content))


def _values(content: Mapping[str, object], definition: str, nodes: int) -> Values:
    if content.get("format") != FORMAT or content.get("version") != VERSION:
        raise RefusedError("it does not say that it holds values of dynamic programming")
    if content.get("definition") != definition:
        raise RefusedError("it is of another task, grid or set of actions")
    value = _array("value", content.get("value"), (nodes,))
    low, high = _array("bounds", content.get("bounds"), (2,)).tolist()
    if not np.all(np.isfinite(value)) or np.isnan(low) or np.isnan(high):
        raise RefusedError("its values hold what is no number")
    return Values(jnp.asarray(value), SWEEPS.require("sweeps", content.get("sweeps")), low, high)


def _array(name: str, given: object, shape: tuple[int, ...]) -> np.ndarray:
    if not isinstance(given, np.ndarray) or given.shape != shape or given.dtype.kind != "f":
        raise RefusedError(f"its {name} is {shown(given)}, no array of {shape}")
    return given
