"""The reference walks, and how far another walk is from one of them."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.timing import built
from benchmarks.tradeoff.program import Rolled, Samples, model_of, roll, traced
from benchmarks.tradeoff.scenes import PERIOD, Walk
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    EventExact,
    Reduced,
    Table,
    ground_moment,
    reduced_inertia,
)

if TYPE_CHECKING:
    from collections.abc import Callable

EXACT = EventExact(rtol=1e-13, atol=1e-15, record_events=True)
"""The reference's integrator; its fidelity is `Reduced()`, on the long walk Table(64, 9)."""


class Reference(NamedTuple):
    """The walk that others are compared with."""

    samples: Samples
    balance: np.ndarray
    """Kinetic and potential energy less the motor's work [J]; falls by what friction takes."""
    events: list[tuple[float, int]]
    status: int


def reference_of(walk: Walk) -> Reference:
    """Compute the reference of a walk, in double precision."""
    with jax.enable_x64(True), jax.numpy_dtype_promotion("strict"):
        model = model_of(Table(64, 9) if walk.name == "long" else Reduced(), "float64")
        arguments = (model, walk.scene("float64"), walk.law("float64"), walk.start("float64"))
        counts = traced("float64", PERIOD, 1, walk.periods, walk.stride)
        program = _reference_program(walk.structure, walk.name == "long", arguments, counts)
        rolled = jax.block_until_ready(program(*arguments, *counts))
        samples = kept(walk, rolled.samples)
        return Reference(samples, balance(samples), events_of(rolled), int(rolled.status))


_PROGRAMS: dict[tuple[str, bool], Callable[..., Any]] = {}


def _reference_program(structure: str, table: bool, arguments, counts) -> Callable[..., Any]:
    """Compiled once for every kind of floor."""
    key = (structure, table)
    if key not in _PROGRAMS:
        _PROGRAMS[key] = built(partial(roll, EXACT), *arguments, *counts).call
    return _PROGRAMS[key]


def kept(walk: Walk, samples: Samples) -> Samples:
    """The rows that the walk filled, as NumPy arrays."""
    return Samples(*(np.asarray(column)[: walk.samples] for column in samples))


def crank_angle(samples: Samples) -> np.ndarray:
    """With no wrapping, in double precision whatever the walk's [rad]."""
    return samples.phase.astype(np.float64) + np.pi * samples.steps


def events_of(rolled: Rolled) -> list[tuple[float, int]]:
    """(time [s], kind) of the switches in order; none if they were not recorded."""
    if rolled.events is None:
        return []
    times, kinds, count = map(np.asarray, rolled.events)
    used = min(int(count), len(times))
    return list(zip(times[:used].tolist(), kinds[:used].tolist(), strict=True))


def balance(samples: Samples) -> np.ndarray:
    """Energy less the motor's work [J], from the exact functions in double precision."""
    with jax.enable_x64(True), jax.numpy_dtype_promotion("strict"):
        M, P, height, mass, gravity = map(np.asarray, _inertia_at()(_padded(samples.phase)))
    rate, velocity = (
        np.asarray(v, np.float64) for v in (samples.crank_rate, samples.foot_velocity)
    )
    size = len(rate)
    moving = M[:size] * rate**2 / 2 + P[:size] * rate * velocity + mass * velocity**2 / 2
    return moving + gravity * height[:size] - np.asarray(samples.work, np.float64)


def _padded(phase) -> jax.Array:
    """To one length, so that one program serves every walk."""
    values = np.full(512, np.pi)
    values[: len(phase)] = phase
    return jnp.asarray(values)


@lru_cache
def _inertia_at() -> Callable[..., Any]:
    @jax.jit
    def at(phases):
        params = BipedParams.from_bars(dtype=jnp.float64)

        def one(phase):
            inertia = reduced_inertia(params, phase)
            return inertia.M, inertia.P, ground_moment(params, phase).Y

        return *jax.vmap(one)(phases), params.total_mass, params.gravity

    return at


def errors_of(walk: Walk, rolled: Rolled, reference: Reference) -> dict[str, Any]:
    """How far a walk is from its reference, the largest over the samples.

    crank angle [rad] and slide [m] for each simulated second; energy balance [J]; normal and
    friction force in weights, the latter where both feet stick or slide alike; where they do not,
    the share of samples. None for a walk that left the model.
    """
    samples = kept(walk, rolled.samples)
    truth = reference.samples
    off = np.abs(crank_angle(samples) - crank_angle(truth))
    slid = np.abs(samples.foot_position.astype(np.float64) - truth.foot_position)
    if int(rolled.status) > 1 or not np.all(np.isfinite(off + slid)):
        return {"status": int(rolled.status), "angle_error": None, "slide_error": None}
    energy = np.abs(balance(samples) - reference.balance)
    alike = samples.mode == truth.mode
    weight = _weight()
    friction = np.abs(samples.friction_force - truth.friction_force)[alike]
    return {
        "status": int(rolled.status),
        "angle_error": float(np.max(off)) / walk.duration,
        "slide_error": float(np.max(slid)) / walk.duration,
        "energy_error": float(np.max(energy)),
        "normal_error": float(np.max(np.abs(samples.normal_force - truth.normal_force))) / weight,
        "friction_error": float(np.max(friction, initial=0.0)) / weight,
        "other_mode": float(np.mean(~alike)),
    }


def _weight() -> float:
    params = BipedParams.from_bars(dtype=jnp.float32)
    return float(params.total_mass * params.gravity)


def event_errors(events: list[tuple[float, int]], reference: Reference) -> dict[str, Any]:
    """Largest error of the switching instants [s] up to where another event comes first."""
    same = 0
    for (_, kind), (_, wanted) in zip(events, reference.events, strict=False):
        if kind != wanted:
            break
        same += 1
    gaps = [abs(events[i][0] - reference.events[i][0]) for i in range(same)]
    return {
        "event_error": max(gaps, default=0.0),
        "events": len(events),
        "events_alike": same,
        "events_wanted": len(reference.events),
    }


def long_walk_check(walk: Walk, reference: Reference, nodes: int = 400) -> float:
    """The long walk's reference beside a quadrature [rad]; walks without motor and slip only.

    With the energy E constant, the time of a turn is the integral of sqrt(M / (2 (E - V))) over the
    crank angle (MODEL 1.4), by Gauss and Legendre's rule: nothing of the integrators is used. The
    difference of the last sample's time, as a turn of the crank.
    """
    phase, steps = float(reference.samples.phase[-1]), int(reference.samples.steps[-1])
    with jax.enable_x64(True), jax.numpy_dtype_promotion("strict"):
        slowness = _slowness(walk, nodes)
        first, last = slowness(walk.phase, SUPPORT_END), slowness(SUPPORT_START, phase)
        taken = first + (steps - 1) * slowness(SUPPORT_START, SUPPORT_END) + last
    gap = taken - walk.samples * walk.stride * PERIOD
    return abs(gap) * float(reference.samples.crank_rate[-1])


def _slowness(walk: Walk, nodes: int) -> Callable[[float, float], float]:
    places, weights = np.polynomial.legendre.leggauss(nodes)
    begin = Samples(*(np.asarray([0.0]) for _ in range(10)))
    energy = balance(
        begin._replace(phase=np.asarray([walk.phase]), crank_rate=np.asarray([walk.rate]))
    )[0]

    def between(low: float, high: float) -> float:
        angles = (low + high) / 2 + (high - low) / 2 * places
        M, _, height, _, gravity = map(np.asarray, _inertia_at()(_padded(angles)))
        integrand = np.sqrt(M[:nodes] / (2 * (energy - gravity * height[:nodes])))
        return float((high - low) / 2 * weights @ integrand)

    return between
