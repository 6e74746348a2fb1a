"""Populations: each member is a training of its own."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import register
from stickslip.agents.machine import unregister
from stickslip.agents.training.ppo import (
    Population,
    PPOTrainer,
    Rates,
    Sizes,
    settings_of,
    train_population,
)
from tests.agents.mass import MassConfig, MassEnv, MassMachine, MassParams

ENV, PARAMS = MassEnv(), MassParams()
SIZES = Sizes(num_envs=8, rollout_steps=16, batch_size=32, epochs=2, hidden=8)
STEPS = 3 * SIZES.samples


@pytest.fixture(autouse=True)
def _mass():
    register(MassMachine())
    yield
    unregister("mass")


def trained(seeds, rates=Rates(), **options) -> Population:  # noqa: B008
    return train_population(ENV, PARAMS, (SIZES, rates), seeds, timesteps=STEPS, **options)


def assert_close(one: Population, first: int, other: Population, second: int, atol: float = 2e-5):
    pairs = zip(jax.tree.leaves(one.learner), jax.tree.leaves(other.learner), strict=True)
    for left, right in pairs:
        np.testing.assert_allclose(left[first], right[second], atol=atol, rtol=1e-3)


@pytest.fixture(scope="module")
def three() -> Population:
    return trained([4, 9, 4], Rates(discount=jnp.asarray([0.99, 0.99, 0.9])))


def test_members_depend_on_their_seeds_and_numbers_alone(three):
    told = []
    alone = trained([4], stretches=2, tell=lambda now: told.append(now.timesteps))
    assert told == [2 * SIZES.samples, STEPS]
    assert_close(alone, 0, three, 0)
    assert_close(trained([4], Rates(discount=0.9)), 0, three, 2)
    weights = three.learner.actor[0][0]
    for one, other in ((0, 1), (0, 2)):
        assert not np.allclose(weights[one], weights[other], atol=1e-3)


@pytest.mark.long
def test_a_member_is_the_trainers_own_run_of_its_seed(three):
    assert three.timesteps == STEPS
    config = MassConfig.of(  # in two stretches, which are as one
        seed=9,
        timesteps=STEPS,
        num_envs=8,
        rollout_steps=16,
        batch_size=32,
        epochs=2,
        hidden=8,
    )
    assert settings_of(config)[0] == SIZES
    rows = []
    trainer = PPOTrainer(config, ENV, PARAMS, rows.append, lambda: False)
    for goal in (1, STEPS):
        trainer.begin_stretch(trainer.timesteps)
        trainer.advance(goal)
    one, other = three.policy(1), trainer.policy()
    for left, right in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_allclose(left, right, atol=2e-5, rtol=1e-3)
    np.testing.assert_allclose(
        three.losses["value_loss"][1], [row.losses["value_loss"] for row in rows], rtol=1e-3
    )
    ended = [np.mean(row.ended["episode_return"]) if row.ended else np.nan for row in rows]
    np.testing.assert_allclose(three.losses["return"][1], ended, rtol=1e-4)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rates": Rates(noise=[0.1, 0.2, 0.3])}, r"shape \(3,\) with 2 seeds"),
        ({"sizes": Sizes(2**16, 2**20, 2**10)}, "num_envs = 65536, .* samples"),
        ({"sizes": replace(SIZES, hidden=4096, layers=8), "seeds": [0] * 64}, "hidden = 4096, lay"),
    ],
)
def test_nonsense_is_refused(given, words):
    settings = given.get("sizes", SIZES), given.get("rates", Rates())
    with pytest.raises(ValueError, match=words):
        train_population(ENV, PARAMS, settings, given.get("seeds", [0, 1]), timesteps=STEPS)
