"""Costs to go over cells, one step of dynamic programming: functions below those of every drive.

At each waypoint every cell A has its own function, bilinear between four numbers at its corners. It
bounds what is left to pay from any of its points if, for each cell B that a move may lead to, some
slopes s of the terms (terms.py) give at all corners that a move lies between

    V_A(a) <= sum over terms of what a slope s charges of p(a, b) - kappa + V_B(b):

both sides are interpolants there (losses.py), so it holds between, too. V begins from the best of
the corners' own moves, and is lowered for each pair of cells by what the best slopes leave missing.
Were p and V linear, nothing would be lost, wherever max(0, p) has its kink.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.posture.bounds.lattice import AHEAD, BACK, NONE, shapes
from stickslip.optim.posture.bounds.losses import kappas, roundings
from stickslip.optim.posture.bounds.sides import FOUR

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.optim.posture.bounds.sides import Side
    from stickslip.optim.posture.bounds.terms import Term
    from stickslip.optim.posture.stations.data import PostureData

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
    def of(cls, problem: PostureData, terms: list[Term], k: int, a: Side, b: Side) -> Step:
        """The step from waypoint k."""
        legs = (shapes(problem, k, a.rear, b.rear), shapes(problem, k, a.front, b.front))
        return cls(terms, (a, b), legs, float(problem.x[k + 1] - problem.x[k]))

    def back(self, after: Float[np.ndarray, "m 4"], cap: float) -> Float[np.ndarray, "n 4"]:
        """Costs to go before it, capped, infinite for cells from which no move goes on."""
        return _swept(self, after, cap, ahead=False)

    def on(self, before: Float[np.ndarray, "n 4"], cap: float) -> Float[np.ndarray, "m 4"]:
        """Costs of arriving after it, likewise."""
        return _swept(self, before, cap, ahead=True)

    def products(self, term: Term, pairs: Pairs) -> tuple[np.ndarray, np.ndarray]:
        """p at pairs of corners [n, 4, 4], 0 where nothing is known, and kappa [n]."""
        one, other = self.ends
        known = one.known[pairs.a] & other.known[pairs.b]
        X, U = one.fields[term.X].corners[pairs.a], other.fields[term.X].corners[pairs.b]
        if term.Y is None:
            p = U[:, None, :] - X[:, :, None]
        else:
            Y, V = one.fields[term.Y].corners[pairs.a], other.fields[term.Y].corners[pairs.b]
            p = (X[:, :, None] + U[:, None, :]) * (V[:, None, :] - Y[:, :, None]) / 2
        kappa = kappas(term, self.ends, (pairs.a, pairs.b), pairs.cut)
        kappa = kappa + roundings(term, self.ends)
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


def _swept(step: Step, given: np.ndarray, cap: float, *, ahead: bool) -> np.ndarray:
    """Costs at the one end from those at the other; ahead: from the one before to the one after."""
    here, there = step.ends[::-1] if ahead else step.ends
    found = np.full((here.alive.size, 4), cap)
    reached = np.zeros(here.alive.size, bool)
    least = np.min(given, axis=1).reshape(there.alive.shape)
    for exactly in (False, True):
        for before, after, shape in step.moves():
            mine, theirs = (after, before) if ahead else (before, after)
            pairs = _worth(here, there, mine, theirs, shape, (found, least, reached))
            if not len(pairs[0]):
                continue
            given_pairs = _pairs(*pairs, ahead)
            (_lower if exactly else _at_corners)(step, given_pairs, found, given, ahead)
    return np.where((reached & here.alive.ravel())[:, None], found, np.inf)


def _worth(
    here: Side, there: Side, mine: tuple, theirs: tuple, shape: tuple, known: tuple
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pairs of cells by which anything may be lowered, and their shapes [2, n]; costs are not
    below 0."""
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
    return Pairs(
        a, b, none.reshape(-1, 4, 4).transpose(0, 2, 1), (shape == AHEAD) | (shape == BACK)
    )


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
    slopes = [np.where(np.mean(p, axis=1) > 0, 1.0, 0.0) if term.Y is not None
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
