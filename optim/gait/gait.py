"""A gait: the squared crank rate along the support phases, what is minimised of it, its result.

Between nodes b is the parabola it is, and all else the polynomial through samples. In a cell of
length h the acceleration is a + c x, b = b0 + 2 a x + c x^2, and it is passed in

    2 h / (rate + next rate) f(z),   z = sqrt|c| h / (rate + next rate)

with f(z) = artanh(z) / z where c > 0, arctan(z) / z where c < 0; z < 1 there unless b falls to 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebval, chebvander
from scipy.integrate import quad_vec

from stickslip.dynamics.checks import require_choice, require_kind, require_known, require_that
from stickslip.dynamics.pytrees import Number, read_only, settle
from stickslip.optim.gait import OBJECTIVES
from stickslip.optim.gait.profile import Grid, Profile, Profiles
from stickslip.optim.problem import Result, require_scalar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float


TIME, TORQUE, WORK = "time", "torque", "work"
"""Terms of an objective: time [s]; torque^2 over time [(N m)^2 s]; positive work [J]."""
FRICTION = "friction"
UNLOADED = 1e-3
"""Share of the weight below which the ground counts as carrying nothing."""
STRAIGHT = 1e-4
"""z below which f(z) is two terms of its series."""
ACCURATE, LEAST_SQUARE = 1e-11, 1e-300
"""Relative error of integrals over time; the least b that is divided by."""
LOOKS, CLOSER_LOOKS = 33, 17
"""Places of a cell where a largest value is looked for, and around the best of them."""
PIECES = 64
"""Pieces of a cell for integrals over the crank angle of functions with kinks (Simpson's rule)."""
TERMS_OF: dict[str, tuple[str, ...]] = {
    "time": (TIME,),
    "torque": (TORQUE,),
    "work": (WORK,),
    "energy": (WORK, TORQUE),
}
"""Terms that a name adds up, the copper loss with the last one of "energy"."""
UNITS = {"time": "s", "torque": "(N m)^2 s", "work": "J", "energy": "J", FRICTION: "-"}


@dataclass(frozen=True)
class Goal:
    """words: as it was asked for. weights: of the terms, in SI units; none for the least friction
    demand, which is a quotient and no sum."""

    words: str
    unit: str
    weights: dict[str, float]

    @property
    def is_friction(self) -> bool:
        return not self.weights

    @property
    def column_unit(self) -> str:
        """Unit of a table's column; "-" for a weighted sum."""
        return "-" if self.unit == "weighted" else self.unit

    def of(self, spent: Mapping[str, float]) -> float:
        return sum(weight * spent[term] for term, weight in self.weights.items())


def goal_of(
    objective: str | Mapping[str, float], copper_loss: float, efficiency: float = 1.0
) -> Goal:
    """The goal, or ValueError for an unknown name, a weight below 0 or none above it."""
    if isinstance(objective, str):
        require_choice("objective", objective, tuple(OBJECTIVES))
        plain = {} if objective == FRICTION else {objective: 1.0}
        weights = _weights(plain, copper_loss, efficiency)
        return Goal(objective, UNITS[objective], weights)
    accepted = f"{', '.join(OBJECTIVES)}, or a mapping of names to weights"
    require_kind("objective", objective, Mapping, accepted)
    if FRICTION in objective:
        raise ValueError(
            "objective has 'friction' in a sum, of which the best is no convex program; accepted: "
            f"{', '.join(TERMS_OF)} in a sum, and mu as a limit"
        )
    require_known(objective, tuple(TERMS_OF), "objective in a sum")
    for name, weight in objective.items():
        require_scalar(f"weight of {name}", weight, low=0.0, accepted="a finite number >= 0")
    given = {name: float(weight) for name, weight in objective.items() if weight > 0}
    weights = _weights(given, copper_loss, efficiency)
    require_that(weights, "objective", objective, "a weight above 0")
    words = " + ".join(f"{weight:g} {name}" for name, weight in given.items())
    return Goal(words, "weighted", weights)


def _weights(
    objective: Mapping[str, float], copper_loss: float, efficiency: float
) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, weight in objective.items():
        for term in TERMS_OF[name]:
            loss = {TORQUE: copper_loss, WORK: 1 / efficiency}[term] if name == "energy" else 1.0
            found[term] = found.get(term, 0.0) + weight * loss
    return {term: weight for term, weight in found.items() if weight > 0}


def _at_nodes(name: str) -> Any:
    """What `Profile` gives by that name, at a gait's nodes [n, K+1]."""
    about = getattr(Profile, name).__doc__
    return property(lambda self: getattr(self.nodes, name)(self.a, self.b), doc=about)


@dataclass(frozen=True)
class Gait:
    """Crank acceleration a [n, K+1] at the nodes of a grid, straight between them, and b = crank
    rate^2, a parabola in each cell: b[k+1] = b[k] + h (a[k] + a[k+1]).

    profiles: the robot on the grid. The acceleration jumps at exchanges of support alone, so torque
    and forces are continuous inside a step. The foot rests on the floor throughout.
    """

    profiles: Profiles
    a: Float[np.ndarray, "n K+1"]
    b: Float[np.ndarray, "n K+1"]

    def __post_init__(self):
        settle(self, a=read_only(self.a), b=read_only(self.b))

    @property
    def grid(self) -> Grid:
        return self.profiles.grid

    @property
    def nodes(self) -> Profile:
        return self.profiles.nodes

    @property
    def theta(self) -> Float[np.ndarray, "n K+1"]:
        """The nodes as crank angles of the supporting leg [rad]."""
        return self.grid.theta

    @property
    def crank_rate(self) -> Float[np.ndarray, "n K+1"]:
        """Crank rate at the nodes [rad/s]."""
        return np.sqrt(np.maximum(self.b, 0.0))

    torque = _at_nodes("torque")
    friction_force = _at_nodes("friction")
    normal_force = _at_nodes("normal")
    zmp = _at_nodes("zmp")

    @property
    def loaded(self) -> Bool[np.ndarray, "n K+1"]:
        """True at nodes where the foot carries a share UNLOADED of the weight; elsewhere friction
        use and zero-moment point are quotients of nothing."""
        return self.normal_force > UNLOADED * self.nodes.robot.weight

    @property
    def repeats(self) -> bool:
        """True if it is one step that ends as it begins."""
        begins, ends = float(self.b[0, 0]), float(self.b[-1, -1])
        return self.grid.turn == np.pi and begins > 0 and abs(ends - begins) <= 1e-9 * begins

    @cached_property
    def samples(self) -> tuple[Float[np.ndarray, "n K D+1"], Float[np.ndarray, "n K D+1"]]:
        """a and b at `grid.samples`."""
        x = self.grid.samples - self.theta[:, :-1, None]
        a = self.a[:, :-1, None]
        rise = (np.diff(self.a, axis=1) / self.grid.h)[..., None]
        b = self.b[:, :-1, None] + 2 * a * x + rise * x**2
        return read_only(a + rise * x), read_only(b)

    @cached_property
    def spent(self) -> dict[str, float]:
        """The terms of the objectives, integrated between the nodes, the time in closed form."""
        torque = Polynomials(self.profiles.samples.torque(*self.samples))
        return {
            TIME: self.duration,
            TORQUE: self._over_time(lambda at: torque(at) ** 2),
            WORK: positive(torque, self.grid.h),
        }

    @property
    def spent_on_grid(self) -> dict[str, float]:
        """The same terms as the program adds them up."""
        terms = terms_on_grid(self.grid, self.b, self.torque)
        return {name: float(value) for name, value in terms.items()}

    @cached_property
    def times(self) -> Float[np.ndarray, "n K"]:
        """Time in each cell [s], in closed form; infinite where the crank stands still in it."""
        h, rate = self.grid.h, np.sqrt(np.maximum(_rested(self.grid, self.b), 0.0))
        rates, c = rate[:, :-1] + rate[:, 1:], np.diff(self.a, axis=1) / h
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.sqrt(np.abs(c)) * h / rates
            small = z < STRAIGHT
            safe = np.where(small, 0.5, z)
            bowl = np.arctanh(np.where(c > 0, np.minimum(safe, 1.0), 0.0)) / safe
            factor = np.where(c > 0, bowl, np.arctan(safe) / safe)
            factor = np.where(small, 1 + np.sign(c) * z**2 / 3, factor)
            passed = np.where(rates > 0, 2 * h / rates * factor, np.inf)
        return read_only(np.where(lowest(self.grid, self.a, self.b) < 0, np.inf, passed))

    def _over_time(self, square: Callable[[np.ndarray], np.ndarray]) -> float:
        """The integral over time of `square` at shares [n, K, 1] of the cells.

        By adaptive quadrature in s, share = s^2 (3 - 2 s): smooth at the ends of a cell that rests
        at one of them, and refined where the crank is slow between them.
        """
        if not np.isfinite(self.duration):
            return np.inf
        h, a, b = self.grid.h, self.a, _rested(self.grid, self.b)
        c = np.diff(a, axis=1) / h

        def rates(s: float) -> np.ndarray:
            x, y = s * s * (3 - 2 * s) * h, (1 - s) ** 2 * (1 + 2 * s) * h
            from_start = b[:, :-1] + x * (2 * a[:, :-1] + c * x)
            from_end = b[:, 1:] + y * (c * y - 2 * a[:, 1:])
            rate = np.sqrt(np.maximum(from_start if s < 0.5 else from_end, LEAST_SQUARE))
            share = np.array([s * s * (3 - 2 * s)])
            return square(share)[..., 0] * h * 6 * s * (1 - s) / rate

        return float(np.sum(quad_vec(rates, 0.0, 1.0, epsabs=0.0, epsrel=ACCURATE, norm="max")[0]))

    @property
    def clock(self) -> Float[np.ndarray, "n K+1"]:
        """Time of each node from the beginning [s]; infinite once the crank has stood still."""
        within = np.cumsum(self.times, axis=1)
        begins = np.concatenate([[0.0], np.cumsum(np.sum(self.times, axis=1))[:-1]])[:, None]
        return begins + np.concatenate([np.zeros_like(begins), within], axis=1)

    @cached_property
    def duration(self) -> float:
        """Duration of all steps [s]; infinite where the crank stands still on the way."""
        return float(np.sum(self.times))

    @property
    def mean_rate(self) -> float:
        """Mean crank rate [rad/s]."""
        return float(self.grid.turn / self.duration)

    @property
    def distance(self) -> float:
        """How far the centre of mass gets [m]."""
        robot, steps, X = self.nodes.robot, self.grid.steps, self.nodes.X[-1]
        if self.grid.end is None:
            return steps * robot.step_length
        return (steps - 1) * robot.step_length + float(X[-1] - X[0]) / robot.mass

    @cached_property
    def friction_use(self) -> float:
        """Largest |friction| / normal force, at the nodes and between them [-]."""
        at = self.profiles.samples
        friction, normal = (Polynomials(of(*self.samples)) for of in (at.friction, at.normal))
        within = peak(lambda at: np.asarray(friction_uses(friction(at), normal(at))))
        return max(self.friction_at_nodes, float(np.max(within)))

    @property
    def friction_at_nodes(self) -> float:
        """The same at the nodes alone [-]."""
        return float(np.max(friction_uses(self.friction_force, self.normal_force)))

    @cached_property
    def largest_power(self) -> float:
        """Largest |torque x crank rate|, at the nodes and at the samples between them [W]."""
        b = self.samples[1]
        between = self.profiles.samples.torque(*self.samples) * np.sqrt(np.maximum(b, 0.0))
        return max(float(np.max(np.abs(between))), self.power_at_nodes)

    @property
    def power_at_nodes(self) -> float:
        """The same at the nodes alone [W]."""
        return float(np.max(np.abs(self.torque * self.crank_rate)))

    @property
    def torque_rate_on_grid(self) -> float:
        """Largest |change of the torque| over the time of a cell [N m/s]; exchanges left out."""
        return float(np.max(np.abs(torque_rates(self.grid, self.torque, self.b))))

    def cost_of_transport(self, copper_loss: float = 0.0, efficiency: float = 1.0) -> float:
        """(Work / efficiency + copper_loss x torque^2 over time) / (weight x distance) [-]."""
        robot = self.nodes.robot
        energy = self.spent[WORK] / efficiency + copper_loss * self.spent[TORQUE]
        return energy / (robot.weight * self.distance)


def terms_on_grid(
    grid: Grid, b: Float[Number, "n K+1"], torque: Float[Number, "n K+1"], xp: ModuleType = np
) -> dict[str, float | Float[Array, ""]]:
    """The objectives' terms as the program adds them up. xp: numpy, or jax.numpy where traced."""
    rate, torques = xp.sqrt(xp.maximum(b, 0.0)), xp.asarray(torque)
    with np.errstate(divide="ignore"):
        pace = grid.h / (rate[:, :-1] + rate[:, 1:])
    squares = torques[:, :-1] ** 2 + torques[:, 1:] ** 2
    return {
        TIME: xp.sum(2 * pace),
        TORQUE: xp.sum(squares * pace),
        WORK: xp.sum(xp.maximum(torques, 0.0) * grid.weights),
    }


def torque_rates(grid: Grid, torque: np.ndarray, b: np.ndarray, xp: ModuleType = np) -> np.ndarray:
    """Change of the torque [n, K+1] over the program's time of each cell [n, K]. xp: as above."""
    rate = xp.where(b > 0, xp.sqrt(xp.where(b > 0, b, 1.0)), 0.0)  # without a slope at rest
    return (torque[:, 1:] - torque[:, :-1]) * (rate[:, :-1] + rate[:, 1:]) / (2 * grid.h)


def friction_uses(
    friction: Float[Number, "..."], normal: Float[Number, "..."], xp: ModuleType = np
) -> Float[Number, "..."]:
    """|friction| / normal force; infinite where nothing presses the foot down. xp: as above."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return xp.where(normal > 0, xp.abs(friction) / normal, np.inf)


@dataclass(frozen=True)
class Certificate:
    """Certificate computed in float64 from the robot's numbers, without trust in the solver.

    value: of the gait on the grid. bound: no gait of the grid is better (infinite below: not
    proved). violation: worst one of a limit at the nodes, in the limit's unit of size. sign: the
    most negative multiplier of a limit (0: none is). complementarity: largest product of a
    multiplier and its limit's slack, over the sum of what the multipliers hold up.
    """

    value: float
    bound: float
    violation: float
    sign: float
    complementarity: float

    @property
    def gap(self) -> float:
        return self.value - self.bound


def _of_best(name: str) -> Any:
    """The attribute of that name of `GaitResult.best`."""
    return property(lambda self: getattr(self.best, name), doc=getattr(Gait, name).__doc__)


@dataclass(frozen=True)
class GaitResult(Result):
    """Result of `solve` for a gait problem: see Result; value and bound are those of the grid.

    gait: the best one of the grid, its limits kept at the nodes; between them its crank may stand
    still, and its duration is infinite then. held: a gait whose limits hold between the nodes, too,
    to 1e-8 of their size (1e-7 where the rounds of tightening end before that), as polynomials
    through samples in each cell tell; b > 0 but for rest at the walk's ends, and the mean rate, in
    closed form. held_value is its value, integrated between the nodes; None where none was found.
    every_bound: no gait whatever is better, of any acceleration that may change at any place (None:
    not proved); its integral is a quadrature, whose error is not bounded. So the best possible lies
    between every_bound and held_value, whatever the grid. certificate: of the grid's optimum.
    """

    gait: Gait | None = None
    held: Gait | None = None
    held_value: float = np.inf
    every_bound: float | None = None
    certificate: Certificate | None = None

    @property
    def discretisation(self) -> float:
        """(held_value - every_bound) / value: the gap that the grid leaves; infinite if unknown."""
        if self.every_bound is None or not np.isfinite(self.held_value):
            return np.inf
        off = self.held_value - self.every_bound
        return off / max(abs(self.value), np.finfo(float).tiny) if off else 0.0

    @property
    def best(self) -> Gait:
        """`held`, or the grid's own gait where there is none. ValueError without any."""
        found = self.gait if self.held is None else self.held
        if found is None:
            raise ValueError(f"the result has no gait ({self.message}); accepted: one with a gait")
        return found

    theta = _of_best("theta")
    crank_rate = _of_best("crank_rate")
    torque = _of_best("torque")
    mean_rate = _of_best("mean_rate")
    friction_use = _of_best("friction_use")


def lowest(grid: Grid, a: Float[np.ndarray, "n K+1"], b: Float[np.ndarray, "n K+1"]) -> np.ndarray:
    """The least b of each cell, in closed form [n, K]; 0 in one that begins or ends at rest, but
    for one in which the crank would turn back."""
    b = _rested(grid, b)
    start, slope = b[:, :-1], a[:, :-1]
    c = np.diff(a, axis=1) / grid.h
    bowl = (slope < 0) & (a[:, 1:] > 0)
    dip = start - slope**2 / np.where(bowl, c, 1.0)
    return np.where(bowl, dip, np.minimum(start, b[:, 1:]))


class Polynomials:
    """Through values at `grid.samples` [..., n, K, D+1], one in each cell."""

    def __init__(self, values: np.ndarray):
        degree = values.shape[-1] - 1
        places = np.cos(np.pi * np.arange(degree, -1, -1) / degree)
        found = values @ np.linalg.inv(chebvander(places, degree)).T
        self._coefficients = np.moveaxis(found, -1, 0)[..., None]

    def __call__(self, share: Float[np.ndarray, "... Q"]) -> np.ndarray:
        return chebval(2 * share - 1, self._coefficients, tensor=False)


def peak(function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The largest value of `function` in each cell at shares [Q] or [..., Q]: at LOOKS places, at
    CLOSER_LOOKS around the best, and at the vertex of a parabola through three."""
    share, spread = np.linspace(0.0, 1.0, LOOKS), 1 / (LOOKS - 1)
    values = function(share)
    best = np.argmax(values, axis=-1)[..., None]
    centre = np.clip(share[best], spread, 1 - spread)
    first = np.max(values, axis=-1)
    values = function(centre + spread * np.linspace(-1.0, 1.0, CLOSER_LOOKS))
    best = np.argmax(values, axis=-1)[..., None]
    inner = np.clip(best, 1, CLOSER_LOOKS - 2)
    before, at, after = (np.take_along_axis(values, inner + i, -1)[..., 0] for i in (-1, 0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        bend, tilt = 2 * at - before - after, (after - before) / 2
        top = at + tilt**2 / (2 * bend)
        within = (bend > 0) & (np.abs(tilt) <= bend) & np.isfinite(top)
    found = np.maximum(first, np.max(values, axis=-1))
    return np.maximum(found, np.where(within, top, -np.inf))


def positive(torque: Polynomials, h: Float[np.ndarray, "n K"]) -> float:
    """The integral over the crank angle of max(T, 0)."""
    values = torque(np.linspace(0.0, 1.0, 2 * PIECES + 1))
    left, middle, right = values[..., :-1:2], values[..., 1::2], values[..., 2::2]
    weight = h[..., None] / PIECES
    simpson = (left + 4 * middle + right) / 6
    found = np.where((left >= 0) & (right >= 0), simpson, 0.0)
    crosses = left * right < 0
    height = np.maximum(left, right)
    part = height**2 / (2 * np.where(crosses, np.abs(left - right), 1.0))
    return float(np.sum(np.where(crosses, part, found) * weight))


def _rested(grid: Grid, b: np.ndarray) -> np.ndarray:
    """b without rounding errors at rest."""
    b = b.copy()
    for end, _ in grid.rests:
        b[end, end] = 0.0
    return b
