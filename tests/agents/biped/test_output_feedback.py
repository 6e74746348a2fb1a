"""The baseline that reads an encoder alone: what it finds out, and that it keeps the foot."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.biped.controllers import StopAtMark
from stickslip.agents.biped.output_feedback import FRICTIONS, OutputFeedback
from stickslip.agents.biped.prediction import GaitTable, OptimalGait
from stickslip.dynamics import Scene
from stickslip.dynamics.biped.estimation import Belief, mixed
from stickslip.envs import BipedEnv, Randomisation
from stickslip.envs.functional import pure_step

ENV = BipedEnv(autoreset="disabled")
STEPS = 300


@pytest.fixture(scope="module")
def controller() -> OutputFeedback:
    """It follows a constant rate: no gait is solved for."""
    table = GaitTable(np.array([2.6]), np.zeros((1, 2)), np.full((1, 2), 2.6**2))
    return OutputFeedback(StopAtMark(gait=OptimalGait(gaits=table)), most=0.5).validate()


@pytest.mark.long
def test_friction_and_payload_are_found_by_an_encoder_alone(controller):
    drawn = Randomisation(payload=(0.0, 4.0))
    scene = Scene.uniform(0.04, 0.04 * 0.83)
    params = ENV.make_params(scene=scene, randomisation=drawn)
    obs, state = ENV.reset_env(jax.random.key(3), params)

    @jax.jit
    def walk(state, obs):
        def body(carry, _):
            memory, state, obs = carry
            memory, action = controller.act(memory, obs, state, params)
            obs, state, _, ended, _, info = pure_step(ENV, jax.random.key(0), state, action, params)
            found = memory.estimate
            payload = found.probabilities @ found.bank.mean[:, 3]
            best = jnp.argmax(found.probabilities)
            deviation = jnp.sqrt(found.bank.covariance[best, 3, 3])
            rows = found.friction(0.5), payload, deviation, memory.friction, ended, info["slid"]
            return (memory, state, obs), rows

        start = controller.init(params, state), state, obs
        return jax.lax.scan(body, start, None, STEPS)[1]

    friction, payload, deviation, used, ended, slid = walk(state, obs)
    assert not np.any(ended)
    near = FRICTIONS[np.argsort(np.abs(np.log(FRICTIONS / 0.04)))[:2]]
    assert np.any(np.isclose(friction[-1], near))
    error = float(payload[-1]) - float(state.drawn.payload)
    assert abs(error) < 0.3
    assert deviation[-1] < 0.1, "1.15 kg before"
    assert np.mean(used[50:] < 0.04) > 0.9
    assert np.sum(slid[-100:]) < np.sum(slid[:100]) / 3, "it has learnt what holds"


def test_a_changed_floor_mixes_beliefs_as_a_mixture_of_normal_distributions(float64):
    rng = np.random.default_rng(0)
    n, change = 3, 0.2
    root, nothing = rng.normal(size=(n, 8, 8)), np.zeros(n)
    bank = Belief(rng.normal(size=(n, 8)), root @ root.transpose(0, 2, 1), *[nothing] * 3)
    before = np.array([0.7, 0.3, 0.0])
    found, after = mixed(jax.tree.map(jnp.asarray, bank), jnp.asarray(before), change)
    moves = change / n + (1 - change) * np.eye(n)
    np.testing.assert_allclose(after, before @ moves)
    for j in range(n):
        weights = before * moves[:, j] / (before @ moves)[j]
        mean = weights @ bank.mean
        off = bank.mean - mean
        spread = bank.covariance + off[:, :, None] * off[:, None, :]
        np.testing.assert_allclose(found.mean[j], mean)
        np.testing.assert_allclose(found.covariance[j], np.tensordot(weights, spread, 1))


@pytest.mark.parametrize(
    "given", [{"noise": 0.0}, {"quantile": 1.5}, {"changes": -1.0}, {"ratio": float("nan")}]
)
def test_bad_settings_are_named(controller, given):
    with pytest.raises(ValueError, match=f"{next(iter(given))} = .*accepted"):
        replace(controller, **given).validate()


@pytest.mark.long
def test_it_walks_over_ice_that_it_cannot_see():
    from stickslip.agents import evaluate_task

    for task in ("BipedIce-v0", "BipedLateEncoder-v0"):
        table = evaluate_task(task, {"it": OutputFeedback()})
        assert table.row(task, "it").metrics["task_score"].value > 0.85
