"""Derivatives of random walks that slide across patch edges, beside central differences."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import EventKind, Patches, Scene, Status
from stickslip.dynamics.biped import (
    SUPPORT_END,
    SUPPORT_START,
    BipedParams,
    BipedState,
    EventExact,
    RK4Split,
    own_time,
    prepare,
    step,
)

pytestmark = pytest.mark.long

WALKS = 250
CALLS = 12
"""Of half the robot's own time each, in a walk that crosses patch edges."""
DIFFERENCED = {
    "rk4_split": RK4Split(4, record_events=True),
    "event_exact": EventExact(1e-9, 1e-11, max_steps=100, record_events=True),
}


def over_patches(seed: int):
    """Random robots and walks in units of crank, gravity and mass; edges before a sliding foot."""
    random = np.random.default_rng(seed)
    times = lambda value, factor: value * factor ** random.uniform(-1, 1, WALKS)  # noqa: E731
    bars = {
        "crank_length": np.exp(random.uniform(np.log(0.01), np.log(0.3), WALKS)),
        "bar_density": times(1.48, 4.0),
        "hip_mass": times(0.70, 4.0),
        "foot_mass": times(0.30, 4.0),
        "gravity": times(9.81, 2.5),
    }
    robot = BipedParams.from_bars(**bars, heel=1e3, toe=1e3, dtype=float)
    forwards = random.choice([-1.0, 1.0], WALKS)
    static = random.uniform(0.02, 0.3, (WALKS, 3))
    edges = np.sort(forwards[:, None] * random.uniform(0.005, 0.2, (WALKS, 2)))
    return robot, {
        "edge": edges,
        "mu_static": static,
        "mu_kinetic": static * random.uniform(0.4, 1.0, (WALKS, 3)),
        "phase": random.uniform(SUPPORT_START, SUPPORT_END, WALKS),
        "crank_rate": random.uniform(0.05, 0.3, WALKS),
        "foot_velocity": forwards * random.uniform(0.05, 0.4, WALKS),
        "torque": random.uniform(-0.05, 0.2, WALKS),
    }


@pytest.mark.parametrize("name", DIFFERENCED)
def test_derivatives_across_patch_edges_are_those_that_differences_show(float64, name):
    """Along one random direction in all inputs. Central differences of fourth order; walks whose
    differences disagree with those of half the distance are left out."""
    robot, inputs = over_patches(3)
    model = prepare(robot, fidelity="table")
    units = jnp.asarray(robot.crank), own_time(robot), jnp.asarray(robot.total_mass)
    random = np.random.default_rng(4)
    along = {k: v * random.uniform(-1, 1, v.shape) for k, v in inputs.items()}

    def walk(model, units, given):
        length, time, mass = units
        scene = Scene(Patches(given["edge"] * length, given["mu_static"], given["mu_kinetic"]))
        rates = {"crank_rate": given["crank_rate"] / time}
        rates["foot_velocity"] = given["foot_velocity"] * length / time
        state, torque = BipedState(phase=given["phase"], **rates), given["torque"] * mass
        torque = torque * length**2 / time**2

        def body(now, _):
            spec = DIFFERENCED[name]
            after, contact = step(model, scene, now, torque, time / 2, integrator=spec)
            return after, (contact.status, contact.events.kinds)

        last, (status, kinds) = jax.lax.scan(body, state, length=CALLS)
        values = last.crank_angle, last.foot_position / length
        values += last.crank_rate * time, last.foot_velocity * time / length
        return jnp.stack(values), (jnp.max(status), kinds.ravel())

    def ahead(model, units, given, along):
        return jax.jvp(partial(walk, model, units), (given,), (along,), has_aux=True)

    _, slope, (status, kinds) = jax.jit(jax.vmap(ahead))(model, units, inputs, along)
    run, found = jax.jit(jax.vmap(walk)), []
    for shift in (1e-5, 5e-6):
        at = {}
        for k in (-2, -1, 1, 2):
            moved = jax.tree.map(lambda a, b: a + k * shift * b, inputs, along)  # noqa: B023
            at[k] = np.asarray(run(model, units, moved)[0])
        found.append((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * shift))
    assert np.all(np.isfinite(slope))
    size = np.max(np.abs(found[1]), axis=1)
    scatter, off = (np.max(np.abs(a - found[1]), axis=1) / size for a in (found[0], slope))
    edges = np.sum(np.asarray(kinds) == EventKind.PATCH, axis=1)
    crossing = (edges > 0) & (np.asarray(status) <= Status.SLIP_ONSET)
    sound = crossing & (scatter < 1e-5)
    print(
        f"\nderivatives across patch edges {name}: {np.sum(crossing)} walks cross "
        f"{np.sum(edges[crossing])} edges; {np.sum(sound)} with differences that agree: median "
        f"{np.median(off[sound]):.1e}, 99 % {np.quantile(off[sound], 0.99):.1e}, "
        f"most {off[sound].max():.1e}"
    )
    assert np.sum(crossing) >= 100
    assert np.sum(sound) > 0.9 * np.sum(crossing)
    assert np.mean(off[sound] < 1e-4) > 0.98
