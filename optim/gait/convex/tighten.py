"""A gait whose limits hold between the nodes, too: a little is taken off them where they do not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.convex.limits import STANDING
from stickslip.optim.gait.convex.program import program_of

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.answer import Answer
    from stickslip.optim.gait.convex.instance import Instance
    from stickslip.optim.gait.gait import Gait

ROUNDS = 6
HELD = 1e-8
"""By how much a limit may be missed, in its unit of size."""
LAST = 1e-7
"""The same after the last round."""
MUCH = 0.3
"""Later than by this share a gait stands still between two nodes. Then it has to keep moving."""
SHARE = 0.05
"""Of the mean rate: how fast at least, doubled as often as that does not do."""
MORE = 1.25
"""What is taken off, over what is missed: the worst place lies between the points looked at."""


def held_between(answer: Answer) -> tuple[Gait | None, float, int]:
    """The gait, its value between the nodes, and how often the program was solved.

    The walk's time between the nodes is kept to the longest one, too, by asking for less.
    """
    instance, gait = answer.instance, answer.gait
    numbers = instance.numbers(relaxed=answer.relaxed)
    structure, free = instance.structure, answer.relaxed
    if free:
        numbers.weights.clear()
        structure = structure._replace(terms=())
    solves, share = 0, SHARE
    for tolerance in (*[HELD] * ROUNDS, LAST):
        missed, late = overshoot(instance, gait, free), _late(instance, gait)
        if np.max(missed) <= tolerance and late <= tolerance:
            return gait, _value(instance, gait), solves
        if tolerance == LAST:
            break
        taken = MORE * np.where(missed > HELD, missed, 0.0)
        slower, C = 0.0, numbers.C - taken
        if 0 < late < MUCH:
            slower = late
        elif late > 0:  # it stands still between two nodes
            floor = (share * instance.units.rate * np.pi * instance.grid.steps) ** 2
            floor = floor / (numbers.longest or np.inf) ** 2 / instance.rows[0].size[-1]
            standing = np.array(instance.limits.names) == STANDING
            C = np.where(standing[:, None], np.minimum(C, -floor), C)
            share = 2 * share
        longest = None if numbers.longest is None else numbers.longest / (1 + slower)
        numbers = replace(numbers, C=C, longest=longest)
        solved = program_of(structure).solve(numbers)
        solves += 1
        if solved.a is None or solved.b is None:
            break
        gait = instance.gait_of(solved)
    return None, np.inf, solves


def _late(instance: Instance, gait: Gait) -> float:
    """By what share of the longest time the gait takes longer."""
    return 0.0 if instance.longest is None else gait.duration / instance.longest - 1


def overshoot(instance: Instance, gait: Gait, free: str = "") -> np.ndarray:
    """What the limits are missed by in each cell, given to both of its nodes [m, nodes], in units
    of their size; `free` may be missed."""
    nodes, inside = instance.rows
    size = nodes.size[:, None, None]
    at = nodes.excess(gait.a, gait.b) / size
    between = np.max(inside.excess(*gait.inner), axis=-1) / size
    left = np.concatenate([between, np.full_like(between[..., :1], -np.inf)], axis=-1)
    right = np.concatenate([np.full_like(between[..., :1], -np.inf), between], axis=-1)
    worst = np.maximum(at, np.maximum(left, right)).reshape(len(nodes.names), -1)
    return np.where(np.array(nodes.names)[:, None] == free, -np.inf, worst)


def _value(instance: Instance, gait: Gait) -> float:
    return gait.friction_use if instance.goal.is_friction else instance.goal.of(gait.spent)
