"""The linkage stays closed, on the chapter's branches, whatever its lengths."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stickslip.dynamics.biped import BODIES, LINKS, BipedParams, kinematics, step_length
from tests.dynamics.biped.helpers import default_params

along = jax.jit(jax.vmap(kinematics, in_axes=(None, 0)))
ANGLES = np.linspace(0.0, 2 * np.pi, 361)

NAMES = ("ground_link", "rod", "rod_pin", "rocker", "tendon_drop", "upper_tendon", "lower_tendon")
NAMES += ("femur", "femur_pin", "tibia", "tibia_pin", "stabiliser", "slot_depth", "offset")
DEFAULTS = dict(zip(NAMES, (2, 5, 2.5, 2.5, 12, 6, 6, 9, 3, 18, 6, 4.2, 4, 2), strict=True))
PERTURBATIONS = st.lists(st.floats(0.93, 1.07), min_size=len(NAMES), max_size=len(NAMES))


def perturbed(factors) -> BipedParams:
    """A robot with every length off by some per cent, if there is one."""
    lengths = {name: DEFAULTS[name] * f for name, f in zip(NAMES, factors, strict=True)}
    try:
        return BipedParams.from_bars(**lengths)
    except ValueError:
        assume(False)
        raise


def distance(a, b):
    return np.linalg.norm(np.asarray(a) - np.asarray(b), axis=-1)


def pinned_lengths(params: BipedParams, now):
    """(length as built, pin, pin) of every distance that the links hold, both legs."""
    A, B, D = (now.hip_pins[:, None, i] for i in range(3))
    p = now.pins
    yield params.ground_link, A, B
    yield params.tendon_drop, B, D
    yield params.crank, A, p.crank_pin
    yield params.rod_pin, p.crank_pin, p.rod_pin
    yield params.rod, p.crank_pin, p.C
    yield params.rod - params.rod_pin, p.rod_pin, p.C
    yield params.rocker, p.rod_pin, B
    yield params.upper_tendon, D, p.F
    yield params.femur_pin, p.F, p.C
    yield params.femur, p.K, p.C
    yield params.femur - params.femur_pin, p.K, p.F
    yield params.lower_tendon, D, p.H
    yield params.tibia_pin, p.H, p.K
    yield params.tibia, p.E, p.K
    yield params.tibia - params.tibia_pin, p.E, p.H
    yield params.stabiliser, p.C, p.slot_pin
    yield params.offset, p.E, p.ankle_bar
    yield params.offset, p.K, p.knee_bar
    yield params.offset, p.C, p.C_bar
    yield params.tibia, p.ankle_bar, p.knee_bar
    yield params.femur, p.knee_bar, p.C_bar


def hip_axes(now):
    """The hip's own directions (A to B, and up) in the ground frame."""
    ahead = np.asarray(now.hip_pins[:, 1] - now.hip_pins[:, 0])
    ahead = ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)
    return ahead[:, None], np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)[:, None]


@settings(max_examples=25)
@given(factors=PERTURBATIONS)
def test_links_keep_lengths_the_pin_its_slot_and_parallelograms_are_parallel(float64, factors):
    params = perturbed(factors)
    now = along(params, jnp.asarray(ANGLES))
    for length, a, b in pinned_lengths(params, now):
        assert np.max(np.abs(distance(a, b) - np.asarray(length))) < 1e-14
    assert np.min(now.closure) > 0
    pins = jax.tree.map(np.asarray, now.pins)
    _, up = hip_axes(now)
    depth = np.sum((pins.slot_pin - np.asarray(now.hip_pins)[:, None, 0]) * up, axis=-1)
    np.testing.assert_allclose(depth, -float(np.asarray(params.slot_depth)), rtol=1e-13)
    foot = pins.ankle_bar - pins.E
    np.testing.assert_allclose(pins.knee_bar - pins.K, foot, atol=1e-14)
    np.testing.assert_allclose(pins.C_bar - pins.C, foot, atol=1e-14)
    stabiliser = (pins.slot_pin - pins.C) * np.asarray(params.offset / params.stabiliser)
    np.testing.assert_allclose(stabiliser, foot, atol=1e-14)


def body_ends(now):
    """For every body that is a uniform bar: (number, tail, head) of the pins it lies between."""
    p = now.pins
    B, D = (now.hip_pins[:, None, i] for i in (1, 2))
    return [
        (2, p.E, p.K), (3, p.K, p.C), (4, p.H, D), (5, p.K, p.knee_bar), (6, D, p.F),
        (7, p.C, p.crank_pin),
        (9, p.rod_pin, B), (10, p.C, p.slot_pin), (11, p.ankle_bar, p.knee_bar),
        (12, p.knee_bar, p.C_bar),
    ]  # fmt: skip


def test_bodies_are_where_their_pins_are_and_point_along_them(float64):
    """The order of BODIES, for both legs: a bar's centre is the middle between its pins."""
    now = along(default_params(), jnp.asarray(ANGLES))
    assert len(BODIES) == 24
    assert len(set(BODIES)) == 24
    for number, tail, head in body_ends(now):
        tail, head = np.broadcast_arrays(tail, head)
        for leg, name in enumerate((str(number), f"{number}p")):
            body = BODIES.index(name)
            middle = (tail[:, leg] + head[:, leg]) / 2
            np.testing.assert_allclose(now.centres[:, body], middle, atol=1e-15, err_msg=name)
            way = head[:, leg] - tail[:, leg]
            turn = np.asarray(now.angles[:, body]) - np.arctan2(way[:, 1], way[:, 0])
            np.testing.assert_allclose(np.cos(turn), 1.0, rtol=1e-14, err_msg=name)
    crank, hip, foot = (BODIES.index(name) for name in ("8", "13", "1p"))
    np.testing.assert_allclose(now.centres[:, crank], now.hip_pins[:, 0], atol=1e-16)
    np.testing.assert_allclose(now.centres[:, foot], now.pins.E[:, 1], atol=1e-16)
    ahead, up = (axis[:, 0] for axis in hip_axes(now))
    want = now.hip_pins[:, 0] + 0.03 * (1.0 * ahead - 6.0 * up)
    np.testing.assert_allclose(now.centres[:, hip], want, atol=1e-15)


def test_centres_follow_their_link_frames(float64):
    """A centre off its link's axis moves with the link: along by x, to the left by y."""
    params = default_params()
    moved = params.replace(centre=params.centre + jnp.asarray([0.01, 0.02]))
    angles = jnp.asarray(ANGLES)
    before, after = along(params, angles), along(moved, angles)
    c, s = jnp.cos(before.angles), jnp.sin(before.angles)
    shift = jnp.stack([0.01 * c - 0.02 * s, 0.01 * s + 0.02 * c], axis=-1)
    np.testing.assert_allclose(after.centres - before.centres, shift, atol=1e-15)


def chapter_angles(theta8):
    """Rod and rocker from eq. (6), stabiliser from eq. (8), as printed."""
    c, s = np.cos(theta8), np.sin(theta8)
    root = s * np.sqrt(-16 * c**2 - 60 * c + 100)
    polynomial = -4 * c**2 + 13 * c - 10
    theta7 = np.arccos((polynomial + root) / (25 - 20 * c))
    theta9 = np.arccos((polynomial - root) / (-25 + 20 * c))
    return theta7, theta9, np.arcsin((5 * np.sin(theta7) - s - 4) / 4.2)


def test_angles_are_those_of_the_printed_arccos_forms(float64):
    angles = np.random.default_rng(1).uniform(0, 2 * np.pi, len(ANGLES))
    now = along(default_params(), jnp.asarray(angles))
    theta7, theta9, theta10 = chapter_angles(angles)
    hip = np.asarray(now.angles[:, BODIES.index("13")])
    np.testing.assert_allclose(hip, -theta10, atol=1e-14)
    for name, want in (("7", theta7), ("9", theta9), ("10", theta10), ("8", angles)):
        turn = np.asarray(now.angles[:, BODIES.index(name)]) - hip - want
        np.testing.assert_allclose(np.sin(turn), 0.0, atol=2e-8, err_msg=name)
        assert np.all(np.cos(turn) > 0), name


@pytest.mark.parametrize("crank_length", [0.01, 0.03, 0.2])
def test_a_step_is_eight_crank_lengths(float64, crank_length):
    params = BipedParams.from_bars(crank_length=crank_length)
    np.testing.assert_allclose(jax.jit(step_length)(params), 8 * crank_length, rtol=1e-14)


def test_default_robot_weighs_what_the_model_page_says(float64):
    params = default_params()
    assert len(LINKS) == 13
    np.testing.assert_allclose(params.total_mass, 8.466, rtol=1e-4)
    loaded = params.replace(payload=5.0).total_mass
    np.testing.assert_allclose(loaded - params.total_mass, 5.0, rtol=1e-14)


def test_float32_positions_are_the_float64_ones(float64):
    angles = ANGLES
    fine = along(default_params(), jnp.asarray(angles))
    coarse = along(default_params().astype(jnp.float32), jnp.asarray(angles, jnp.float32))
    for a, b in zip(jax.tree.leaves(coarse.pins), jax.tree.leaves(fine.pins), strict=True):
        assert a.dtype == jnp.float32
        assert np.max(np.abs(np.asarray(a, float) - b)) < 1e-6  # of lengths up to half a metre
