"""What a picture of the biped shows, as plain numbers."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stickslip.envs.rendering.biped.floor import Patch


@dataclass(frozen=True)
class BipedFrame:
    """One instant of PASIBOT's walk. Nothing is computed from it but positions.

    phase: crank angle of the supporting leg [rad]. steps: exchanges of support so far.
    floor_position: floor position of the supporting ankle [m]. slide: how far the feet have slid
    since the start, forwards positive [m]. crank_rate [rad/s]. foot_velocity: of the supporting
    foot, forwards [m/s]. time [s]. torque: of the motor on the crank [N m]. friction_force,
    normal_force: of the ground on the foot, forwards and upwards [N]. zmp: zero-moment point before
    the supporting ankle [m]. mu_static, mu_kinetic: friction under the foot [-], None where it
    cannot slip. sticking: whether the foot holds. mean_crank_rate: over the walk or the last step,
    as the caller has it; commanded_rate: what is asked for [rad/s], None if nothing is.
    status: "ok", or the name of what ended the walk. floor: what the episode walks on, and weight:
    of the robot in it [N]; None for those that the renderer was made for. walked: by the centre of
    mass since the episode's start [m]; None: the hip's way since the first step's start is shown.
    """

    phase: float
    steps: int
    floor_position: float
    slide: float
    crank_rate: float
    foot_velocity: float
    time: float
    torque: float
    friction_force: float
    normal_force: float
    zmp: float
    mu_static: float | None
    mu_kinetic: float | None
    sticking: bool
    mean_crank_rate: float
    commanded_rate: float | None
    status: str = "ok"
    floor: tuple[Patch, ...] | None = None
    weight: float | None = None
    walked: float | None = None

    def finite(self, fallback: BipedFrame | None) -> BipedFrame:
        """The same frame with each number that is not finite taken from `fallback`, or zero.

        A walk may end because a number overflowed; its last picture is drawn all the same.
        """
        holes = {
            field.name: 0.0 if fallback is None else getattr(fallback, field.name)
            for field in fields(self)
            if isinstance(value := getattr(self, field.name), float) and not isfinite(value)
        }
        return replace(self, **holes) if holes else self
