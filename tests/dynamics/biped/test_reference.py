"""Every value of the reference file, to 1e-8 relative, in float64."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.dynamics.biped.helpers import (
    FINE,
    default_model,
    default_params,
    forward,
    inertia_along,
    walk,
)

close = partial(np.testing.assert_allclose, rtol=1e-8, atol=0.0)
STATES = range(8)
TRAJECTORIES = range(6)
STEPS = 3200
"""Enough for 1e-8: from here on, finer steps move nothing by more than 4e-9."""


def test_inertia_functions_are_the_reference(float64, reference):
    rows = reference["scalars"]
    got = inertia_along(default_params(), [row["theta"] for row in rows])
    for name, values in got._asdict().items():
        close(values, [row[name] for row in rows], err_msg=name)


@pytest.mark.parametrize("kind", ["stick", "slip"])
@pytest.mark.parametrize("index", STATES)
def test_forces_are_the_reference(float64, reference, index, kind):
    row = reference["states"][index]
    want, slips = row[kind], kind == "slip"
    velocity = row["slide_velocity"] * slips
    floor = (row["mu_kinetic"],) * 2 if slips else (1e6, 0.0)
    result = forward(default_params(), row["theta"], row["omega"], velocity, row["torque"], *floor)
    close(result.crank_acceleration, want["alpha"])
    close(result.foot_acceleration, want["foot_acceleration"] if slips else 0.0)
    close(result.friction_force, want["friction"])
    close(result.normal_force, want["normal"])
    close(result.zmp * result.normal_force, want["ankle_moment"])
    assert slips or float(result.zmp) == pytest.approx(want["zmp"], rel=1e-8, abs=0)
    assert int(result.mode) == np.sign(velocity)


@pytest.mark.parametrize(
    "fidelity", [pytest.param("reduced", marks=pytest.mark.long), FINE], ids=["exact", "table"]
)
@pytest.mark.parametrize("index", TRAJECTORIES)
def test_trajectories_end_and_switch_where_the_reference_does(float64, reference, index, fidelity):
    case = reference["trajectories"][index]
    walked = walk(case, STEPS, fidelity=fidelity)
    final, fastest = walked.final, float(np.max(np.abs(walked.states.foot_velocity)))
    close(final.crank_angle, case["theta"])
    close(final.crank_rate, case["omega"])
    close(final.foot_velocity, case["slide_velocity"], rtol=0.0, atol=1e-8 * fastest)
    close(final.foot_position, case["slide"])
    close(final.time, case["t_end"])
    events = walked.events()
    assert [kind for _, kind, _ in events] == [kind for _, kind, _ in case["events"]]
    for (time, _, angle), (want_time, _, want_angle) in zip(events, case["events"], strict=True):
        close(time, want_time)
        close(angle, want_angle)


def test_the_fine_table_stands_for_the_exact_functions(float64):
    angles = np.linspace(np.pi / 2, 3 * np.pi / 2, 2001)
    exact = inertia_along(default_params(), angles)
    table = jax.vmap(default_model(FINE).inertia.at)(jnp.asarray(angles))
    for want, got in zip(exact, table, strict=True):
        assert np.max(np.abs(got - want)) < 1e-12 * np.max(np.abs(want))
