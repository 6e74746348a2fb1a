"""Data of a posture problem, read by its checks and measures."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from stickslip.optim.posture.stations.wheels import nearer_between

if TYPE_CHECKING:
    from jaxtyping import Float


@dataclass(frozen=True)
class PostureData:
    """The fields of PostureProblem; see there."""

    params: UGVParams
    track: Track
    x: Float[np.ndarray, "K"]
    criterion: Any = "wheel_energy"
    friction: Numeric = 0.8
    leg_rate: float | None = 1.0
    min_normal: float = 0.0
    min_grip: float = 0.0
    min_clearance: float = 0.02
    max_torque: float | None = None
    start_angles: Float[np.ndarray, "2"] | None = None
    end_angles: Float[np.ndarray, "2"] | None = None
    solver: PoseSolver = field(default=PoseSolver())

    @property
    def n(self) -> int:
        """Length of the decision vector, 2K."""
        return 2 * len(self.x)

    @cached_property
    def min_wheel_clearance(self) -> float:
        """Least distance of the wheels at a waypoint, less wheel_gap [m]: so much that they stay
        apart between waypoints, too, the legs turning evenly. 0 where leg_rate is None."""
        if self.leg_rate is None:
            return 0.0
        return nearer_between(self.params, float(self.leg_rate) * float(np.max(np.diff(self.x))))
