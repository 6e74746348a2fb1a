"""Files of value policies: one .npz of arrays and one JSON text. Loading runs no code from it."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.optimum.grid import Axis, Grid, Sheet
from stickslip.agents.optimum.policy import Ahead, ValuePolicy
from stickslip.agents.policy.file import describe_environment
from stickslip.agents.registry import machine_of_environment
from stickslip.agents.untrusted import (
    RefusedError,
    Rule,
    arrays_in,
    metadata_text,
    parse_json,
    read_bytes,
    refusing,
    require_entries,
    require_format,
)
from stickslip.dynamics.checks import require_number, shown
from stickslip.dynamics.numeric import with_all_digits
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from stickslip.agents.protocol import Params, State, Timed
    from stickslip.agents.untrusted import Json

FORMAT, VERSION = "stickslip value policy", 1
LARGEST = 512 * 2**20
"""Bytes of a file."""
ACCEPTED = "accepted: a .npz written by stickslip.agents.optimum.save_value_policy"
RULES = {
    "depth": Rule(int, "steps ahead", low=1, high=1000),
    "beam": Rule(int, "ways kept", low=1, high=10**5),
    "outside": Rule(float, "what leaving the grid is worth"),
}


def save_value_policy(
    policy: ValuePolicy[State, Params],
    params: Params,
    path: str | Path,
    metadata: Mapping[str, Json] | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a policy with the task it was made for, and return the path.

    metadata: JSON values under names of the caller's choice beside what the file says of itself.
    The file appears whole or not at all. ValueError if the path exists and is not to be replaced,
    and for an environment of no machine.
    """
    policy.validate()
    usual = _axes(policy.states.grid(params))
    wraps = {name: axis.periodic for name, axis in _axes(policy.grid).items()}
    if wraps != {name: axis.periodic for name, axis in usual.items()}:
        raise ValueError(
            f"axes are periodic as {wraps}; accepted: as in the usual grid of the task"
        )
    numbers = int(policy.ahead.depth), policy.ahead.beam, float(policy.outside)
    own = {"format": FORMAT, "version": VERSION, **dict(zip(RULES, numbers, strict=True))}
    own |= describe_environment(policy.env, params)
    text = metadata_text(own, metadata)
    arrays = {"values": np.asarray(policy.values), "actions": np.asarray(policy.actions)}
    for name, axis in _axes(policy.grid).items():
        arrays[name] = np.asarray(axis.nodes, np.float64)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays, metadata=np.array(text))
    return write_whole(path, file.getvalue(), overwrite=overwrite)


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
            arrays, content = _contents(path)
            return *_policy(arrays, content), content
    except ValueError as error:
        raise ValueError(f"{path}: {error}; {ACCEPTED}") from error


def read_value_metadata(path: str | Path) -> dict[str, Json] | None:
    """Metadata of a value policy's file; None for any other file."""
    try:
        with refusing("its contents"):
            return _contents(path)[1]
    except ValueError:
        return None


def _contents(path: str | Path) -> tuple[dict[str, np.ndarray], dict[str, Json]]:
    arrays = arrays_in(read_bytes(path, LARGEST), LARGEST)
    text = arrays.pop("metadata", None)
    if text is None or text.shape != () or text.dtype.kind != "U":
        raise RefusedError("no metadata among its entries")
    content = parse_json(str(text), "its metadata")
    return arrays, require_format(content, FORMAT, VERSION, "a value policy")


def _policy(
    arrays: dict[str, np.ndarray], content: Mapping[str, Json]
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


def _with_nodes(grid: Grid, arrays: Mapping[str, np.ndarray]) -> Grid:
    """The grid with other nodes along its axes."""
    named = iter(_axes(grid))

    def other(axis: Axis) -> Axis:
        nodes = arrays[next(named)]
        return Axis(axis.name, nodes, axis.periodic, axis.unit)

    return Grid(tuple(Sheet(one.name, tuple(map(other, one.axes))) for one in grid.sheets))
