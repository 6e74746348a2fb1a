"""Handing over support: without an impact where the linkage is symmetric, else refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status, biped
from stickslip.dynamics.biped import links
from tests.dynamics.biped import helpers

ENDS = [biped.SUPPORT_START, biped.SUPPORT_END]
CRACKED = {"femur": 9.2}
"""A length that breaks the symmetry; the linkage still closes."""

mismatch = jax.jit(biped.exchange_mismatch)


def uneven(**lengths) -> biped.BipedParams:
    return biped.BipedParams.from_bars(**(lengths or CRACKED))


@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_M_P_and_Y_have_period_pi_whatever_the_masses(float64, scale):
    params = helpers.default_params()
    masses = jnp.asarray(np.random.default_rng(3).uniform(0.1, 2.0, 13))
    balanced = np.where(np.arange(13)[:, None] == 7, 0.0, 0.01)  # the crank stays on its axis
    params = params.replace(mass=scale * masses, centre=params.centre + balanced)
    inertia = helpers.inertia_along(params, ENDS)
    for name in ("M", "P", "Y"):
        start, end = getattr(inertia, name)
        np.testing.assert_allclose(start, end, rtol=1e-11, err_msg=name)
    for name in ("dM", "dP", "dY"):
        start, end = getattr(inertia, name)
        assert abs(start - end) > 1e-3, f"{name} is expected to jump"


@pytest.mark.parametrize("direction", [1, -1], ids=["forwards", "backwards"])
@pytest.mark.parametrize("mu", [0.02, 5.0], ids=["slipping", "sticking"])
def test_exchange_changes_nothing_but_the_leg(float64, direction, mu):
    """Rates and foot speed go on through it, to the step's order; the floor position leaps."""
    model = helpers.default_model()
    begin = biped.SUPPORT_END if direction > 0 else biped.SUPPORT_START
    phase, rate, velocity = begin - direction * 1e-5, 3.0 * direction, 0.05 * (mu < 1)
    state = helpers.state_of(phase=phase, crank_rate=rate, foot_velocity=velocity)
    scene, size = Scene.uniform(jnp.asarray(mu), jnp.asarray(mu)), jnp.asarray(1e-5)
    given = model, scene, state, jnp.asarray(0.0), size
    after, contact = biped.step(*given, integrator=helpers.RECORDING)
    assert int(contact.switches) == 1
    assert int(after.steps) == direction
    np.testing.assert_allclose(after.crank_rate, state.crank_rate, rtol=2e-3)
    np.testing.assert_allclose(after.foot_velocity, state.foot_velocity, atol=1e-3)
    np.testing.assert_allclose(after.crank_angle - state.crank_angle, 3e-5 * direction, rtol=1e-2)
    moved = biped.floor_position(model, after) - biped.floor_position(model, state)
    np.testing.assert_allclose(moved, 0.24 * direction, atol=1e-5)


def test_mismatch_is_rounding_for_the_default_and_grows_with_the_asymmetry(float64):
    assert float(mismatch(helpers.default_params())) < 1e-12
    assert float(mismatch(biped.BipedParams.from_bars(crank_length=0.1, hip_mass=9.0))) < 1e-12
    single = biped.BipedParams.from_bars(crank_length=0.032, dtype="float32").astype(np.float64)
    assert 1e-6 < float(mismatch(single)) < links.MISMATCH / 10
    assert bool(biped.prepare(single).symmetric)
    values = [float(mismatch(uneven(femur=femur))) for femur in (9.001, 9.01, 9.1)]
    assert values[0] > 1e-4
    assert values[0] < values[1] < values[2]


def test_an_unbalanced_crank_breaks_the_exchange(float64):
    """Its arms change places, so that M, P and Y have not the period of the step any more."""
    params = helpers.default_params()
    params = params.replace(centre=params.centre.at[7].set(jnp.asarray([0.003, 0.0])))
    M = helpers.inertia_along(params, ENDS).M
    assert abs(float(M[0] - M[1])) > 1e-5
    np.testing.assert_allclose(mismatch(params), 0.1, rtol=1e-12)


def test_walking_on_with_an_impact_is_refused(float64):
    with pytest.raises(ValueError, match=r"breaks the exchange of support: .* steps=\"one\""):
        biped.simulate(uneven(), Scene.grip(), helpers.state_of(), 1.0, 1.0, 0.01)


def test_in_a_batch_the_asymmetric_member_stops_at_the_exchange(float64):
    robots = [helpers.default_model(), helpers.model_of(uneven())]
    models = jax.tree.map(lambda *leaves: jnp.stack(leaves), *robots)
    scene, size = Scene.grip(outputs="state"), jnp.asarray(0.01)
    state = helpers.state_of(phase=biped.SUPPORT_END - 0.01, crank_rate=3.0)
    given = scene, state, jnp.asarray(1.0), size
    after, contact = jax.vmap(lambda model: biped.step(model, *given))(models)
    assert contact.status.tolist() == [Status.OK, Status.NO_EXCHANGE]
    assert after.steps.tolist() == [1, 0]
    np.testing.assert_allclose(after.phase[1], biped.SUPPORT_END, atol=1e-9)
