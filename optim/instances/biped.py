"""The biped's instances: gaits, torques through the simulator, feedback gains, and designs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from inspect import signature
from typing import TYPE_CHECKING, Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics import biped
from stickslip.dynamics.biped import links
from stickslip.dynamics.names import ABOVE_ZERO
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.optim.function_problem import FunctionProblem
from stickslip.optim.gait.problem import GaitProblem, in_cvxpy
from stickslip.optim.instances.instance import drawn
from stickslip.optim.problem import FEASIBLE, FreeProblem

if TYPE_CHECKING:
    import cvxpy as cp
    from jaxtyping import Array, Float, PyTree

    from stickslip.optim.gait.convex.grid_problem import GridProblem
    from stickslip.optim.problem import Vector

FINE = biped.RK4Split(substeps=2, max_events=6)
"""Of the scene "firm", on which a walk in usual steps topples a little later."""
TORQUE_LIMIT = 4.0
DT = 0.02
"""Length of one step of the simulator [s]."""
HELD = 5
"""Steps that a torque is held for."""
TORQUE_WEIGHT, SLIDE_WEIGHT, FALL_WEIGHT = 0.02, 20.0, 5.0
STATE = {"phase": np.pi / 2 + 0.4, "crank_rate": 2.0}
SCENES = {
    "grip": Scene.grip,
    "firm": lambda: Scene.named("firm"),
    "slippery": lambda: Scene.named("slippery"),
    "icy": lambda: Scene.uniform(0.03, 0.025),
    "patch": lambda: Scene.patches([0.05, 0.4], [0.5, 0.05, 0.5], [0.4, 0.04, 0.4]),
}
SECONDS = 3.0
FRICTION = (0.05, 0.3)
"""Static friction is drawn evenly in its logarithm; kinetic friction is KINETIC of it."""
KINETIC = 0.85
GAIN_RANGE, TORQUE_RANGE = (0.0, 4.0), (-2.0, 2.0)
USUAL = signature(biped.BipedParams.from_bars).parameters
LENGTHS = {name: USUAL[name].default for name in ABOVE_ZERO if name != "crank"}
"""Design variables in crank lengths, with the reference robot's values."""
MASSES = {name: USUAL[name].default for name in ("hip_mass", "foot_mass")}
NUMBERS = MASSES | {name: USUAL[name].default for name in ("crank_length", "bar_density")}
"""Numbers of a drawn robot."""
PART = 0.2
"""A design differs from the reference robot by at most this part."""
ANGLES = 64
MISMATCH = 0.05
"""Tolerance of an impact-free exchange of support [crank lengths, rad]."""
LEAST_STEP = 0.9
"""Least step, in parts of the reference robot's."""
COPPER_LOSS = 0.5
CRANK_RATE = 3.0
VALUE_ROOM, MARGIN_ROOM = 1e3, 1e2
"""Beyond these, values and margins grow by the logarithm alone: robots that walk stay far within,
and the forces of a linkage that does not close mean nothing (1e20 weights)."""


def robot(seed: int | None, dtype: Any = np.float64) -> biped.BipedParams:
    """The reference robot, or one that is drawn."""
    return biped.BipedParams.from_bars(**drawn(seed, **NUMBERS), dtype=dtype)


def gait_problem(
    objective: str,
    numbers: int,
    points: int = 1,
    mu: float | None = None,
    mean_rate: float | None = None,
    seed: int | None = None,
) -> GaitProblem | Interpolated:
    """The best periodic step of the reference robot in so many numbers, with a motor of
    TORQUE_LIMIT. points: of each cell that limits hold at. seed: of robot and limits."""
    cells, limits = numbers - 2, {"mu": mu, "mean_rate": mean_rate, "torque_limit": TORQUE_LIMIT}
    limits = drawn(seed, **{name: one for name, one in limits.items() if one is not None})
    whole = GaitProblem.periodic(robot(seed, np.float32), objective, steps=points * cells, **limits)
    return whole if points == 1 else Interpolated(fine=whole, cells=cells)


@dataclass(frozen=True, eq=False, kw_only=True)
class Interpolated(FreeProblem):
    """A periodic step with a crank acceleration at both ends of `cells` cells, straight in between.

    fine: the problem whose cells divide these evenly. Its objective and limits are those of the
    step, so that no limit is missed between the few nodes. Decision vector as GaitProblem's.
    """

    problem: ClassVar[Any] = property(lambda self: self.fine)
    fine: GaitProblem
    cells: int

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        low, high = self.fine.bounds
        return low[self.kept], high[self.kept]

    @cached_property
    def kept(self) -> np.ndarray:
        """Indices of the decision vector in that of `fine` [n]."""
        return np.r_[0, 1 : self.fine.n : self.fine.cells // self.cells]

    @cached_property
    def on_grid(self) -> GridProblem:
        """The convex program, in which accelerations are straight between those that are kept."""
        whole = np.eye(self.fine.cells + 1)
        inside = np.setdiff1d(np.arange(1, self.fine.cells), self.kept - 1)
        bend = whole[inside - 1] - 2 * whole[inside] + whole[inside + 1]
        return replace(self.fine.on_grid, straight=sp.csr_array(bend))

    @cached_property
    def matrix(self) -> Float[np.ndarray, "fine n"]:
        """Matrix from the decision vector to that of `fine`."""
        found = np.zeros((self.fine.n, self.n))
        found[0, 0] = 1.0
        for column, one in enumerate(np.eye(self.cells + 1), start=1):
            found[1:, column] = np.interp(np.arange(1, self.fine.n), self.kept[1:], one)
        return found

    def expand(self, x: Any) -> Float[np.ndarray, "... whole"]:
        return (self.batch(x) if np.ndim(x) > 1 else self.point(x)) @ self.matrix.T

    def gradient(self, x: Vector) -> Float[np.ndarray, "n"]:
        return self.fine.gradient(self.expand(x)) @ self.matrix

    def jacobian(self, x: Vector) -> Float[np.ndarray, "m n"]:
        return self.fine.jacobian(self.expand(x)) @ self.matrix

    def in_cvxpy(self) -> tuple[cp.Problem, Callable[[], Float[np.ndarray, "n"]]]:
        program, found = in_cvxpy(self.on_grid)
        return program, lambda: found()[self.kept]


@dataclass(frozen=True)
class Shooting:
    """The cost of a row of torques [n], each held for HELD steps of DT.

    crank_rate: what is wanted [rad/s]. slide_limit: how far the foot may slide in all [m], as a
    margin; None: any, at a price. integrator: over each DT, None: RK4Split(). The cost is the mean
    squared error of the crank rate in parts of what is wanted, TORQUE_WEIGHT times the mean squared
    torque in parts of the limit, SLIDE_WEIGHT for each metre slid (without a slide_limit), and
    FALL_WEIGHT times the part of the time left when a walk ends early.
    """

    crank_rate: float
    slide_limit: float | None
    integrator: biped.RK4Split | None = None

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1] and margins [0] or [1]."""
        torques = jnp.repeat(x, HELD)
        cost, slid = walk_cost(self, data, torques, len(torques) * DT)
        if self.slide_limit is None:
            return (cost + SLIDE_WEIGHT * slid)[None], jnp.zeros(0)
        return cost[None], (1 - slid / self.slide_limit)[None]


def walk_cost(
    of: Shooting | Gains, given: tuple[Any, Any, Any], torque: Any, time: float
) -> tuple[Array, Array]:
    """Cost of a walk without its slide, and the distance slid [m]; see Shooting. given: model,
    scene and first state; torque: as of `simulate`, for a time [s]."""
    integrator = of.integrator or biped.RK4Split()
    walk = biped.simulate(*given, torque, time, DT, integrator=integrator)
    going = walk.contacts.status <= Status.SLIP_ONSET
    error = walk.states.crank_rate[1:] / of.crank_rate - 1
    effort = (walk.torques / TORQUE_LIMIT) ** 2
    cost = jnp.mean(jnp.where(going, error**2 + TORQUE_WEIGHT * effort, FALL_WEIGHT))
    return cost, jnp.sum(jnp.where(going, walk.contacts.slide_distance, 0.0))


def shooting_problem(
    scene: str, numbers: int, slide_limit: float | None = None, seed: int | None = None
) -> FunctionProblem:
    """Torques of the reference robot that walks already, numbers x HELD x DT seconds; seed: of
    robot, floor, first state and box."""
    model = biped.prepare(robot(seed), fidelity="table")
    state = biped.BipedState(**drawn(seed, **STATE)).astype(np.float64)
    floor = jax.tree.map(lambda of: of * drawn(seed, floor=1.0)["floor"], SCENES[scene]())
    most = np.full(numbers, TORQUE_LIMIT)
    low, high = drawn(seed, low=-most, high=most).values()
    function = Shooting(CRANK_RATE, slide_limit, FINE if scene == "firm" else None)
    return FunctionProblem(function, (model, floor, state), low, high, forward=True)


@dataclass(frozen=True)
class Gains:
    """The mean cost of `walks` walks of SECONDS under a feedback, by `Shooting`'s measure.

    The torque is x[0] (crank_rate - rate) + x[1] and, in the angle of the support phase, harmonics
    with the coefficients x[2:] (sine and cosine in turn), within TORQUE_LIMIT. Each walk draws its
    friction, its phase and its crank rate at the beginning, up to the one wanted.
    """

    crank_rate: float
    walks: int
    integrator: biped.RK4Split | None = None

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1]; no margins."""
        keys = jax.random.split(jax.random.key(draw), self.walks)
        return jnp.mean(jax.vmap(partial(self.one, data, x))(keys))[None], jnp.zeros(0)

    def one(self, model: PyTree, x: Float[Array, "n"], key: Array) -> Array:
        low, high = np.log(FRICTION)
        of_floor, of_phase, of_rate = jax.random.uniform(key, (3,), x.dtype)
        mu = jnp.exp(low + (high - low) * of_floor)
        state = biped.BipedState(
            phase=np.pi * (0.5 + of_phase), crank_rate=self.crank_rate * of_rate
        ).astype(x.dtype)
        given, law = (model, Scene.uniform(mu, KINETIC * mu), state), partial(self.torque, x)
        cost, slid = walk_cost(self, given, law, SECONDS)
        return cost + SLIDE_WEIGHT * slid

    def torque(self, x: Float[Array, "n"], state: biped.BipedState) -> Array:
        """The feedback law [N m]."""
        turns = 2.0 * np.arange(1, (len(x) - 2) // 2 + 1)
        angle = turns * (jnp.asarray(state.phase) - np.pi / 2)
        waves = jnp.stack([jnp.sin(angle), jnp.cos(angle)], -1).ravel()
        asked = x[0] * (self.crank_rate - state.crank_rate) + x[1] + waves @ x[2:]
        return jnp.clip(asked, -TORQUE_LIMIT, TORQUE_LIMIT)


def gains_problem(
    numbers: int, crank_rate: float, walks: int, seed: int | None = None
) -> FunctionProblem:
    """2 + 2 h numbers with h harmonics; seed: of robot and box."""
    model = biped.prepare(robot(seed), fidelity="table")
    low, high = np.array([GAIN_RANGE, *[TORQUE_RANGE] * (numbers - 1)]).T
    low, high = drawn(seed, low=low, high=high).values()
    return FunctionProblem(Gains(crank_rate, walks), model, low, high, forward=True)


@dataclass(frozen=True)
class BipedDesign:
    """Design problem of a robot that walks at CRANK_RATE without slip.

    goal: "friction": the largest |F| / N, or "energy": positive work and copper loss for each metre
    [J/m]. names: of what the vector multiplies. angles: how many crank angles, None: ANGLES; both
    ends of the step are among those of "friction", which is greatest there. Margins: the linkage
    closes there; the exchange is free of impact within MISMATCH; the step is no shorter than
    LEAST_STEP of the reference; the foot presses on the ground.

    A design that misses any of them has a value, too, that is no lower for it: a step counts as
    half the reference's at least, and a foot that does not press as one that hardly does. All is
    finite; where the linkage ceases to close, forces jump.
    """

    goal: str
    names: tuple[str, ...]
    angles: int | None = None

    def __call__(self, data: PyTree, x: Float[Array, "n"], draw: Array) -> tuple[Array, Array]:
        """Value [1] and margins [2 angles + 2]."""
        angles = ANGLES if self.angles is None else self.angles
        usual = LENGTHS | MASSES
        chosen = {name: usual[name] * part for name, part in zip(self.names, x, strict=True)}
        robot = biped.BipedParams.from_bars(**chosen, dtype=np.float64)
        theta = links.SUPPORT_START + np.pi * (np.arange(angles) + 0.5) / angles
        if self.goal == "friction":
            theta = np.linspace(links.SUPPORT_START, links.SUPPORT_END, angles)
        need = jax.vmap(lambda angle: biped.inverse_dynamics(robot, angle, CRANK_RATE, 0.0))(theta)
        length, weight = biped.step_length(robot), robot.total_mass * robot.gravity
        margins = jnp.concatenate(
            [
                jax.vmap(partial(links.closing_margin, robot))(theta),
                need.normal_force / weight,
                (1 - links.exchange_mismatch(robot) / MISMATCH)[None],
                (length / (LEAST_STEP * data) - 1)[None],
            ]
        )
        if self.goal == "friction":
            pressed = jnp.maximum(need.normal_force, FEASIBLE * weight)
            value = jnp.max(jnp.abs(need.friction_force) / pressed)
        else:
            power = jnp.maximum(need.torque, 0) * CRANK_RATE + COPPER_LOSS * need.torque**2
            value = jnp.mean(power) * np.pi / CRANK_RATE / length
            value = value * jnp.where(length > data / 2, 1.0, length / (data / 2))
        return within(value, VALUE_ROOM)[None], within(margins, MARGIN_ROOM)


def within(x: Float[Array, "*any"], room: float) -> Float[Array, "*any"]:
    """x where |x| <= room; beyond, +-room (1 + log(|x| / room)): one goes on where the other ends,
    and so does its slope."""
    size = jnp.maximum(jnp.abs(x) / room, 1.0)
    return jnp.where(size > 1, jnp.sign(x) * room * (1 + jnp.log(size)), x)


def biped_design(goal: str, masses: bool = False, seed: int | None = None) -> FunctionProblem:
    """Lengths of PASIBOT's links, and masses of hip and feet, in parts of the reference robot's.
    seed: of the box, that still holds the reference."""
    names = (*LENGTHS, *(MASSES if masses else ()))
    usual = np.asarray(biped.step_length(biped.BipedParams.from_bars(dtype=np.float64)))
    ones = np.ones(len(names))
    low, high = drawn(seed, low=(1 - PART) * ones, high=(1 + PART) * ones).values()
    return FunctionProblem(BipedDesign(goal, names), usual, low, high, forward=True)
