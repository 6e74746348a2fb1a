"""Default penalty of a failure: more than any drive to the end costs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.ugv import UGVParams

if TYPE_CHECKING:
    from stickslip.optim.posture.criteria import Criterion


def penalty_for(criterion: Criterion, vehicle: UGVParams, friction: Numeric, length: Numeric):
    """A penalty that makes failing cost more than any drive to the end, in the criterion's unit.

    A wheel that does not slip has |F| <= mu N, both have the same F, and the normal forces add up
    to about the weight W. So |M| < W r (mu <= 2), what the motors put in over the drive stays below
    (1 + mu) W length, a margin of grip below (1 + mu) W, a demand below 1 + mu. The legs' work in
    total_energy has no such bound: the same penalty is then ample, but not proved. Nor has the
    torque's variation: W r built up and let go once a metre stands for it.
    """
    return penalty_in(criterion.unit, vehicle, friction, length)


def penalty_in(unit: str, vehicle: UGVParams, friction: Numeric, length: Numeric):
    """`penalty_for` a criterion with this unit."""
    W, r = vehicle.weight, vehicle.wheel_radius
    bounds = {
        "J": (1 + friction) * W * length,
        "N m": W * r,
        "N^2 m": (W * r) ** 2 * length,
        "N": (1 + friction) * W,
        "-": 1 + friction,
    }
    if unit not in bounds:
        raise ValueError(
            f"failure_penalty = None with a criterion whose unit is {unit!r}; accepted: a number "
            ">= 0 in that unit"
        )
    return bounds[unit]
