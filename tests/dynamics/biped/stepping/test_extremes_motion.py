"""Starting anywhere, at any rate, torque and time step: a named end, finite numbers, no gifts."""

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, step
from tests.dynamics.biped.helpers import (
    default_model,
    default_params,
    inertia_along,
    inverse,
    state_of,
)
from tests.dynamics.biped.stepping.marching import Start, march
from tests.dynamics.biped.stepping.test_extremes_friction import long_footed

pytestmark = pytest.mark.long

LIFT_OFF_RATE = 8.6238
"""At constant crank speed [rad/s]: where m g + Y' w^2 first vanishes, at 1.035 pi."""


@pytest.mark.parametrize("direction", [1, -1])
def test_constant_crank_speed_lifts_off_at_the_known_rate(float64, direction):
    """On a floor without slip; a foot that can slip does so first, since its cone closes."""
    params, angles = default_params(), np.linspace(SUPPORT_START, SUPPORT_END, 4001)
    _, _, _, _, _, dY = inertia_along(params, angles)
    phase = angles[dY.argmin()]
    weight = float(params.total_mass) * float(np.asarray(params.gravity))
    rate = np.sqrt(weight / -dY.min())
    assert rate == pytest.approx(LIFT_OFF_RATE, abs=1e-3)
    scene, model = Scene.grip(outputs="state"), default_model()
    for share, status in ((0.999, Status.OK), (1.001, Status.LIFT_OFF)):
        motion = [jnp.asarray(x) for x in (phase, direction * share * rate, 0.0, 0.0, 0.0)]
        needed = inverse(params, *motion)
        assert needed.normal_force / weight == pytest.approx(1 - share**2, abs=1e-6)
        state = state_of(phase=phase, crank_rate=direction * share * rate)
        after, contact = step(model, scene, state, needed.torque, jnp.asarray(1e-9))
        assert int(contact.status) == status
        assert (float(after.time) > 0) == (status == Status.OK)


def test_walking_backwards_retraces_the_walk_forwards(dtype):
    """A held foot has no friction work: turn the rate round and the walk runs back through its
    exchanges to where it began, kinetic energy and all."""
    counts, single = (50, 400, 800), dtype == jnp.float32
    go = [Start(mu_static=1e6, crank_rate=20.0, dt=1e-3, count=n) for n in counts]
    there = march(go, long_footed(dtype.name), dtype)
    assert there.state.steps.max() >= 2
    assert set(there.status) == {Status.OK}
    back = [
        Start(1e6, None, float(phase), -float(rate), dt=1e-3, count=n)
        for phase, rate, n in zip(there.state.phase, there.state.crank_rate, counts, strict=True)
    ]
    again = march(back, long_footed(dtype.name), dtype)
    assert set(again.status) == {Status.OK}
    turned = again.state.phase + np.pi * (again.state.steps + there.state.steps)
    np.testing.assert_allclose(turned, SUPPORT_START, atol=3e-4 if single else 2e-6)
    np.testing.assert_allclose(again.state.crank_rate, -20.0, atol=3e-3 if single else 2e-5)
