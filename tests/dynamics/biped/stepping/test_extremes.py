"""The extremes: friction at its limits, every case a row of one compiled batch."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.core import eval_context

from stickslip.dynamics import Scene, Status, biped
from tests.dynamics.biped import helpers
from tests.precision import mostly_single

if TYPE_CHECKING:
    from collections.abc import Sequence

ENDS = (biped.SUPPORT_START, biped.SUPPORT_END)
ROWS = 96
"""Walks go in batches of this size, the last one filled up, so that all share a program."""


@dataclass(frozen=True)
class Start:
    """One walk: `count` calls of `step` with `dt` [s] under a constant torque [N m].

    mu_kinetic is mu_static. The other fields are those of BipedState.
    """

    mu_static: float = 1.0
    phase: float = biped.SUPPORT_START
    crank_rate: float = 0.0
    foot_velocity: float = 0.0
    torque: float = 0.0
    dt: float = 0.01
    count: int = 1


class March(NamedTuple):
    """Results, one entry a walk: work [J], switches in all and at most in a call, calls to the end;
    sound: every number of every call was finite, and the phase inside the support phase."""

    state: biped.BipedState
    contact: biped.Contact
    work: Any
    switches: Any
    most_switches: Any
    calls: Any
    sound: Any

    @property
    def status(self) -> list[Status]:
        return [Status(int(word)) for word in self.contact.status]


def march(starts: Sequence[Start], model: biped.BipedModel, dtype: Any) -> March:
    """The walks side by side in `dtype`, each stopped by a terminal status; NumPy arrays."""
    parts = [_one_batch(starts[at : at + ROWS], model, dtype) for at in range(0, len(starts), ROWS)]
    return jax.tree.map(lambda *parts: np.concatenate(parts), *parts)


def _one_batch(starts: Sequence[Start], model: biped.BipedModel, dtype: Any) -> March:
    rows = [*starts, *[Start(count=0)] * (ROWS - len(starts))]

    def column(name: str, kind=dtype):
        return jnp.asarray(np.array([getattr(row, name) for row in rows]).astype(kind))

    scenes = Scene.uniform(column("mu_static"))
    phase = np.array([row.phase for row in rows]).astype(dtype)
    for end in np.asarray(ENDS, dtype):  # as this type rounds them
        phase[np.abs(phase - end) < 1e-6] = end
    zero, steps = jnp.zeros(ROWS, dtype), jnp.zeros(ROWS, jnp.int32)
    place = jnp.asarray(phase), steps, column("crank_rate"), zero, column("foot_velocity"), zero
    numbers = column("torque"), column("dt"), column("count", np.int32)
    found = _march(model, scenes, biped.BipedState(*place), *numbers)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[: len(starts)], found)


@jax.jit
def _march(model, scenes, states, torques, sizes, counts) -> March:
    """Every row for as many calls as it wants; the slowest row says how many rounds there are."""
    go = jax.vmap(biped.step, (None, 0, 0, 0, 0))
    first = jax.eval_shape(go, model, scenes, states, torques, sizes)[1]
    blank = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), first)
    zero, none = jnp.zeros_like(torques), jnp.zeros_like(counts)
    begin = March(states, blank, zero, none, none, none, counts == counts)

    def body(_, now: March) -> March:
        state, contact = go(model, scenes, now.state, torques, sizes)
        after = March(
            state,
            contact,
            work=now.work + contact.work,
            switches=now.switches + contact.switches,
            most_switches=jnp.maximum(now.most_switches, contact.switches),
            calls=now.calls + 1,
            sound=now.sound & _sound(state, contact),
        )
        runs = (now.contact.status <= Status.SLIP_ONSET) & (now.calls < counts)
        return jax.tree.map(lambda new, old: jnp.where(runs, new, old), after, now)

    return jax.lax.fori_loop(0, jnp.max(counts), body, begin)


def _sound(state: biped.BipedState, contact: biped.Contact):
    leaves = jax.tree.leaves((state, contact))
    finite = jnp.all(jnp.stack([jnp.isfinite(leaf) for leaf in leaves]), axis=0)
    low, high = jnp.asarray(ENDS, state.phase.dtype)
    return finite & (state.phase >= low) & (state.phase <= high)


TRIALS = biped.RK4Split().trials


@lru_cache
def long_footed(dtype: str) -> biped.BipedModel:
    """The default robot with feet too long to topple on."""
    with eval_context():
        return helpers.default_model(dtype=dtype).replace(
            heel=jnp.asarray(1e3, dtype), toe=jnp.asarray(1e3, dtype)
        )


def march_in(dtype, starts):
    return march(starts, long_footed(dtype.name), dtype)


def momentum_and_energy(phase, crank_rate, foot_velocity):
    """Along x, and kinetic plus potential (MODEL 1.4), from the exact functions."""
    with jax.enable_x64(True):
        params = helpers.default_params()
        (M, _, P, *_), moment = helpers.exact_along(params, phase)
        mass, gravity = float(params.total_mass), float(np.asarray(params.gravity))
    w, v = np.asarray(crank_rate, float), np.asarray(foot_velocity, float)
    energy = M * w**2 / 2 + P * w * v + mass * v**2 / 2 + gravity * moment.Y
    return P * w + mass * v, energy


def painleve(direction: int) -> tuple[float, float]:
    """Least friction at which sliding that way has no unique solution, and the phase."""
    angles = np.linspace(np.pi / 2, 3 * np.pi / 2, 4001)
    M, _, P, _, Y, _ = helpers.inertia_along(helpers.default_params(), angles)
    pushes = direction * P * Y > 0
    mass = float(helpers.default_params().total_mass)
    bound = (M * mass - P**2) / np.where(pushes, np.abs(P * Y), 1.0)
    bound = np.where(pushes, bound, np.inf)
    return bound.min(), angles[bound.argmin()]


def frictionless_starts():
    rng = np.random.default_rng(3)
    return [
        Start(
            mu_static=0.0,
            phase=rng.uniform(1.6, 4.7),
            crank_rate=rng.uniform(-4, 4),
            foot_velocity=velocity,
            torque=rng.uniform(-0.5, 0.5),
            dt=1e-3,
            count=300,
        )
        for velocity in [0.0] * 12 + [0.3, -0.3, 1e-9, -1e-9] * 3
    ]


@mostly_single
@pytest.mark.long
def test_without_friction_momentum_and_energy_are_kept(dtype):
    """0.3 s from rest and sliding, through exchanges, turning back on the way."""
    starts = frictionless_starts()
    end = march_in(dtype, starts)
    assert np.all(end.sound)
    kept = np.array([not status.terminal for status in end.status])
    assert kept.sum() >= 20
    assert all(status in (Status.OK, Status.LIFT_OFF) for status in end.status)
    names = ("phase", "crank_rate", "foot_velocity")
    before = momentum_and_energy(*([getattr(one, name) for one in starts] for name in names))
    after = momentum_and_energy(*(getattr(end.state, name) for name in names))
    single = dtype == jnp.float32
    assert np.max(np.abs(after[0] - before[0])[kept]) < (5e-5 if single else 1e-6)  # of 5 kg m/s
    gained = after[1] - before[1] - end.work
    assert np.max(np.abs(gained)[kept]) < (5e-5 if single else 1e-6)  # of some 5 J
    assert np.all(end.contact.friction_force == 0)
    assert end.switches.max() > 1


@pytest.mark.parametrize(
    ("direction", "known"), [pytest.param(1, 3.2636, marks=pytest.mark.long), (-1, 1.3410)]
)
def test_sliding_beyond_painleve_is_refused_and_short_of_it_runs(float64, direction, known):
    """Both directions have a bound; 0.1 % below it a step still has its one solution."""
    bound, phase = painleve(direction)
    assert bound == pytest.approx(known, abs=2e-3)
    slide = {"phase": phase, "crank_rate": 0.5, "foot_velocity": 0.2 * direction, "dt": 1e-5}
    rows = [Start(mu_static=share * bound, **slide) for share in (0.999, 1.001, 10.0, 1e6)]
    other = replace(rows[1], foot_velocity=-0.2 * direction)
    for dtype in (jnp.dtype("float32"), jnp.dtype("float64")):
        with jax.enable_x64(dtype == jnp.float64):
            end = march_in(dtype, [*rows, other])
        assert np.all(end.sound)
        assert end.status == [Status.OK] + [Status.NO_SOLUTION] * 3 + [Status.OK]
        assert np.all(end.state.phase[1:4] == np.asarray(phase, dtype))
        assert np.all(end.state.time[1:4] == 0)


def edges(dtype) -> list[tuple[float, float, float]]:
    """(mu, phase, crank rate) with |f| = mu N at rest, to rounding."""
    rng = np.random.default_rng(5)
    phases, rates = rng.uniform(1.7, 4.6, 40), rng.uniform(-4, 4, 40)
    model, zero = long_footed(dtype.name), jnp.zeros((), dtype)
    found = []
    for phase, rate in zip(phases, rates, strict=True):
        place = jnp.asarray(phase, dtype), jnp.asarray(rate, dtype)
        held = helpers.forward(model, *place, zero, zero, zero + 1e9, zero + 1e9)
        found.append(float(abs(held.friction_force) / held.normal_force))
    return list(zip(found, phases.tolist(), rates.tolist(), strict=True))


def test_chatter_at_the_edge_of_the_cone_is_bounded(dtype):
    """mu exactly what the foot at rest demands, and up to 1000 roundings to either side, at
    many phases and step sizes: the calls end, no time is lost, and neighbours go the same way."""
    sizes = 10 ** np.random.default_rng(6).uniform(-6, -2, 40)
    nudges = np.array([-1000, -100, -1, 0, 1, 100]) * float(jnp.finfo(dtype).eps)
    rows = [
        Start(mu_static=mu * (1 + nudge), phase=phase, crank_rate=rate, dt=size, count=40)
        for nudge in nudges
        for (mu, phase, rate), size in zip(edges(dtype), sizes, strict=True)
    ]
    end = march_in(dtype, rows)
    assert np.all(end.sound)
    assert {status.name for status in end.status} <= {"OK", "SLIP_ONSET"}
    assert 1 < end.most_switches.max() <= TRIALS
    assert np.all(end.calls == 40)
    np.testing.assert_allclose(end.state.time, 40 * np.tile(sizes, len(nudges)), rtol=1e-5)
    limits = {"foot_position": 1e-9, "phase": 1e-8, "crank_rate": 1e-6}
    for name, limit in limits.items():
        among = getattr(end.state, name).reshape(len(nudges), -1)
        single = dtype == jnp.float32  # where 1000 roundings are 1e-4 of mu
        assert np.max(np.ptp(among, axis=0)) < (5e-3 if single else limit), name


NUDGES = np.array([0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6])


def held_from_the_edge(dtype):
    """Status and state after holding a torque for 0.1 s that brings the foot to the cone's edge, to
    a nudge, with mu_kinetic = mu_static: [starts, nudges]."""
    model, rng = helpers.default_model(dtype=dtype.name), np.random.default_rng(0)
    mu = np.exp(rng.uniform(np.log(0.02), np.log(0.6), 24))
    phase, rate = rng.uniform(1.6, 4.6, 24), rng.uniform(-1, 4, 24)
    with jax.enable_x64(True):
        params = helpers.default_params()
        M, dM, P, dP, Y, dY = helpers.inertia_along(params, phase)
        mass, gravity = float(params.total_mass), float(np.asarray(params.gravity))
    alpha = (mu * (mass * gravity + dY * rate**2) - dP * rate**2) / (P - mu * Y)
    torque = np.clip(M * alpha + dM * rate**2 / 2 + gravity * Y, -8, 8)
    zero, spec = jnp.zeros((), dtype), biped.EventExact(max_steps=256)

    def one(mu, phase, rate, torque):
        state = biped.BipedState(phase, jnp.zeros((), jnp.int32), rate, zero, zero, zero)
        scene, size = Scene.uniform(mu, mu, outputs="state"), jnp.asarray(0.1, dtype)
        after, contact = biped.step(model, scene, state, torque, size, integrator=spec)
        return contact.status, after

    rows = (jnp.asarray(np.repeat(r[:, None], len(NUDGES), 1), dtype) for r in (mu, phase, rate))
    held = jnp.asarray(torque[:, None] * (1 + NUDGES), dtype)
    return jax.jit(jax.vmap(jax.vmap(one)))(*rows, held)


@pytest.mark.parametrize(
    "dtype", ["float64", pytest.param("float32", marks=pytest.mark.long)], indirect=True
)
def test_event_exact_leaves_the_edge_of_the_cone_within_its_steps(dtype):
    """Slides that begin with next to no acceleration and end at once, and onsets whose margin is
    lost in roundings: nothing is repeated for ever, and a nudge makes no difference."""
    status, after = jax.tree.map(np.asarray, held_from_the_edge(dtype))
    assert set(status.ravel()) <= {Status.OK, Status.SLIP_ONSET, Status.LIFT_OFF}
    walked = np.all(status <= Status.SLIP_ONSET, axis=1)
    assert walked.sum() > 12
    np.testing.assert_allclose(after.time[walked], 0.1, rtol=1e-6)
    limit = 1e-4 if dtype == jnp.float64 else 5e-3  # of the nudge of 1e-6, and of roundings
    assert np.max(np.ptp(after.crank_rate[walked], axis=1)) < limit
