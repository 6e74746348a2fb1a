"""All splits of one posture: its ground forces, and what is asked of them, affine in one number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.ugv import Equilibrium, Forces, Pose, UGVParams, ground_forces
from stickslip.optim.problem import FEASIBLE
from stickslip.optim.torque_split.program import Affine

if TYPE_CHECKING:
    from jaxtyping import Float

LIMITS = (
    *(f"grip at the {wheel} wheel" for wheel in ("rear", "rear", "front", "front")),
    *(f"normal force of the {wheel} wheel" for wheel in ("rear", "front")),
    *(f"torque of the {wheel} motor" for wheel in ("rear", "rear", "front", "front")),
)
"""Name of each row of `SplitData.limits`; two rows for a modulus."""


class Family(NamedTuple):
    """All the ground forces that hold a posture: equal + difference * per_newton.

    equal: [..., 4], F_rear, N_rear, F_front, N_front for the same torque at each wheel [N].
    per_newton: [..., 4], what each newton of difference = F_front - F_rear adds [-].
    """

    equal: Float[np.ndarray, "... 4"]
    per_newton: Float[np.ndarray, "... 4"]

    @classmethod
    def of(cls, params: UGVParams, posture: Pose | Equilibrium | Family) -> Family:
        """Family of a pose, in the pose's precision; of an equilibrium, of its pose.

        ValueError where the body or a leg touches the ground, or the wheels overlap. What a newton
        of difference adds is taken for none where it is below rounding: on a straight slope the
        normal forces do not depend on the split.
        """
        if isinstance(posture, Family):
            return posture
        kinds = "a Pose, an Equilibrium or a Family"
        require_kind("posture", posture, (Pose, Equilibrium), kinds)
        placed = posture.pose if isinstance(posture, Equilibrium) else posture
        for what, least in (
            ("clearance", np.min(placed.clearance, initial=np.inf)),
            ("wheel_clearance", np.min(placed.wheel_clearance, initial=np.inf)),
        ):
            if least < -FEASIBLE:
                raise ValueError(f"posture with a {what} of {least:.3g} m; accepted: >= 0")
        weight = float(params.weight)
        equal, shifted = (
            np.stack([np.asarray(force) for force in ground_forces(params, placed, difference)], -1)
            for difference in (0.0, weight)
        )
        rounding = 16 * np.finfo(equal.dtype).eps
        per_newton = (shifted.astype(float) - equal) / weight
        return cls(equal.astype(float), np.where(abs(per_newton) < rounding, 0.0, per_newton))

    def at(self, difference: float) -> Forces:
        """The forces with that F_front - F_rear [N]."""
        return Forces(*(self.equal + difference * self.per_newton))


@dataclass(frozen=True)
class SplitData:
    """One posture's numbers, in units of the vehicle's weight and of weight times wheel radius.

    friction: mu, None for no limit. turns: of the wheels, for "positive_power". min_normal,
    max_torque: in those units, None for no limit.
    """

    family: Family
    weight: float
    friction: float | None
    turns: tuple[float, float] | None
    min_normal: float
    max_torque: float | None

    def forces(self) -> tuple[Affine, Affine]:
        """F and N of the rear and the front wheel, [2] each."""
        equal, per_newton = self.family.equal / self.weight, self.family.per_newton
        return Affine(equal[::2], per_newton[::2]), Affine(equal[1::2], per_newton[1::2])

    def terms(self, criterion: str, demand: float = 0.0) -> Affine:
        """The criterion's terms; of friction demand, those of |F| - demand N."""
        F, N = self.forces()
        if criterion in ("friction_demand", "grip", "peak_torque"):
            return cone(F, N, {"friction_demand": demand, "grip": self.friction}.get(criterion, 0))
        if criterion == "squared_torque":
            return F
        if criterion == "normal_force":
            return Affine(-N.alpha, -N.beta)
        turns = np.asarray(self.turns, float)
        return Affine(-F.alpha * turns, -F.beta * turns)

    def limits(self, grip: bool = True) -> Affine:
        """Limits, met where <= 0, in the order of LIMITS; rows that do not apply always hold."""
        F, N = self.forces()
        held = Affine(np.full(4, -1.0), np.zeros(4))
        grips = cone(F, N, self.friction) if grip and self.friction is not None else held
        torques = held
        if self.max_torque is not None:
            torques = cone(F, N, 0.0)
            torques = Affine(torques.alpha - self.max_torque, torques.beta)
        normals = Affine(self.min_normal - N.alpha, -N.beta)
        rows = (grips, normals, torques)
        return Affine(*(np.concatenate(part) for part in zip(*rows, strict=True)))


def cone(F: Affine, N: Affine, mu: float) -> Affine:
    """F - mu N and -F - mu N of each wheel, [4]: none positive where |F| <= mu N."""
    alpha, beta = (
        np.stack([f - mu * n, -f - mu * n], -1).ravel() for f, n in zip(F, N, strict=True)
    )
    return Affine(alpha, beta)
