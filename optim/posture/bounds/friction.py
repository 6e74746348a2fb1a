"""The friction coefficient that no wheel exceeds, whatever the legs do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.posture.stations.wheels import longest_wheelbase

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.stations.data import PostureData


def most_friction(problem: PostureData) -> Float[np.ndarray, "K 2"]:
    """mu of the rear and the front wheel at each waypoint, at most.

    The front wheel stands at the waypoint and the rear one within reach behind it. Of the front
    wheel, and of both where the ground has no surface of its own, it is the very mu.
    """
    mu = np.broadcast_to(np.asarray(problem.friction, float), problem.x.shape)[:, None]
    surface = problem.track.surface
    if surface is None:
        return np.repeat(mu, 2, 1)
    reach = 1.01 * (longest_wheelbase(problem.params) + 2 * float(problem.params.wheel_radius))
    behind = surface.most(problem.x - reach, problem.x)
    return mu * np.stack([behind, surface.most(problem.x, problem.x)], -1)
