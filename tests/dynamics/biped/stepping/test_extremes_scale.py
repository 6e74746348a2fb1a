"""Robots of any size and mass walk alike; heavy loads; linkages a hair from not closing."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from tests.dynamics.biped.helpers import default_model, model_of
from tests.dynamics.biped.stepping.marching import Start, march

pytestmark = pytest.mark.long

BINARY = [
    (1.0, 1.0, 1.0),
    *[(4.0**k, 2.0**j, 1.0) for k in (-5, 0, 5) for j in (-20, 0, 20) if k or j],
    (1.0, 1.0, 4.0**5),
    (1.0, 1.0, 4.0**-5),
]
"""(length, mass, gravity) against the default robot: 4^5 = 1024, 2^20 = 1.05e6. These powers of two
scale every number of a walk exactly, so that the results agree bit for bit."""


WALKS = [
    {"phase": 2.0, "crank_rate": 3.0, "torque": 0.9, "dt": 0.01, "count": 100},
    {"phase": 3.0, "crank_rate": 3.0, "foot_velocity": -0.2, "torque": 0.5, "dt": 0.005,
     "count": 60},
    {"phase": 3.0, "crank_rate": -3.0, "torque": -0.8, "dt": 0.01, "count": 60},
]  # fmt: skip
FLOORS = [(0.06, 0.05), (0.1, 0.05), (0.3, 0.2)]


def robot(length: float, mass: float, gravity: float, dtype: str) -> BipedParams:
    """The default robot with its lengths, masses and gravity scaled."""
    return BipedParams.from_bars(
        0.03 * length,
        1.48 * mass / length,
        0.7 * mass,
        0.3 * mass,
        1e-3 * mass * length**2,
        gravity=9.81 * gravity,
        dtype=jnp.dtype(dtype),
    )


def scaled_walks(scales, dtype) -> dict[str, np.ndarray]:
    """Every walk by every robot, in units of its length, mass and sqrt(length / gravity)."""
    rows, units = [], []
    for length, mass, gravity in scales:
        model = model_of(robot(length, mass, gravity, dtype.name))
        second = np.sqrt(length / gravity)
        for walk, (mu_static, mu_kinetic) in zip(WALKS, FLOORS, strict=True):
            start = Start(mu_static, mu_kinetic, **walk, model=model)
            rows.append(
                replace(
                    start,
                    crank_rate=start.crank_rate / second,
                    foot_velocity=start.foot_velocity * length / second,
                    torque=start.torque * mass * length * gravity,
                    dt=start.dt * second,
                )
            )
            units.append((length, second, mass * gravity))
    end = march(rows, default_model(dtype=dtype.name), dtype)
    assert np.all(end.sound)
    length, second, force = np.array(units).T.astype(dtype)
    state, contact = end.state, end.contact
    return {
        "phase": state.phase,
        "steps": state.steps,
        "crank_rate": state.crank_rate * second,
        "foot_position": state.foot_position / length,
        "foot_velocity": state.foot_velocity * second / length,
        "time": state.time / second,
        "friction_force": contact.friction_force / force,
        "normal_force": contact.normal_force / force,
        "zmp": contact.zmp / length,
        "work": end.work / (force * length),
        "path": end.path / length,
        "switches": end.switches,
        "status": contact.status,
    }


def test_size_mass_and_gravity_scale_out_bit_for_bit(dtype):
    """Time scales with sqrt(length / gravity), force with mass gravity, torque with length, too."""
    found = scaled_walks(BINARY, dtype)
    assert found["switches"].max() > 5
    assert found["path"].max() > 0.1
    for name, values in found.items():
        by_robot = values.reshape(len(BINARY), len(WALKS))
        np.testing.assert_array_equal(by_robot, by_robot[:1].repeat(len(BINARY), 0), name)
