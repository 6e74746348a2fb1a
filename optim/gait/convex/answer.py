"""Answer of a program with its certificate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.program import Solved, program_of
from stickslip.optim.gait.proof.certificate import Multipliers, every_bound, grid_bound
from stickslip.optim.gait.result import Certificate

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.instance import Instance
    from stickslip.optim.gait.gait import Gait

SIGNS = (1.0, -1.0)
MET = 1e-5
"""Relative gap above which the multipliers are tried with the other sign, too."""


@dataclass(frozen=True)
class Answer:
    """The gait on the grid, its certificate, a bound on every gait (None: none proved), how the
    solver ended and how often it ran. instance: what was solved. relaxed: the limit that the
    program minimised the excess of, if it did."""

    gait: Gait
    certificate: Certificate
    every: float | None
    solved: Solved
    instance: Instance
    solves: int = 1
    relaxed: str = ""


SLOW = 0.1
"""If the greatest b is less than this of its unit, the unit is reduced and all is solved
again: the solver's accuracy is that of the largest numbers."""


def answered(instance: Instance, solves: int = 1, *, every: bool = True) -> Answer | Solved:
    """Solve and certify; the bare outcome without a point. every: bound every gait, too."""
    numbers = instance.numbers()
    solved = program_of(instance.structure).solve(numbers)
    if solved.a is None or solved.b is None or solved.duals is None:
        return solved
    if solves < 3 and np.max(solved.b) < SLOW:
        rate = instance.units.rate * float(np.sqrt(max(np.max(solved.b), 1e-6)))
        return answered(instance.towards(rate_unit=rate), solves + 1, every=every)
    gait = instance.gait_of(solved)
    value = instance.goal.of(gait.on_grid)
    nodes = instance.sample(inside=False)
    inside = instance.sample(inside=True) if every else None
    scaled = solved.a, gait.b / instance.units.b
    bound, of_every = -np.inf, -np.inf
    for sign in SIGNS:
        multipliers = Multipliers.of(solved.duals, sign)
        periodic, scale = instance.periodic, instance.scale
        new = grid_bound(instance.grid, nodes, numbers, multipliers, periodic, scaled) * scale
        if new > bound:
            bound = new
            if inside is not None:
                found = every_bound(instance.grid, inside, numbers, multipliers, periodic)
                of_every = found * scale
        if value - bound <= MET * max(abs(value), scale):
            break
    certificate = conditions(instance, gait, solved, value, max(bound, 0.0))
    proved = max(of_every, 0.0) if every else None
    return Answer(gait, certificate, proved, solved, instance, solves)


def conditions(
    instance: Instance, gait: Gait, solved: Solved, value: float, bound: float
) -> Certificate:
    """The certificate of a value and a bound: with violation, sign and complementarity."""
    rows = instance.rows[0]
    excess = rows.excess(gait.a, gait.b) / rows.size[:, None, None]
    missed = max(float(np.max(excess)), 0.0)
    if solved.duals is None:
        return Certificate(value, bound, missed, -np.inf, np.inf)
    multipliers = solved.duals.rows
    total = max(1.0, float(np.sum(np.abs(multipliers))))
    slack = -excess.reshape(multipliers.shape)
    products = float(np.max(np.abs(multipliers * slack))) / total
    return Certificate(value, bound, missed, min(float(np.min(multipliers)) / total, 0.0), products)
