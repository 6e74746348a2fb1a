"""The drawing of a page has the links where the kinematics put them, and every slide."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.links import kinematics
from stickslip.dynamics.scene import Patches
from stickslip.envs.biped.picture import biped_drawing, stretches_of
from stickslip.envs.rendering.drawing import Drawing
from stickslip.envs.rendering.linkage import Mechanism
from tests.envs.rendering.frames import walk_rows


def drawn(count: int, slide: float = 0.0) -> Drawing:
    return biped_drawing(walk_rows(count, slide), Mechanism(BipedParams.from_bars()))


def test_bars_end_at_the_pins_of_the_kinematics():
    frames = walk_rows(30)
    drawing = drawn(30)
    i = 25
    exact = jax.jit(kinematics)(BipedParams.from_bars(), jnp.asarray(frames.phase[i]))
    leg = frames.steps[i] % 2
    tibia = [part for part in drawing.parts if part.group == leg and part.role == "main"]
    (bar,) = next(part.bars for part in reversed(tibia) if part.bars)
    ends = drawing.points[i, list(bar)] - [frames.floor_position[i], 0.0]
    np.testing.assert_allclose(ends, np.stack([exact.pins.E[0], exact.pins.K[0]]), atol=1e-5)


def test_a_leg_keeps_its_points_across_an_exchange_of_support():
    drawing = drawn(60)
    assert drawing.active is not None
    assert len(np.unique(drawing.active)) == 2
    leaps = np.abs(np.diff(drawing.points, axis=0)).max(axis=(1, 2))
    exchange = np.flatnonzero(np.diff(drawing.active))
    assert leaps[exchange].max() < 1.5 * np.delete(leaps, exchange).max()


def test_every_slide_is_marked_with_its_length():
    marks = drawn(60, slide=2e-3).marks
    assert marks is not None
    assert np.nansum(marks[:, 3]) == pytest.approx(59 * 2e-3, rel=1e-6)
    assert np.sum(marks[:, 2] - marks[:, 1]) == pytest.approx(59 * 2e-3, rel=1e-6)
    assert np.isfinite(marks[:, 3]).sum() == len(np.unique(walk_rows(60).steps))
    assert drawn(60).marks.shape == (0, 4)


def test_only_the_foot_that_carries_is_pushed_by_the_ground():
    one, other = drawn(60).contacts
    np.testing.assert_array_equal(np.isfinite(np.stack([one.normal, other.normal])).sum(axis=0), 1)


def test_patches_are_stretches_of_the_floor():
    floor = Patches(jnp.array([0.5]), jnp.array([0.3, 0.05]), jnp.array([0.3, 0.04]))
    first, second = stretches_of(floor)
    assert (first.end, second.start) == (0.5, 0.5)
    assert (first.icy, second.icy) == (False, True)
    assert "0.05" in second.words
