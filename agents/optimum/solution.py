"""Dynamic programming for an environment: from a task to a value function and its policy."""

from __future__ import annotations

import hashlib
import io
import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Generic

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import episode_key, horizon, without_resets
from stickslip.agents.optimum.grid import Grid
from stickslip.agents.optimum.policy import Ahead, EnvProcess, StateMap, ValuePolicy
from stickslip.agents.optimum.value_iteration import (
    Counts,
    Values,
    finite_horizon,
    greedy,
    transitions,
)
from stickslip.agents.protocol import Params, State
from stickslip.agents.registry import machine_of_env
from stickslip.agents.untrusted import LARGEST, RefusedError, arrays_in, read_bytes, refusing
from stickslip.dynamics.checks import require_integer, require_kind
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from jaxtyping import Array, Int

    from stickslip.envs.functional import FunctionalEnv


@dataclass(frozen=True)
class Solution(Generic[State, Params]):
    """A value function and how it was found.

    values.value: the most that can be earned from a node in `values.sweeps` steps, on the grid.
    chosen: number of the action that is best at each node, one step ahead. counts: of the
    transitions. None of it is proved for the environment: `known` replays the policy.
    """

    policy: ValuePolicy[State, Params]
    params: Params
    values: Values
    chosen: Int[Array, " nodes"]
    counts: Counts
    seconds: float


def solve(
    env: FunctionalEnv[State, Params],
    params: Params,
    *,
    grid: Grid | None = None,
    fineness: float = 1.0,
    actions: int = 41,
    steps: int | None = None,
    ahead: Ahead | None = None,
    states: StateMap[State, Params] | None = None,
    checkpoint: str | Path | None = None,
    progress: bool = False,
) -> Solution[State, Params]:
    """The value function of a task, by dynamic programming on the environment's own step.

    grid: nodes, default: the machine's usual grid with `fineness` times as many cells along each
    axis. actions: so many torques (or what the action is), evenly from -1 to 1. steps: of the
    return that is maximised, default: an episode. ahead: how far the policy looks. states: the
    state's coordinates, default: the machine's. checkpoint: a file to keep the values in every few
    sweeps, and to resume from where it is there.

    ValueError for a task whose rewards depend on more than the coordinates, for a grid that memory
    does not hold, and for a checkpoint of another definition.
    """
    began = time.perf_counter()
    env.check_params(params)
    env = without_resets(env)
    actions = require_integer("actions", actions, low=2, high=10**4)
    require_kind("ahead", ahead, (Ahead, type(None)), "an Ahead or None")
    states = machine_of_env(env).state_map(env, params) if states is None else states
    grid = states.grid(params, fineness) if grid is None else grid
    require_kind("grid", grid, Grid, "a Grid")
    grid.validate()
    start = env.reset(episode_key(0), params)[1]
    kind = jax.eval_shape(lambda one: states.place(grid, one).coordinates, start).dtype
    tried = jnp.linspace(-1.0, 1.0, actions, dtype=kind)[:, None]
    process, outside = EnvProcess(params, tried, grid, env, states), states.leaving(params)
    steps = horizon(params) if steps is None else require_integer("steps", steps)
    before, report = None, None
    if checkpoint is not None:
        # The sweeps of an episode are those of a longer one, too: `steps` is no part of this.
        what = version("stickslip"), repr((env, states)), outside
        kept = Checkpoint(Path(checkpoint), digest_of(*what, params, grid, tried), grid.size)
        before, report = kept.read(), kept.write
    if before is not None and before.sweeps > steps:
        raise ValueError(
            f"{checkpoint} holds {before.sweeps} sweeps; accepted: at most steps = {steps}"
        )
    table = transitions(process, outside, progress=progress)
    values = finite_horizon(table, steps, start=before, report=report, progress=progress)
    chosen = greedy(table, values.value)[1]
    policy = ValuePolicy(values.value, tried, outside, grid, env, states, ahead or Ahead())
    policy.validate()
    seconds = time.perf_counter() - began
    return Solution(policy, params, values, chosen, table.counts, seconds)


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


@dataclass(frozen=True)
class Checkpoint:
    """A file of the values after some sweeps. definition: digest of task, grid and actions."""

    path: Path
    definition: str
    nodes: int

    def write(self, now: Values) -> None:
        """Write the values atomically."""
        file = io.BytesIO()
        np.savez(
            file,
            allow_pickle=False,
            definition=np.array(self.definition),
            sweeps=np.array(now.sweeps),
            value=np.asarray(now.value),
        )
        write_whole(self.path, file.getvalue())

    def read(self) -> Values | None:
        """The values in the file; None where there is none.

        ValueError, naming the file, for one that is damaged or of another definition.
        """
        if not self.path.exists():
            return None
        largest = max(LARGEST, 16 * self.nodes)
        try:
            with refusing("it"):
                return self._values(arrays_in(read_bytes(self.path, largest), largest))
        except ValueError as error:
            raise ValueError(
                f"{self.path}: {error}; accepted: what an earlier run of the same task, grid and "
                "actions wrote there, or a new path"
            ) from error

    def _values(self, arrays: dict[str, np.ndarray]) -> Values:
        wanted = {"definition": ((), "U"), "sweeps": ((), "i"), "value": ((self.nodes,), "f")}
        if set(arrays) != set(wanted) or str(arrays["definition"]) != self.definition:
            raise RefusedError("it is of another task, grid or set of actions")
        if any((arrays[name].shape, arrays[name].dtype.kind) != wanted[name] for name in wanted):
            raise RefusedError("its arrays are of other shapes")
        value, sweeps = arrays["value"], int(arrays["sweeps"])
        if sweeps < 0 or not np.all(np.isfinite(value)):
            raise RefusedError("its values hold what is no number")
        return Values(jnp.asarray(value), sweeps)
