"""Grid of a gait, and the robot's inertia functions on it, in float64."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from stickslip.dynamics.biped import BipedParams, exchange_mismatch, step_length
from stickslip.dynamics.biped.inertia import inertia_and_moment
from stickslip.dynamics.biped.links import MISMATCH, SUPPORT_END, SUPPORT_START, as_batch
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.pytrees import float64_program, read_only
from stickslip.optim.problem import require_scalar

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

BLOCK = 512
"""Crank angles computed at once: one program for every number of them."""
ROBOT = "a BipedParams of one robot (carry a payload in params.payload)"
WAY = "a finite number > 0 [m], with steps_taken = None"
LEAST_END = 0.01
"""Least crank angle of a last step [rad]."""
POINTS = 4
"""Gauss-Legendre points in each cell, for bounds on every gait."""
DEGREE, SAMPLES = 6, 400
"""Least degree of the polynomials through a cell's samples, and about the samples of a step:
in cells of pi / 8 a degree of 5 has errors of 3e-3 in the inertia functions."""
CLOSER = 1.5
"""Power of a node's number that its distance from rest goes with. The first cell's time is in error
by its length to the power 1.5: above 4/3 that is of second order in the number of cells."""


@dataclass(frozen=True)
class Grid:
    """K cells in each of n support phases.

    from_rest, to_rest: the walk begins or ends with no speed. There nodes stand closer (CLOSER),
    since the crank rate grows with the root of the angle; elsewhere they are pi / K apart.
    end: crank angle past the beginning of the last step at which the walk ends [rad], None: pi.
    """

    steps: int
    cells: int
    from_rest: bool = False
    to_rest: bool = False
    end: float | None = None

    @property
    def rests(self) -> list[tuple[int, int]]:
        """Ends of the walk at rest: index in both axes, and direction of time from there."""
        return [(0, 1)] * int(self.from_rest) + [(-1, -1)] * int(self.to_rest)

    @property
    def turn(self) -> float:
        """Crank angle of the whole walk [rad]."""
        return np.pi * self.steps if self.end is None else np.pi * (self.steps - 1) + self.end

    @cached_property
    def theta(self) -> Float[np.ndarray, "n K+1"]:
        """Nodes as crank angles of the supporting leg [rad]; both ends of every phase."""
        share = np.linspace(0.0, 1.0, self.cells + 1)
        rows = np.tile(share, (self.steps, 1))
        if self.steps == 1 and self.from_rest and self.to_rest:
            near, far = share**CLOSER, (1 - share) ** CLOSER
            rows[0] = near / (near + far)
        else:
            if self.from_rest:
                rows[0] = share**CLOSER
            if self.to_rest:
                rows[-1] = 1 - (1 - share) ** CLOSER
        theta = SUPPORT_START + (SUPPORT_END - SUPPORT_START) * rows
        theta[:, 0], theta[:, -1] = SUPPORT_START, SUPPORT_END
        if self.end is not None:
            theta[-1] = SUPPORT_START + self.end * rows[-1]
        return read_only(theta)

    @cached_property
    def h(self) -> Float[np.ndarray, "n K"]:
        return read_only(np.diff(self.theta, axis=1))

    @property
    def error(self) -> float:
        """About the trapezoid rule's error, as a share of a limit's size: the mean cell squared."""
        return (np.pi / self.cells) ** 2

    @cached_property
    def weights(self) -> Float[np.ndarray, "n K+1"]:
        """Weights of the trapezoid rule over the phase [rad]."""
        ends = np.zeros((self.steps, 1))
        return read_only((np.hstack([self.h, ends]) + np.hstack([ends, self.h])) / 2)

    @cached_property
    def inside(self) -> tuple[Float[np.ndarray, "n K Q"], Float[np.ndarray, "n K Q"]]:
        """Points inside the cells, from each cell's left node [rad], and their weights [rad].

        Gauss and Legendre's; in a cell at rest at one end in the root of the distance from it, in
        which integrals over time are smooth.
        """
        x, w = np.polynomial.legendre.leggauss(POINTS)
        x, w = (x + 1) / 2, w / 2
        share = np.broadcast_to(x, (*self.h.shape, POINTS)).copy()
        weight = np.broadcast_to(w, share.shape).copy()
        if self.from_rest:
            share[0, 0], weight[0, 0] = x**2, 2 * x * w
        if self.to_rest:
            share[-1, -1], weight[-1, -1] = 1 - x[::-1] ** 2, (2 * x * w)[::-1]
        return read_only(share * self.h[..., None]), read_only(weight * self.h[..., None])

    @cached_property
    def samples(self) -> Float[np.ndarray, "n K D+1"]:
        """Chebyshev's points in each cell, ends included, for polynomials through them [rad]."""
        degree = max(DEGREE, -(-SAMPLES // self.cells))
        share = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
        found = self.theta[:, :-1, None] + share * self.h[..., None]
        found[..., -1] = self.theta[:, 1:]
        return read_only(found)


def wrapped(phase: Float[Array, ""]) -> Float[Array, ""]:
    """The crank angle of the leg that supports at a phase, which may lie beyond its end."""
    return SUPPORT_START + jnp.mod(phase - SUPPORT_START, np.pi)


def locate(
    theta: Float[Array, "n K+1"], phase: Float[Array, ""], steps: Int[Array, ""]
) -> tuple[Int[Array, ""], Int[Array, ""], Float[Array, ""]]:
    """Step, cell and crank angle of a phase; the last step goes on for ever. Beyond a phase's end,
    within a step's reach, the next step is read."""
    beyond = (phase - SUPPORT_START >= np.pi).astype(steps.dtype)
    phase = phase - np.pi * beyond.astype(phase.dtype)
    row = jnp.clip(steps + beyond, 0, theta.shape[0] - 1)
    cell = jnp.searchsorted(theta[row], phase, side="right") - 1
    return row, jnp.clip(cell, 0, theta.shape[1] - 2), phase


@dataclass(frozen=True)
class Robot:
    """Whole mass [kg], gravity [m/s^2], the foot's edges behind and before the ankle [m], step
    length [m], length of the crank [m]."""

    mass: float
    gravity: float
    heel: float
    toe: float
    step_length: float
    crank: float

    @property
    def weight(self) -> float:
        return self.mass * self.gravity


@dataclass(frozen=True)
class Profile:
    """M, P, Y, L, their slopes and X of MODEL 1.4 at crank angles theta [...], in float64.

    With the foot at rest torque and forces are affine in b = crank rate^2 and a = b'/2.
    """

    robot: Robot
    theta: Float[np.ndarray, "..."]
    M: Float[np.ndarray, "..."]
    dM: Float[np.ndarray, "..."]
    P: Float[np.ndarray, "..."]
    dP: Float[np.ndarray, "..."]
    Y: Float[np.ndarray, "..."]
    dY: Float[np.ndarray, "..."]
    L: Float[np.ndarray, "..."]
    dL: Float[np.ndarray, "..."]
    X: Float[np.ndarray, "..."]

    @property
    def fall(self) -> Float[np.ndarray, "..."]:
        """Slope of the potential energy by the crank angle, g Y [N m]."""
        return self.robot.gravity * self.Y

    def torque(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """The motor's torque [N m]."""
        return self.M * a + self.dM / 2 * b + self.fall

    def friction(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Friction force on the foot, forwards [N]."""
        return self.P * a + self.dP * b

    def normal(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Normal force on the foot [N]."""
        return self.robot.weight + self.Y * a + self.dY * b

    def zmp(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """The zero-moment point from the ankle forwards [m] (eq. 30)."""
        moment = self.L * a + self.dL * b + self.robot.gravity * self.X
        normal = self.normal(a, b)
        return np.divide(moment, normal, out=np.zeros_like(moment), where=normal > 0)

    @property
    def lift_off_rate(self) -> float:
        """The constant crank rate at which the foot first leaves the ground [rad/s]."""
        return float(np.sqrt(self.robot.weight / np.max(np.abs(self.dY))))

    @property
    def torque_unit(self) -> float:
        """A torque of the robot's own size [N m]: its weight on a crank's length."""
        return self.robot.weight * self.robot.crank


class Rows(NamedTuple):
    """Coefficients [m, n, ...] of A a + B b <= C, with the size of one unit of each [m]."""

    names: tuple[str, ...]
    A: Float[np.ndarray, "m n ..."]
    B: Float[np.ndarray, "m n ..."]
    C: Float[np.ndarray, "m n ..."]
    size: Float[np.ndarray, "m"]

    def excess(
        self, a: Float[np.ndarray, "n ..."], b: Float[np.ndarray, "n ..."]
    ) -> Float[np.ndarray, "m n ..."]:
        """Violation of each limit, > 0, in its own unit."""
        return self.A * a + self.B * b - self.C

    def scaled_excess(
        self, a: Float[np.ndarray, "n ..."], b: Float[np.ndarray, "n ..."]
    ) -> Float[np.ndarray, "m n ..."]:
        """Violation of each limit in units of `size`."""
        return self.excess(a, b) / self.size.reshape(-1, *[1] * np.ndim(a))


@dataclass(frozen=True)
class Profiles:
    """A robot's profiles on a grid, each computed when it is first used."""

    params: BipedParams
    robot: Robot
    grid: Grid

    @cached_property
    def nodes(self) -> Profile:
        return self.at(self.grid.theta)

    @cached_property
    def inside(self) -> Profile:
        return self.at(self.grid.theta[:, :-1, None] + self.grid.inside[0])

    @cached_property
    def samples(self) -> Profile:
        return self.at(self.grid.samples)

    def at(self, theta: Float[np.ndarray, "..."]) -> Profile:
        """At any crank angles of the supporting leg, exact (`inertia_and_moment`)."""
        angles, where = np.unique(np.ravel(theta), return_inverse=True)
        blocks = -(-len(angles) // BLOCK)
        padded = np.pad(angles, (0, blocks * BLOCK - len(angles)), mode="edge")
        rows = [_numbers(self.params, block) for block in np.split(padded, blocks)]
        columns = read_only(np.concatenate(rows, axis=1)[:, where])
        if not np.all(np.isfinite(columns)):
            raise ValueError("params give inertia functions that are not finite in float64")
        return Profile(self.robot, read_only(theta), *columns.reshape(-1, *np.shape(theta)))


def robot_of(params: BipedParams, steps: int, periodic: bool) -> Robot:
    """The robot's constants; ValueError for a batch of robots, or for one that cannot hand over its
    support without an impact where it has to."""
    require_kind("params", params, BipedParams, ROBOT)
    if batch := as_batch(params)[0]:
        raise ValueError(f"params is a batch of shape {batch}; accepted: one robot")
    params.validate()
    mass, length, mismatch = map(float, _constants(params))
    if (steps > 1 or periodic) and not mismatch < MISMATCH:
        raise ValueError(
            f"this linkage breaks the exchange of support by {mismatch:.3g} (crank lengths or "
            f"rad); accepted: below {MISMATCH:.1g}, or a transfer of one step"
        )
    names = ("gravity", "heel", "toe", "crank")
    rest = {name: float(np.asarray(getattr(params, name))) for name in names}
    return Robot(mass=mass, step_length=length, **rest)


def mark_of(params: BipedParams, distance: Any) -> tuple[int, float]:
    """Steps begun, and crank angle past the last one's beginning [rad], where the centre of mass is
    a distance [m] from where it was when a step began; of a nearer mark LEAST_END."""
    require_scalar("distance", distance, low=0.0, strict=True, accepted=WAY)
    profiles = Profiles(params, robot_of(params, 1, False), Grid(1, 500))
    robot, turned, X = profiles.robot, profiles.grid.theta[0] - SUPPORT_START, profiles.nodes.X[0]
    steps = max(1, int(np.ceil(distance / robot.step_length - 1e-6)))
    ahead = CubicSpline(turned, (X - X[0]) / robot.mass)
    found = ahead.solve(distance - (steps - 1) * robot.step_length, extrapolate=False)
    return steps, max(float(found[0]), LEAST_END) if len(found) else np.pi


@float64_program
def _numbers(params: BipedParams, theta: Float[Array, " n"]) -> Float[Array, "9 n"]:
    wide = params.astype(jnp.float64)

    def at(angle: Float[Array, ""]) -> Float[Array, " 9"]:
        inertia, moment = inertia_and_moment(wide, angle)
        return jnp.stack([*inertia, moment.L, moment.dL, moment.X])

    return jax.vmap(at, out_axes=1)(theta)


@float64_program
def _constants(params: BipedParams) -> tuple[Float[Array, ""], ...]:
    wide = params.astype(jnp.float64)
    return wide.total_mass, step_length(wide), exchange_mismatch(wide)
