"""Bad values raise ValueError with the field, what was given and what is accepted."""

import re
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from tests.dynamics.biped.helpers import default_model, default_params

bars = BipedParams.from_bars


def walk(**changes):
    """A sound call of simulate with something unsound in it."""
    options = {"scene": Scene.grip(), "state": BipedState(), "torque": 1.0, "duration": 1.0}
    options |= {"dt": 0.01} | changes
    names = ("scene", "state", "torque", "duration", "dt")
    values = [options.pop(name) for name in names]
    return simulate(default_model(dtype="float32"), *values, **options)


def replaced(**changes):
    return default_params("float32").replace(**changes)


BAD = {
    # what: (call, field, given, accepted)
    "mu_k > mu_s": (lambda: Scene.uniform(0.1, 0.2), "mu_kinetic", "0.2", "mu_static"),
    "friction a word": (lambda: Scene.uniform("ice"), "mu_static", "'ice'", "finite"),
    "edges unordered": (lambda: Scene.patches([0.6, 0.3], [1, 2, 3]), "edges", "0.6", "increasing"),
    "unknown floor": (lambda: Scene("ice").validate(), "floor", "'ice'", "Grip"),
    "a list, by dataclasses.replace": (
        lambda: replace(default_params("float32"), payload=[1.0]), "payload", "[1.0]", "array"
    ),
    "zero length": (lambda: bars(crank_length=0.0), "crank", "0.0", "> 0"),
    "negative length": (lambda: bars(femur=-1.0), "femur", "-1.0", "a finite number > 0"),
    "infinite gravity": (lambda: bars(gravity=np.inf), "gravity", "inf", "a finite number > 0"),
    "no mass at all": (
        lambda: bars(bar_density=0.0, hip_mass=0.0, foot_mass=0.0), "total mass", "0.0", "> 0",
    ),
    "too few masses": (lambda: replaced(mass=np.ones(12)), "mass", "(12,)", "(13,)"),
    "unknown field": (lambda: replaced(shin=1.0), "shin", "'shin'", "tibia"),
    "no duration": (lambda: walk(duration=0.0), "duration", "0.0", "> 0"),
    "too few torques": (lambda: walk(torque=jnp.ones(7)), "torque", "(7,)", "100"),
    "a torque that is not hashable": (
        lambda: walk(torque=type("Pull", (), {"__call__": abs, "__hash__": None})()),
        "torque", "object at", "a hashable function",
    ),
    "a torque by NumPy": (
        lambda: walk(torque=lambda now: np.sin(now.time)), "torque", "<lambda>", "jax.numpy"
    ),
    "a torque with an if": (
        lambda: walk(torque=lambda now: 1.0 if now.time > 0 else 0.0), "torque", "<", "jax.numpy"
    ),
    "unknown fidelity": (lambda: walk(fidelity="coarse"), "fidelity", "'coarse'", "'table'"),
    "unknown integrator": (
        lambda: walk(integrator="leapfrog"), "integrator", "'leapfrog'", "'rk4_split'"
    ),
    "phase out of range": (
        lambda: walk(state=BipedState(phase=0.3)), "phase", "0.3", "pi/2 to 3 pi/2",
    ),
    "a sliding foot on grip": (
        lambda: walk(state=BipedState(foot_velocity=0.1)), "foot_velocity", "0.1", "0 [m/s]",
    ),
    "events not recorded": (lambda: walk().events(), "events", "RK4Split", "record_events=True"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_bad_values_are_refused_by_name_value_and_what_is_accepted(what):
    call, *words = BAD[what]
    with pytest.raises(ValueError, match=re.escape(words[0])) as caught:
        call()
    for word in words[1:]:
        assert word in str(caught.value)


@pytest.mark.parametrize("length", [{"rocker": 1.0}, {"femur": 20.0}, {"slot_depth": 10.0}])
def test_a_linkage_that_cannot_close_is_refused_with_the_angle(float64, length):
    said = r"cannot close at crank angle \d\.\d+ rad \(\d+"
    with pytest.raises(ValueError, match=said) as caught:
        bars(**length)
    assert "accepted: lengths whose loops close" in str(caught.value)


def test_in_a_batch_the_member_that_cannot_close_is_named(float64):
    with pytest.raises(ValueError, match=r"batch member 1"):
        bars(rocker=jnp.asarray([2.5, 1.0, 2.5]))


def test_axes_to_map_over_and_traced_robots_are_no_numbers_to_check():
    robot = default_params("float32")
    axes = replace(jax.tree.map(lambda leaf: None, robot), gravity=0)
    weights = jax.vmap(lambda one: one.gravity * one.total_mass, (axes,))(
        jax.jit(lambda up: replace(robot, gravity=up))(jnp.asarray([-9.81, 9.81]))
    )
    expected = np.array([-9.81, 9.81]) * float(robot.total_mass)
    np.testing.assert_allclose(weights, expected, rtol=1e-6)
