"""Result of a posture problem: a drive, what it misses, and its values between its waypoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.optim.posture.criteria import Criterion, Weighted
from stickslip.optim.posture.station import Station
from stickslip.optim.problem import FEASIBLE
from stickslip.optim.result import Result

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.waypoints import PostureData


@dataclass(frozen=True)
class PostureResult(Result):
    """The outcome of `solve` for a posture problem: see Result; and of the same drive on waypoints
    `fine_spacing` [m] apart, ten times closer, the legs moving evenly from one to the next
    (`evaluate_finer`), fine_value, fine_feasible and fine_residuals: what the problem, and so every
    bound, knows nothing of.
    """

    fine_value: float = np.inf
    fine_spacing: float = np.nan
    fine_feasible: bool = False
    fine_residuals: Mapping[str, float] = field(default_factory=dict)

    @property
    def leg_angles(self) -> Float[np.ndarray, "K 2"] | None:
        """x as pairs, rear and front leg at each waypoint [rad]."""
        return None if self.x is None else self.x.reshape(-1, 2)

    @property
    def discretisation(self) -> float:
        """Relative difference of fine_value from the value; infinite where there is none.

        Where it is not small, the waypoints are too far apart.
        """
        if not (np.isfinite(self.value) and np.isfinite(self.fine_value)):
            return np.inf
        off = self.fine_value - self.value
        return off / max(abs(self.value), np.finfo(float).tiny) if off else 0.0


def violations(
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


# Stations are computed in double precision from the problem's own numbers. By other means
# (bisection, other equations, other quadrature) torques and turns differ by 1e-15 to 2e-13 of
# themselves, on ground 1 km long and 1500 m high, too; next to nothing, by roundings of the
# vehicle's weight. A bound that is called proved is lowered by more than both.
RELATIVE = 5e-13
"""Relative rounding error of the value."""
ROUNDINGS = 4 * float(np.finfo(float).eps)
"""Rounding error relative to the vehicle's weight."""
NOTHING = 1e-12
"""Difference that counts as zero, relative to the vehicle's weight."""


def closes(problem: PostureData, value: float, bound: float | None, relative: float) -> bool:
    """True if a bound leaves at most `relative` of the value open, or next to nothing of what the
    vehicle's weight would give: a value near 0 is no smaller unit."""
    if bound is None:
        return False
    return value - bound <= relative * abs(value) + NOTHING * natural(problem, problem.criterion)


def natural(problem: PostureData, criterion: Criterion | Weighted) -> float:
    """Natural scale from the vehicle's weight, in the criterion's unit."""
    if isinstance(criterion, Weighted):
        return sum(float(weight) * natural(problem, one) for one, weight in criterion.parts)
    weight, length = float(problem.params.weight), float(problem.x[-1] - problem.x[0])
    torque = weight * float(problem.params.wheel_radius)
    of = {"J": weight * length, "N m": torque, "N^2 m": torque**2 / length, "N": weight}
    return of.get(criterion.unit, 1.0)


def below(problem: PostureData, value: float, criterion: Criterion | Weighted | None = None):
    """A number that the exact value is not below, where `value` was computed."""
    return value - slack(problem, value, problem.criterion if criterion is None else criterion)


def slack(problem: PostureData, value: float, criterion: Criterion | Weighted) -> float:
    """Rounding error of a drive's computed value, in the criterion's unit."""
    if isinstance(criterion, Weighted):
        parts = ((one, float(weight)) for one, weight in criterion.parts)
        return sum(w * slack(problem, abs(value) / w, one) for one, w in parts if w > 0)
    absolute = ROUNDINGS * natural(problem, criterion)
    if criterion.unit == "N^2 m":
        # Of a sum of (dM)^2 / dx, each M being off by `torque`, by Cauchy and Schwarz.
        torque = ROUNDINGS * float(problem.params.weight) * float(problem.params.wheel_radius)
        length = float(problem.x[-1] - problem.x[0])
        least_step = float(np.min(np.diff(problem.x)))
        rest = torque * length / least_step
        absolute = (2 * np.sqrt(abs(value) * length) + rest) * torque / least_step
    elif criterion.unit == "-":
        absolute *= 1 + value * value
    return RELATIVE * abs(value) + float(absolute)
