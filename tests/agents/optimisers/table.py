"""Runs by hand."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stickslip.agents.optimisers.report import COUNTED, Run
from stickslip.agents.sweeps.cells import open_store, write_cell
from stickslip.optim import instance

NAME = "gait-time-d16-v2"
BEST = instance(NAME).best_known


def run(
    found: list[tuple[int, float]],
    end: int,
    *,
    method: str = "mine",
    seed: int = 0,
    name: str = NAME,
    outcome: str = "spent",
) -> Run:
    """A run that had gaps after so many evaluations, and ended; 10 evaluations take 1 s."""
    best = instance(name).best_known
    values = [best + gap * abs(best) for _, gap in found]
    at = np.array([count for count, _ in found] + [end])
    return Run(
        name,
        method,
        seed,
        outcome,
        "",
        False,
        dict.fromkeys(COUNTED, 0) | {"values": end},
        instance(name).known.digest,
        at,
        at / 10,
        np.array([*values, values[-1] if values else np.nan]),
    )


def kept(runs: Sequence[Run], path: Path) -> Path:
    """The directory of a race that made these runs."""
    path.mkdir()
    content = {"definition": {"runs": len(runs)}, "cells": len(runs)}
    head = open_store(path, "race", content, False)
    for number, one in enumerate(runs):
        write_cell(path, number, head, one.table())
    return path
