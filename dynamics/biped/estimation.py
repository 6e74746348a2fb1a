"""A Kalman filter of the walk's state, the load and the encoder's errors from a noisy angle."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.contact import Torque
from stickslip.dynamics.biped.links import SUPPORT_START
from stickslip.dynamics.biped.model import BipedModel, Inertia, load
from stickslip.dynamics.biped.settings import RK4Split
from stickslip.dynamics.biped.simulation import stepped
from stickslip.dynamics.biped.state import BipedState
from stickslip.dynamics.names import UNKNOWNS
from stickslip.dynamics.scene import Scene, Uniform
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Float

    from stickslip.dynamics.pytrees import Number, Scalar

STATE = {"crank_angle": 1e-6, "crank_rate": 1e-5, "foot_velocity": 1e-6}
LOADS = {"payload": 1e-4, "mass_factor": 1e-5, "torque_loss": 1e-4, "encoder_delay": 1e-5}
"""Names and steps of the differences that a prediction's slopes are made of; units of Belief."""
NAMES = (*STATE, *UNKNOWNS)
ANGLE = np.array([name in ("crank_angle", "encoder_bias") for name in NAMES], float)
"""What an encoder reads, of a mean."""
PUSH = 1e-4
"""Step of the difference by the torque [N m]."""
STRIBECK = 0.05
"""Crank rate [rad/s] below which the loss in the drive fades."""
OUTLIER = 100.0
"""Most that one angle adds to `misfit`: an outlier, or a walk that the model cannot go on with."""
STEEP = 10.0
"""Greatest slope of a prediction: those across a switch have no bound."""
ONE_STEP = RK4Split()


class Belief(NamedTuple):
    """Normal distribution of what an encoder's angles tell, and how badly they fit.

    mean [8], covariance [8, 8]: crank angle [rad], crank rate [rad/s], foot velocity [m/s], payload
    [kg], factor of the robot's masses and inertias [-], torque lost in the drive [N m], and of the
    encoder the bias [rad] and the delay [s]. A number of variance 0 is known. misfit: -2 log
    likelihood of the angles so far. innovation: last angle less the predicted one [rad]; deviation:
    that difference's standard deviation [rad].
    """

    mean: Float[Array, " 8"]
    covariance: Float[Array, "8 8"]
    misfit: Scalar
    innovation: Scalar
    deviation: Scalar


class Noise(NamedTuple):
    """Standard deviations of an angle [rad] and of a step's torque, all that is neglected [N m]."""

    angle: Number
    torque: Number


def initial_belief(
    angle: Scalar,
    rate: Scalar,
    deviations: Float[Array, " 2"],
    means: Float[Array, " 5"],
    spread: Float[Array, " 5"],
) -> Belief:
    """Belief at the start of a walk, the foot at rest. deviations: of the angle [rad] and the rate
    [rad/s]. means, spread: of UNKNOWNS; a spread of 0 for what is known."""
    mean = jnp.concatenate([jnp.stack([angle, rate, 0.0 * rate]), means])
    variance = jnp.concatenate([deviations, jnp.zeros_like(spread[:1]), spread]) ** 2
    nothing = jnp.zeros_like(mean[0])
    return Belief(mean, jnp.diag(variance), nothing, nothing, nothing)


def mixed(
    bank: Belief, probabilities: Float[Array, " n"], change: Scalar
) -> tuple[Belief, Float[Array, " n"]]:
    """Beliefs of n frictions, and their probabilities, where the floor may have become another.

    The interaction of interacting multiple models (Blom and Bar-Shalom, IEEE Trans. Automatic
    Control 33(8), 1988): with the probability `change` any of the n frictions comes next, and its
    filter goes on from the mean belief of all. misfit begins anew.
    """
    n, P = len(probabilities), bank.covariance
    after = (1 - change) * probabilities + change / n
    tiny = jnp.finfo(after.dtype).tiny
    own = ((1 - change) * probabilities / jnp.maximum(after, tiny))[:, None, None]
    mean = probabilities @ bank.mean
    off = bank.mean - mean
    square = off[:, :, None] * off[:, None, :]
    every = jnp.tensordot(probabilities, P + square, 1)
    covariance = own * P + (1 - own) * (every + own * square)
    found = bank._replace(mean=mean + own[..., 0] * off, covariance=covariance)
    return found._replace(misfit=jnp.zeros_like(bank.misfit)), after


def observe(
    robot: tuple[BipedModel, Inertia | None],
    friction: Uniform,
    belief: Belief,
    torque: Scalar | Callable[[Scalar], Scalar],
    duration: Scalar,
    angle: Scalar,
    noise: Noise,
    *,
    loads: tuple[str, ...] = tuple(LOADS),
    integrator: RK4Split = ONE_STEP,
) -> Belief:
    """The belief after `duration` [s] of a torque [N m] and one more angle [rad], NaN for none.

    An extended Kalman filter whose prediction is one step of the walk (MODEL 1.4), switches
    included, its slopes differences of such steps. The encoder reads the angle + bias + noise, the
    drive loses torque_loss tanh(rate / 0.05 rad/s). Of an encoder with a delay the states are those
    that it shows; torque is then a function of the delay [s]: the mean torque over the `duration`
    that ended so much earlier. A foot that is predicted at rest is taken to be there.

    robot: of `prepare`, and its `unit_inertia()`, or None without a payload; its fidelity is the
    filter's. loads: names of LOADS that may have a variance above 0; fewer cost less. Scalars:
    batch with vmap, over frictions above all. In single precision the differences are 1000 times
    as large. A walk that ends within the step leaves the belief as it is, with the misfit of an
    outlier. Neglected: the floor's patches.
    """
    names, dtype = (*STATE, *loads), belief.mean.dtype
    columns = np.array([NAMES.index(name) for name in names])
    coarse = 1.0 if dtype == jnp.float64 else 1e3
    push = coarse * PUSH
    sizes = jnp.asarray([*(coarse * (STATE | LOADS)[name] for name in names), push], dtype)

    predicted = partial(_predicted, robot, friction, torque, duration, integrator)
    moved = jnp.eye(8, dtype=dtype)[columns] * sizes[:-1, None]
    moved = belief.mean + jnp.pad(moved, ((1, 1), (0, 0)))
    pushes = jnp.zeros(len(moved), dtype).at[-1].set(push)
    ahead, statuses = jax.vmap(predicted)(moved, pushes)
    slopes = ((ahead[1:, :3] - ahead[0, :3]) / sizes[:, None]).T
    slopes = jnp.clip(jnp.nan_to_num(slopes), -STEEP, STEEP)
    F = jnp.eye(8, dtype=dtype).at[:3, columns].set(slopes[:, :-1])
    pushed = jnp.pad(slopes[:, -1], (0, 5)) * noise.torque
    P = F @ belief.covariance @ F.T + jnp.outer(pushed, pushed)
    rests = (jnp.arange(8) == 2) & (ahead[0, 2] == 0)
    P = jnp.where(rests | rests[:, None], 0.0, P)
    after = _corrected(ahead[0], P, angle, belief.misfit, noise.angle)
    sound = jnp.all(jnp.isfinite(after.mean)) & (statuses[0] <= Status.SLIP_ONSET)
    lost = belief._replace(misfit=belief.misfit + OUTLIER)
    return jax.tree.map(lambda one, other: jnp.where(sound, one, other), after, lost)


def _predicted(robot, friction, torque, duration, integrator, mean, push):
    """Mean after a step, and the step's status."""
    model, unit = robot
    angle, rate, velocity, payload, factor, loss, _, delay = mean
    torque = torque(delay) if callable(torque) else torque
    steps = jnp.floor((angle - SUPPORT_START) / np.pi)
    state = BipedState(angle - np.pi * steps, steps.astype(int), rate, 0.0 * rate, velocity)
    drive = Torque(torque + push - loss * jnp.tanh(rate / STRIBECK))
    loaded, scene = load(model, unit, factor, payload), Scene(floor=friction)
    state, contact = stepped(
        integrator, model.fidelity, loaded, scene, state.astype(mean.dtype), drive, duration
    )
    found = jnp.stack([state.crank_angle, state.crank_rate, state.foot_velocity])
    return jnp.concatenate([found, mean[3:]]), contact.status


def _corrected(mean, P, angle, misfit, noise) -> Belief:
    """Kalman's correction by one angle; none by NaN."""
    h, was_read = jnp.asarray(ANGLE, mean.dtype), ~jnp.isnan(angle)
    S = h @ P @ h + noise**2
    gain, innovation = jnp.where(was_read, P @ h / S, 0), jnp.where(was_read, angle - h @ mean, 0)
    P = P - jnp.outer(gain, gain) * S
    more = jnp.minimum(innovation**2 / S, OUTLIER) + jnp.log(S)
    misfit = misfit + jnp.where(was_read, more, 0)
    return Belief(mean + gain * innovation, (P + P.T) / 2, misfit, innovation, jnp.sqrt(S))
