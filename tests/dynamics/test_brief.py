"""Parameters, scenes and tracks show themselves in a line, whatever their numbers are."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.ugv import Track
from stickslip.envs import BipedEnv, UGVEnv

MAKERS = {
    "patches": lambda: Scene.patches(np.arange(40.0), np.full(41, 0.5), payload=1.0),
    "rough": Track.rough,
    "function": lambda: Track.from_function(jnp.sin),
    "biped": lambda: BipedEnv().make_params(scene="ice-patch"),
    "ugv": lambda: UGVEnv().make_params(track="rough"),
}


def require_line(tree):
    text = repr(tree)
    assert "\n" not in text
    assert text.startswith(type(tree).__name__ + "(")
    assert len(text) < 1200


@pytest.mark.parametrize("name", MAKERS)
def test_a_repr_is_a_line_for_one_for_a_batch_and_when_traced(name):
    tree = MAKERS[name]()
    require_line(tree)
    require_line(jax.tree.map(lambda leaf: jnp.stack([jnp.asarray(leaf)] * 30), tree))
    jax.eval_shape(lambda one: require_line(one) or jnp.zeros(()), tree)
    require_line(jax.tree.map(lambda _: 0, tree))


def test_a_repr_names_fields_and_their_values():
    text = "Scene(floor=Uniform(mu_static=0.06, mu_kinetic=0.05), steps='one', outputs='forces')"
    assert repr(Scene.uniform(0.06, 0.05, steps="one")) == text
    assert "knots=float64[193]" in repr(Track.rough())
