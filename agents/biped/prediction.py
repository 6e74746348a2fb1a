"""Baselines that choose the torque of a control period by predicting its end.

ComputedTorque holds the horizontal momentum, so that the floor need not push, however slippery it
is; OptimalGait follows the best gait of all that do not slip.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.policy.task import same_numbers
from stickslip.agents.protocol import Memoryless, Ruled
from stickslip.dynamics.biped import BipedModel, BipedParams, BipedState, RK4Split, own_time, step
from stickslip.dynamics.biped.contact import Motion, ankle_moment, sticking
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.biped.robot_file import robot_text
from stickslip.dynamics.checks import require_kind, require_number
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.dynamics.scene import Scene
from stickslip.envs.biped.state import HOLDS, BipedEnvState, drawn_robot
from stickslip.envs.functional import POSITIVE
from stickslip.optim.progress import say_stage

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float, Int

    from stickslip.agents.protocol import Action, Obs
    from stickslip.dynamics.biped.contact import Coefficients
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.optim.gait.gait import Gait

PREDICTIONS = 3
"""Predictions of the coming period; each corrects the torque, nearly linear in the outcome."""
SMALLEST_RUN = 1e-4
"""Torques closer than this give no slope [N m]."""
RATES = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
"""Mean crank rates of the usual gaits [rad/s]."""
SHARE = {"low": 0.0, "strict": True, "high": 1.0, "accepted": "in (0, 1]"}
FOOTING = {"friction": POSITIVE, "footing": SHARE}
"""Rules of both controllers."""


def action_of(
    torque: ArrayLike, env_params: BipedEnvParams, env_state: BipedEnvState
) -> Float[Array, " 1"]:
    """The action for a torque [N m], clipped to the motor's limit, in the state's type."""
    dtype = env_state.biped.crank_rate.dtype
    share = jnp.asarray(torque, dtype) / jnp.asarray(env_params.torque_limit, dtype)
    return jnp.clip(share, -1.0, 1.0)[None]


def foot_at_rest(
    robot: BipedModel, biped: BipedState, friction: ArrayLike, footing: ArrayLike
) -> tuple[Coefficients, Motion, Motion, Float[Array, ""], Float[Array, ""]]:
    """Motion of the robot with its foot at rest, linear in the torque: coefficients, motion under
    no torque and under 1 N m, and least and greatest torque [N m] for which |f| <= friction x N and
    the zero-moment point is within `footing` of the way to heel and toe."""
    inertia, rate = robot.inertia.at(biped.phase), biped.crank_rate
    idle = sticking(robot, inertia, rate**2, jnp.zeros_like(rate))
    driven = sticking(robot, inertia, rate**2, jnp.ones_like(rate))

    def excess(motion: Motion):
        """Not positive where a motion is allowed: friction both ways, toe, heel."""
        f, N = motion.friction_force, motion.normal_force
        at = robot.inertia.moment_at(biped.phase)
        alpha, a1 = motion.crank_acceleration, motion.foot_acceleration
        moment = ankle_moment(robot, at, biped.crank_rate**2, alpha, a1)
        toe, heel = footing * robot.toe * N, footing * robot.heel * N
        cone = friction * N
        return jnp.stack([f - cone, -f - cone, moment - toe, -moment - heel])

    base = excess(idle)
    slope = excess(driven) - base
    bound = -base / jnp.where(slope == 0, 1.0, slope)
    highest = jnp.min(jnp.where(slope > 0, bound, jnp.inf))
    lowest = jnp.minimum(jnp.max(jnp.where(slope < 0, bound, -jnp.inf)), highest)
    return inertia, idle, driven, lowest, highest


def after_a_period(
    robot: BipedModel,
    biped: BipedState,
    torque: Float[Array, ""],
    period: Float[Array, ""],
    friction: ArrayLike,
) -> BipedState:
    """Predicted state after a held torque [N m], on a floor that holds a foot at rest and
    drags on a slide by this coefficient."""
    dtype = biped.crank_rate.dtype
    holds, drags = jnp.full((), HOLDS, dtype), jnp.asarray(friction, dtype)
    floor = Scene.uniform(holds, drags, outputs="state")
    return step(robot, floor, biped, torque, period, integrator=RK4Split(max_events=2))[0]


def secant(
    error: Callable[[Float[Array, ""]], Float[Array, ""]],
    guess: Float[Array, ""],
    slope: Float[Array, ""],
) -> Float[Array, ""]:
    """The torque [N m] at which `error` is 0, from a guess and the slope there."""

    def correct(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
        torque, before, run, slope = search
        now = error(torque)
        moved = jnp.abs(run) > SMALLEST_RUN
        slope = jnp.where(moved, (now - before) / jnp.where(moved, run, 1.0), slope)
        run = -now / slope
        return torque + run, now, run, slope

    search = guess, jnp.zeros_like(guess), jnp.zeros_like(guess), slope
    return jax.lax.fori_loop(0, PREDICTIONS, correct, search)[0]


class Schedule(NamedTuple):
    """Due time of the next exchange of support."""

    due: Float[Array, ""]
    """From now [control periods]."""
    steps: Int[Array, ""]
    """Exchanges when this was noted down."""


@pytree_dataclass
class ComputedTorque(Ruled):
    """Hold P(theta) x crank rate constant: in steady walking the floor need not push at all.

    With the foot at rest the friction is the change of the horizontal momentum, f = d(P w)/dt
    (MODEL 1.4). P w = c means that the centre of mass travels at constant speed: one step length s
    in the time pi / (commanded rate), hence c = m s x commanded rate / pi.

    The torque is held for a control period, so it is found by secant steps on the stepped dynamics
    of a foot at rest, such that P w is at its target at the end of the period. P has a kink at the
    exchange of support; the walk is timed such that exchanges fall on control instants.

    Far from its target P w moves by no more than |f| <= friction x N allows, and a zero-moment
    point within `footing` of the way to toe and heel. A slide is predicted with `friction` for its
    drag. friction [-]: to be set below the floor's static one. footing [-]: share of the foot, in
    (0, 1]. It reads phase, rates, masses and commanded rate of the true state, never the floor's
    friction. The default robot's motor (4 N m) can follow up to about 4 rad/s.
    """

    friction: ArrayLike = 0.04
    footing: ArrayLike = 0.8
    RULES: ClassVar = FOOTING

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> Schedule:
        """Nothing is scheduled yet: infinitely far off, so that the first step sets it."""
        return Schedule(jnp.full_like(env_state.biped.crank_rate, jnp.inf), env_state.biped.steps)

    def act(
        self, memory: Schedule, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[Schedule, Action]:
        """See Controller."""
        period = jnp.asarray(env_params.control_period, env_state.biped.crank_rate.dtype)
        robot, biped = drawn_robot(env_state.drawn, env_params), env_state.biped
        memory, cruise = _timed(memory, robot, env_state, period)
        inertia, idle, driven, *ends = foot_at_rest(robot, biped, self.friction, self.footing)
        now, force = inertia.P * biped.crank_rate, idle.friction_force
        per_torque = driven.friction_force - force
        low, high = (force + per_torque * torque for torque in ends)
        target = jnp.clip(cruise, now + period * low, now + period * high)
        guess = ((target - now) / period - force) / per_torque

        def error(torque: Float[Array, ""]) -> Float[Array, ""]:
            after = after_a_period(robot, biped, torque, period, self.friction)
            return robot.inertia.at(after.phase).P * after.crank_rate - target

        torque = secant(error, guess, period * per_torque)
        return memory, action_of(torque, env_params, env_state)


def _timed(
    memory: Schedule, robot: BipedModel, env_state: BipedEnvState, period: Float[Array, ""]
) -> tuple[Schedule, Float[Array, ""]]:
    """The schedule brought up to date, and the momentum P w to cruise at [kg m/s].

    The centre of mass's distance is measured in periods at the commanded speed. A schedule that is
    off by more than a period is dropped for the free one, which is the distance to go.
    """
    biped = env_state.biped
    stride = robot.total_mass * robot.step_length
    speed = stride * env_state.drawn.mean_rate / np.pi
    per_step = stride / (speed * period)
    end = robot.inertia.moment_at(jnp.full_like(biped.phase, SUPPORT_END)).X
    to_go = (end - robot.inertia.moment_at(biped.phase).X) / (speed * period)
    exchanged = (biped.steps - memory.steps).astype(to_go.dtype)
    due = memory.due - 1 + per_step * exchanged
    passing = to_go < 0.5  # the exchange falls on this instant, give or take: look at the next one
    to_go = to_go + jnp.where(passing, per_step, 0.0)
    next_due = due + jnp.where(passing, per_step, 0.0)
    on_time = jnp.abs(to_go - next_due) < 1.0
    next_due = jnp.where(on_time, next_due, to_go)
    due = next_due - jnp.where(passing, per_step, 0.0)
    cruise = speed * to_go / jnp.maximum(jnp.round(next_due), 1.0)
    return Schedule(due, biped.steps), cruise


class GaitTable(NamedTuple):
    """Periodic gaits of growing mean crank rate [R]: b = crank rate^2 [R, K+1] and a, the crank
    acceleration [R, K+1], at K + 1 evenly spaced crank angles of the support phase.

    Between two of them the mixture is taken: limits are convex in (a, b), so that what two gaits
    keep their mixture keeps, too; its mean rate is at least the mixture of theirs.
    """

    mean_rate: ArrayLike
    a: ArrayLike
    b: ArrayLike

    @classmethod
    def of(cls, gaits: Sequence[Gait]) -> GaitTable:
        """Table of periodic gaits. ValueError where there is none, or where grids differ."""
        rows = sorted(gaits, key=lambda gait: gait.mean_rate)
        if not rows or len({gait.a.shape for gait in rows}) > 1 or rows[0].grid.steps != 1:
            raise ValueError("gaits; accepted: one or more periodic ones, of equally many cells")
        rates = np.array([gait.mean_rate for gait in rows])
        return cls(rates, np.stack([g.a[0] for g in rows]), np.stack([g.b[0] for g in rows]))

    def target(
        self, mean_rate: Float[Array, ""], phase: Float[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """a and b at a phase, beyond the support phase those of the next step."""
        rates, a, b = (jnp.asarray(part, phase.dtype) for part in self)
        row = jnp.clip(jnp.searchsorted(rates, mean_rate) - 1, 0, max(rates.shape[0] - 2, 0))
        above = jnp.minimum(row + 1, rates.shape[0] - 1)
        gap = rates[above] - rates[row]
        share = jnp.where(gap > 0, (mean_rate - rates[row]) / jnp.where(gap > 0, gap, 1), 0)
        share = jnp.clip(share, 0.0, 1.0)
        cells = a.shape[1] - 1
        place = jnp.mod(phase - SUPPORT_START, np.pi) / np.pi * cells
        cell = jnp.clip(jnp.floor(place).astype(jnp.int32), 0, cells - 1)
        h = np.pi / cells
        x = (place - cell.astype(place.dtype)) * h

        def at(i: Array) -> tuple[Array, Array]:
            start = a[i, cell]
            rise = (a[i, cell + 1] - start) / h
            return start + rise * x, b[i, cell] + 2 * start * x + rise * x**2

        (a_slow, b_slow), (a_fast, b_fast) = at(row), at(above)
        return a_slow + share * (a_fast - a_slow), b_slow + share * (b_fast - b_slow)


@pytree_dataclass
class OptimalGait(Memoryless):
    """Follow a gait found by `stickslip.optim.GaitProblem`, from any state.

    The torque of a period is chosen by prediction, such that the crank rate at its end is the
    gait's there. Far from the gait it is kept where |f| <= friction x N and the zero-moment point
    within `footing` of the way to toe and heel.

    friction [-]: to be set below the floor's. footing [-]: share of the foot, in (0, 1]. gaits: by
    default those of least friction demand of the reference robot with a motor of 3.6 N m at 1 to 7
    rad/s; `suited_to` computes another robot's. The commanded rate picks among them, beyond their
    ends the nearest one. Masses are read from the true state, never the floor's friction.
    """

    friction: ArrayLike = 0.05
    footing: ArrayLike = 0.8
    gaits: GaitTable = field(default_factory=lambda: usual_gaits())
    RULES: ClassVar = FOOTING

    @classmethod
    def of(cls, *gaits: Gait, friction: ArrayLike = 0.05, footing: ArrayLike = 0.8) -> OptimalGait:
        """Controller that follows these periodic gaits, each at its own mean crank rate."""
        return cls(friction, footing, GaitTable.of(gaits)).validate()

    def suited_to(self, env_params: BipedEnvParams) -> OptimalGait:
        """The controller with gaits of these parameters' robot, its motor at 90 % of its limit.

        Its own one for the reference robot, and where robots are drawn. ValueError without gaits.
        """
        robot = env_params.only_robot
        if robot is None or same_numbers(robot, BipedParams.from_bars()):
            return self
        limit = 0.9 * float(np.asarray(env_params.torque_limit))
        return replace(self, gaits=_gaits_of_text(robot_text(vars(robot)), limit))

    def validate(self) -> OptimalGait:
        require_kind("gaits", self.gaits, GaitTable, "a GaitTable, as GaitTable.of makes it")
        for name, value in self.gaits._asdict().items():
            require_number(f"gaits.{name}", value, accepted="finite numbers")
        return super().validate()

    def act(
        self, memory: None, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[None, Action]:
        """See Controller."""
        dtype = env_state.biped.crank_rate.dtype
        period = jnp.asarray(env_params.control_period, dtype)
        commanded = jnp.asarray(env_state.drawn.mean_rate, dtype)
        robot, biped = drawn_robot(env_state.drawn, env_params), env_state.biped
        inertia, idle, _, low, high = foot_at_rest(robot, biped, self.friction, self.footing)
        a, _ = self.gaits.target(commanded, biped.phase)
        guess = inertia.M * (a - idle.crank_acceleration)

        def error(torque: Float[Array, ""]) -> Float[Array, ""]:
            after = after_a_period(robot, biped, torque, period, self.friction)
            _, wanted = self.gaits.target(commanded, after.phase)
            return after.crank_rate - jnp.sqrt(jnp.maximum(wanted, 0.0))

        torque = secant(error, jnp.clip(guess, low, high), period / inertia.M)
        torque = jnp.clip(torque, low, high)
        return memory, action_of(torque, env_params, env_state)


@lru_cache(maxsize=1)
def usual_gaits() -> GaitTable:
    """Those of the reference robot; computed once."""
    return gaits_of(BipedParams.from_bars(), RATES, "friction", torque_limit=3.6)


@lru_cache(maxsize=8)
def _gaits_of_text(text: str, torque_limit: float) -> GaitTable:
    """Those of the robot of a file's text, at the usual rates in its own unit of time."""
    say_stage("computing gaits of this robot for optimal-gait")
    robot = BipedParams.from_file(text)
    slower = float(own_time(BipedParams.from_bars()) / own_time(robot))
    return gaits_of(robot, [slower * one for one in RATES], torque_limit=torque_limit)


def gaits_of(
    robot: BipedParams,
    rates: Sequence[float],
    objective: str | Mapping[str, float] = "friction",
    *,
    steps: int = 64,
    **limits: Any,
) -> GaitTable:
    """The best gaits for each of the mean crank rates [rad/s] for which there is one.

    steps, limits: as of GaitProblem.periodic. ValueError where there is none for any of them.
    """
    from stickslip.optim.gait.problem import GaitProblem
    from stickslip.optim.problem import solve

    asked = {"steps": steps, **limits}
    results = [solve(GaitProblem.periodic(robot, objective, mean_rate=w, **asked)) for w in rates]
    found = [one.best for one in results if one.gait is not None and one.status.solved]
    if not found:
        why = results[-1].message if results else ""
        raise ValueError(f"no gait for any of the rates: {why}; accepted: rates that can be met")
    return GaitTable.of(found)
