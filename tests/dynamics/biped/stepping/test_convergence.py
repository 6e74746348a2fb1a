"""The integrator is of fourth order, and stays so across switching instants."""

import jax.numpy as jnp
import numpy as np
import pytest

from tests.dynamics.biped.helpers import (
    default_model,
    floor_of,
    last_state,
    outcome,
    start_of,
    walk,
)

COUNTS = np.array([200, 400, 800, 1600])
SHIFTS = np.array([0.87, 0.93, 1.0, 1.06, 1.13])
"""Around each count: where in its step an event falls is then averaged out."""
TRUTH = 25600
STICKING, SWITCHING = [1, 2], [0, 3, 4, 5]
SCALE = np.array([1.0, 1.0, 0.01, 0.1])  # rad, rad/s, m, m/s


def final(case, count):
    torque, duration = jnp.asarray(case["torque"]), jnp.asarray(case["t_end"])
    count = jnp.asarray(count, jnp.int32)
    scene, state = floor_of(case), start_of(case)
    return np.asarray(outcome(last_state(default_model(), scene, state, torque, duration, count)))


def observed_order(case) -> float:
    """Slope of log error over log step; the error is the largest of four, each to its scale."""
    truth = final(case, TRUTH)
    counts = np.rint(np.outer(COUNTS, SHIFTS)).astype(int)
    errors = [np.max(np.abs(final(case, count) - truth) / SCALE) for count in counts.flat]
    return -np.polyfit(np.log(counts.flat), np.log(errors), 1)[0]


@pytest.mark.parametrize("index", STICKING)
def test_order_is_four_while_sticking(float64, reference, index):
    assert observed_order(reference["trajectories"][index]) == pytest.approx(4, abs=0.1)


@pytest.mark.parametrize("index", SWITCHING)
def test_order_is_four_across_slips_stops_and_exchanges(float64, reference, index):
    """Two of the four approach 4 from above; none stays behind."""
    assert 3.95 < observed_order(reference["trajectories"][index]) < 4.6


@pytest.mark.parametrize("index", SWITCHING)
def test_coarse_steps_meet_every_event_of_the_reference(float64, reference, index):
    """In 50 steps (16 to 40 ms); a missed onset once waited for the end of its step."""
    case = reference["trajectories"][index]
    events = walk(case, 50).events()
    assert [kind for _, kind, _ in events] == [kind for _, kind, _ in case["events"]]
    last = max(time for time, _, _ in case["events"])
    for (time, _, _), (want, _, _) in zip(events, case["events"], strict=True):
        assert abs(time - want) < 0.04 * last
