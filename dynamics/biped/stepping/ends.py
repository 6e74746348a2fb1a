"""Margins of the model's validity: positive inside it, zero at a walk's end."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.coefficients.inertia import GroundMoment
from stickslip.dynamics.biped.contact import ankle_moment, fall_under
from stickslip.dynamics.biped.drive import Torque
from stickslip.dynamics.scene import Grip
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped.contact import Coefficients, Motion
    from stickslip.dynamics.biped.drive import System
    from stickslip.dynamics.biped.model import BipedModel


class Midpoint(NamedTuple):
    """Quantities at a step's middle that event detection needs."""

    crank_acceleration: Float[Array, ""]
    foot_acceleration: Float[Array, ""]
    normal_force: Float[Array, ""]
    solvability: Float[Array, ""]
    cone_margin: Float[Array, ""]
    """Margin of the static friction cone [N]."""


class Ground(NamedTuple):
    """Ground forces at one instant, from which the ends are detected."""

    rate: Float[Array, ""]
    normal: Float[Array, ""]
    solvability: Float[Array, ""]
    moment: Float[Array, ""] | None
    """Moment of the ground's force about the ankle [N m]; None where toppling is not judged."""


class Ending(NamedTuple):
    """An end and its margin at the start, the middle and the end of a trial step."""

    status: Int[Array, ""]
    margins: tuple[Array, Array, Array]


class Sample(NamedTuple):
    """An instant of a trial step; inertia None in the middle."""

    theta: Float[Array, ""]
    rate: Float[Array, ""]
    motion: Motion | Midpoint
    inertia: Coefficients | None


def lever_at(system: System, theta: Float[Array, ""]) -> GroundMoment | None:
    """Terms of the ground's moment; None where toppling is not detected."""
    judged = system.scene.outputs != "state"
    return system.model.inertia.moment_at(theta) if judged else None


def ground_at(system: System, lever: GroundMoment | None, sample: Sample) -> Ground:
    """Ground forces of a motion, from which the ends are detected."""
    motion, moment = sample.motion, None
    if lever is not None:
        accelerations = motion.crank_acceleration, motion.foot_acceleration
        moment = ankle_moment(system.model, lever, sample.rate, *accelerations)
    return Ground(sample.rate, motion.normal_force, motion.solvability, moment)


def grounds_of(
    system: System, lever: GroundMoment | None, samples: tuple[Sample, Sample, Sample]
) -> tuple[Ground, Ground, Ground]:
    """Ground forces at the start (whose lever is given), middle and end of a trial step."""
    levers = None, None, None
    if lever is not None:
        levers = lever, *_levers(system, lever, samples[0], samples[2])
    grounds = [ground_at(system, a, b) for a, b in zip(levers, samples, strict=True)]
    return grounds[0], grounds[1], grounds[2]


def _levers(
    system: System, first: GroundMoment, start: Sample, end: Sample
) -> tuple[GroundMoment, GroundMoment]:
    """Moment terms in the middle and at the end, with one evaluation of L: P and Y are slopes of
    the mass moments, and in between are Hermite's cubics. Errors as the turn's fifth power, and in
    the middle its fourth."""
    inertia, later = start.inertia, end.inertia
    if inertia is None or later is None:
        raise TypeError("the inertia at both ends of a step is needed")
    L, dL = system.model.inertia.spin_at(end.theta)
    turn = end.theta - start.theta
    enough = jnp.abs(turn) > 1e-3  # below, a difference of L has no digits and is not needed
    mean = (first.dL + dL) / 2
    secant = jnp.where(enough, (L - first.L) / jnp.where(enough, turn, 1.0), mean)

    def halfway(a: Array, b: Array, slope: Array, slope_after: Array) -> Array:
        return (a + b) / 2 + turn / 8 * (slope - slope_after)

    def risen(a: Array, slope: Array, slope_after: Array, bend: Array, bend_after: Array) -> Array:
        return a + turn * ((slope + slope_after) / 2 + turn / 12 * (bend - bend_after))

    X = risen(first.X, inertia.P, later.P, inertia.dP, later.dP)
    Y = risen(first.Y, inertia.Y, later.Y, inertia.dY, later.dY)
    middle = GroundMoment(
        halfway(first.L, L, first.dL, dL),
        1.5 * secant - mean / 2,
        halfway(first.X, X, inertia.P, later.P),
        halfway(first.Y, Y, inertia.Y, later.Y),
    )
    return middle, GroundMoment(L, dL, X, Y)


def _off_foot(model: BipedModel, normal: Array, moment: Array) -> Bool[Array, ""]:
    """True where the zero-moment point lies beyond the toe or the heel."""
    return (moment > model.toe * normal) | (-moment > model.heel * normal)


def status_now(system: System, at: Ground) -> Int[Array, ""]:
    """OK, or the most severe end at this instant."""
    status = jnp.zeros_like(at.normal, jnp.int32)
    if at.moment is not None:
        off_foot = _off_foot(system.model, at.normal, at.moment)
        status = jnp.where(off_foot, fall_under(system.model, at.normal), status)
    if system.max_rate is not None:
        status = jnp.where(jnp.abs(at.rate) > system.max_rate, Status.RUNAWAY, status)
    status = jnp.where(at.normal <= 0, Status.LIFT_OFF, status)
    return jnp.where(at.solvability > 0, status, Status.NO_SOLUTION).astype(jnp.int32)


def first_ending(system: System, samples: tuple[Ground, Ground, Ground]) -> Ending:
    """The end whose margin is the first to cross zero along straight lines through the samples."""
    normals = [at.normal for at in samples]
    moments = [at.moment for at in samples if at.moment is not None]
    best = _ending(Status.LIFT_OFF, normals)
    if moments:
        margins = _edge_margins(system, normals, moments)
        best = _ending(fall_under(system.model, normals[2]), margins)
    if isinstance(system.drive, Torque) and not isinstance(system.scene.floor, Grip):
        best = _earlier(best, _ending(Status.NO_SOLUTION, [at.solvability for at in samples]))
    if system.max_rate is not None:
        room = [system.max_rate - jnp.abs(at.rate) for at in samples]
        best = _earlier(best, _ending(Status.RUNAWAY, room))
    return best


def _edge_margins(system: System, normals: list[Array], moments: list[Array]) -> list[Array]:
    """(Edge - zero-moment point) times normal force [N m], of the edge that is left first."""
    toe, heel = system.model.toe, system.model.heel
    off_in_middle = _off_foot(system.model, normals[1], moments[1])
    forwards = jnp.where(off_in_middle, moments[1], moments[2]) > 0
    edge, sign = jnp.where(forwards, toe, heel), jnp.where(forwards, 1.0, -1.0)
    return [edge * force - sign * moment for force, moment in zip(normals, moments, strict=True)]


def _ending(status: Status | Int[Array, ""], margins: list[Array]) -> Ending:
    start, middle, end = margins
    return Ending(jnp.full_like(start, status, jnp.int32), (start, middle, end))


def _earlier(one: Ending, other: Ending) -> Ending:
    """The earlier end, by straight lines through the half step in which the first sign changes."""
    by_middle = (one.margins[1] < 0) | (other.margins[1] < 0)

    def half(ending: Ending) -> tuple[Array, Array]:
        start, middle, end = ending.margins
        return jnp.where(by_middle, start, middle), jnp.where(by_middle, middle, end)

    (before, after), (before_other, after_other) = half(one), half(other)
    sooner: Bool[Array, ""] = before * after_other >= before_other * after
    return jax.tree.map(lambda a, b: jnp.where(sooner, a, b), one, other)
