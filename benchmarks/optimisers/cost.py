"""What an evaluation costs: microseconds of processor time, by kind of call."""

from __future__ import annotations

import numpy as np

from benchmarks.timing import seconds_of
from stickslip.optim import Instance

BATCH = 64


def cost_of(instance: Instance) -> dict[str, float]:
    """Of a value with its constraints, alone and in batches of 64, and of a gradient, [us]."""
    objective = instance.objective()
    rng = np.random.default_rng(0)
    points = objective.from_unit(rng.random((BATCH, objective.n)))
    turn = iter(range(10**9))

    def single() -> None:
        objective(points[next(turn) % BATCH])

    single()
    found = {"value": seconds_of(lambda: [single() for _ in range(8)], 3)[0] / 8}
    objective.batch(points)
    found["in a batch"] = seconds_of(lambda: objective.batch(points), 3)[0] / BATCH
    if objective.has_slopes:
        objective.gradient(points[0])
        found["gradient"] = seconds_of(lambda: objective.gradient(points[0]), 3)[0]
    return {name: float(f"{1e6 * each:.3g}") for name, each in found.items()}
