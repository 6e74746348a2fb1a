"""Parameters, scenes and tracks show themselves in a line or two, whatever their numbers are."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.envs import BipedEnv, Randomisation, RandomTrack, UGVEnv, UGVRandomisation

MOST = 400
"""Characters, however many numbers there are."""


@lru_cache
def trees() -> dict[str, Any]:
    biped, ugv = BipedEnv().default_params, UGVEnv().default_params
    drawn = UGVRandomisation(RandomTrack.named("random-mixed"), (0.5, 0.9), (1.0, 2.0))
    return {
        "patches": Scene.patches(np.arange(40.0), np.full(41, 0.5), payload=1.0),
        "robot": BipedParams.from_bars(crank_length=0.04, payload=1.0),
        "biped": biped.replace(scene="ice-patch", slip_weight=1.0),
        "ugv": ugv.replace(track="rough", randomisation=drawn, friction=0.5),
        "points": Track.from_points([0.0, 1.0, 2.0], [0.0, 0.1, 0.0]),
        "function": Track.from_function(jnp.sin),
    }


def require_short(tree: Any) -> str:
    text = repr(tree)
    assert "\n" not in text
    assert text.startswith((type(tree).__name__ + "(", type(tree).__name__ + "."))
    assert text.count("(") == text.count(")")
    assert len(text) <= MOST * 2, text
    return text


@pytest.mark.parametrize("name", ["patches", "robot", "biped", "ugv", "points", "function"])
def test_it_is_short_for_one_for_a_batch_and_when_traced(name):
    tree = trees()[name]
    assert len(require_short(tree)) <= MOST
    require_short(jax.tree.map(lambda leaf: jnp.stack([jnp.asarray(leaf)] * 30), tree))
    jax.eval_shape(lambda one: require_short(one) and jnp.zeros(()), tree)
    require_short(jax.tree.map(lambda _: 0, tree))


def test_it_says_what_a_reader_asks_for():
    assert repr(Scene.named("slippery")) == "Scene.uniform(mu_static=0.06, mu_kinetic=0.05)"
    assert repr(Scene.grip(steps="one", payload=2.0)) == "Scene.grip(payload=2, steps='one')"
    assert repr(Track.bump(0.2)) == "Track.bump(height=0.2, centre=4, width=1, start=0, end=8)"
    assert repr(Track.flat()) == "Track.flat(start=0, end=8)"
    assert repr(BipedParams.from_bars()) == "BipedParams(total_mass=8.466)"
    assert repr(BipedParams.from_bars(payload=1.5)) == "BipedParams(total_mass=9.966, payload=1.5)"
    assert repr(UGVParams(body_mass=200.0)) == "UGVParams(total_mass=340, body_mass=200)"
    drawn = Randomisation(phase=(1.6, 4.6))
    assert repr(drawn) == "Randomisation(phase=(1.6, 4.6))"
    text = repr(BipedEnv().make_params(scene="firm", mean_rate=2.5, randomisation=drawn))
    for words in ("mu_static=0.5", "mean_rate=2.5", "total_mass=8.466", "phase=(1.6, 4.6)"):
        assert words in text
    assert "torque_limit" not in text
    text = repr(UGVEnv().make_params(track="bump", friction=0.6))
    for words in ("Track.bump(", "total_mass=440", "steps=66", "friction=0.6"):
        assert words in text
    assert "leg_rate" not in text
