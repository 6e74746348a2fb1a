"""Every integrator under the same friction switching: order, events, rest, cost, refusals."""

from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import INTEGRATORS, BipedState, EventExact, simulate, step
from tests.dynamics.biped.helpers import default_model, floor_of, outcome, start_of, state_of

pytestmark = pytest.mark.long

EXACT = EventExact(rtol=1e-12, atol=1e-14, record_events=True)
SLIPPERY = (0.06, 0.05)


@partial(jax.jit, static_argnums=0)
def _ending(integrator, model, scene, state, torque, duration, count):
    size = duration / count.astype(duration.dtype)

    def once(_, now):
        return step(model, scene, now, torque, size, integrator=integrator)[0]

    return jax.lax.fori_loop(0, count, once, state)


def ending(integrator, scene: Scene, state: BipedState, torque, duration, count) -> np.ndarray:
    """Where a walk ends after `count` equal steps; one compilation for every count."""
    numbers = jnp.asarray(torque), jnp.asarray(duration), jnp.asarray(count)
    scene = jax.tree.map(jnp.asarray, scene)
    return np.asarray(outcome(_ending(integrator, default_model(), scene, state, *numbers)))


@pytest.mark.parametrize("index", range(6))
def test_event_exact_meets_every_reference_trajectory(float64, reference, index):
    case = reference["trajectories"][index]
    walk = simulate(
        default_model(), floor_of(case), start_of(case), case["torque"], case["t_end"], 0.05,
        integrator=EXACT,
    )  # fmt: skip
    final = walk.final
    expected = [case["theta"], case["omega"], case["slide"]]
    found = [float(final.crank_angle), float(final.crank_rate), float(final.foot_position)]
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-10)
    # the first trajectory's own exchange instant is off by 9e-12 s (see test_reference)
    assert float(final.foot_velocity) == pytest.approx(case["slide_velocity"], abs=1e-10)
    events = walk.events()
    assert [kind for _, kind, _ in events] == [kind for _, kind, _ in case["events"]]
    times = [time for time, *_ in events]
    assert times == pytest.approx([time for time, *_ in case["events"]], abs=3e-11)


def test_event_exact_s_error_follows_its_tolerance(float64):
    state = state_of(phase=2.0, crank_rate=3.0)
    exact = ending(EXACT, Scene.uniform(0.06, 0.06 * 0.8), state, 0.0, 1.2, 10)
    errors = []
    for rtol in (1e-5, 1e-7, 1e-9):
        spec = EventExact(rtol=rtol, atol=rtol * 1e-3, max_turn=1.0)
        found = ending(spec, Scene.uniform(0.06, 0.048), state, 0.0, 1.2, 3)
        errors.append(np.abs(found - exact).max())
    assert errors[0] < 1e-3
    assert errors[1] < 1e-5
    assert errors[2] < 1e-7
    assert errors[2] < errors[1] < errors[0]


STARTS = {  # phase, crank rate, torque, mu_static, mu_kinetic
    "forwards": (2.0, 3.0, 0.0, *SLIPPERY),
    "backwards": (4.3, -3.0, 0.0, *SLIPPERY),
    "at rest": (2.5, 1.0, 0.3, 0.9, 0.8),
}
DT, COUNT = 2e-3, 600


@lru_cache
def walks(name: str, dtype: str):
    """All of STARTS as one batch of walks, 1.2 s; and the first one by itself."""
    phase, rate, torque, *mu = jnp.asarray(list(STARTS.values()), dtype).T
    model, spec = default_model(dtype=dtype), INTEGRATORS[name]

    def walk(phase, rate, torque, mu_static, mu_kinetic):
        state = state_of(dtype)
        state = BipedState(**(vars(state) | {"phase": phase, "crank_rate": rate}))
        scene, torques = Scene.uniform(mu_static, mu_kinetic), jnp.broadcast_to(torque, COUNT)
        return simulate(model, scene, state, torques, COUNT * DT, DT, integrator=spec)

    return jax.jit(jax.vmap(walk))(phase, rate, torque, *mu)


def member(trajectory, start: str):
    index = list(STARTS).index(start)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[index], trajectory)


@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("start", ["forwards", "backwards"])
def test_a_foot_breaks_loose_slides_and_comes_to_rest_walking_either_way(float64, name, start):
    """At rest means exactly 0; friction acts against the slide."""
    walk = member(walks(name, "float64"), start)
    velocity, contacts = walk.states.foot_velocity, walk.contacts
    assert int(walk.contacts.status.max()) == Status.SLIP_ONSET
    assert np.any(velocity != 0)
    assert np.all(velocity[[0, -1]] == 0)
    rest = velocity[1:] == 0
    assert np.all(np.abs(contacts.friction_force)[rest] <= 0.0605 * contacts.normal_force[rest])
    against = contacts.friction_force * np.sign(velocity[1:])
    assert np.all(against[(contacts.mode != 0) & ~rest] < 0)


@pytest.mark.parametrize("name", ["euler", "rk4_split", "event_exact"])
def test_a_foot_at_rest_within_the_cone_does_not_move(dtype, name):
    """It keeps its place and its zero velocity to the last digit."""
    walk = member(walks(name, str(dtype)), "at rest")
    assert walk.states.phase.dtype == dtype
    assert np.all(walk.states.foot_velocity == 0)
    assert np.all(walk.states.foot_position == 0)
    assert np.all(walk.contacts.status == Status.OK)


def test_an_adaptive_call_that_runs_out_of_steps_says_so_and_how_far_it_came(float64):
    model, scene = default_model(), Scene.uniform(0.5, 0.4)
    state, spec = state_of(phase=2.0, crank_rate=3.0), EventExact(rtol=1e-10, max_steps=20)
    after, contact = step(model, scene, state, 0.5, 1.0, integrator=spec)
    assert int(contact.status) == Status.NOT_CONVERGED
    assert 0 < float(after.time) < 1.0
    assert np.isfinite(np.asarray(outcome(after))).all()
    enough = step(model, scene, state, 0.5, 0.1, integrator=EventExact(rtol=1e-10, max_steps=400))
    assert int(enough[1].status) == Status.OK
