"""Names and inputs that no system takes are refused before anything is traced."""

import jax.numpy as jnp
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.bodies.newton_euler import condition_number, newton_euler


def test_solvers_without_a_matrix_have_no_condition_number():
    with pytest.raises(ValueError, match="solver = 'groups' is unknown; accepted: 'lu'"):
        condition_number(BipedParams.from_bars(), jnp.asarray(2.0), solver="groups")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"system": "backward"},
            "system = 'backward' is unknown; accepted: 'inverse', 'inverse_gr",
        ),
        ({"solver": "qr"}, "solver = 'qr' is unknown; accepted: 'lu', 'scaled'"),
        ({"torque": None}, "torque is missing; accepted: torque, mu_kinetic, direction"),
        ({"crank_acceleration": 1.0}, "crank_acceleration is given; accepted: torque, mu"),
        (
            {"difference_step": 0.0},
            r"difference_step = 0.0; accepted: None \(exact\) or a crank an",
        ),
        ({"difference_step": True}, "difference_step = True; accepted"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(changes, message):
    right = {"system": "forward_slip", "torque": 1.0, "mu_kinetic": 0.1, "direction": 1.0}
    with pytest.raises(ValueError, match=message):
        newton_euler(BipedParams.from_bars(), jnp.asarray(2.0), jnp.asarray(1.0), **right | changes)
