"""The least friction of a motion without slip, against sampling by the full inverse dynamics."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, inverse_dynamics, simulate
from stickslip.optim.gait.footing import Footing

pytestmark = pytest.mark.usefixtures("float64")


def uses(robot, phases, rates, accelerations):
    """|F| / N by the inverse dynamics at each state."""
    at = jax.jit(jax.vmap(lambda *state: inverse_dynamics(robot, *state, outputs="forces")))
    motion = at(*map(jnp.asarray, (phases, rates, accelerations)))
    return np.abs(motion.friction_force) / np.asarray(motion.normal_force)


def test_a_constant_rate_needs_the_chapters_friction():
    robot = BipedParams.from_bars()
    phases = np.linspace(np.pi / 2, 3 * np.pi / 2, 20_001)
    fine = uses(robot, phases, np.full(20_001, 3.0), np.zeros(20_001))
    need = Footing.of(robot).at_rate(3.0)
    assert need.friction == pytest.approx(fine.max(), rel=1e-6)
    assert need.friction == pytest.approx(0.08, abs=1e-3)
    assert need.crank_angle == pytest.approx(phases[np.argmax(fine)], abs=1e-3)
    assert Footing.of(robot).at_rate(9.5).friction == np.inf  # the foot leaves the ground


@pytest.mark.long
def test_rates_over_time_and_angle_need_what_fine_samples_of_them_show():
    robot = BipedParams.from_bars(hip_mass=1.1)
    footing, times = Footing.of(robot), np.linspace(0, 2, 200_001)
    acceleration = np.array([4.0, -6.0])  # to 4 rad/s in a second and back through rest
    rate = np.where(times < 1, 4 * times, 4 - 6 * (times - 1))
    angle = 2.0 + np.where(times < 1, 2 * times**2, 2 + 4 * (times - 1) - 3 * (times - 1) ** 2)
    phase = np.pi / 2 + np.mod(angle - np.pi / 2, np.pi)
    fine = uses(robot, phase, rate, acceleration[(times >= 1).astype(int)])
    need = footing.accelerated(angle[::100_000], rate[::100_000], acceleration)
    assert need.friction == pytest.approx(fine.max(), rel=1e-4)
    nodes, rates = np.array([1.8, 3.0, 4.5, 1.8 + np.pi]), np.array([2.0, 4.0, 3.0, 2.0])
    angle = np.linspace(nodes[0], nodes[-1], 200_001)
    rate, rise = np.interp(angle, nodes, rates), np.diff(rates) / np.diff(nodes)
    slope = rise[np.clip(np.searchsorted(nodes, angle, "right") - 1, 0, 2)]
    phase = np.pi / 2 + np.mod(angle - np.pi / 2, np.pi)
    fine = uses(robot, phase, rate, rate * slope)
    assert footing.along(nodes, rates).friction == pytest.approx(fine.max(), rel=1e-4)


@pytest.mark.long
def test_held_torques_need_what_a_walk_in_tiny_steps_shows():
    robot, fine = BipedParams.from_bars(), 200
    torques = np.array([1.6, 1.0, 0.8, -0.4, -0.6, -0.5, -0.8, -0.8, -0.5, 0.5])
    start, floor = BipedState(phase=4.4, crank_rate=0.5), Scene.grip(outputs="state")
    walks = [
        simulate(robot, floor, start, np.repeat(torques, n), 1.0, 0.1 / n, integrator="event_exact")
        for n in (1, fine)
    ]
    coarse, tiny = (jax.tree.map(np.asarray, walk) for walk in walks)
    states, rates = coarse.states, coarse.states.crank_rate
    assert np.any(rates < 0)
    assert states.steps[-1] != states.steps[0]
    angle, seconds = states.phase + np.pi * states.steps, np.diff(states.time)
    need = Footing.of(robot).driven(angle, rates, torques, seconds)
    contacts = tiny.contacts
    sampled = np.max(np.abs(contacts.friction_force) / contacts.normal_force)
    assert need.friction == pytest.approx(sampled, rel=2e-3)  # its samples miss jumps by 0.5 ms
    assert need.friction > sampled * (1 - 1e-6)
