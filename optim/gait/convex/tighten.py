"""A gait whose limits hold between the nodes, too: a little is taken off them where they do not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.between import Polynomials, lowest, peak
from stickslip.optim.gait.convex.grid_problem import STANDING
from stickslip.optim.gait.objective import TIME

if TYPE_CHECKING:
    from stickslip.optim.gait.convex.grid_problem import GridProblem
    from stickslip.optim.gait.convex.program import Numbers
    from stickslip.optim.gait.gait import Gait
    from stickslip.optim.gait.profile import Grid

ROUNDS = 9
HELD = 1e-8
"""Tolerated violation of a limit, in its unit of size."""
LAST = 1e-7
"""The same after the last round."""
MOVING, QUARTER = 0.005, 0.25
"""Lower limit of the crank rate: this share of the lift-off rate, or of the mean rate asked for
where that is less. Slower at its crest, a walk is at the mercy of how long a motor holds its
torque: with 4000 holds a step, as in `replay`, half of that may end in a fall backwards."""
STARTED = 0.1 * np.pi
"""Way from rest over which that grows from 0 [rad]."""
MORE = 1.1
"""Factor between tightening and violation: the gait found next bulges elsewhere."""


def held_between(
    problem: GridProblem, gait: Gait, free: str = ""
) -> tuple[Gait | None, float, int]:
    """The gait, its value between the nodes, and how often the program was solved. free: a limit
    whose excess is minimised.

    The walk's time between the nodes is kept to the longest one, too, by asking for less. It is
    known once the crank stands still nowhere.
    """
    numbers = problem.numbers(relaxed=free)
    solves, before = 0, np.full_like(numbers.C, np.inf)
    for tolerance in (*[HELD] * ROUNDS, LAST):
        violation, slow = overshoot(problem, gait, free), too_slow(problem, gait)
        late = 0.0 if problem.longest is None else gait.duration / problem.longest - 1
        if max(np.max(violation), np.max(slow), late) <= tolerance:
            goal = problem.goal
            return gait, gait.friction_use if goal.is_friction else goal.of(gait.spent), solves
        if tolerance == LAST:
            break
        taken = MORE * np.where(violation > HELD, violation, 0.0)
        stuck = violation > np.maximum(before / 2, HELD)
        taken = taken + np.where(stuck, _slack(problem, gait, numbers), 0.0)
        numbers = _kept_moving(problem, gait, replace(numbers, C=numbers.C - taken), slow)
        before = violation
        if numbers.longest is not None and 0 < late < np.inf:
            took = min(gait.spent_on_grid[TIME] * problem.units.rate, numbers.longest)
            numbers = replace(numbers, longest=took / (1 + late))
        solved = problem.solve(numbers)
        solves += 1
        if solved.a is None or solved.b is None:
            break
        gait = problem.gait_of(solved)
    return None, np.inf, solves


def _slack(problem: GridProblem, gait: Gait, numbers: Numbers) -> np.ndarray:
    """Slack of each limit at the nodes [m, nodes], in units of their size. Where one
    is violated between nodes that leave much of it, taking less than that off changes nothing."""
    rows = problem.rows
    spent = (rows.A * gait.a + rows.B * gait.b).reshape(len(rows.names), -1)
    return np.maximum(numbers.C - spent / rows.size[:, None], 0.0)


def overshoot(problem: GridProblem, gait: Gait, free: str = "") -> np.ndarray:
    """Violation of the limits in each cell, assigned to both of its nodes [m, nodes], in units
    of their size, but of `free` and of b >= 0 (see `too_slow`)."""
    rows = problem.rows_between
    between = peak(Polynomials(rows.scaled_excess(*gait.samples)))
    worst = _at_nodes(between).reshape(len(rows.names), -1)
    left_out = np.isin(rows.names, (free, STANDING))
    return np.where(left_out[:, None], -np.inf, worst)


def too_slow(problem: GridProblem, gait: Gait) -> np.ndarray:
    """Shortfall of a cell's least b, in closed form, below its lower limit, at its
    nodes [nodes]; in a cell at rest the b that the acceleration there leads to. In the limit's unit
    of size."""
    grid, least = gait.grid, lowest(gait.grid, gait.a, gait.b)
    share = np.ones_like(least)
    for rests, end, sign in _ends(grid):
        if rests:
            least[end, end] = sign * 2 * grid.h[end, end] * gait.a[end, end]
            distance = np.abs(grid.theta[end] - grid.theta[end, end])
            nearer = np.minimum(distance[:-1], distance[1:])
            nearer[end] = grid.h[end, end]
            share[end] = np.minimum(share[end], nearer / STARTED)
    size = problem.rows_between.size[-1]
    asked = np.inf
    if problem.longest is not None:
        asked = np.pi * grid.steps / problem.longest
    floor = min(MOVING * problem.limits.lift_off, QUARTER * asked) ** 2
    return _at_nodes(floor * share - least).ravel() / size


def _ends(grid: Grid) -> tuple[tuple[bool, int, int], ...]:
    """Ends of the walk: at rest or not, index in both axes, and direction of time from there."""
    return (grid.from_rest, 0, 1), (grid.to_rest, -1, -1)


def _at_nodes(cells: np.ndarray) -> np.ndarray:
    """The larger value of both cells at each node [..., K+1]."""
    none = np.full_like(cells[..., :1], -np.inf)
    left, right = (np.concatenate(pair, axis=-1) for pair in ((cells, none), (none, cells)))
    return np.maximum(left, right)


def _kept_moving(problem: GridProblem, gait: Gait, numbers: Numbers, slow: np.ndarray) -> Numbers:
    """b at both nodes of a cell kept by what is missing above what it is now; where the walk rests
    the acceleration is."""
    grid, row = gait.grid, problem.limits.names.index(STANDING)
    size = problem.rows_between.size[row]
    A, C, now = numbers.A.copy(), numbers.C.copy(), gait.b.ravel() / size
    for rests, end, sign in _ends(grid):
        if rests and slow[end] > 0:
            reach = sign * 2 * grid.h[end, end]
            now[end] = reach * gait.a[end, end] / size
            A[row, end] = -reach * problem.units.b / size
    floor = np.where(slow > 0, now + MORE * slow, -np.inf)
    C[row] = np.minimum(C[row], -floor)
    return replace(numbers, A=A, C=C)
