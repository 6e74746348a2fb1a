"""Problems shared by the tests, and the criteria written out again in plain NumPy."""

from functools import lru_cache
from typing import Any

import numpy as np

from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.optim import PostureProblem, Result, solve

TRACK = Track.bump(height=0.25)
"""Steep enough that some postures slip on a slippery floor; Python numbers, so of no precision."""
LOW, HIGH = float(UGVParams().leg_angle_min), float(UGVParams().leg_angle_max)


@lru_cache
def over_bump(criterion: str = "wheel_energy", **fields: Any) -> PostureProblem:
    """Ten waypoints over the bump, 0.6 m apart: all share the compiled programs."""
    return PostureProblem(UGVParams(), TRACK, np.linspace(2.0, 7.4, 10), criterion, **fields)


def tiny(criterion: str = "wheel_energy", **fields: Any) -> PostureProblem:
    """Four waypoints up the bump, unevenly spaced, on a floor where some postures slip."""
    given = {"friction": 0.3, "leg_rate": 3.0, "min_clearance": 0.1} | fields
    return PostureProblem(UGVParams(), TRACK, np.array([3.3, 3.7, 4.1, 4.6]), criterion, **given)


def on_grid(problem: PostureProblem, method: str, **options: Any) -> Result:
    """What the method itself finds, without the polish that follows paths over a grid."""
    return solve(problem, method, polish=False, **options)


def random_x(problem: PostureProblem, seed: int = 0, spread: float = 0.2) -> np.ndarray:
    """Angles about straight down."""
    random = np.random.default_rng(seed)
    return np.clip(np.pi / 2 + spread * random.standard_normal(problem.n), LOW, HIGH)


def plain_cost(name: str, at: Any, mu: float) -> np.ndarray:
    """A criterion of stations [..., K], by loops over waypoints and wheels."""
    K = at.torque.shape[-1]
    if name in ("wheel_energy", "total_energy", "torque_variation"):
        return sum(_plain_step(name, at, k) for k in range(1, K))
    worst = []
    for k in range(K):
        pairs = (at.F_rear, at.N_rear), (at.F_front, at.N_front)
        wheels = [(F[..., k], N[..., k]) for F, N in pairs]
        if name == "peak_torque":
            worst.append(np.abs(at.torque[..., k]))
        elif name == "grip":
            worst += [-(mu * N - np.abs(F)) for F, N in wheels]
        elif name == "normal_force":
            worst += [-N for _, N in wheels]
        else:
            worst += [np.abs(F) / N for F, N in wheels]
    return np.max(worst, axis=0)


def _plain_step(name: str, at: Any, k: int) -> np.ndarray:
    M, before = at.torque[..., k], at.torque[..., k - 1]
    if name == "torque_variation":
        return (M - before) ** 2 / (at.x[..., k] - at.x[..., k - 1])
    work = [(M + before) / 2 * (at.turn[..., k] - at.turn[..., k - 1])]
    if name == "total_energy":
        for leg in range(2):
            move = at.leg_angles[..., k, leg] - at.leg_angles[..., k - 1, leg]
            torque = (at.leg_torques[..., k, leg] + at.leg_torques[..., k - 1, leg]) / 2
            work.append(torque * move)
    return sum(np.where(part > 0, part, 0.0) for part in work)
