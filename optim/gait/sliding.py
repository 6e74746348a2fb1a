"""Motion of a biped over a piece of the crank angle, its foot at rest or sliding.

The centre of mass has a constant acceleration r relative to the foot. A foot at rest then carries
the constant friction force m r, and the square w of the centre's speed relative to the foot rises
in proportion to its way. Torque and forces are those of a prescribed crank (eqs. 31 and 34). The
velocity of a sliding foot is a parabola over time; where it is zero the foot stops, and rests for
the remainder of the piece.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple, cast

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import Motion, ankle_moment, prescribed, zero_moment_point
from stickslip.dynamics.biped.inertia import GroundMoment, ReducedInertia
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.optim.gait.profile import locate, wrapped

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped import BipedModel
    from stickslip.dynamics.pytrees import Scalar

NEVER = 1e6
"""Cost of what breaks a limit, duration of what does not move."""
BARELY = 1e-9
"""Angle too small to matter [rad]."""


class Limits(NamedTuple):
    """Numbers of a problem. reserve: share of the static friction that a foot at rest leaves
    unused, and by which a foot that is to slip exceeds it. heel, toe: infinite where the
    zero-moment point has no limit. weights [3]: of time, torque^2 over time and positive work."""

    total_mass: Scalar
    gravity: Scalar
    mu_static: Scalar
    mu_kinetic: Scalar
    reserve: Scalar
    torque: Scalar
    power: Scalar
    min_normal: Scalar
    heel: Scalar
    toe: Scalar
    weights: Float[Array, " 3"]


class Place(NamedTuple):
    """A crank angle of the supporting leg [rad], and the terms of MODEL 1.4 there."""

    theta: Scalar
    inertia: ReducedInertia
    moment: GroundMoment


class Passage(NamedTuple):
    """Motion over a piece, or sums over some. cost: NEVER or more where a limit is broken. slid:
    forwards [m]. velocity: of the foot at the end [m/s], 0 where it rests. mode: 0 rests, +1 slides
    forwards, -1 backwards, from the beginning to the crank angle `stop` [rad] (infinite: to the
    end); of sums 1 where any slides. torque: at the beginning [N m]."""

    cost: Scalar
    time: Scalar
    slid: Scalar
    velocity: Scalar
    mode: Scalar
    stop: Scalar
    torque: Scalar


def crank_rate(mass: Scalar, inertia: ReducedInertia, w: Scalar) -> Scalar:
    """Crank rate of a centre of mass with w."""
    return mass * jnp.sqrt(jnp.maximum(w, 0.0)) / inertia.P


def crank_motion(
    mass: Scalar, inertia: ReducedInertia, w: Scalar, r: Scalar
) -> tuple[Scalar, Scalar]:
    """Crank rate and acceleration of a centre of mass with w and r."""
    rate = crank_rate(mass, inertia, w)
    return rate, (mass * r - inertia.dP * rate**2) / inertia.P


def over_piece(
    limits: Limits, ends: tuple[Place, Place], w: Scalar, r: Scalar, velocity: Scalar
) -> Passage:
    """Motion from an angle to another. w: at the start. Slip begins at the start or not at all."""
    way = (ends[1].moment.X - ends[0].moment.X) / limits.total_mass
    squares = w, jnp.maximum(w + 2 * r * way, 0.0)
    pace = jnp.sqrt(squares[0]) + jnp.sqrt(squares[1])
    time = jnp.where(pace > 0, 2 * way / jnp.where(pace > 0, pace, 1.0), NEVER)
    inner, outer = (limits.mu_static * (1 + by * limits.reserve) for by in (-1, 1))
    states = list(zip(ends, squares, strict=True))
    still = [_motion(limits, *at, r, jnp.zeros_like(r)) for at in states]
    onset = (velocity == 0) & ~_holds(still[0], outer)
    mode = jnp.where(onset, -jnp.sign(still[0].friction_force), jnp.sign(velocity))
    sliding = [_motion(limits, *at, r, mode) for at in states]
    push, push_after = (time * mode * motion.foot_acceleration for motion in sliding)
    speed = jnp.abs(velocity)
    after = speed + (push + push_after) / 2
    slides = mode != 0
    stops = slides & (after <= 0)
    share, slid = _slide(speed, push, push_after, stops)
    between = share * time * (jnp.sqrt(w) + r * share * time / 2) / way
    halt = jax.tree.map(lambda one, other: one + between * (other - one), *ends)
    halted = _motion(limits, halt, w + 2 * r * between * way, r, jnp.zeros_like(r))
    rests = ~slides | stops
    sound = (pace > 0) & (slides | _holds(still[0], inner))
    sound &= ~rests | _holds(still[1], inner)
    sound &= ~stops | _holds(halted, inner)
    sound &= ~onset | (push > 0)
    begin = jax.tree.map(partial(jnp.where, slides), sliding[0], still[0])
    end = jax.tree.map(partial(jnp.where, rests), still[1], sliding[1])
    for i, motion in ((0, begin), (1, end), (1, sliding[1])):
        sound &= _keeps(limits, ends[i], squares[i], motion)
    torques = jnp.stack([begin.torque, end.torque])
    work = (ends[1].theta - ends[0].theta) * jnp.mean(jnp.maximum(torques, 0.0))
    spent = jnp.stack([time, time * jnp.mean(torques**2), work])
    return Passage(
        cost=jnp.where(sound, limits.weights @ spent, NEVER),
        time=time,
        slid=jnp.where(slides, mode * time * slid, 0.0),
        velocity=jnp.where(rests, 0.0, mode * after),
        mode=mode,
        stop=jnp.where(stops, halt.theta, jnp.inf),
        torque=begin.torque,
    )


def _slide(
    speed: Scalar, push: Scalar, push_after: Scalar, stops: Bool[Array, ""]
) -> tuple[Scalar, Scalar]:
    """Share of the duration until the foot stops, 1 if it does not, and its way over the duration.

    speed: at the start; push, push_after: accelerations times the duration.
    """
    bend = (push_after - push) / 2
    root = jnp.sqrt(jnp.maximum(push**2 - 4 * bend * speed, 0.0))
    down = jnp.maximum(root - push, jnp.finfo(root.dtype).tiny)
    share = jnp.where(stops, jnp.minimum(2 * speed / down, 1.0), 1.0)
    return share, share * (speed + share * (push / 2 + share * bend / 3))


def _motion(limits: Limits, place: Place, w: Scalar, r: Scalar, mode: Scalar) -> Motion:
    """The motion in a mode."""
    rate, alpha = crank_motion(limits.total_mass, place.inertia, w, r)
    model = cast("BipedModel", limits)  # of which mass and gravity are read
    return prescribed(model, place.inertia, rate, alpha, mode, limits.mu_kinetic)


def _holds(motion: Motion, friction: Scalar) -> Bool[Array, ""]:
    """True if that friction holds a foot at rest."""
    return jnp.abs(motion.friction_force) <= friction * motion.normal_force


def _keeps(limits: Limits, place: Place, w: Scalar, motion: Motion) -> Bool[Array, ""]:
    """True if the motor's limits, the normal force's and the zero-moment point's hold."""
    accelerations = motion.crank_acceleration, motion.foot_acceleration
    model, torque = cast("BipedModel", limits), jnp.abs(motion.torque)
    rate = crank_rate(limits.total_mass, place.inertia, w)
    moment = ankle_moment(model, place.moment, rate**2, *accelerations)
    zmp = zero_moment_point(moment, motion.normal_force)
    sound = (motion.normal_force > limits.min_normal) & (zmp <= limits.toe) & (zmp >= -limits.heel)
    return sound & (torque <= limits.torque) & (torque * rate <= limits.power)


def over_cell(
    limits: Limits, places: Place, w: Scalar, w_next: Scalar, velocity: Scalar
) -> tuple[Passage, Passage]:
    """Motion over all pieces between the places [H+1], of one r, and over each piece [H]."""
    X = places.moment.X / limits.total_mass
    r = (w_next - w) / (2 * (X[-1] - X[0]))
    found: list[Passage] = []
    for i in range(X.size - 1):
        ends = tuple(jax.tree.map(lambda leaf, j=j: leaf[j], places) for j in (i, i + 1))
        at = w + 2 * r * (X[i] - X[0])
        found.append(over_piece(limits, cast("tuple[Place, Place]", ends), at, r, velocity))
        velocity = found[-1].velocity
    pieces = jax.tree.map(lambda *leaves: jnp.stack(leaves), *found)
    sums = {name: jnp.sum(getattr(pieces, name)) for name in ("cost", "time", "slid")}
    return found[-1]._replace(mode=jnp.max(jnp.abs(pieces.mode)), **sums), pieces


@pytree_dataclass
class SlidingLaw:
    """Torque over the crank angle of a walk in pieces: r, w [m^2/s^2] and the centre's place X [m]
    at their beginnings, mode and stop as of Passage, all [n, K]; theta [n, K+1] rad."""

    theta: Float[Array, "n K+1"]
    X: Float[Array, "n K"]
    w: Float[Array, "n K"]
    r: Float[Array, "n K"]
    mode: Float[Array, "n K"]
    stop: Float[Array, "n K"]
    mu_kinetic: Float[Array, ""]

    def at(
        self, model: BipedModel, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Crank acceleration and b; see GaitLaw."""
        rate, alpha, _ = self._crank(model, phase, steps)
        return alpha, rate**2

    def jump_after(self, phase: Float[Array, ""], steps: Int[Array, ""]) -> Float[Array, ""]:
        """The angle at which the torque may jump: a piece's end, or where the foot stops in it."""
        row, i, theta = locate(self.theta, phase, steps)
        stop, end = self.stop[row, i], self.theta[row, i + 1]
        return jnp.where(theta < stop - BARELY, jnp.minimum(stop, end), end)

    def torque(
        self, model: BipedModel, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> Float[Array, ""]:
        """The motor's torque [N m], of the foot's planned mode."""
        rate, alpha, mode = self._crank(model, phase, steps)
        inertia = model.inertia.at(wrapped(phase))
        return prescribed(model, inertia, rate, alpha, mode, self.mu_kinetic).torque

    def _crank(
        self, model: BipedModel, phase: Float[Array, ""], steps: Int[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
        row, i, theta = locate(self.theta, phase, steps)
        X = model.inertia.moment_at(theta).X / model.total_mass
        w = self.w[row, i] + 2 * self.r[row, i] * (X - self.X[row, i])
        inertia = cast("ReducedInertia", model.inertia.at(theta))
        motion = crank_motion(model.total_mass, inertia, w, self.r[row, i])
        return *motion, jnp.where(theta < self.stop[row, i], self.mode[row, i], 0.0)
