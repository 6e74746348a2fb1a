"""Files of dynamic programming: value policies, and values to resume from. Data, never code."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.machine import machine_of_environment
from stickslip.agents.optimum.grid import Axis, Grid
from stickslip.agents.optimum.policy import Ahead, ValuePolicy
from stickslip.agents.optimum.value_iteration import Values
from stickslip.agents.policy.file import describe_environment
from stickslip.agents.untrusted import (
    RefusedError,
    Rule,
    pack,
    read_bytes,
    refusing,
    require_entries,
    require_format,
    unpack,
)
from stickslip.dynamics.checks import require_number, shown
from stickslip.dynamics.numeric import with_all_digits
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from stickslip.agents.protocol import Params, State, Timed
    from stickslip.agents.untrusted import Json

FORMAT, VERSION = "stickslip value policy", 1
LARGEST = 512 * 2**20
"""Bytes of a file."""
ACCEPTED = "accepted: a .npz written by stickslip.agents.optimum.save_value_policy"
RULES = {
    "depth": Rule(int, "steps ahead", low=1, high=1000),
    "beam": Rule(int, "paths kept", low=1, high=10**5),
    "outside": Rule(float, "value of leaving the grid"),
}


def save_value_policy(
    policy: ValuePolicy[State, Params], params: Params, path: str | Path, *, overwrite: bool = False
) -> Path:
    """Write a policy with the task it was made for atomically, and return the path.

    ValueError if the path exists and is not to be replaced, for an environment of no machine, and
    for a grid that wraps along other axes than the usual one of the task.
    """
    policy.validate()
    usual, axes = _axes(policy.states.grid(params)), _axes(policy.grid)
    if any(axis.periodic != usual[name].periodic for name, axis in axes.items()):
        raise ValueError("other axes are periodic; accepted: those of the usual grid of the task")
    numbers = int(policy.ahead.depth), policy.ahead.beam, float(policy.outside)
    content = {"format": FORMAT, "version": VERSION, **dict(zip(RULES, numbers, strict=True))}
    content |= describe_environment(policy.env, params)
    content |= {"values": np.asarray(policy.values), "actions": np.asarray(policy.actions)}
    content |= {name: np.asarray(axis.nodes, np.float64) for name, axis in axes.items()}
    return write_whole(path, pack(content), overwrite=overwrite)


def load_value_policy(path: str | Path) -> tuple[ValuePolicy[object, Timed], Timed]:
    """The policy in a file, and the parameters of the task that it was made for.

    ValueError naming the file, what is wrong with it and what is accepted, if it is missing, cut
    short, of another kind or has contents that do not fit. The file is data: nothing in it is run.
    """
    return read_value_policy(path)[:2]


def read_value_policy(
    path: str | Path,
) -> tuple[ValuePolicy[object, Timed], Timed, dict[str, Json]]:
    """The same, and what the file says of itself."""
    try:
        with refusing("its contents"):
            content, arrays = _contents(path)
            return *_policy(arrays, content), content
    except ValueError as error:
        raise ValueError(f"{path}: {error}; {ACCEPTED}") from error


def read_value_metadata(path: str | Path) -> dict[str, Json] | None:
    """Metadata of a value policy's file; None for any other file."""
    try:
        with refusing("its contents"):
            return _contents(path)[0]
    except ValueError:
        return None


def _contents(path: str | Path) -> tuple[dict[str, Json], dict[str, np.ndarray]]:
    """JSON values of a file, and its arrays."""
    whole = unpack(read_bytes(path, LARGEST), LARGEST)
    arrays = {name: one for name, one in whole.items() if isinstance(one, np.ndarray)}
    content = {name: one for name, one in whole.items() if name not in arrays}
    return require_format(content, FORMAT, VERSION, "a value policy"), arrays


def _policy(
    arrays: dict[str, np.ndarray], content: dict[str, Json]
) -> tuple[ValuePolicy[object, Timed], Timed]:
    machine = machine_of_environment(content.get("environment"))
    task = None if machine is None else machine.read_task(content)
    if machine is None or task is None:
        raise RefusedError("it does not say for which task it is")
    numbers = require_entries({name: content.get(name) for name in RULES}, RULES)
    env, params = without_resets(task.env), task.params
    states = machine.state_map(env, params)
    usual = states.grid(params)
    if set(arrays) != (names := {"values", "actions", *_axes(usual)}):
        raise RefusedError(f"its entries are {shown(sorted(arrays))}, not {shown(sorted(names))}")
    for name, values in arrays.items():
        if values.dtype not in (np.float32, np.float64):
            raise RefusedError(f"{name} is {values.dtype}, not float32 or float64")
        require_number(name, values, dtype=np.float32, accepted="finite in float32")
    values, actions = (with_all_digits(arrays.pop(name)) for name in ("values", "actions"))
    ahead = Ahead(numbers["depth"], numbers["beam"])
    grid = _with_nodes(usual, arrays)
    policy = ValuePolicy(values, actions, numbers["outside"], grid, env, states, ahead)
    return policy.validate(), params


def _axes(grid: Grid) -> dict[str, Axis]:
    """The grid's axes by the names of their nodes in a file."""
    return {
        f"nodes_{index}_{at}": axis
        for index, sheet in enumerate(grid.sheets)
        for at, axis in enumerate(sheet.axes)
    }


def _with_nodes(grid: Grid, arrays: dict[str, np.ndarray]) -> Grid:
    """The grid with other nodes along its axes."""
    named = iter(_axes(grid))
    sheets = []
    for sheet in grid.sheets:
        axes = tuple(replace(axis, nodes=arrays[next(named)]) for axis in sheet.axes)
        sheets.append(replace(sheet, axes=axes))
    return Grid(tuple(sheets))


@dataclass(frozen=True)
class Checkpoint:
    """A file of the values after some sweeps. definition: digest of task, grid and actions."""

    path: Path
    definition: str
    nodes: int

    def write(self, now: Values) -> None:
        """Write the values atomically."""
        content = {"definition": self.definition, "sweeps": now.sweeps}
        write_whole(self.path, pack({**content, "value": np.asarray(now.value)}))

    def read(self) -> Values | None:
        """The values in the file; None where there is none.

        ValueError, naming the file, for one that is damaged or of another definition.
        """
        if not self.path.exists():
            return None
        try:
            with refusing("it"):
                content = unpack(read_bytes(self.path, LARGEST), LARGEST)
                if content.get("definition") != self.definition:
                    raise RefusedError("it is of another task, grid or set of actions")
                value, sweeps = content["value"], int(content["sweeps"])
                if value.shape != (self.nodes,) or sweeps < 0 or not np.all(np.isfinite(value)):
                    raise RefusedError("its values are no finite numbers, one for each node")
                return Values(jnp.asarray(value), sweeps)
        except ValueError as error:
            raise ValueError(
                f"{self.path}: {error}; accepted: what an earlier run of the same task, grid and "
                "actions wrote there, or a new path"
            ) from error


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
