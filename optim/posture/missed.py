"""Constraint violations of a drive, in their own units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.optim.problem import FEASIBLE

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.stations.data import PostureData
    from stickslip.optim.posture.stations.station import Station


def missed_by(
    problem: PostureData, angles: Float[np.ndarray, "K 2"], at: Station
) -> dict[str, float]:
    """Largest violation of each constraint, 0 where it is met: see
    PostureProblem.residuals. at: the stations [K] at these angles."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    missed: dict[str, list[Any]] = {"leg_range": [low - angles, angles - high]}
    for name, k, pair in (
        ("start_angles", 0, problem.start_angles),
        ("end_angles", -1, problem.end_angles),
    ):
        if pair is not None:
            missed[name] = [np.abs(angles[k] - pair)]
    if problem.leg_rate is not None:
        rate = np.abs(np.diff(angles, axis=0)) / np.diff(problem.x)[:, None]
        missed["leg_rate"] = [rate - problem.leg_rate]
    missed["grip"] = [problem.min_grip - at.grip]
    missed["normal"] = [problem.min_normal - at.N_rear, problem.min_normal - at.N_front]
    if problem.solver.samples:
        missed["clearance"] = [problem.min_clearance - at.clearance]
    if not problem.solver.overlap:
        missed["wheels"] = [problem.min_wheel_clearance - at.wheel_clearance]
    if problem.max_torque is not None:
        missed["torque"] = [np.abs(at.torque) - problem.max_torque]
    worst = {name: float(np.max(np.stack(of))) for name, of in missed.items()}
    worst["pose"] = float(np.sum(~np.asarray(at.placed)))
    return {name: np.inf if np.isnan(of) else max(of, 0.0) for name, of in worst.items()}


def tolerated(problem: PostureData, name: str) -> float:
    """Tolerance of a residual of that name, FEASIBLE in the scale of its constraint."""
    sizes = {"grip": problem.params.weight, "normal": problem.params.weight}
    sizes |= dict.fromkeys(("clearance", "wheels"), problem.params.leg_length)
    sizes |= {"leg_rate": problem.leg_rate}
    sizes |= {"torque": problem.params.weight * problem.params.wheel_radius}
    return FEASIBLE * float(sizes.get(name, 1.0) or 1.0)
