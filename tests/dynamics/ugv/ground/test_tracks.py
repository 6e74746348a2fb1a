"""Every kind of track gives its own derivatives, keeps its smoothness and refuses nonsense."""

from dataclasses import dataclass, fields, replace
from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import register_pytree
from stickslip.dynamics.ugv.ground.spline import INTERPOLATIONS
from stickslip.dynamics.ugv.track import TRACKS, Track
from tests.precision import mostly_single

RNG = np.random.default_rng(5)
POINTS_X = np.cumsum(RNG.uniform(0.2, 0.7, 20))
POINTS_Y = RNG.normal(0.0, 0.05, 20)
EVEN_X = np.linspace(-1.0, 9.0, 41)


MAKERS = {name: getattr(Track, name) for name in TRACKS}
HILLS = lambda x: 0.1 * jnp.sin(1.3 * x) + 0.02 * x**2 / (1 + x**2)  # noqa: E731
MAKERS["function"] = lambda: Track.from_function(HILLS)
MAKERS["table"] = lambda: Track.sinusoid().resampled(-1.0, 9.0, 50)
for kind in INTERPOLATIONS:
    MAKERS[f"{kind} points"] = lambda kind=kind: Track.from_points(POINTS_X, POINTS_Y, kind)
MAKERS["even points"] = lambda: Track.from_points(EVEN_X, np.sin(EVEN_X))

each_kind = pytest.mark.parametrize("kind", MAKERS)


@jax.jit
def profile(track, x):
    return track.profile(x)


def somewhere(count=200):
    return jnp.asarray(np.random.default_rng(1).uniform(-3.0, 12.0, count))


@each_kind
def test_slope_and_second_derivative_are_those_of_the_height(kind, float64):
    track, x, h = MAKERS[kind](), somewhere(), 1e-5
    _, slope, second = profile(track, x)
    ahead, behind = profile(track, x + h), profile(track, x - h)
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), slope, atol=2e-8)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), second, atol=3e-6)
    gradients = jax.jit(jax.vmap(lambda x: (jax.grad(track.height)(x), jax.grad(track.slope)(x))))
    np.testing.assert_allclose(gradients(x)[0], slope, atol=1e-13)
    np.testing.assert_allclose(gradients(x)[1], second, atol=1e-12)


@mostly_single
@each_kind
def test_profile_is_elementwise_and_in_the_floats_it_is_given(kind, dtype):
    track = MAKERS[kind]()
    x = jnp.linspace(-3.0, 12.0, 24, dtype=dtype)

    @jax.jit
    def every_way(track, x):
        parts = [track.profile(x.reshape(2, 3, 4)), jax.vmap(track.profile)(x.reshape(6, 4))]
        return track.profile(x), parts, (track.height(x), track.slope(x)), track.profile(x[3])

    whole, parts, alone, one_place = every_way(track, x)
    for shaped in parts:
        for one, other in zip(shaped, whole, strict=True):
            assert one.dtype == dtype
            np.testing.assert_allclose(one.ravel(), other, rtol=1e-5, atol=1e-6)
    assert [part.shape for part in one_place] == [(), (), ()]
    assert [part.shape for part in jax.eval_shape(track.profile, 2)] == [(), (), ()]
    assert {part.dtype for part in alone} == {dtype}


@each_kind
def test_numbers_may_be_traced_batched_and_differentiated(kind, float64):
    """A batch is each of its members; derivatives are those of differences."""
    track, x = MAKERS[kind](), somewhere(7)
    leaves, tree = jax.tree.flatten(track.astype(float))
    factors, h = np.asarray([0.9, 1.0, 1.1]), 1e-6
    copies = [np.stack([leaf] * 3) for leaf in map(np.asarray, leaves)]
    many = jax.jit(jax.vmap(lambda track, factor: profile(_scaled(track, factor), x)))
    ones = jax.jit(lambda factor: profile(_scaled(track, factor), x))
    for i, factor in enumerate(factors):
        for a, b in zip(many(jax.tree.unflatten(tree, copies), factors), ones(factor), strict=True):
            np.testing.assert_allclose(a[i], b, atol=1e-13)
    total = lambda factor: sum(jnp.sum(part) for part in profile(_scaled(track, factor), x))  # noqa: E731
    shifted = np.asarray([1 + h, 1 - h])  # as `factors`: one program
    ahead, behind = (sum(np.sum(part) for part in ones(factor)) for factor in shifted)
    slope = (ahead - behind) / (2 * h)
    found = jax.jit(lambda factor: (jax.grad(total)(factor), jax.jacfwd(total)(factor)))(1.0)
    np.testing.assert_allclose(found, [slope, slope], rtol=1e-6, atol=1e-7)


def _scaled(track, factor):
    """The track with each number of its shape but the knots scaled."""
    names = [f.name for f in fields(track.shape) if not f.metadata.get("static")]
    names = [n for n in names if n not in ("knots", "rests")]
    values = {n: jnp.asarray(getattr(track.shape, n), float) for n in names}
    axes = {n: (1,) * (v.ndim - jnp.ndim(factor)) for n, v in values.items()}
    changed = {n: v * jnp.reshape(factor, jnp.shape(factor) + axes[n]) for n, v in values.items()}
    return replace(track, shape=replace(track.shape, **changed))


@pytest.mark.parametrize(
    ("kind", "order"),
    [("cubic points", 2), ("even points", 2), ("table", 2), ("rough", 2), ("pchip points", 1),
     ("makima points", 1), ("linear points", 0), ("ramp", 2), ("step", 2), ("ditch", 2)],
)  # fmt: skip
def test_pieces_join_smoothly(kind, order, float64):
    """Nothing jumps up to the stated derivative, at the knots and past the ends."""
    track = MAKERS[kind]()
    shape = track.shape
    if hasattr(shape, "knots"):
        knots = shape.knots + shape.rests
        inner = knots if kind in ("cubic points", "even points") else knots[1:-1]
        ends = knots[[0, -1]]
    else:
        inner = ends = jnp.asarray([1.5, 2.5, 3.25, 3.75, 4.25, 4.75, 5.5, 6.5])
    at = lambda x: (np.asarray(part) for part in profile(track, x))  # noqa: E731
    for places, smooth in ((inner, order), (ends, min(order, 1))):
        jumps = [np.abs(a - b) for a, b in zip(at(places + 1e-9), at(places - 1e-9), strict=True)]
        for jump in jumps[: smooth + 1]:
            assert np.max(jump) < 1e-6


def test_points_are_met_and_the_ends_go_on_straight(dtype):
    for kind in INTERPOLATIONS:
        track = Track.from_points(POINTS_X, POINTS_Y, kind)
        np.testing.assert_allclose(track.height(jnp.asarray(POINTS_X, dtype)), POINTS_Y, atol=1e-6)
        for end, way in ((POINTS_X[0], -1.0), (POINTS_X[-1], 1.0)):
            out = jnp.asarray(end + way * np.asarray([0.5, 3.0, 40.0]), dtype)
            height, slope, second = track.profile(out)
            m = track.slope(jnp.asarray(end, dtype))
            np.testing.assert_allclose(slope, m, rtol=1e-5)
            y = track.height(jnp.asarray(end, dtype))
            np.testing.assert_allclose(height, y + m * (out - end), rtol=1e-5, atol=1e-5)
            np.testing.assert_array_equal(second, 0.0)


def test_a_table_of_quintics_converges_with_the_sixth_power(float64):
    track, x = Track.sinusoid(), jnp.linspace(0.0, 8.0, 4001)
    exact, errors = track.profile(x), {}
    for pieces in (20, 40):
        found = track.resampled(0.0, 8.0, pieces).profile(x)
        errors[pieces] = [np.max(np.abs(a - b)) for a, b in zip(found, exact, strict=True)]
    bound = (8 / 20) ** 6 * 0.05 * np.pi**6 / 46080
    assert 0.9 * bound < errors[20][0] < 1.001 * bound
    for k, power in enumerate((6, 5, 4)):
        np.testing.assert_allclose(errors[20][k] / errors[40][k], 2.0**power, rtol=0.1)


def test_named_grounds_have_the_shapes_they_say(float64):
    at = lambda track, *x: [float(v) for v in track.height(jnp.asarray(x))]  # noqa: E731
    assert at(Track.flat(), -3.0, 4.0) == [0.0, 0.0]
    np.testing.assert_allclose(at(Track.incline(-0.2), 3.0), -0.6)
    np.testing.assert_allclose(at(Track.bump(), 4.0, 5.0), [0.1, 0.1 / np.e])
    np.testing.assert_allclose(at(Track.sinusoid(), 0.5, 1.5), [0.05, -0.05])
    np.testing.assert_allclose(at(Track.ramp(), 1.0, 4.0, 6.5, 50.0), [0, 0.6, 1.2, 1.2])
    np.testing.assert_allclose(Track.ramp().slope(jnp.asarray([2.5, 4.0, 5.5])), 0.3)
    np.testing.assert_allclose(at(Track.step(), 3.75, 4.0, 4.25), [0, 0.05, 0.1], atol=1e-15)
    np.testing.assert_allclose(
        at(Track.ditch(), 3.2, 3.5, 3.75, 4.25, 5.0), [0, -0.05, -0.1, -0.1, 0], atol=1e-15
    )


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
