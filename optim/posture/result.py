"""Result of a posture problem: a drive, and its values between its waypoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.result import Result

if TYPE_CHECKING:
    from jaxtyping import Float


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
