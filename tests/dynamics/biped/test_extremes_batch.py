"""One bad member in a large batch leaves the others bit for bit, also where the batch thins out."""

from dataclasses import replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status, Uniform
from stickslip.dynamics.biped import BipedState, step
from stickslip.dynamics.pytrees import rebuilt
from tests.dynamics.biped.helpers import default_model

MEMBERS = 400
"""More than 6 x 64, below which a batch is not thinned out (lanes.py)."""

BAD = 137


@lru_cache
def batch():
    """Walks that stick, slip, stop and exchange: some need one trial, some many; float32."""
    rng = np.random.default_rng(21)

    def value(low, high):
        return jnp.asarray(rng.uniform(low, high, MEMBERS), jnp.float32)

    states = BipedState(
        phase=value(1.58, 4.70),
        steps=jnp.asarray(rng.integers(-3, 4, MEMBERS), jnp.int32),
        crank_rate=value(-6, 6),
        foot_position=value(-0.1, 0.1),
        foot_velocity=value(-0.2, 0.2) * jnp.asarray(np.arange(MEMBERS) % 3 == 0, jnp.float32),
        time=value(0, 1),
    )
    kinetic = value(0.02, 0.1)
    scenes = Scene(Uniform(kinetic + 0.02, kinetic), outputs="state")
    return jnp.ones(MEMBERS, bool), scenes, states, value(-1, 2)


@jax.jit
def _many(model, closes, scenes, states, torques):
    def one(closes, *member):
        return step(rebuilt(model, closes=closes), *member, jnp.float32(0.03))

    return jax.vmap(one)(closes, scenes, states, torques)


def many(*members):
    return _many(default_model(dtype="float32"), *members)


@lru_cache
def undisturbed():
    return many(*batch())


def disturbed(what: str):
    """The batch with one member spoilt, and the status that it must get."""
    closes, scenes, states, torques = batch()
    if what == "linkage":
        return many(closes.at[BAD].set(False), scenes, states, torques), {Status.NO_SOLUTION}
    if what in ("crank_rate", "foot_velocity", "phase"):
        spoilt = getattr(states, what).at[BAD].set(jnp.nan)
        states = replace(states, **{what: spoilt})
        return many(closes, scenes, states, torques), {Status.NON_FINITE}
    value = {"torque nan": jnp.nan, "torque inf": jnp.inf, "torque 1e6": 1e6}[what]
    ends = {Status.NON_FINITE}
    if what == "torque 1e6":
        ends = {Status.LIFT_OFF, Status.NOT_CONVERGED}
    return many(closes, scenes, states, torques.at[BAD].set(value)), ends


@pytest.mark.long
def test_the_batch_is_thinned_out_more_than_once_and_walks():
    _, contact = undisturbed()
    assert np.sum(contact.switches == 0) > 64  # done in the first round
    assert np.sum(contact.switches >= 1) > 64  # more than fit into one smaller batch
    assert np.sum(contact.switches >= 2) > 5


@pytest.mark.parametrize(
    "what",
    ["torque nan", "torque inf", "torque 1e6", "crank_rate", "foot_velocity", "phase", "linkage"],
)
def test_a_bad_member_is_named_and_leaves_the_others_alone(what):
    after, ends = disturbed(what)
    assert Status(int(after[1].status[BAD])) in ends
    others = np.arange(MEMBERS) != BAD
    for a, b in zip(jax.tree.leaves(undisturbed()), jax.tree.leaves(after), strict=True):
        np.testing.assert_array_equal(np.asarray(a)[others], np.asarray(b)[others])
