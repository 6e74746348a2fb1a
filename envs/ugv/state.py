"""State of an episode of UGVEnv."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.ugv.draw import UGVDrawn
from stickslip.optim.posture.station import Station

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int


class Attitude(NamedTuple):
    """Angles of the vehicle [rad]."""

    pitch: Float[Array, ""]
    slope_rear: Float[Array, ""]
    """Slope of the ground under the rear wheel."""
    slope_front: Float[Array, ""]


class StepWork(NamedTuple):
    """Work of one step of the environment [J]."""

    wheel_work: Float[Array, ""]
    """Put in by the motors, none recovered."""
    total_work: Float[Array, ""]
    """The same with the legs' actuators."""


class UGVTotals(NamedTuple):
    """Sums over the episode, or what a step adds to them."""

    reward: Float[Array, ""]
    wheel_energy: Float[Array, ""]
    """Put in by the motors, none recovered [J]."""
    total_energy: Float[Array, ""]
    """The same with the legs' actuators [J]."""


@register_pytree
@dataclass(frozen=True)
class UGVEnvState:
    """State of an episode. station, attitude: the last ones inside the model. over: it has ended.

    cost: the criterion so far; it starts at 0.
    """

    station: Station
    attitude: Attitude
    elapsed: Int[Array, ""]
    """Steps so far."""
    cost: Float[Array, ""]
    over: Bool[Array, ""]
    drawn: UGVDrawn
    totals: UGVTotals
    rests: tuple[Float[Array, ""], UGVTotals]
    """Rounding errors of cost and totals (see `compensated`)."""

    @property
    def leg_angles(self) -> Float[Array, "... 2"]:
        """Rear and front [rad]."""
        return self.station.leg_angles
