"""Switches inside control steps, told at their instants."""

import jax
import numpy as np
import pytest

from stickslip.agents.biped.controllers import CrankSpeedPI
from stickslip.agents.biped.pictures.switching import (
    Switch,
    _agreeing,
    _without_brief,
    accuracy_of,
    sliding_spans,
    switches_of,
)
from stickslip.agents.evaluation.rollout import rollout, without_resets
from stickslip.agents.registry import machine_by_name
from stickslip.dynamics.biped import RK4, EventExact, RK4Split, simulate
from stickslip.dynamics.status import EventKind
from stickslip.envs import BipedEnv
from stickslip.envs.biped.draw import drawn_scene
from stickslip.envs.biped.params import Randomisation

SLIP, STICK, EXCHANGE = EventKind.SLIP, EventKind.STICK, EventKind.EXCHANGE


@pytest.fixture(scope="module")
def walk():
    """A walk of a few steps on a floor whose friction is drawn: environment, parameters, episode
    and switches."""
    env = without_resets(BipedEnv())
    drawn = Randomisation(friction=(0.3, 0.5))
    params = env.make_params(time_limit=2.0, randomisation=drawn)
    played = rollout(env, CrankSpeedPI(), params, 0).trimmed()
    return env, params, played, switches_of(played, env, params)


def test_switches_lie_inside_the_steps_that_they_changed(walk):
    env, params, played, found = walk
    kinds = [one.kind for one in found]
    assert min(kinds.count(kind) for kind in (SLIP, STICK, EXCHANGE)) >= 1
    states = played.state.biped
    for one in found:
        assert one.step - 1 <= one.time / 0.02 <= one.step + 1e-5
        if one.kind == EXCHANGE:  # the crank's angle, with its acceleration even over the step
            phase, rate = (getattr(states, name)[one.step - 2] for name in ("phase", "crank_rate"))
            after = one.time - (one.step - 1) * 0.02
            gain = (states.crank_rate[one.step - 1] - rate) / 0.02
            angle = phase + rate * after + gain * after**2 / 2
            assert angle == pytest.approx(1.5 * np.pi, abs=5e-3)
    assert max(one.time / 0.02 % 1 for one in found) > 0.05  # not all at a step's end
    shown = machine_by_name("biped").shown(played, env, params, "walker")
    told = [one.time for one in shown.events]
    assert told == pytest.approx([one.time for one in found], abs=1e-7)
    assert shown.spans is not None
    slid = float(np.sum(shown.spans[:, 1] - shown.spans[:, 0]))
    most = 0.02 * np.count_nonzero(played.info["slid"])
    assert 0.5 * most < slid <= most + 1e-6
    assert "0.1 ms" in shown.timing
    factor = float(played.start_state.drawn.friction)
    assert dict(shown.facts)["friction, drawn"].startswith(f"{factor:.4g}")
    assert shown.drawing is not None
    assert f"{0.06 * factor:.3g}" in shown.drawing.stretches[0].words


@pytest.mark.long
def test_instants_are_those_of_the_whole_walk(walk):
    env, params, played, found = walk
    start = played.start_state
    whole = simulate(
        params.robot,
        drawn_scene(start.drawn, params),
        start.biped,
        jax.numpy.asarray(played.info["torque"]),
        len(played.reward) * 0.02,
        0.02,
        fidelity=env.fidelity,
        integrator=RK4Split(max_events=3, record_events=True),
    )
    told = [Switch(time, EventKind[kind.upper()], 1) for time, kind, _ in whole.events()]
    told = _without_brief(told)
    assert [one.kind for one in found] == [one.kind for one in told]
    np.testing.assert_allclose([one.time for one in found], [one.time for one in told], atol=1e-4)


def test_what_a_log_lacks_is_told_for_the_steps_end():
    still, slides, steps = np.array([False, False]), np.array([False, True]), np.array([0, 0])
    assert _agreeing([(0.01, SLIP)], slides, steps, 0.02) == [(0.01, SLIP)]
    assert _agreeing([], slides, steps, 0.02) == [(0.02, SLIP)]
    assert _agreeing([(0.01, SLIP)], still, steps, 0.02)[1:] == [(0.02, STICK)]
    assert _agreeing([(0.01, EXCHANGE)], still, steps, 0.02) == []
    assert _agreeing([], still, np.array([3, 2]), 0.02) == [(0.02, EXCHANGE)]


def test_slides_that_are_over_at_once_are_none_and_turning_back_is_no_rest():
    rows = [(0.1, SLIP, 1), (0.1, STICK, 0), (0.2, SLIP, 1), (0.3, STICK, 0), (0.3, SLIP, -1)]
    found = _without_brief([Switch(time, kind, 1, way) for time, kind, way in rows])
    assert [(one.time, one.kind, one.way) for one in found] == [(0.2, SLIP, 1), (0.3, SLIP, -1)]
    np.testing.assert_allclose(sliding_spans(found, 0.5), [[0.2, 0.5]])
    ended = [*found, Switch(0.4, STICK, 1), Switch(0.45, EXCHANGE, 1, 1)]
    np.testing.assert_allclose(sliding_spans(ended, 0.5), [[0.2, 0.4]])
    assert sliding_spans([], 0.5).shape == (0, 2)


@pytest.mark.parametrize(
    ("spec", "said"),
    [(RK4Split(), "20 ms"), (RK4(4), "steps of 5 ms"), (EventExact(rtol=1e-6), "tolerance")],
)
def test_how_exact_it_is_depends_on_the_integrator(spec, said: str):
    assert said in accuracy_of(spec, 0.02)
