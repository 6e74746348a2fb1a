"""The best split of torque between the axles of a UGV in a fixed posture.

With a motor at each wheel, equilibrium is three linear equations in four ground forces, which
leaves one number free: d = F_front - F_rear (`ground_forces(..., difference)`). Friction cones,
normal forces and torques M = -F r are affine in d, so each criterion is a convex function of d
between two ends (the friction demand a quasiconvex one). Its least value lies at an end, at a zero
of a term or where two terms cross; all of these are compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_choice, require_kind, shown
from stickslip.dynamics.ugv import Equilibrium, Forces, Pose, UGVParams, ground_forces
from stickslip.optim.options import as_floats, require_scalar
from stickslip.optim.problem import FEASIBLE
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Float

ROUNDINGS = 5e-13
"""Allowance of a bound, relative to the numbers that it sums."""
SHORTFALLS = (1e-9, 1e-8, 1e-7, 1e-6)
"""Relative distance of the trial bound below the least friction demand found."""
LIMITS = (
    *(f"grip at the {wheel} wheel" for wheel in ("rear", "rear", "front", "front")),
    *(f"normal force of the {wheel} wheel" for wheel in ("rear", "front")),
    *(f"torque of the {wheel} motor" for wheel in ("rear", "rear", "front", "front")),
)
"""Name of each row of `SplitData.limits`; two rows for a modulus."""
ENDLESS = (
    "no split is the best: the harder the wheels pull against each other, the less the value; "
    "accepted: a max_torque"
)


class Kind(NamedTuple):
    """Composition of a criterion: the largest of its terms, the sum of their positive parts or of
    their squares. torques, forces: the powers of weight times wheel radius, and of weight alone,
    that its unit holds."""

    unit: str
    outer: str
    torques: int
    forces: int


SPLIT_CRITERIA = {
    "friction_demand": Kind("-", "max", 0, 0),
    "grip": Kind("N", "max", 0, 1),
    "peak_torque": Kind("N m", "max", 1, 0),
    "squared_torque": Kind("N^2 m^2", "square", 2, 0),
    "positive_power": Kind("J or W", "positive", 1, 0),
    "normal_force": Kind("N", "max", 0, 1),
}
"""Objectives, all minimised: the largest |F| / N; minus the least margin mu N - |F|; the
largest |M|; the sum of M^2; the sum over wheels of max(0, M turn); minus the least N."""


class Affine(NamedTuple):
    """Numbers alpha + beta d, [m] each."""

    alpha: np.ndarray
    beta: np.ndarray

    def at(self, d: float) -> np.ndarray:
        """Their values at d, [m]."""
        return self.alpha + self.beta * d


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


@dataclass(frozen=True)
class Split:
    """The best split of one posture.

    forces [N]; torques [2], rear and front [N m], anticlockwise positive (driving forwards is
    negative); difference: F_front - F_rear [N]. value and lower_bound in the criterion's unit, the
    bound being for all splits of this posture (None: not proved). residuals: the worst violation
    of each limit [N, N m], 0 where it holds. status: INFEASIBLE says in `message` which limits are
    to blame, and the numbers beside it are those of the split at which these are violated alike, or
    of the least friction demand. FAILED where the value falls without end (wheels in a hollow
    pressed against each other, the motors without limit): the numbers are then those of a split,
    not of a best one.
    """

    forces: Forces
    torques: Float[np.ndarray, "2"]
    difference: float
    value: float
    lower_bound: float | None
    feasible: bool
    status: OptimStatus
    residuals: dict[str, float]
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
        require_kind("params", params, UGVParams, "a UGVParams")
        self._check(friction, turns)
        family = Family.of(params, posture)
        if family.equal.shape != (4,) or not np.all(np.isfinite(family)):
            raise ValueError(
                f"forces {family.equal} of shape {family.equal.shape} are not accepted; accepted: "
                "one posture, with finite forces (`along` takes a row of postures)"
            )
        weight, radius = float(params.weight), float(params.wheel_radius)
        most = None if self.max_torque is None else self.max_torque / (weight * radius)
        given = SplitData(family, weight, friction, turns, self.min_normal / weight, most)
        return self._split(given, radius)

    def along(
        self,
        params: UGVParams,
        postures: Pose | Equilibrium | Family,
        friction: float | None = 0.8,
        turns: Float[np.ndarray, "K 2"] | None = None,
    ) -> list[Split]:
        """The best split at each of K postures (arrays of shape [K])."""
        require_kind("params", params, UGVParams, "a UGVParams")
        family = Family.of(params, postures)
        if family.equal.ndim != 2:
            raise ValueError(f"postures of shape {family.equal.shape[:-1]}; accepted: [K]")
        K = len(family.equal)
        if turns is not None and np.shape(turns) != (K, 2):
            raise ValueError(f"turns has shape {np.shape(turns)}; accepted: ({K}, 2)")
        each = [None] * K if turns is None else list(turns)
        return [
            self.solve(params, Family(equal, per_newton), friction, turn)
            for equal, per_newton, turn in zip(*family, each, strict=True)
        ]

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

    def _split(self, given: SplitData, radius: float) -> Split:
        """The split in SI units, with residuals, status and message."""
        status, message, d, value, bound = self._best(given)
        unit = given.weight ** (self.kind.forces + self.kind.torques) * radius**self.kind.torques
        forces = given.family.at(d * given.weight)
        residuals = dict.fromkeys(LIMITS, 0.0)
        for name, excess in zip(LIMITS, given.limits().at(d), strict=True):
            size = given.weight * (radius if "torque" in name else 1.0)
            residuals[name] = max(residuals[name], float(excess) * size)
        return Split(
            forces=forces,
            torques=np.array([-forces.F_rear * radius, -forces.F_front * radius]),
            difference=d * given.weight,
            value=value * unit,
            lower_bound=bound * unit if np.isfinite(bound) else None,
            feasible=all(excess <= 1e-9 * given.weight for excess in residuals.values()),
            status=status,
            residuals=residuals,
            message=message,
        )

    def _best(self, given: SplitData) -> tuple[OptimStatus, str, float, float, float]:
        """Status, message, the split, its value and the bound, in weights."""
        by_demand = self.criterion == "friction_demand"
        limits = given.limits(grip=not by_demand)
        low, high, i, j = ends(limits)
        if low > high:
            names = " and ".join(dict.fromkeys((LIMITS[i], LIMITS[j])))
            d = (low + high) / 2 if np.isfinite(low + high) else 0.0
            message = f"no split keeps within its limits: {names}"
            return OptimStatus.INFEASIBLE, message, d, np.inf, -np.inf
        if by_demand:
            d, value, bound = least_demand(given, low, high)
        else:
            d, value, bound = least(self.kind.outer, given.terms(self.criterion), low, high)
        mu = given.friction
        if not np.isfinite(value):
            return OptimStatus.INFEASIBLE, "no split loads both wheels", d, value, bound
        if bound == -np.inf:
            return OptimStatus.FAILED, ENDLESS, d, value, bound
        if not by_demand or mu is None or value <= mu:
            return OptimStatus.OPTIMAL, "all places where it may lie are compared", d, value, bound
        if bound <= mu:
            message = f"a friction of {bound:.9g} to {value:.9g} is needed: too near to tell"
            return OptimStatus.INACCURATE, message, d, value, bound
        message = f"no split keeps within grip: a friction of {value:.6g} is needed"
        return OptimStatus.INFEASIBLE, message, d, value, bound


def least(outer: str, terms: Affine, low: float, high: float) -> tuple[float, float, float]:
    """Argument, least value and lower bound of outer(alpha + beta d) for d from low to high.

    A largest term that falls without end: d is some number, the bound -inf.
    """
    a, b = terms
    if outer == "max" and endless(terms, low, high):
        d = float(np.clip(0.0, low, high))
        return d, float(np.max(terms.at(d))), -np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        if outer == "square":
            places = np.array([-(a @ b) / (b @ b)])
        elif outer == "positive":
            places = -a / b
        else:
            i, j = np.array(list(combinations(range(len(a)), 2))).T
            places = (a[i] - a[j]) / (b[j] - b[i])
    places = np.clip(np.append(places[np.isfinite(places)], [0.0, low, high]), low, high)
    places = places[np.isfinite(places)]
    at = a + places[:, None] * b
    value = {
        "max": lambda: np.max(at, 1),
        "positive": lambda: np.sum(np.maximum(at, 0.0), 1),
        "square": lambda: np.sum(at**2, 1),
    }[outer]()
    best = int(np.argmin(value))
    size = np.abs(a) + np.abs(b * places[best])
    off = ROUNDINGS * float(np.sum(size**2) if outer == "square" else np.max(size) * len(a))
    bound = float(value[best]) - off
    return float(places[best]), float(value[best]), bound if outer == "max" else max(bound, 0.0)


def least_demand(given: SplitData, low: float, high: float) -> tuple[float, float, float]:
    """Argument, least value and lower bound of the larger |F| / N of both wheels.

    Either ratio falls and then rises with the split, so the least of the larger one is where a
    friction force is none, where both ratios are the same, or at an end. A t for which |F| - t N is
    above 0 at one of the wheels for every split bounds it. The bound is -inf where the ratio falls
    as long as the forces grow, the value infinite where no split loads both wheels.
    """
    F, N = given.forces()
    found = [d for d in _ratio_places(F, N, low, high) if np.min(N.at(d)) > 0]
    if not found:
        return 0.0, np.inf, -np.inf
    ratios = [float(np.max(np.abs(F.at(d)) / N.at(d))) for d in found]
    d, demand = found[int(np.argmin(ratios))], min(ratios)
    if endless(given.terms("friction_demand", demand), low, high):
        return d, demand, -np.inf
    for shortfall in SHORTFALLS:
        tried = demand * (1 - shortfall)
        if least("max", given.terms("friction_demand", tried), low, high)[2] > 0:
            return d, demand, tried
    return d, demand, 0.0


def _ratio_places(F: Affine, N: Affine, low: float, high: float) -> list[float]:
    """Candidates for the least larger ratio, from low to high, and a point between the ends."""
    finite = [end for end in (low, high) if np.isfinite(end)]
    middle = sum(finite) / max(1, len(finite))
    if len(finite) == 1:  # a weight away from the only end
        middle += 1.0 if finite[0] == low else -1.0
    (rear, front), (n_rear, n_front) = (np.stack(of, -1)[:, ::-1] for of in (F, N))
    crossings = [
        np.roots(np.polymul(rear, n_front) - sign * np.polymul(front, n_rear)) for sign in (1, -1)
    ]
    roots = np.concatenate([np.roots(rear), np.roots(front), *crossings])
    places = [0.0, middle, *finite, *np.real(roots[np.isreal(roots)])]
    return [float(d) for d in places if low <= d <= high]


def cone(F: Affine, N: Affine, mu: float) -> Affine:
    """F - mu N and -F - mu N of each wheel, [4]: none positive where |F| <= mu N."""
    alpha, beta = (
        np.stack([f - mu * n, -f - mu * n], -1).ravel() for f, n in zip(F, N, strict=True)
    )
    return Affine(alpha, beta)


def endless(terms: Affine, low: float, high: float) -> bool:
    """True if all terms fall together as d goes on for ever between the ends."""
    onwards = high == np.inf and np.all(terms.beta < 0)
    return bool(onwards or (low == -np.inf and np.all(terms.beta > 0)))


def ends(limits: Affine) -> tuple[float, float, int, int]:
    """Low and high end and the limit that sets each, -1 for none; (inf, -inf, i, i) where limit i
    alone cannot be met."""
    a, b = limits
    never = (b == 0) & (a > 0)
    if np.any(never):
        i = int(np.argmax(never))
        return np.inf, -np.inf, i, i
    at = np.divide(-a, b, out=np.zeros_like(a), where=b != 0)
    below, above = np.where(b < 0, at, -np.inf), np.where(b > 0, at, np.inf)
    i, j = int(np.argmax(below)), int(np.argmin(above))
    low, high = float(below[i]), float(above[j])
    return low, high, i if np.isfinite(low) else -1, j if np.isfinite(high) else -1
