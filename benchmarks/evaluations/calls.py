"""The calls that are timed, as a process of its own: it asks nothing but the package and NumPy.

Reads lines "problem call" from standard input and answers each with a line: microseconds of wall
and of processor time a point, least of several bursts. `numbers` for a call answers with what the
problem gives at fixed points. A first argument of "sync" switches asynchronous dispatch off.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import jax
import numpy as np

BATCH = 256
BURSTS = 5
PROBLEMS = {
    "bump, n = 68": ("bump", {}, 34),
    "rough C, n = 68": ("rough", {"key": 7, "end": 10.0}, 34),
    "bump, n = 260": ("bump", {}, 130),
}
SINGLE = ("value", "gradient", "constraints", "value and constraints", "value and gradient")
IN_BATCHES = ("values of 256", "values and constraints of 256")
CALLS = (*SINGLE, *IN_BATCHES)


@lru_cache
def problem_of(name: str) -> Any:
    """The problem of that name."""
    from stickslip.dynamics.ugv import Track
    from stickslip.optim import PostureProblem

    track, options, waypoints = PROBLEMS[name]
    ground = Track.named(track, **options)
    first, *_, last = PostureProblem.along(ground).x
    made = PostureProblem.along(ground)
    return PostureProblem(made.params, ground, np.linspace(first, last, waypoints))


@lru_cache
def points_of(name: str) -> np.ndarray:
    """Angles about straight down [256, n]."""
    problem = problem_of(name)
    noise = np.random.default_rng(0).standard_normal((BATCH, problem.n))
    return np.clip(np.pi / 2 + 0.1 * noise, *problem.bounds)


def called(name: str, call: str) -> tuple[Callable[[np.ndarray], Any], int]:
    """What is timed, of one point or of all, and how many points that is."""
    problem = problem_of(name)
    both = getattr(problem, "value_and_margins", problem.evaluate)
    return {
        "value": (problem.objective, 1),
        "gradient": (problem.gradient, 1),
        "constraints": (problem.constraints, 1),
        "value and constraints": (both, 1),
        "value and gradient": (lambda x: (problem.objective(x), problem.gradient(x)), 1),
        "values of 256": (problem.objectives, BATCH),
        "values and constraints of 256": (problem.evaluate_all, BATCH),
    }[call]


def timed(name: str, call: str) -> dict[str, float]:
    """Microseconds a point: the least of BURSTS, each of some 30 ms."""
    function, many = called(name, call)
    points: Iterator[np.ndarray] | Any = points_of(name)
    given = [points] if many > 1 else list(points)
    jax.block_until_ready(function(given[-1]))
    turns = 3 if many > 1 else 100
    taken = []
    for _ in range(BURSTS):
        begun, used = time.perf_counter(), time.process_time()
        for i in range(turns):
            function(given[i % len(given)])  # NumPy's arrays: whoever has them has waited
        taken.append((time.perf_counter() - begun, time.process_time() - used))
    wall, processor = (1e6 * min(of) / turns / many for of in zip(*taken, strict=True))
    return {"wall": wall, "processor": processor}


def numbers(name: str) -> dict[str, list[float]]:
    """Values, gradients and constraints at four points."""
    problem, points = problem_of(name), points_of(name)[:4]
    return {
        "value": [problem.objective(x) for x in points],
        "gradient": np.concatenate([problem.gradient(x) for x in points]).tolist(),
        "constraints": np.concatenate([problem.constraints(x) for x in points]).tolist(),
    }


def main() -> None:
    """Answer until there are no more questions."""
    if "sync" in sys.argv:
        jax.config.update("jax_cpu_enable_async_dispatch", False)
    for line in sys.stdin:
        name, call = json.loads(line)
        found = numbers(name) if call == "numbers" else timed(name, call)
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
