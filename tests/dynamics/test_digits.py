"""Numbers given while double precision is off have all their digits once it is on."""

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, simulate
from stickslip.dynamics.biped.contact import edge_ahead, friction_on
from stickslip.dynamics.ugv import Odometer, Track, UGVParams

GIVEN = {
    "friction": lambda: Scene.uniform([0.1, 0.3], [0.07, 0.3], payload=[0.1, 0.7]),
    "patches": lambda: Scene.patches([0.3, 0.7], [0.6, 0.1, 0.3], payload=0.1),
    "patches in NumPy": lambda: Scene.patches(np.array([0.3, 0.7]), np.array([0.6, 0.1, 0.3])),
    "vehicle": lambda: UGVParams(body_length=[0.83, 0.7], leg_length=np.array([0.3, 0.35])),
    "points": lambda: Track.from_points([0.1, 0.7, 1.3], [1500.1, 1500.3, 1500.2]),
    "rough ground": lambda: Track.rough(3, start=1000.1, end=1010.0),
    "table": lambda: Track.sinusoid().resampled(0.1, 9.7, 50),
    "odometer": lambda: Odometer.along(Track.rough(3)),
}


def test_what_was_made_in_double_precision_is_refused_where_that_is_off():
    with jax.enable_x64(True):
        robot, env = BipedParams.from_bars(), gymnasium.make("stickslip/Biped-v0", setting="exact")
        env.reset(seed=0)
    asks = {
        "params.crank": lambda: simulate(robot, "grip", BipedState(), 0.1, 0.1, 0.01),
        "the environment": lambda: env.step([0.0]),
        "params": lambda: env.unwrapped.functional.reset(jax.random.key(0), env.unwrapped.params),
    }
    for name, ask in asks.items():
        with pytest.raises(ValueError, match=f"^{name} is float64, which JAX has switched off"):
            ask()


@pytest.mark.parametrize("make", GIVEN.values(), ids=GIVEN)
def test_numbers_have_the_digits_that_double_precision_gives_them(make):
    early = make()
    with jax.enable_x64(True):
        for one, other in zip(jax.tree.leaves(early), jax.tree.leaves(make()), strict=True):
            np.testing.assert_array_equal(jnp.asarray(one), other)


def test_a_double_walk_finds_the_edges_and_frictions_that_were_given():
    floor = Scene.patches([0.3, 0.7], [0.6, 0.1, 0.3]).floor
    with jax.enable_x64(True):
        here = np.int32(1)
        assert edge_ahead(floor, here, np.float64(1.0), np.float64) == 0.7
        assert friction_on(floor, here, np.float64).mu_static == 0.1
