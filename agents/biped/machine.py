"""What training has to know of the biped; see stickslip.agents.machines.Machine."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.biped.evaluate import COLUMNS, play, row_of_test
from stickslip.agents.biped.task import describe_environment
from stickslip.agents.biped.training import TEST_SEEDS, Task, make_task
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stickslip.agents.biped.config import TrainConfig

EVALUATED = (
    "return",
    "mean_speed",
    "mean_crank_rate",
    "slip_per_metre",
    "energy_per_metre",
    "falls",
)
EPISODE = (
    "episodes",
    "return",
    "duration",
    "mean_crank_rate",
    "speed",
    "slip_per_metre",
    "energy_per_metre",
    "falls",
)


def about(task: Task) -> dict[str, Any]:
    """See Machine."""
    return describe_environment(task.env, task.rest)


def evaluate_policy(task: Task, policy: Any, config: TrainConfig) -> dict[str, float]:
    """The standard reward over whole episodes from anywhere, deterministic."""
    seeds = range(TEST_SEEDS, TEST_SEEDS + config.evaluation_episodes)
    played = play(replace(task.env, autoreset="disabled"), policy, task.moving, seeds)
    return row_of_test(COLUMNS, EVALUATED, played)


def summary(ended: Sequence[dict[str, Any]], period: float) -> dict[str, float]:
    """Means over the episodes and ratios of sums."""
    names = ("return", "length", "walked", "slid", "energy", "mean_rate")
    rows = [
        (*(float(info["episode_" + name]) for name in names), info["status"] > Status.SLIP_ONSET)
        for info in ended
    ]
    total, length, walked, slid, energy, rate, fell = np.asarray(rows, float).T
    far = walked.sum() > 0.1
    return {
        "episodes": len(rows),
        "return": total.mean(),
        "duration": length.mean() * period,
        "mean_crank_rate": np.average(rate, weights=length),
        "speed": walked.sum() / (length.sum() * period),
        "slip_per_metre": slid.sum() / walked.sum() if far else np.nan,
        "energy_per_metre": energy.sum() / walked.sum() if far else np.nan,
        "falls": fell.mean(),
    }


def beside_bar(row: Mapping[str, float]) -> str:
    """See Machine."""
    rate = row.get("mean_crank_rate", np.nan)
    return f"return {row.get('return', np.nan):.2f}, {rate:.2f} rad/s"


def line(row: Mapping[str, float]) -> str:
    """See Machine."""
    return (
        f"return {row['return']:6.2f}  "
        f"{row['mean_crank_rate']:5.2f} rad/s  slip {row['slip_per_metre']:7.4f} m/m  "
        f"energy {row['energy_per_metre']:6.1f} J/m  falls {100 * row['falls']:3.0f} %"
    )


def write_products(trained: Any) -> list[Path]:
    """See Machine."""
    from stickslip.agents.biped import products as train_products

    return train_products.write_products(trained)


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
