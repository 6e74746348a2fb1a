"""Value iteration for an environment: from a task to a value function and its policy."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Generic

import jax
import jax.numpy as jnp

from stickslip.agents.evaluation.rollout import episode_key, horizon, without_resets
from stickslip.agents.optimum.blocks import KeptBlocks
from stickslip.agents.optimum.checkpoint import digest_of, keeper, kept_values
from stickslip.agents.optimum.controller import ValuePolicy, even_actions
from stickslip.agents.optimum.state_map import EnvProcess, StateMap
from stickslip.agents.protocol import Params, State
from stickslip.agents.registry import machine_of_env
from stickslip.dynamics.checks import require_choice, require_integer, require_kind
from stickslip.optim.dynamic_programming.grid import Grid
from stickslip.optim.dynamic_programming.lookahead import Ahead
from stickslip.optim.dynamic_programming.outcomes import Counts, transitions
from stickslip.optim.dynamic_programming.sweeps import (
    Values,
    average_reward,
    finite_horizon,
    greedy,
)
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from jaxtyping import Array, Int

    from stickslip.agents.reports.show import View
    from stickslip.envs.functional import FunctionalEnv
    from stickslip.optim.dynamic_programming.grid import Cell

OBJECTIVES = ("episode", "average")
RESTARTS = 256
"""Starts that are drawn for the average reward."""


@dataclass(frozen=True)
class Solution(Generic[State, Params]):
    """A value function and how it was found.

    values.value: objective "episode": the most that can be earned from a node in `values.sweeps`
    steps, on the grid; "average": relative to one another, with bounds of the average reward of a
    step. None of it is proved for the environment: `known` replays the policy.
    """

    policy: ValuePolicy[State, Params]
    params: Params
    values: Values
    objective: str
    chosen: Int[Array, " nodes"]
    """Number of the action that is best at each node, one step ahead."""
    counts: Counts
    """Of the transitions."""
    seconds: float

    def view(self, seed: int = 0) -> View:
        """The policy's episode of a seed to play, with what was solved; `View.save` makes a page.

        The policy looks ahead by the environment's own step, a program that takes time to compile.
        ValueError for an environment of no machine.
        """
        from stickslip.agents.reports.show import View, show

        env = self.policy.env
        played = show(env, {"dynamic programming": self.policy}, self.params, seed).page
        title = f"Dynamic programming on {type(env).__name__}"
        note = "Values are those of the grid; known(solution) replays the policy."
        return View(replace(played, title=title, tables=(("", self._table()),), lead=note))

    def _repr_html_(self) -> str:
        """HTML for notebooks: grid, actions, sweeps and values."""
        return self._table().html()

    def _table(self) -> Table:
        values, counts, ahead = self.values, self.counts, self.policy.ahead
        names = "; ".join(
            f"{sheet.name}: " + " x ".join(f"{len(axis.nodes)} {axis.name}" for axis in sheet.axes)
            for sheet in self.policy.grid.sheets
        ).replace("_", " ")
        rows = [
            ("grid", f"{self.policy.grid.size:,} nodes ({names})"),
            ("actions tried", f"{len(self.policy.actions)}"),
            ("steps ahead, ways kept", f"{int(ahead.depth)}, {ahead.beam}"),
            ("sweeps", f"{values.sweeps:,}"),
        ]
        if self.objective == "average":
            bounds = f"{values.low:.6g} to {values.high:.6g}"
            rows.append(("reward of a step on the grid", bounds))
        else:
            least, most = float(jnp.min(values.value)), float(jnp.max(values.value))
            about = f"{least:.6g} to {most:.6g}, of {values.sweeps:,} steps"
            rows.append(("return on the grid, by node", about))
        ended, outside = (f"{one / counts.all:.2%}" for one in counts[:2])
        rows.append(("transitions", f"{counts.all:,}: {ended} end it, {outside} leave the grid"))
        rows.append(("took", f"{self.seconds:.3g} s"))
        return Table([Column("Solution", words=True), Column("", words=True)], rows)


def solve(
    env: FunctionalEnv[State, Params],
    params: Params,
    *,
    grid: Grid | None = None,
    fineness: float = 1.0,
    actions: int = 41,
    objective: str = "episode",
    steps: int | None = None,
    ahead: Ahead | None = None,
    states: StateMap[State, Params] | None = None,
    checkpoint: str | Path | None = None,
    progress: bool = False,
) -> Solution[State, Params]:
    """The value function of a task, by dynamic programming on the environment's own step.

    grid: nodes, default: the machine's usual grid with `fineness` times as many cells along each
    axis. actions: so many torques (or what the action is), evenly from -1 to 1. objective:
    "episode", the most that can be earned in `steps` steps (default: an episode), or "average",
    the most that an endless walk earns a step, beginning anew where it falls. ahead: how far the
    policy looks. states: the state's coordinates, default: the machine's. checkpoint: a file to
    keep the values in every few sweeps, and to go on from where it is there; until the end the
    transitions are kept in a folder beside it, FILE.transitions, as large as they are in memory.

    ValueError for a task whose rewards depend on more than the coordinates, for a grid that memory
    does not hold, and for a checkpoint of another definition.
    """
    began = time.perf_counter()
    env.check_params(params)
    env = without_resets(env)
    actions = require_integer("actions", actions, low=2, high=10**4)
    require_choice("objective", objective, OBJECTIVES)
    require_kind("ahead", ahead, (Ahead, type(None)), "an Ahead or None")
    states = machine_of_env(env).state_map(env, params) if states is None else states
    grid = states.grid(params, fineness) if grid is None else grid
    require_kind("grid", grid, Grid, "a Grid")
    grid.validate()
    start = env.reset(episode_key(0), params)[1]
    kind = jax.eval_shape(lambda one: states.place(grid, one).coordinates, start).dtype
    process = EnvProcess(params, even_actions(actions, kind), grid, env, states)
    outside = states.leaving(params)
    steps = horizon(params) if steps is None else require_integer("steps", steps)
    before, report, blocks = None, None, None
    if checkpoint is not None:
        path = Path(checkpoint)
        # The sweeps of an episode are those of a longer one, too: `steps` is no part of this.
        what = version("stickslip"), repr((env, states)), objective, outside
        definition = digest_of(*what, params, grid, process.actions)
        before, report = kept_values(path, definition, grid.size), keeper(path, definition)
        blocks = KeptBlocks(path, definition, grid.size)
    table = transitions(process, outside, progress=progress, blocks=blocks)
    how = {"start": before, "report": report, "progress": progress}
    if objective == "episode":
        if before is not None and before.sweeps > steps:
            raise ValueError(
                f"{checkpoint} holds {before.sweeps} sweeps; accepted: at most steps = {steps}"
            )
        values = finite_horizon(table, steps, **how)
        again = None
    else:
        again = _restarts(process, params)
        values = average_reward(table, again, **how)
    chosen = greedy(table, values.value, again)[1]
    policy = ValuePolicy(
        values.value, process.actions, outside, grid, env, states, ahead or Ahead()
    )
    seconds = time.perf_counter() - began
    policy.validate()
    if blocks is not None:
        blocks.discard()
    return Solution(policy, params, values, objective, chosen, table.counts, seconds)


def _restarts(process: EnvProcess[State, Params], params: Params) -> Cell:
    """The cells of starts as the environment draws them."""

    def one(seed: jax.Array) -> Cell:
        state = process.env.reset_env(episode_key(seed), params)[1]
        return process.grid.cell(process.place(state))

    return jax.jit(jax.vmap(one))(jnp.arange(RESTARTS, dtype=jnp.uint32))
