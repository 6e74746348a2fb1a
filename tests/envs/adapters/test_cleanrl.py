"""Gymnasium's vector wrappers over our vector environment, in a loop as CleanRL writes it."""

from __future__ import annotations

import gymnasium
import numpy as np
from gymnasium.wrappers.vector import (
    ClipAction,
    NormalizeObservation,
    RecordEpisodeStatistics,
    RescaleAction,
)

import stickslip  # noqa: F401  (registers the environments)
from tests.envs.adapters.tiny import BIPED, hurry

NUM_ENVS, STEPS = 32, 16


def wrapped():
    envs = gymnasium.make_vec(BIPED, num_envs=NUM_ENVS, **hurry())
    return NormalizeObservation(ClipAction(RecordEpisodeStatistics(envs)))


def test_actions_beyond_the_limits_saturate_and_others_are_rescaled():
    plain = gymnasium.make_vec(BIPED, num_envs=NUM_ENVS, **hurry())
    limits = np.float32([-10.0]), np.float32([10.0])
    results = []
    for envs, action in ((wrapped().env, 3.0), (plain, 3.0), (RescaleAction(plain, *limits), 10.0)):
        envs.reset(seed=0)
        results.append(envs.step(np.full((NUM_ENVS, 1), action, np.float32))[0])
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[2], results[1])
