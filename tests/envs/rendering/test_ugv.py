"""Pictures of the UGV show what its frame says."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import jax
import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import UGVParams

pytest.importorskip("matplotlib")

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.ugv import UGVFrame, UGVRenderer
from tests.envs.ugv.helpers import drive, task

pytestmark = pytest.mark.long


@lru_cache
def frames() -> tuple[UGVFrame, ...]:
    """Of a drive with the legs held."""
    env, params = task()
    run = drive(env, params, np.zeros((int(params.steps), 2)))
    found = []
    for k in (0, 5, 10):
        state, info = jax.tree.map(lambda leaf, k=k: leaf[k], (run.state, run.info))
        found.append(env.picture(state, info, params))
    return tuple(found)


def pixels(picture: np.ndarray, colour: str) -> int:
    """How many have exactly a colour."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(picture.astype(int) - wanted).max(axis=-1) <= 2).sum())


def renderer(**options) -> UGVRenderer:
    return UGVRenderer(UGVParams(), "wheel_energy", "J", **options)


def test_a_frame_is_what_the_state_says():
    frame = frames()[1]
    (centre,), (contact,), (hinge,) = frame.wheels("centre"), frame.wheels("point"), frame.hinges
    far = np.hypot(*(centre - contact).T), np.hypot(*(hinge - centre).T)
    np.testing.assert_allclose(far[0], UGVParams().wheel_radius, rtol=1e-5)
    np.testing.assert_allclose(far[1], 0.35, rtol=1e-5)
    length = np.hypot(*(hinge[1] - hinge[0]))
    assert length == pytest.approx(UGVParams().body_length, rel=1e-5)
    assert contact[1, 0] == pytest.approx(frame.at.x[0])
    assert frame.preview.shape == (1, 4, 2)
    assert np.interp(frame.at.x[0], *frame.ground[0].T) == pytest.approx(contact[1, 1], abs=1e-3)
    assert np.all(frames()[2].turned < frame.turned)  # it rolls forwards


def test_a_picture_holds_vehicle_ground_and_forces():
    picture = renderer().draw(frames()[1])
    assert picture.shape == (540, 960, 3)
    assert picture.dtype == np.uint8
    for colour in (theme.HIP, theme.SUPPORT["main"], theme.SUPPORT["mid"], theme.HOLDS):
        assert pixels(picture, colour) > 100
    assert pixels(picture, theme.floor_colour(0.8)) > 30000


def test_slip_is_shown_in_another_colour():
    frame = frames()[1]
    holds = renderer().draw(frame)
    slips = renderer().draw(
        replace(
            frame,
            status=np.array([Status.WHEEL_SLIP]),
            at=frame.at._replace(grip=np.array([-1.0])),
        )
    )
    assert pixels(slips, theme.SLIDES) > pixels(holds, theme.SLIDES) + 1000
    assert pixels(slips, theme.HOLDS) < pixels(holds, theme.HOLDS)
