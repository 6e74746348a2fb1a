"""Proofs that no gait keeps to some limits, from the multipliers of a relaxed program.

Where all weights of the objective are 0, a bound above 0 (`certificate.py`) is a contradiction: a
gait within the limits would have the value 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.program import Solved, program_of
from stickslip.optim.gait.proof.certificate import Multipliers, every_bound, grid_bound
from stickslip.optim.gait.proof.pointwise import Polygons

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.instance import Instance
    from stickslip.optim.gait.convex.program import Numbers

SIGNS = (1.0, -1.0)


def relaxed(instance: Instance, limit: str) -> tuple[Numbers, Solved]:
    """Least necessary violation r of a limit, in its unit of size, and the solution."""
    numbers = instance.numbers(relaxed=limit)
    numbers.weights.clear()
    structure = instance.structure._replace(terms=())
    return numbers, program_of(structure).solve(numbers)


def excluded(instance: Instance, solved: Solved, every: bool) -> bool:
    """True if multipliers prove that no gait keeps to the instance's limits: no gait of the grid,
    or no gait whatever. solved: of `relaxed`, of this instance or one that differs in its rows."""
    if solved.duals is None or solved.a is None or solved.b is None:
        return False
    numbers = instance.numbers()
    numbers.weights.clear()
    sample = instance.sample(inside=every)
    for sign in SIGNS:
        multipliers = Multipliers.of(solved.duals, sign)
        if every:
            found = every_bound(instance.grid, sample, numbers, multipliers, instance.periodic)
        else:
            at = solved.a, solved.b
            found = grid_bound(instance.grid, sample, numbers, multipliers, instance.periodic, at)
        if found > 0:
            return True
    return False


def nothing_left(instance: Instance) -> bool:
    """True if the limits leave no acceleration and no rate at all at some node."""
    sample = instance.sample(inside=False)
    polygons = Polygons.of(sample.A, sample.B, sample.C, sample.torque, sample.ends)
    return bool(np.any(polygons.low > polygons.high))
