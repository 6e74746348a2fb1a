"""What a posture problem is given, which all that checks or measures it looks at."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams
from stickslip.optim.posture.waypoints import longest_wheelbase

if TYPE_CHECKING:
    from jaxtyping import Float


@dataclass(frozen=True)
class PostureData:
    """The fields of PostureProblem, which says what they mean."""

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
    def most_friction(self) -> Float[np.ndarray, "K 2"]:
        """mu that the rear and the front wheel do not exceed at each waypoint, whatever the legs
        do; of the front wheel, and without a surface, the very mu."""
        mu = np.broadcast_to(np.asarray(self.friction, float), self.x.shape)[:, None]
        surface = self.track.surface
        if surface is None:
            return np.repeat(mu, 2, 1)
        reach = longest_wheelbase(self.params) + 2 * float(self.params.wheel_radius)
        behind = surface.most(self.x - 1.01 * reach, self.x)
        return mu * np.stack([behind, surface.most(self.x, self.x)], -1)
