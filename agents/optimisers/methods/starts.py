"""Where searches begin, and how they begin again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from jaxtyping import Float

    from stickslip.optim.instances.objective import Objective


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
