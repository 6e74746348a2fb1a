"""Traced numbers that are none, or are huge, come out marked: nothing passes as OK."""

from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import BipedState, forward_dynamics, inverse_dynamics, step
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.ugv import Track, UGVParams, equilibrium
from tests.dynamics.biped.helpers import default_model, default_params
from tests.fuzz.members import unmarked

SOUND = {
    "phase": 2.0,
    "steps": 3.0,
    "crank_rate": 2.0,
    "foot_position": 0.01,
    "foot_velocity": 0.0,
    "time": 0.5,
    "torque": 0.8,
    "dt": 0.01,
    "mu_static": 0.3,
    "mu_kinetic": 0.2,
}
BAD = (np.nan, np.inf, -np.inf, 1e30, -1e30)
ROWS = [(name, value) for name in SOUND for value in BAD]


def spoilt(sound) -> np.ndarray:
    """Rows of sound numbers, each with one of BAD in one place."""
    bad = np.repeat(np.eye(len(sound), dtype=bool), len(BAD), axis=0)
    return np.where(bad, np.tile(BAD, len(sound))[:, None], sound).astype(np.float32)


@lru_cache
def stepped():
    """One step for each of ROWS, in one batch."""

    @jax.jit
    def one(row):
        row = dict(row)
        state = BipedState(**{name: row.pop(name) for name in BipedState.__dataclass_fields__})
        scene = Scene.uniform(row["mu_static"], row["mu_kinetic"])
        return step(default_model(dtype="float32"), scene, state, row["torque"], row["dt"])

    rows = dict(zip(SOUND, spoilt([*SOUND.values()]).T, strict=True))
    return jax.tree.map(np.asarray, jax.vmap(one)(rows))


@pytest.mark.parametrize("name", SOUND)
def test_a_step_marks_every_number_that_is_none(name):
    after, contact = stepped()
    for i, (field, value) in enumerate(ROWS):
        if field == name and not np.isfinite(value):
            assert contact.status[i] == Status.NON_FINITE, (field, value)
    assert not np.any(unmarked(contact.status, (after, contact)))


@pytest.mark.parametrize("name", SOUND)
def test_a_number_that_is_none_spoils_no_other(name):
    """A rate of inf, times no time, would make the crank angle nan."""
    after, _ = stepped()
    for i, (field, value) in enumerate(ROWS):
        if field == name and not np.isfinite(value):
            for other in {"phase", "crank_rate", "foot_position", "foot_velocity"} - {name}:
                assert getattr(after, other)[i] == np.float32(SOUND[other]), (name, value, other)


def test_forces_at_an_instant_mark_every_number_that_is_none():
    names = ("phase", "crank_rate", "foot_velocity", "torque", "mu_static", "mu_kinetic")
    rows = spoilt([SOUND[name] for name in names])
    forward = jax.vmap(jax.jit(partial(forward_dynamics, default_model(dtype="float32"))))
    found = jax.tree.map(np.asarray, forward(*rows.T))
    assert np.all(found.status[~np.isfinite(rows).all(1)] == Status.NON_FINITE)
    assert not np.any(unmarked(found.status, found))
    motion = rows[:, [0, 1, 3, 2, 2]]
    inverse = jax.vmap(jax.jit(partial(inverse_dynamics, default_params("float32"))))
    found = jax.tree.map(np.asarray, inverse(*motion.T))
    assert np.all(found.status[~np.isfinite(motion).all(1)] == Status.NON_FINITE)
    assert not np.any(unmarked(found.status, found))
    phase = np.linspace(SUPPORT_START, SUPPORT_END, 5, dtype=np.float32)
    still = np.zeros_like(phase)
    assert np.all(np.asarray(inverse(phase, still, still, still, still).status) == Status.OK)


def test_a_vehicle_marks_every_number_that_is_none():
    sound = (4.0, 1.5, 1.6, 0.8, 50.0, 300.0, 0.28)
    rows = spoilt(sound)

    @jax.jit
    def one(x, rear, front, friction, wheel_mass, body_mass, wheel_radius):
        vehicle = UGVParams(wheel_mass=wheel_mass, body_mass=body_mass, wheel_radius=wheel_radius)
        angles = jnp.stack([rear, front])
        return equilibrium(vehicle, Track.bump().astype(jnp.float32), x, angles, friction)

    found = jax.tree.map(np.asarray, jax.vmap(one)(*rows.T))
    assert np.all(found.status[~np.isfinite(rows).all(1)] != Status.OK)
    assert not np.any(unmarked(found.status, found))
