"""Tracks of two shapes are two structures, a user's own shape among them."""

from dataclasses import dataclass
from itertools import combinations

import jax
import jax.numpy as jnp
import pytest

from stickslip.dynamics import register_pytree
from stickslip.dynamics.ugv.track import TRACKS, Track


@register_pytree
@dataclass(frozen=True)
class Waves:
    """A user's ground, of as many numbers as a bump and a step have."""

    height: float = 0.1
    width: float = 2.0
    place: float = 5.0

    def profile(self, x):
        """Height, slope and second derivative."""
        turn = (x - self.place) / self.width
        sine, cosine = self.height * jnp.sin(turn), self.height * jnp.cos(turn)
        return sine, cosine / self.width, -sine / self.width**2


def test_tracks_of_two_shapes_have_two_structures_a_users_own_among_them():
    tracks = [Track.named(name) for name in TRACKS] + [Track(Waves(), 0.0, 10.0)]
    shapes = {type(track.shape) for track in tracks}
    assert len({jax.tree.structure(track) for track in tracks}) == len(shapes) > 5
    for a, b in combinations(tracks, 2):
        same = jax.tree.structure(a) == jax.tree.structure(b)
        assert same == (type(a.shape) is type(b.shape))


def test_a_users_own_shape_is_driven_over():
    track = Track(Waves(), 0.0, 10.0)
    slope = jax.grad(lambda x: track.profile(x)[0])(6.0)
    assert float(slope) == pytest.approx(float(track.slope(6.0)))
    assert float(slope) == pytest.approx(0.1 * jnp.cos(0.5) / 2.0)
