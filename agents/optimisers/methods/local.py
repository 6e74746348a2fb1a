"""Local searches with restarts: scipy's, and Adam."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize

from stickslip.optim.instances.exports import as_scipy
from stickslip.optim.instances.objective import PENALTY

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from jaxtyping import Float

    from stickslip.optim.instances.objective import Objective

RATE = 0.02
"""Adam's first step, in parts of the box."""
UNLIMITED = 2000
"""Of Adam's iterations, where there is no budget of evaluations."""


def slsqp(objective: Objective, seed: int) -> None:
    """scipy's SLSQP with its own settings."""
    _scipy(objective, seed, "SLSQP", {"maxiter": 1000})


def trust_constr(objective: Objective, seed: int) -> None:
    """scipy's trust-constr with its own settings."""
    _scipy(objective, seed, "trust-constr", {"maxiter": 1000})


def cobyla(objective: Objective, seed: int) -> None:
    """scipy's COBYLA; its first step is a fifth of the bounds' mean range."""
    low, high = objective.bounds
    _scipy(
        objective, seed, "COBYLA", {"maxiter": 10**6, "rhobeg": 0.2 * float(np.mean(high - low))}
    )


def _scipy(objective: Objective, seed: int, method: str, options: dict[str, float]) -> None:
    def search(start: np.ndarray, _: int) -> None:
        given = as_scipy(objective, start)
        if method == "COBYLA":
            given.pop("jac", None)
            for one in [given["constraints"]] if "constraints" in given else ():
                one.pop("jac", None)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what it met on its way
            minimize(**given, method=method, options=options)

    restarted(objective, seed, search)


def adam(objective: Objective, seed: int) -> None:
    """Adam in a box of sides 1 on the gradient of value and penalty, its rate falling as a cosine.

    An iteration takes a value and a gradient. It ends with the budget.
    """
    low, high = objective.bounds
    u = objective.to_unit(next(starts(objective, seed)))
    mean, square = np.zeros(objective.n), np.zeros(objective.n)
    count = UNLIMITED if objective.budget is None else max(1, objective.budget // 2)
    for k in range(count):
        x = objective.from_unit(u)
        objective(x)
        slope = objective.gradient(x)
        missed = objective.constraints(x) < 0
        if np.any(missed):
            slope = slope - PENALTY * np.sum(objective.jacobian(x)[missed], axis=0)
        slope = slope * (high - low)
        mean, square = 0.9 * mean + 0.1 * slope, 0.99 * square + 0.01 * slope**2
        step = (mean / (1 - 0.9 ** (k + 1))) / (np.sqrt(square / (1 - 0.99 ** (k + 1))) + 1e-12)
        u = np.clip(u - RATE * 0.5 * (1 + np.cos(np.pi * k / count)) * step, 0, 1)


def starts(objective: Objective, seed: int) -> Iterator[Float[np.ndarray, "n"]]:
    """The middle of the bounds first with seed 0, uniformly random points else, without end."""
    rng = np.random.default_rng([seed, 7])
    if seed == 0:
        yield objective.middle
    while True:
        yield objective.from_unit(rng.random(objective.n))


def restarted(
    objective: Objective, seed: int, search: Callable[[Float[np.ndarray, "n"], int], object]
) -> None:
    """A local search from one start after the other, until the budget ends it; search: of a start
    and the number of the restart. Ends where a search evaluates nothing."""
    for number, start in enumerate(starts(objective, seed)):
        before = objective.record.evaluations
        search(start, number)
        if objective.record.evaluations == before:
            return
