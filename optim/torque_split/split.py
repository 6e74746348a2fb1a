"""The best split of torque between the axles of a UGV in a fixed posture, with a proof.

With a motor at each wheel, equilibrium is three linear equations in four ground forces, which
leaves one number free: F_front - F_rear (`ground_forces(..., difference)`). Friction cones, normal
forces and torques M = -F r are linear in it too, so each criterion is a linear program (the squared
torque a quadratic one) in cvxpy, built once and solved again at every posture.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_choice, require_kind, shown
from stickslip.dynamics.ugv import Equilibrium, Forces, Pose, UGVParams
from stickslip.optim.options import as_floats, require_scalar
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus
from stickslip.optim.torque_split.demand import least_demand
from stickslip.optim.torque_split.family import LIMITS, Family, SplitData
from stickslip.optim.torque_split.program import (
    ENDLESS,
    SplitProgram,
    SplitSolution,
    ends,
    nearest_equal,
)

if TYPE_CHECKING:
    from jaxtyping import Float

TOLERANCE = 1e-6
"""Gap between value and bound that counts as proved, relative to |value| or, where that is less, to
the unit of the computation (weight, or weight times wheel radius)."""


class Kind(NamedTuple):
    """Composition of a criterion. outer, terms: see SplitProgram. torques: the power of
    weight times wheel radius that its unit holds; forces: that of weight alone."""

    unit: str
    outer: str
    terms: int
    torques: int
    forces: int


SPLIT_CRITERIA = {
    "friction_demand": Kind("-", "max", 4, 0, 0),
    "grip": Kind("N", "max", 4, 0, 1),
    "peak_torque": Kind("N m", "max", 4, 1, 0),
    "squared_torque": Kind("N^2 m^2", "square", 2, 2, 0),
    "positive_power": Kind("J or W", "positive", 2, 1, 0),
    "normal_force": Kind("N", "max", 2, 0, 1),
}
"""Objectives, all minimised: the largest |F| / N; minus the least margin mu N - |F|; the
largest |M|; the sum of M^2; the sum over wheels of max(0, M turn); minus the least N."""


@dataclass(frozen=True)
class Split:
    """The outcome for one posture.

    forces [N]; torques [2], rear and front [N m], anticlockwise positive (driving forwards is
    negative); difference: F_front - F_rear [N]. value and lower_bound in the criterion's unit, the
    bound being by duality for all splits of this posture (None: not proved). residuals: the worst
    violation of each limit [N, N m], 0 where it holds. status: OPTIMAL only with a bound that meets
    the value; INFEASIBLE says in `message` which limits are to blame, and the numbers beside it are
    those of the split at which these are violated alike, or of the least friction demand. FAILED
    where the value falls without end (wheels in a hollow pressed against each other, the motors
    without limit): the numbers are then those of a split, not of a best one.
    """

    forces: Forces
    torques: Float[np.ndarray, "2"]
    difference: float
    value: float
    lower_bound: float | None
    feasible: bool
    status: OptimStatus
    residuals: dict[str, float]
    seconds: float
    message: str


class TorqueSplit:
    """Finds splits for one criterion of SPLIT_CRITERIA.

    min_normal: least normal force [N]. max_torque: of each motor [N m], None for no limit.
    """

    def __init__(
        self,
        criterion: str = "friction_demand",
        *,
        min_normal: float = 0.0,
        max_torque: float | None = None,
    ):
        require_choice("criterion", criterion, tuple(SPLIT_CRITERIA))
        require_scalar("min_normal", min_normal, low=0.0, accepted="a finite force >= 0 [N]")
        if max_torque is not None:
            accepted = "None, or a finite torque >= 0 [N m]"
            require_scalar("max_torque", max_torque, low=0.0, accepted=accepted)
        self.criterion, self.kind = criterion, SPLIT_CRITERIA[criterion]
        self.min_normal, self.max_torque = min_normal, max_torque
        self.program = SplitProgram(self.kind.outer, self.kind.terms, len(LIMITS))

    def solve(
        self,
        params: UGVParams,
        posture: Pose | Equilibrium | Family,
        friction: float | None = 0.8,
        turns: tuple[float, float] | None = None,
    ) -> Split:
        """The best split in one posture.

        friction: mu [-], None for no limit. turns: how far the rear and the front wheel turn
        relative to their legs, or how fast, for "positive_power" alone [rad or rad/s,
        anticlockwise positive]: the value is then work [J] or power [W]. "friction_demand" is
        minimised whatever the friction is, and infeasible where more than that is needed.
        """
        began = time.perf_counter()
        require_kind("params", params, UGVParams, "a UGVParams")
        self._check(friction, turns)
        family = Family.of(params, posture)
        if family.equal.shape != (4,) or not np.all(np.isfinite(family)):
            raise ValueError(
                f"forces {family.equal} of shape {family.equal.shape} are not accepted; accepted: "
                "one posture, with finite forces (`along` takes a row of postures)"
            )
        weight, unit = float(params.weight), float(params.weight * params.wheel_radius)
        most = None if self.max_torque is None else self.max_torque / unit
        least = self.min_normal / weight
        setting = SplitData(family, weight, friction, turns, least, most)
        if self.criterion == "friction_demand":
            outcome = least_demand(self.program, setting)
        else:
            outcome = self.program.solve(setting.terms(self.criterion), setting.limits())
        return self._split(setting, float(params.wheel_radius), outcome, began)

    def along(
        self,
        params: UGVParams,
        postures: Pose | Equilibrium | Family,
        friction: float | None = 0.8,
        turns: Float[np.ndarray, "K 2"] | None = None,
        *,
        progress: bool = False,
    ) -> list[Split]:
        """The best split at each of K postures (arrays of shape [K]); progress: show a bar."""
        require_kind("params", params, UGVParams, "a UGVParams")
        family = Family.of(params, postures)
        if family.equal.ndim != 2:
            raise ValueError(f"postures of shape {family.equal.shape[:-1]}; accepted: [K]")
        if turns is not None and np.shape(turns) != (len(family.equal), 2):
            raise ValueError(
                f"turns has shape {np.shape(turns)}; accepted: ({len(family.equal)}, 2)"
            )
        each = [None] * len(family.equal) if turns is None else list(turns)
        splits = []
        with Bar("torque split", len(each), "posture", progress) as bar:
            for equal, per_newton, turn in zip(*family, each, strict=True):
                splits.append(self.solve(params, Family(equal, per_newton), friction, turn))
                bar.advance()
        return splits

    def _check(self, friction, turns) -> None:
        if friction is not None:
            require_scalar("friction", friction, low=0.0, accepted="a number >= 0, or None")
        elif self.criterion == "grip":
            raise ValueError("friction = None is not accepted; accepted with 'grip': a number >= 0")
        accepted = "two numbers with 'positive_power', None with the others"
        wanted = self.criterion == "positive_power"
        if (turns is not None) != wanted or (
            wanted and as_floats("turns", turns, accepted).shape != (2,)
        ):
            raise ValueError(
                f"turns = {shown(turns)} is not accepted with {self.criterion!r}; accepted: "
                f"{accepted}"
            )

    def _split(
        self, setting: SplitData, radius: float, outcome: SplitSolution, began: float
    ) -> Split:
        """The outcome in SI units, with its residuals, a status it has earned and a message."""
        limits = setting.limits()
        unit = setting.weight ** (self.kind.forces + self.kind.torques) * radius**self.kind.torques
        status, message, d = self._judge(setting, outcome)
        difference = d * setting.weight
        forces = setting.family.at(difference)
        residuals = dict.fromkeys(LIMITS, 0.0)
        for name, excess in zip(LIMITS, limits.at(d), strict=True):
            size = setting.weight * (radius if "torque" in name else 1.0)
            residuals[name] = max(residuals[name], float(excess) * size)
        proved = np.isfinite(outcome.bound)
        return Split(
            forces=forces,
            torques=np.array([-forces.F_rear * radius, -forces.F_front * radius]),
            difference=difference,
            value=outcome.value * unit,
            lower_bound=outcome.bound * unit if proved else None,
            feasible=all(excess <= 1e-9 * setting.weight for excess in residuals.values()),
            status=status,
            residuals=residuals,
            seconds=time.perf_counter() - began,
            message=message,
        )

    def _judge(self, setting: SplitData, outcome: SplitSolution) -> tuple[OptimStatus, str, float]:
        """Status, message and the split to show [weights]."""
        low, high, i, j = ends(setting.limits(grip=self.criterion != "friction_demand"))
        if low > high:
            names = " and ".join(dict.fromkeys((LIMITS[i], LIMITS[j])))
            d = (low + high) / 2 if np.isfinite(low + high) else 0.0
            return OptimStatus.INFEASIBLE, f"no split keeps within its limits: {names}", d
        if not np.isfinite(outcome.d):
            d = nearest_equal(low, high)
            return OptimStatus.FAILED, "the solver found no split, although there is one", d
        if outcome.status is OptimStatus.FAILED and outcome.bound == -np.inf:
            return OptimStatus.FAILED, ENDLESS, outcome.d
        gap = outcome.value - outcome.bound
        if outcome.status is not OptimStatus.OPTIMAL or gap > TOLERANCE * max(
            1, abs(outcome.value)
        ):
            return OptimStatus.INACCURATE, f"gap {gap:.3g} to the bound (of 1 weight)", outcome.d
        demand, least = outcome.value, outcome.bound
        if self.criterion != "friction_demand" or setting.friction is None:
            demand = least = -np.inf
        if demand > (setting.friction or 0.0) >= least:
            text = f"a friction of {least:.9g} to {demand:.9g} is needed: too near to tell"
            return OptimStatus.INACCURATE, text, outcome.d
        if setting.friction is not None and demand > setting.friction:
            text = f"no split keeps within grip: a friction of {demand:.6g} is needed"
            return OptimStatus.INFEASIBLE, text, outcome.d
        return OptimStatus.OPTIMAL, "proved by the dual", outcome.d
