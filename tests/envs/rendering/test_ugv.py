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
from stickslip.envs.rendering.scene import paint
from stickslip.envs.ugv.picture import UGVFrame, ugv_frames, ugv_picture
from tests.envs.ugv.helpers import drive, task

pytestmark = pytest.mark.long


@lru_cache
def frames() -> UGVFrame:
    """Of a drive with the legs held."""
    env, params = task()
    run = drive(env, params, np.zeros((int(params.steps), 2)))
    states, infos = jax.tree.map(lambda leaf: np.asarray(leaf)[:11:5], (run.state, run.info))
    return ugv_frames(states, infos, params, env.solver, env.preview)


def pixels(picture: np.ndarray, colour: str) -> int:
    """How many have exactly a colour."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(picture.astype(int) - wanted).max(axis=-1) <= 2).sum())


def draw(frame: UGVFrame) -> np.ndarray:
    return paint(ugv_picture(frame, UGVParams(), "wheel_energy", "J"), 1)


def test_a_frame_is_what_the_state_says():
    frame = frames()
    rows = frame.wheels("centre"), frame.wheels("point"), frame.hinges
    centre, contact, hinge = (of[1] for of in rows)
    far = np.hypot(*(centre - contact).T), np.hypot(*(hinge - centre).T)
    np.testing.assert_allclose(far[0], UGVParams().wheel_radius, rtol=1e-5)
    np.testing.assert_allclose(far[1], 0.35, rtol=1e-5)
    length = np.hypot(*(hinge[1] - hinge[0]))
    assert length == pytest.approx(UGVParams().body_length, rel=1e-5)
    assert contact[1, 0] == pytest.approx(frame.at.x[1])
    assert frame.preview.shape == (3, 4, 2)
    assert np.interp(frame.at.x[1], *frame.ground[1].T) == pytest.approx(contact[1, 1], abs=1e-3)
    assert np.all(np.diff(frame.turned, axis=0) < 0)  # it rolls forwards


def test_a_picture_holds_vehicle_ground_and_forces():
    picture = draw(frames())
    assert picture.shape == (540, 960, 3)
    assert picture.dtype == np.uint8
    for colour in (theme.HIP, theme.SUPPORT["main"], theme.SUPPORT["mid"], theme.HOLDS):
        assert pixels(picture, colour) > 100
    assert pixels(picture, theme.floor_colour(0.8)) > 30000


def test_slip_is_shown_in_another_colour():
    frame = frames()
    holds = draw(frame)
    status, at = np.full(3, Status.WHEEL_SLIP), frame.at._replace(grip=np.full(3, -1.0))
    slips = draw(replace(frame, status=status, at=at))
    assert pixels(slips, theme.SLIDES) > pixels(holds, theme.SLIDES) + 1000
    assert pixels(slips, theme.HOLDS) < pixels(holds, theme.HOLDS)
