"""Costs to go over cells, by dynamic programming: functions below those of every drive.

At each waypoint every cell A has its own function, bilinear between four numbers at its corners. It
bounds what is left to pay from any of its points if, for each cell B that a move may lead to, some
slopes s of the terms (steps.py) give at all corners that a move lies between

    V_A(a) <= sum over terms of what a slope s charges of p(a, b) - kappa + V_B(b):

both sides are interpolants there, so it holds between, too. V begins from the best of the corners'
own moves, and is lowered for each pair of cells by what the best slopes leave missing. Were p and V
linear, nothing would be lost, wherever max(0, p) has its kink.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from stickslip.dynamics.pytrees import float64_program
from stickslip.optim.posture.bounds.cells import AHEAD, BACK, NONE, Axis, StationCells, shapes
from stickslip.optim.posture.bounds.steps import FOUR, Side, Term, kappas, sizes, terms_of
from stickslip.optim.posture.criteria import Criterion, Station, step_cost, steps

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.optim.posture.problem import PostureProblem


TURNS = 6
"""Iterations of the search for a slope."""
UNITS = 64
"""Roundings of a sum of a few numbers, more than there are."""
UP, DOWN = (
    np.array([[(p[leg], q[leg]) == pair for q in FOUR for p in FOUR] for leg in (0, 1)])
    for pair in ((0, 1), (1, 0))
)


class Pairs(NamedTuple):
    """Pairs of cells, from A and to B, and at which of the 16 pairs of corners no move lies."""

    a: Int[np.ndarray, "n"]
    b: Int[np.ndarray, "n"]
    none: Bool[np.ndarray, "n 4 4"]
    cut: Bool[np.ndarray, "2 n"]


@dataclass(frozen=True)
class Step:
    """A step between two waypoints' cells."""

    terms: list[Term]
    ends: tuple[Side, Side]
    legs: tuple[Int[np.ndarray, "n m"], Int[np.ndarray, "n m"]]
    """Moves of each leg's cells: see shapes."""
    dx: float

    @classmethod
    def of(cls, problem: PostureProblem, terms: list[Term], k: int, a: Side, b: Side) -> Step:
        legs = (shapes(problem, k, a.rear, b.rear), shapes(problem, k, a.front, b.front))
        return cls(terms, (a, b), legs, float(problem.x[k + 1] - problem.x[k]))

    def products(self, term: Term, pairs: Pairs) -> tuple[np.ndarray, np.ndarray]:
        """p at pairs of corners [n, 4, 4], 0 where nothing is known, and kappa [n]."""
        one, other = self.ends
        known = one.known[pairs.a] & other.known[pairs.b]
        X, U = one.fields[term.X].corners[pairs.a], other.fields[term.X].corners[pairs.b]
        if term.Y is None:
            p = U[:, None, :] - X[:, :, None]
            if term.heat:
                p = (U[:, None, :] + X[:, :, None]) / 2
        else:
            Y, V = one.fields[term.Y].corners[pairs.a], other.fields[term.Y].corners[pairs.b]
            p = (X[:, :, None] + U[:, None, :]) * (V[:, None, :] - Y[:, :, None]) / 2
        kappa = kappas(term, self.ends, (pairs.a, pairs.b), pairs.cut)
        kappa = kappa + sizes(term, self.ends)[1]
        return np.where(known[:, None, None], p, 0.0), np.where(known, kappa, 0.0)

    def moves(self) -> Iterator[tuple[tuple, tuple, tuple]]:
        """Cells before, cells after and the shapes of their pairs, by leg; short moves first."""
        diagonals = [list(_diagonals(of)) for of in self.legs]
        both = [(rear, front) for rear in diagonals[0] for front in diagonals[1]]
        both.sort(key=lambda pair: sum(abs(b.start - a.start) for a, b, _ in pair))
        for (rear_a, rear_b, rear), (front_a, front_b, front) in both:
            yield (rear_a, front_a), (rear_b, front_b), (rear, front)


def _diagonals(shape: np.ndarray) -> Iterator[tuple[slice, slice, np.ndarray]]:
    rows, columns = shape.shape
    for by in range(1 - rows, columns):
        first, past = max(0, -by), min(rows, columns - by)
        found = shape[np.arange(first, past), np.arange(first, past) + by]
        if np.any(found):
            yield slice(first, past), slice(first + by, past + by), found


def swept(
    step: Step, given: Float[np.ndarray, "m 4"], cap: float, *, ahead: bool
) -> Float[np.ndarray, "n 4"]:
    """Costs at the one end from those at the other, capped, infinite for cells that no move joins;
    ahead: from the one before to the one after."""
    here, there = step.ends[::-1] if ahead else step.ends
    found = np.full((here.alive.size, 4), cap)
    reached = np.zeros(here.alive.size, bool)
    least = np.min(given, axis=1).reshape(there.alive.shape)
    recovered = sum(term.down * sizes(term, step.ends)[0] for term in step.terms)
    for exactly in (False, True):
        for before, after, shape in step.moves():
            mine, theirs = (after, before) if ahead else (before, after)
            pairs = _worth(here, there, mine, theirs, shape, (found, least - recovered, reached))
            if not len(pairs[0]):
                continue
            (_lower if exactly else _at_corners)(step, _pairs(*pairs, ahead), found, given, ahead)
    return np.where((reached & here.alive.ravel())[:, None], found, np.inf)


def _worth(
    here: Side, there: Side, mine: tuple, theirs: tuple, shape: tuple, known: tuple
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pairs of cells by which anything may be lowered, and their shapes [2, n]."""
    found, least, reached = known
    ok = here.alive[mine] & there.alive[theirs]
    ok &= (shape[0] != NONE)[:, None] & (shape[1] != NONE)
    reached.reshape(here.alive.shape)[mine] |= ok
    most = np.max(found, axis=1).reshape(here.alive.shape)[mine]
    rows, columns = np.nonzero(ok & (most > least[theirs]))
    at, of = (
        (rows + part[0].start) * side.alive.shape[1] + columns + part[1].start
        for side, part in ((here, mine), (there, theirs))
    )
    return at, of, np.stack([shape[0][rows], shape[1][columns]])


def _pairs(at: np.ndarray, of: np.ndarray, shape: np.ndarray, ahead: bool) -> Pairs:
    a, b = (of, at) if ahead else (at, of)
    none = np.zeros((len(a), 16), bool)
    for leg in (0, 1):
        none |= (shape[leg] == AHEAD)[:, None] & UP[leg]
        none |= (shape[leg] == BACK)[:, None] & DOWN[leg]
    cut = (shape == AHEAD) | (shape == BACK)
    return Pairs(a, b, none.reshape(-1, 4, 4).transpose(0, 2, 1), cut)


def _turned(of: np.ndarray, ahead: bool) -> np.ndarray:
    """Corners of this end first."""
    return of.transpose(0, 2, 1) if ahead else of


def _at_corners(
    step: Step, pairs: Pairs, found: np.ndarray, given: np.ndarray, ahead: bool
) -> None:
    """The best of the corners' own moves."""
    total = np.zeros(pairs.none.shape)
    for term in step.terms:
        total += term.cost(step.products(term, pairs)[0], step.dx)
    at, of = (pairs.b, pairs.a) if ahead else (pairs.a, pairs.b)
    total = _turned(np.where(pairs.none, np.inf, total), ahead) + given[of][:, None, :]
    found[at] = np.minimum(found[at], np.min(total, axis=2))


def _lower(step: Step, pairs: Pairs, found: np.ndarray, given: np.ndarray, ahead: bool) -> None:
    """Lowered by what these pairs leave missing."""
    at, of = (pairs.b, pairs.a) if ahead else (pairs.a, pairs.b)
    left = given[of][:, None, :] - found[at][:, :, None]
    left = np.where(_turned(pairs.none, ahead), np.inf, left).reshape(-1, 16)
    parts, size = [], np.max(np.abs(left), where=np.isfinite(left), initial=0.0)
    for term in step.terms:
        p, kappa = step.products(term, pairs)
        parts.append((term, _turned(p, ahead).reshape(-1, 16), kappa[:, None]))
        size = max(size, float(np.max(term.cost(np.abs(p), step.dx))))
    total = left + best_charges(parts, left, step.dx)
    short = np.min(total.reshape(-1, 4, 4), axis=2) - UNITS * np.finfo(float).eps * size
    found[at] += np.minimum(short, 0.0)


def best_charges(
    parts: list[tuple[Term, np.ndarray, np.ndarray]], left: np.ndarray, dx: float
) -> np.ndarray:
    """Charges of the slopes [n, 16] that about maximise the least of left + charges.

    parts: terms with p [n, 16] and kappa [n, 1]. One slope after the other; any are a bound.
    """
    slopes = [np.where(np.mean(p, axis=1) > 0, term.up, term.down) if term.Y is not None
              else np.mean(p, axis=1) for term, p, _ in parts]  # fmt: skip
    charges = [term.below(s[:, None], p, kappa, dx)[0]
               for (term, p, kappa), s in zip(parts, slopes, strict=True)]  # fmt: skip
    for _ in range(1 if len(parts) == 1 else 2):
        for number, (term, p, kappa) in enumerate(parts):
            others = left + sum(of for n, of in enumerate(charges) if n != number)
            s = _best_slope(term, p, kappa, others, dx)
            charges[number] = term.below(s[:, None], p, kappa, dx)[0]
    return np.sum(charges, axis=0)


def _best_slope(
    term: Term, p: np.ndarray, kappa: np.ndarray, left: np.ndarray, dx: float
) -> np.ndarray:
    """Maximise a concave function, the least of 16, by the intersection of its end tangents."""
    rows = np.arange(len(p))

    def at(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, by = term.below(s[:, None], p, kappa, dx)
        value = value + left
        which = np.argmin(value, axis=1)
        return value[rows, which], np.broadcast_to(by, p.shape)[rows, which]

    low, high = term.slopes(p)
    (f, df), (g, dg) = at(low), at(high)
    best, most = np.where(g > f, high, low), np.maximum(f, g)
    for _ in range(TURNS):
        inside = (df > 0) & (dg < 0)
        if not np.any(inside):
            break
        fall = np.where(inside, df - dg, 1.0)
        s = np.where(inside, np.clip((g - f + df * low - dg * high) / fall, low, high), best)
        h, dh = at(s)
        best, most = np.where(h > most, s, best), np.maximum(h, most)
        left_of, right_of = inside & (dh > 0), inside & (dh <= 0)
        low, f, df = (np.where(left_of, new, old) for new, old in ((s, low), (h, f), (dh, df)))
        high, g, dg = (np.where(right_of, new, old) for new, old in ((s, high), (h, g), (dh, dg)))
    return best


BESIDE = 4
"""Waypoints on either side of those that are halved, so that the rate is known there."""
LEFT = 0.1
"""Share of the loss that the other waypoints may have."""
NEAR = 0.25
"""Worst stations: of the range of the best drive's stations, how near to the bound they count."""


def place(axes: tuple[Axis, Axis], angles: Float[np.ndarray, "2"]) -> tuple[list[int], np.ndarray]:
    """The cell of a posture, and its corners' weights: (0, 0), (0, 1), (1, 0), (1, 1)."""
    cell, shares = [], []
    for axis, angle in zip(axes, angles, strict=True):
        at = int(np.clip(np.searchsorted(axis, angle) - 1, 0, len(axis) - 2))
        cell.append(at)
        shares.append(np.clip((angle - axis[at]) / (axis[at + 1] - axis[at]), 0.0, 1.0))
    (i, j) = shares
    return cell, np.array([(1 - i) * (1 - j), (1 - i) * j, i * (1 - j), i * j])


def lossy(left: Float[np.ndarray, "K"], go: Float[np.ndarray, "K"]) -> Bool[np.ndarray, "K"]:
    """Waypoints at which a sum loses. left: cost to go by the bound; go: by the best drive."""
    loss = np.maximum(-np.diff(np.asarray(go) - np.asarray(left)), 0.0)
    worth = np.zeros(len(left), bool)
    order = np.argsort(-loss)
    missing = np.sum(loss) - np.cumsum(loss[order])
    most = order[: 1 + int(np.searchsorted(-missing, -LEFT * np.sum(loss)))]
    worth[most] = worth[most + 1] = True
    return binary_dilation(worth, iterations=BESIDE)


def bottleneck(costs: Float[np.ndarray, "K"], bound: float) -> Bool[np.ndarray, "K"]:
    """Waypoints at which a worst station loses. costs: of the best drive, by the bound."""
    worth = costs >= min(bound, np.max(costs)) - NEAR * np.ptp(costs)
    return binary_dilation(worth, iterations=BESIDE)


CAP = 0.05
"""Margin above the best known cost up to which costs to go are kept."""


class Sums:
    """The bound of a sum over steps at one level after the other."""

    def __init__(self, problem: PostureProblem, x: np.ndarray | None):
        self.problem = problem
        self.x = np.zeros(0) if x is None else np.asarray(x, float)
        """The best drive known; none, and nothing is asked of it: see `least`."""
        self.terms = terms_of(problem.posture.criterion)
        self.recovers = any(term.down for term in self.terms)
        names = {name for term in self.terms for name in (term.X, term.Y) if name}
        self.fields = tuple(sorted(names - {"rear", "front"}))

    def bound(
        self, cells: list[StationCells], least: float, enough: float, tick: Callable[[], None]
    ) -> tuple[float, list[StationCells], np.ndarray]:
        """No drive through these cells costs less than the first; the second: those that a drive of
        `least` or less may pass; the third: at which waypoints they are worth halving. enough: a
        bound with which that is not asked for. tick: called once or twice for each waypoint."""
        every = np.ones(len(cells), bool)
        dead = [replace(of, alive=np.zeros_like(of.alive)) for of in cells]
        if not all(np.any(of.alive) for of in cells):
            return np.inf, dead, every
        sides = [Side.of(one, self.terms) for one in cells]
        if self.recovers and any(np.any(side.alive.ravel() & ~side.known) for side in sides):
            return -np.inf, cells, every  # nothing is known of what is recovered there
        given, pairs = (self.problem, self.terms), enumerate(pairwise(sides))
        steps = [Step.of(*given, k, a, b) for k, (a, b) in pairs]
        cap = self._cap(steps, least)
        to_go = [_free(sides[-1])]
        for step in steps[::-1]:
            to_go.append(swept(step, to_go[-1], cap, ahead=False))
            tick()
        bound = float(np.min(to_go[-1]))
        if not np.isfinite(bound):
            return np.inf, dead, every
        if not np.isfinite(least) or bound >= enough:
            return bound, cells, every
        passed, arrived = [], _free(sides[0])
        for k, (of, side, left) in enumerate(zip(cells, sides, to_go[::-1], strict=True)):
            if k:
                arrived = swept(steps[k - 1], arrived, cap, ahead=True)
                tick()
            through = np.min(arrived + left, axis=1).reshape(side.alive.shape)
            alive = np.zeros_like(of.alive)
            alive[side.box] = side.alive & (through <= least)
            passed.append(replace(of, alive=alive))
        return bound, passed, self._worth(sides, to_go[::-1], least)

    def _worth(self, sides: list[Side], to_go: list[np.ndarray], least: float) -> np.ndarray:
        """Waypoints at which the best known drive shows that costs to go are too low."""
        angles = self.x.reshape(-1, 2)
        left = []
        for side, values, at in zip(sides, to_go, angles, strict=True):
            cell, weights = place((side.rear, side.front), at)
            left.append(values[np.ravel_multi_index(cell, side.alive.shape)] @ weights)
        cost = _step_costs(self.problem.posture.criterion, self.problem.stations(self.x))
        paid = np.cumsum([0.0, *cost])
        left = np.minimum(np.nan_to_num(left, nan=0.0, posinf=least), least)
        return lossy(left, paid[-1] - paid)

    def _cap(self, steps: list[Step], least: float) -> float:
        size = 0.0
        for step in steps:
            for term in step.terms:
                size += float(term.cost(np.asarray(sizes(term, step.ends)[0]), step.dx))
        if not np.isfinite(least) or self.recovers:
            return 1.0 + 2 * size
        return least + CAP * least + 1e-6 * size


@float64_program
def _step_costs(criterion: Criterion, at: Station) -> Float[Array, "K-1"]:
    """Cost of each step of a drive."""
    return step_cost(criterion, *steps(at))


def _free(side: Side) -> np.ndarray:
    """Nothing is left to pay, or was."""
    return np.where(side.alive.ravel()[:, None], np.zeros((1, 4)), np.inf)
