"""Replay of a gait in simulation, compared with its promised values.

Without slip the energy E = M w^2 / 2 + V changes by the motor's work alone: dE/d theta = T, exactly
and for every gait. So the reduced model, linearised about a gait, is an integrator in the energy,
and the feedback T = T* - gain (E - E*) takes a deviation away as exp(-gain x angle). V cancels at
one crank angle, so that E - E* = M (w^2 - b*) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedState, EventExact, Table, prepare, step
from stickslip.dynamics.biped.links import SUPPORT_END
from stickslip.dynamics.checks import require_integer, require_kind, require_memory
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.optim.gait.gait import Gait, friction_uses
from stickslip.optim.gait.profile import locate, wrapped
from stickslip.optim.problem import require_scalar

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.biped import BipedModel, BipedParams
    from stickslip.dynamics.biped.state import Contact
    from stickslip.optim.gait.sliding import SlidingLaw

    Law: TypeAlias = "GaitLaw | SlidingLaw"
    Walk: TypeAlias = Any
    """A Gait, or a SlipTransfer, whose module imports this one."""
    Trace: TypeAlias = tuple[BipedState, Contact, Float[Array, ""]]
    """State, contact and error of the crank rate at the end of each hold."""

NO_TIME = 1e-4
"""Part of a hold so near to the exchange of support that it counts as reached."""
SLIPPED = 1e-6
"""Slide, in step lengths, below which a foot did not slip. Where a torque jumps between instants
of the simulation it may be outside the friction cone for less than a microsecond."""
EXACT = EventExact(rtol=1e-9, atol=1e-12)
FINE = Table(64, 9)
"""Inertia functions exact to 1e-13 on the default robot."""
HOLDS, LONGEST = 4000, 2.5e-4
"""Holds of a torque in the mean time of a step, and the longest [s]: on ice a hundredth of a newton
metre is a tenth of what friction carries."""
BLOCK = 4000
"""Holds of one compiled scan; a walk takes as many blocks as it needs."""


@dataclass(frozen=True)
class Replay:
    """A gait's torque in `dynamics.biped`, event_exact, in float64.

    mu: of the floor, static and kinetic (None: the foot cannot slip). status: the gravest one met.
    slid: path of the foot over the floor [m]. steps: exchanges reached. duration [s], work
    (positive, [J]) and mean_rate [rad/s] up to the last exchange. friction_use: largest
    |friction| / normal force at the ends of holds, exchanges left out [-], infinite where the foot
    lifts off. rate_error: largest |crank rate - gait's| [rad/s] there; end_rate, end_velocity: of
    the crank and of the foot [m/s] in the end. arrived: whether all steps were done; of a gait that
    stops, whether the crank was within a hundredth of a step of its place at the time promised.
    """

    mu: float | None
    status: Status
    slid: float
    steps: int
    duration: float
    work: float
    mean_rate: float
    friction_use: float
    rate_error: float
    end_rate: float
    end_velocity: float
    arrived: bool
    step_length: float

    @property
    def kept(self) -> bool:
        """True if the walk came to its end, and slid less than a millionth of a step's length."""
        inside = self.status <= Status.SLIP_ONSET
        return inside and self.arrived and self.slid <= SLIPPED * self.step_length


def replay(
    params: BipedParams,
    gait: Walk,
    *,
    mu: float | None = None,
    mu_kinetic: float | None = None,
    feedback: float = 0.0,
    walk_steps: int | None = None,
    zmp: bool = False,
) -> Replay:
    """Walk a gait from its own beginning. See Replay.

    params: the robot that walks, the gait's own or another. mu_kinetic: None: as mu. feedback
    [1/rad]: gain on the energy; 0 is open loop, the torque over the crank angle. walk_steps: how
    far, by default the gait's own steps, of a periodic one 3. zmp: whether a zero-moment point
    outside the foot topples the robot; a gait without the limit zmp may pass the edges. ValueError
    for a gait that stands still on its way.
    """
    if mu is not None:
        require_scalar("mu", mu, low=0.0, accepted="None, or a finite number >= 0")
    elif mu_kinetic is not None:
        raise ValueError(f"mu_kinetic = {mu_kinetic} without mu; accepted: with a static friction")
    kinetic = mu if mu_kinetic is None else mu_kinetic
    require_scalar("feedback", feedback, low=0.0, accepted="a finite number >= 0 [1/rad]")
    require_kind("zmp", zmp, bool, "True or False")
    n = gait.grid.steps
    count = (3 if gait.repeats else n) if walk_steps is None else walk_steps
    inside = gait.grid.end is not None  # a step: it cannot go on
    require_integer("walk_steps", count, low=n if inside else 1, high=n if inside else 10_000)
    duration = gait.duration
    if not np.isfinite(duration):
        raise ValueError("the gait stands still on its way; accepted: one of finite duration")
    hold, whole = min(duration / n / HOLDS, LONGEST), duration * count / n
    require_memory(f"walk_steps = {count}", "holds", 1.5 * whole / hold, 400)
    with jax.enable_x64(True):
        trace = _walked(params, gait, mu, kinetic, float(feedback), count, float(hold), zmp, whole)
    return _summed(gait, trace, mu, count, whole)


@pytree_dataclass
class GaitLaw:
    """Torque over the crank angle of a gait: theta [n, K+1] rad, a rad/s^2 and b rad^2/s^2 as in
    Gait. Phase and steps are the place along the walk."""

    theta: Float[Array, "n K+1"]
    a: Float[Array, "n K+1"]
    b: Float[Array, "n K+1"]

    @classmethod
    def of(cls, gait: Gait) -> GaitLaw:
        """The law of a gait, in JAX's own precision."""
        dtype = jnp.result_type(float)
        return cls(*(jnp.asarray(part, dtype) for part in (gait.theta, gait.a, gait.b)))

    def at(
        self, model: BipedModel, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Crank acceleration [rad/s^2] and b [rad^2/s^2]."""
        row, cell, phase = locate(self.theta, phase, steps)
        left, right = self.theta[row, cell], self.theta[row, cell + 1]
        x, start = phase - left, self.a[row, cell]
        rise = (self.a[row, cell + 1] - start) / (right - left)
        return start + rise * x, self.b[row, cell] + 2 * start * x + rise * x**2

    def jump_after(self, phase: Float[Array, ""], steps: Int[Array, ""]) -> float:
        """The next angle at which the torque may jump [rad]: the exchange of support."""
        return SUPPORT_END

    def torque(
        self, model: BipedModel, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> Float[Array, ""]:
        """The motor's torque [N m]."""
        a, b = self.at(model, phase, steps)
        inertia = model.inertia.at(wrapped(phase))
        return inertia.M * a + inertia.dM * b / 2 + model.gravity * inertia.Y


def _walked(
    params: BipedParams, gait: Walk, mu: float | None, kinetic: float | None,
    feedback: float, count: int, hold: float, zmp: bool, whole: float,
) -> Trace:  # fmt: skip
    """All holds, until as many steps are done or the walk takes half as long again as promised."""
    scene = Scene.grip() if mu is None else Scene.uniform(mu, kinetic)
    scene = replace(scene, outputs="forces" if zmp else "state")
    scene = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), scene)
    model = prepare(params.astype(jnp.float64), fidelity=FINE)
    law = jax.tree.map(jnp.asarray, GaitLaw.of(gait) if isinstance(gait, Gait) else gait.law)
    state = BipedState(crank_rate=float(np.sqrt(gait.b[0, 0]))).astype(jnp.float64)
    blocks, most = [], int(np.ceil(1.5 * whole / hold / BLOCK)) + 1
    for _ in range(most):
        trace = jax.tree.map(np.asarray, _block(model, scene, law, state, feedback, hold))
        blocks.append(trace)
        state = jax.tree.map(lambda leaf: jnp.asarray(leaf[-1]), trace[0])
        ended = np.any(trace[1].status > Status.SLIP_ONSET)
        if ended or state.steps >= count or state.time > 1.5 * whole:
            break
    return jax.tree.map(lambda *parts: np.concatenate(parts), *blocks)


@jax.jit
def _block(
    model: BipedModel, scene: Scene, law: Law, state: BipedState,
    feedback: Float[Array, ""], hold: Float[Array, ""],
) -> Trace:  # fmt: skip
    """BLOCK holds; the torque is the gait's at the middle of what a hold will cover."""

    def body(now: BipedState, nothing: None) -> tuple[BipedState, Trace]:
        steps = jnp.asarray(now.steps)
        phase, rate = jnp.asarray(now.phase), jnp.asarray(now.crank_rate)
        a, b = law.at(model, phase, steps)
        to_go = jnp.maximum(law.jump_after(phase, steps) - phase, 0.0)  # end where it may jump
        root = jnp.sqrt(jnp.maximum(rate**2 + 2 * a * to_go, 0.0))
        due = 2 * to_go / jnp.maximum(rate + root, 1e-12)
        near = (due < 1.5 * hold) & (due > NO_TIME * hold)
        length = jnp.where(near, due, hold)
        ahead = phase + jnp.maximum(rate * length / 2 + a * length**2 / 8, 0.0)
        excess = model.inertia.at(phase).M * (rate * jnp.abs(rate) - b) / 2
        torque = law.torque(model, ahead, steps) - feedback * excess
        after, contact = step(model, scene, now, torque, length, integrator=EXACT)
        _, b = law.at(model, jnp.asarray(after.phase), jnp.asarray(after.steps))
        error = after.crank_rate - jnp.sqrt(jnp.maximum(b, 0.0))
        return after, (after, contact, error)

    return jax.lax.scan(body, state, None, length=BLOCK)[1]


def _summed(gait: Walk, trace: Trace, mu: float | None, count: int, whole: float) -> Replay:
    """The numbers of a walk, up to its last exchange."""
    state, contact, error = trace
    times = state.time
    failed = np.nonzero(contact.status > Status.SLIP_ONSET)[0]
    angle = state.phase - np.pi / 2 + np.pi * state.steps
    turn = np.pi * count if gait.grid.end is None else gait.grid.turn
    if gait.grid.to_rest:  # look at the time that was promised
        done = np.nonzero(times >= whole)[0]
    else:
        done = np.nonzero(state.steps >= count if gait.grid.end is None else angle >= turn)[0]
    end = int(done[0]) if len(done) else len(times) - 1
    end = min(end, int(failed[0])) if len(failed) else end
    state, contact, error = jax.tree.map(lambda leaf: leaf[: end + 1], trace)
    rate, turned, duration = float(state.crank_rate[-1]), float(angle[end]), float(times[end])
    arrived = abs(turned - turn) < 0.01 * np.pi
    if turned > turn and rate > 0 and not gait.grid.to_rest:
        duration, turned = duration - (turned - turn) / rate, turn
    status = Status(int(np.max(contact.status)))
    inside = np.diff(state.steps, prepend=0) == 0
    use = friction_uses(contact.friction_force, contact.normal_force)
    return Replay(
        mu=mu,
        status=status,
        slid=float(np.sum(contact.slide_distance)),
        steps=int(state.steps[-1]),
        duration=duration,
        work=float(np.sum(contact.positive_work)),
        mean_rate=turned / duration if duration > 0 else 0.0,
        friction_use=float(np.max(np.where(inside, use, 0.0))),
        rate_error=float(np.max(np.where(inside, np.abs(error), 0.0))),
        end_rate=rate,
        end_velocity=float(state.foot_velocity[-1]),
        arrived=bool(arrived),
        step_length=gait.nodes.robot.step_length,
    )
