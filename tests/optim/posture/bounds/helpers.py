"""Small problems on ground, vehicles and floors that nothing here was tuned on."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from stickslip.dynamics.ugv import Surface, Track, UGVParams
from stickslip.optim import PostureProblem
from stickslip.optim.problem import shortfall

SHORT = UGVParams(body_length=0.7, leg_length=0.28, wheel_radius=0.2, body_mass=180.0)
STRAIGHT = (np.pi / 2, np.pi / 2)
HILL = Track.bump(0.3, 4.2, 1.3)
"""Compiled once: all problems here are on bumps of some size."""
PATCHY = replace(HILL, surface=Surface.patches((3.3, 3.5), (0.8, 0.3, 0.8)))


@lru_cache
def over(criterion: str = "wheel_energy", kind: str = "usual", **fields) -> PostureProblem:
    """Nine waypoints over a bump."""
    given = {
        "usual": (UGVParams(), Track.bump(), np.linspace(3.0, 4.6, 9), {"friction": 0.8}),
        "short": (SHORT, HILL, np.linspace(3.1, 4.7, 9), {"friction": 1.1}),
        "slippery": (UGVParams(), HILL, np.linspace(3.6, 4.8, 9), {"friction": 0.22}),
        "patchy": (UGVParams(), PATCHY, np.linspace(3.6, 4.8, 9), {"friction": 1.0}),
    }[kind]
    params, track, x, more = given
    more = more | {"leg_rate": 1.2, "start_angles": STRAIGHT} | fields
    return PostureProblem(params, track, x, criterion, **more)


def drives(problem: PostureProblem, count: int, seed: int = 0) -> np.ndarray:
    """Random drives within the legs' range and rate: [count, 2K]."""
    random = np.random.default_rng(seed)
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    begin = np.full((count, 2), np.pi / 2)
    if problem.start_angles is None:
        begin = random.uniform(low, high, (count, 2))
    path = [begin]
    favour = random.uniform(-1, 1, (count, 2))  # half of them keep going one way
    for dx in np.diff(problem.x):
        way = np.where(random.random((count, 1)) < 0.5, favour, random.uniform(-1, 1, (count, 2)))
        path.append(np.clip(path[-1] + problem.leg_rate * dx * way, low, high))
    return np.stack(path, 1).reshape(count, -1)


def sample(problem: PostureProblem, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values of drives, and the sums of their violated margins."""
    value, margins = problem.evaluate_all(x)
    return value, shortfall(margins)


def better(problem: PostureProblem, x: np.ndarray, rounds: int = 25) -> np.ndarray:
    """Feasible drives, the best first, after a search by mixing and shaking them: [n, 2K]."""
    random = np.random.default_rng(1)
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    limit = problem.leg_rate * np.diff(problem.x)[:, None]
    best = np.zeros((0, x.shape[1]))
    for round_ in range(rounds):
        value, short = sample(problem, x)
        good = x[(short <= 0) & np.isfinite(value)]
        both = np.concatenate([best, good])
        best = both[np.argsort(problem.objectives(_padded(both, len(x) * 2))[: len(both)])][:200]
        if not len(best):
            return best
        a, b = best[random.integers(len(best), size=(2, len(x)))]
        share = random.uniform(0, 1.3, (len(x), 1))
        mixed = a + share * (b - a) + 0.2 * 0.85**round_ * random.standard_normal(a.shape)
        steps = mixed.reshape(len(x), -1, 2)
        path = [best[0].reshape(-1, 2)[0] + 0 * steps[:, 0]]
        if problem.start_angles is None:
            path = [np.clip(steps[:, 0], low, high)]
        for k in range(1, steps.shape[1]):
            move = np.clip(steps[:, k] - path[-1], -limit[k - 1], limit[k - 1])
            path.append(np.clip(path[-1] + move, low, high))
        x = np.stack(path, 1).reshape(len(x), -1)
    return best


def _padded(x: np.ndarray, size: int) -> np.ndarray:
    """Repeated up to a size, so that one program does for all."""
    return x[np.arange(size) % len(x)] if len(x) else x.reshape(0, x.shape[1])
