"""Postures inside a cell are never below what is proved of the cell, nor steps below their cost."""

import jax
import numpy as np
import pytest

from stickslip.optim.posture import evaluate
from stickslip.optim.posture.bounds import cells as proved
from stickslip.optim.posture.bounds.branch import NAMES, at_least
from stickslip.optim.posture.bounds.cells import Surveyor, first_axis, shapes
from stickslip.optim.posture.bounds.steps import FOUR, Side, terms_of
from stickslip.optim.posture.bounds.sweep import Pairs, Step, best_charges
from stickslip.optim.posture.criteria import CRITERIA
from tests.optim.posture.bounds.helpers import over
from tests.optim.posture.helpers import plain_cost

CELLS = 10
KINDS = ("usual", "short", "slippery")
MANY = 1 << 10


@pytest.fixture(scope="module")
def cells():
    """Of each kind: the cells of two neighbouring waypoints."""
    found = {}
    for kind in KINDS:
        problem = over(kind=kind)
        surveyor = Surveyor(problem)
        axes = [first_axis(problem, leg, CELLS) for leg in (0, 1)]
        found[kind] = [surveyor.halved(k, surveyor.first(k, *axes)) for k in (4, 5)]
    return found


def stations(problem, pairs: np.ndarray):
    """Stations of waypoints 4 and 5 at pairs of angles [n, 2, 2]."""
    whole = np.full((len(pairs), len(problem.x), 2), np.pi / 2)
    whole[:, 4:6] = pairs
    with jax.enable_x64(True):
        at = evaluate.stations(problem.posture, whole)
    return at.map(lambda of: np.asarray(of)[:, 4:6])


def sample(cells, random, inside_rate=None):
    """Pairs of angles for both waypoints, and the cells that they lie in."""
    a, b = cells
    low = np.array([a.rear[0], a.front[0]])
    high = np.array([a.rear[-1], a.front[-1]])
    first = random.uniform(low, high, (MANY, 2))
    second = random.uniform(low, high, (MANY, 2))
    if inside_rate is not None:
        second = np.clip(first + random.uniform(-1, 1, (MANY, 2)) * inside_rate, low, high)
    pairs = np.stack([first, second], 1)
    at = [
        tuple(
            np.clip(np.searchsorted(axis, pairs[:, n, leg]) - 1, 0, len(axis) - 2)
            for leg, axis in enumerate((of.rear, of.front))
        )
        for n, of in enumerate((a, b))
    ]
    return pairs, at


@pytest.mark.parametrize("kind", KINDS)
def test_fields_lie_within_what_is_proved_of_their_cells(cells, kind):
    problem, random = over(kind=kind), np.random.default_rng(0)
    pairs, where = sample(cells[kind], random)
    at = stations(problem, pairs)
    fields = {
        "torque": at.torque, "turn": at.turn, "F": at.F_rear, "N_rear": at.N_rear,
        "N_front": at.N_front, "leg_rear": at.leg_torques[..., 0],
        "leg_front": at.leg_torques[..., 1],
    }  # fmt: skip
    turns = []
    for n, of in enumerate(cells[kind]):
        known = of.alive & of.inside.known
        counts = known[where[n]]
        assert np.mean(counts) > 0.5 or kind == "slippery"
        short = at.wheel_clearance[:, n] < problem.min_wheel_clearance
        ruled_out = ~of.alive[where[n]]
        assert np.all((at.grip[:, n] < 0)[ruled_out] | short[ruled_out])  # rightly
        assert np.mean(ruled_out[short]) > 0.5 or not np.any(short)
        for name in proved.FIELDS:
            held = of.range_of(name)[where[n]]
            if name == "turn":
                held = held[counts]
                turns.append((held.middle - fields[name][counts, n], held.radius))
                continue
            value = fields[name][:, n][counts]
            assert np.all((held.lo[counts] <= value) & (value <= held.hi[counts])), name
    # Turns count from a place of their own, the same at both waypoints.
    origin = np.median(turns[0][0])
    for off, radius in turns:
        assert np.all(np.abs(off - origin) <= 2 * radius)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", NAMES)
def test_worst_stations_are_not_below_their_cells(cells, kind, name):
    problem, random = over(kind=kind), np.random.default_rng(1)
    pairs, where = sample(cells[kind], random)
    at = stations(problem, pairs)
    for n, of in enumerate(cells[kind]):
        bound = at_least(name, of)[where[n]]
        value = plain_cost(name, at.map(lambda v, n=n: v[:, n : n + 1]), problem.friction)
        assert np.all(value[of.alive[where[n]]] >= bound[of.alive[where[n]]] - 1e-9)
        assert np.max(bound[np.isfinite(bound)]) > np.median(value)  # and says something


def test_grip_is_bounded_by_the_friction_under_the_wheels():
    problem, random = over("grip", "patchy"), np.random.default_rng(1)
    surveyor = Surveyor(problem)
    axes = [first_axis(problem, leg, 20) for leg in (0, 1)]
    cells = [surveyor.halved(k, surveyor.first(k, *axes)) for k in (4, 5)]
    pairs, where = sample(cells, random)
    at = stations(problem, pairs)
    for n, of in enumerate(cells):
        alive = of.alive[where[n]]
        short = at_least("grip", of)[where[n]][alive] + at.grip[alive, n]
        assert np.max(short) <= 0
        assert np.quantile(short, 0.1) > -150  # N; -1000 by the most friction within reach


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", [one for one, of in CRITERIA.items() if of.kind == "sum"])
def test_steps_are_not_below_what_slopes_charge_at_their_corners(cells, kind, name):
    """For slopes drawn at random, and for those that are best beside random costs to go."""
    problem, random = over(name, kind), np.random.default_rng(2)
    limit = problem.leg_rate * float(problem.x[5] - problem.x[4])
    pairs, where = sample(cells[kind], random, limit)
    a, b = cells[kind]
    alive = a.alive[where[0]] & b.alive[where[1]]
    value = plain_cost(name, stations(problem, pairs), problem.friction)[alive]
    terms = terms_of(problem.criterion)
    sides = [Side.of(of, terms) for of in (a, b)]
    step = Step.of(problem, terms, 4, *sides)
    rows = [
        np.ravel_multi_index(
            tuple(at[alive] - box.start for at, box in zip(of, side.box, strict=True)),
            side.alive.shape,
        )
        for of, side in zip(where, sides, strict=True)
    ]
    kinds = np.stack([
        shapes(problem, 4, *axes)[where[0][leg], where[1][leg]][alive]
        for leg, axes in enumerate(((a.rear, b.rear), (a.front, b.front)))
    ])  # fmt: skip
    assert np.all(kinds != proved.NONE)
    assert len(np.unique(kinds)) == 3
    weights = np.ones((len(value), 4, 4))
    for leg, axes in enumerate(((a.rear, b.rear), (a.front, b.front))):
        weights *= _weights(axes, pairs[alive][:, :, leg],
                            (where[0][leg][alive], where[1][leg][alive]),
                            kinds[leg], leg)  # fmt: skip
    np.testing.assert_allclose(weights.sum((1, 2)), 1)
    taken = Pairs(*rows, weights == 0, kinds != 1)
    parts = [
        (term, p.reshape(-1, 16), kappa[:, None])
        for term in terms for p, kappa in [step.products(term, taken)]
    ]  # fmt: skip
    left = np.where(weights > 0, random.normal(0, 10, weights.shape), np.inf).reshape(-1, 16)
    drawn = []
    for term, p, kappa in parts:
        low, high = term.slopes(p)
        slope = random.uniform(low, np.maximum(high, low))[:, None]
        drawn.append(term.below(slope, p, kappa, step.dx)[0])
    for charged in (sum(drawn), best_charges(parts, left, step.dx)):
        total = np.sum(weights.reshape(-1, 16) * charged, axis=1)
        assert np.all(value >= total - 1e-9)
        assert np.max(total) > 0  # and says something
    charges = best_charges(parts, left, step.dx), sum(drawn)
    best, other = (np.min(left + of, axis=1) for of in charges)
    if len(terms) == 1:
        assert np.mean(best >= other - 1e-3 * np.abs(other)) > 0.99


def _weights(axes, angles, cells, kinds, leg):
    """What each pair of corners of a move counts in the interpolant of a leg's square or triangle:
    [n, 4, 4], the same whatever the other leg's corners are."""
    s, t = ((angles[:, n] - of[cells[n]]) / np.diff(of)[cells[n]] for n, of in enumerate(axes))
    square = np.stack([(1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t])
    ahead = np.stack([1 - s, 0 * s, s - t, t])
    back = np.stack([1 - t, t - s, 0 * s, s])
    found = np.select([kinds == proved.AHEAD, kinds == proved.BACK], [ahead, back], square)
    assert np.min(found) > -1e-6  # inside
    return np.stack([[found[2 * p[leg] + q[leg]] for q in FOUR] for p in FOUR]).transpose(2, 0, 1)
