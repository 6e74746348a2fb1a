"""What a reset draws is drawn apart: no draw says anything of another."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from stickslip.envs import UGVRandomisation
from stickslip.envs.biped import state as of_biped
from stickslip.envs.ugv import state as of_ugv
from tests.envs import helpers
from tests.envs.ugv import helpers as ugv

KEYS = 400


def of_the_biped() -> Callable[[Array], Any]:
    params = helpers.task("random")[1]
    return lambda key: of_biped.draw(key, params)


def of_the_ugv() -> Callable[[Array], Any]:
    params = ugv.task("short")[1]
    ranges = UGVRandomisation(friction=(0.1, 0.9), start_angles=(1.0, 2.0))
    params = params.replace(randomisation=ranges)

    def draws(key: Array) -> Any:
        drawn, angles = of_ugv.draw(key, params)
        return drawn.friction, list(angles)

    return draws


@pytest.mark.parametrize(("draws", "count"), [(of_the_biped, 6), (of_the_ugv, 3)])
def test_draws_are_independent_of_each_other(draws, count):
    keys = jax.vmap(jax.random.key)(jnp.arange(KEYS))
    leaves = [np.asarray(of, float) for of in jax.tree.leaves(jax.jit(jax.vmap(draws()))(keys))]
    values = np.stack([of for of in leaves if np.ptp(of) > 0])
    assert len(values) == count
    correlation = np.corrcoef(values) - np.eye(count)
    assert np.abs(correlation).max() < 0.2  # four standard deviations
