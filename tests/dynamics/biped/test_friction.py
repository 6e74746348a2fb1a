"""Coulomb's law, and inverse beside forward dynamics, at random instants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.dynamics import Status
from tests.dynamics.biped.helpers import default_params, forward, inverse

INSTANTS = {
    "theta": st.floats(np.pi / 2, 3 * np.pi / 2),
    "rate": st.floats(-5, 5),
    "torque": st.floats(-4, 4),
    "mu_static": st.floats(0, 1.2),
    "ratio": st.floats(0, 1),
}


@given(**INSTANTS, velocity=st.sampled_from([-0.3, 0.0, 0.0, 1e-9, 0.2]))
def test_forward_dynamics_obeys_coulomb_and_inverts_inverse_dynamics(
    float64, theta, rate, torque, mu_static, ratio, velocity
):
    params, mu_kinetic = default_params(), mu_static * ratio
    now = forward(params, theta, rate, velocity, torque, mu_static, mu_kinetic)
    if int(now.status) == Status.NO_SOLUTION:
        assert mu_kinetic > 1.29  # MODEL 1.4: not below
    f, N, mode = float(now.friction_force), float(now.normal_force), int(now.mode)
    if mode == 0:
        assert velocity == 0
        assert float(now.foot_acceleration) == 0
        assert abs(f) <= mu_static * N
    else:
        assert f == pytest.approx(-mode * mu_kinetic * N, rel=1e-12, abs=1e-12)
        assert mode == np.sign(velocity or float(now.foot_acceleration)) or N <= 0
    asked = inverse(params, theta, rate, now.crank_acceleration, velocity, now.foot_acceleration)
    assert float(asked.torque) == pytest.approx(torque, abs=1e-10)
    assert float(asked.friction_force) == pytest.approx(f, abs=1e-9)
    assert float(asked.normal_force) == pytest.approx(N, abs=1e-9)
    assert float(asked.zmp) == pytest.approx(float(now.zmp), rel=1e-9, abs=1e-9)
