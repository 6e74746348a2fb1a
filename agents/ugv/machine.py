"""What training has to know of the UGV; see stickslip.agents.machines.Machine."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.biped.evaluate import row_of_test
from stickslip.agents.biped.training import TEST_SEEDS
from stickslip.agents.ugv.evaluate import optima, play_ugv, ugv_columns
from stickslip.agents.ugv.plans import Optimum
from stickslip.agents.ugv.task import describe_ugv
from stickslip.agents.ugv.training import UGVTask, make_ugv_task
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stickslip.agents.ugv.config import UGVTrainConfig

EVALUATED = ("return", "cost", "score", "total_energy", "demand", "failures")
EPISODE = ("episodes", "return", "cost", "length", "wheel_energy", "total_energy", "failures")
GRID = 21
"""Angles of the optimiser's grid for the score during training."""

make_task = make_ugv_task


def about(task: UGVTask) -> dict[str, Any]:
    """See Machine."""
    return describe_ugv(task.env, task.test)


def evaluate_policy(task: UGVTask, policy: Any, config: UGVTrainConfig) -> dict[str, float]:
    """The reward in the criterion's unit over whole episodes on tracks never trained on, and the
    cost over the optimiser's on the same tracks."""
    env = replace(task.env, autoreset="disabled")
    drawn = bool(task.test.randomisation.track or task.test.randomisation.friction)
    seeds = range(TEST_SEEDS, TEST_SEEDS + (config.evaluation_episodes if drawn else 1))
    played = play_ugv(env, policy, task.test, seeds)._replace(optimum=_optima(config, len(seeds)))
    return row_of_test(ugv_columns(task.env.measure.unit), EVALUATED, played)


@lru_cache(maxsize=1)
def _optima(config: UGVTrainConfig, count: int) -> np.ndarray:
    """The optimiser's values on the test tracks, computed once."""
    task = make_task(config)
    env = replace(task.env, autoreset="disabled")
    return optima(env, task.test, range(TEST_SEEDS, TEST_SEEDS + count), Optimum(GRID))


def summary(ended: Sequence[dict[str, Any]], period: float) -> dict[str, float]:
    """Means over the episodes; of the cost, over those that reached the end."""
    failed = np.asarray([info["status"] != Status.OK for info in ended])

    def mean(name: str, rows: np.ndarray) -> float:
        values = np.asarray([float(info["episode_" + name]) for info in ended])[rows]
        return float(values.mean()) if len(values) else np.nan

    every = np.ones(len(ended), bool)
    return {
        "episodes": len(ended),
        "return": mean("return", every),
        "length": mean("length", every),
        **{name: mean(name, ~failed) for name in ("cost", "wheel_energy", "total_energy")},
        "failures": float(failed.mean()),
    }


def beside_bar(row: Mapping[str, float]) -> str:
    """See Machine."""
    return f"return {row.get('return', np.nan):.2f}, cost {row.get('cost', np.nan):.4g}"


def line(row: Mapping[str, float]) -> str:
    """See Machine."""
    return (
        f"return {row['return']:9.2f}  cost {row['cost']:9.4g}  "
        f"{row['score']:6.3f} of the optimum  with legs {row['total_energy']:7.1f} J  "
        f"failures {100 * row['failures']:3.0f} %"
    )


def write_products(trained: Any) -> list[Path]:
    """See Machine."""
    from stickslip.agents.ugv import products as ugv_products

    return ugv_products.write_products(trained)


__all__ = [
    "EPISODE",
    "EVALUATED",
    "about",
    "beside_bar",
    "evaluate_policy",
    "line",
    "make_task",
    "summary",
    "write_products",
]
