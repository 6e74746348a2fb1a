"""Batch evaluation of any machine: every controller in every scene over many seeds, vmapped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.evaluation.run import evaluate_in
from stickslip.agents.registry import machine_of_env

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.protocol import Params, Player, State
    from stickslip.envs.functional import FunctionalEnv


def evaluate(
    env: FunctionalEnv[State, Params],
    controllers: Mapping[str, Player[State, Params]],
    scenes: Mapping[str, Params],
    *,
    episodes: int = 32,
    seeds: Sequence[int] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Evaluation:
    """Run every controller in every scene over the seeds (by default 0, 1, ..., episodes - 1).

    env: a BipedEnv, a UGVEnv or another machine's. controllers: by name (see Controller); the UGV's
    planners are among them. scenes: the environment's parameters, by name. Seed s is the first
    episode after `reset(seed=s)` of every adapter; where a reset draws nothing one episode is run.
    progress: called with a line before each row. ValueError for an environment of no machine.
    """
    measures = machine_of_env(env).measures(env)
    return evaluate_in(
        env, controllers, scenes, measures, episodes=episodes, seeds=seeds, progress=progress
    )
