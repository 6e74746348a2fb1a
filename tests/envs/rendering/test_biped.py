"""Pictures of the biped: what must show in them, and what drawing must not do."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from typing import Any

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.scene import Scene
from stickslip.envs.biped.picture import BipedFrame, biped_picture, stretches_of
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.animation import save_animation
from stickslip.envs.rendering.scene import paint
from tests.envs.rendering.frames import STANDING, walk_rows

pytest.importorskip("matplotlib")
pytest.importorskip("PIL")

PANEL = np.s_[70:500, 200:640]
"""Where the robot is in a picture of the default size, without the key."""


ROBOT = BipedParams.from_bars()


def draw(frame: BipedFrame, i: int = 0) -> np.ndarray:
    return paint(biped_picture(frame, ROBOT), i)


def has_colour(picture: np.ndarray, colour: str) -> bool:
    return bool(np.any(np.all(picture == rgb(colour), axis=-1)))


def rgb(colour: str) -> list[int]:
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]


def test_a_heavier_robot_has_a_shorter_arrow():
    bare, heavy = draw(STANDING), draw(replace(STANDING, weight=2 * 83.0))
    lengths = [np.sum(np.all(one[PANEL] == rgb(theme.HOLDS), -1)) for one in (bare, heavy)]
    assert lengths[1] < lengths[0]


def test_a_picture_is_rgb():
    picture = draw(STANDING)
    assert picture.shape == (540, 960, 3)
    assert picture.dtype == np.uint8
    assert picture.flags["C_CONTIGUOUS"]
    assert picture.flags.writeable


def test_a_patch_shows_where_it_is():
    plain = draw(STANDING)
    icy = Scene.patches(np.array([0.1, 0.3]), np.array([0.4, 0.05, 0.4]))
    picture = draw(replace(STANDING, floor=stretches_of(icy.floor)))
    below_the_surface = np.s_[462:466, 16:944]
    changed = np.any(picture[below_the_surface] != plain[below_the_surface], axis=-1)
    columns = np.flatnonzero(changed.any(axis=0))
    share = (columns[-1] - columns[0]) / (944 - 16)
    assert share == pytest.approx(0.2 / 2.22, rel=0.1)  # 2.22 m of floor are in the picture
    assert has_colour(picture, theme.floor_colour(0.05))


def test_sliding_shows_in_force_badge_and_marks():
    held, slid = draw(walk_rows(10), 9), draw(walk_rows(10, slide_per_frame=0.003), 9)
    badge = np.s_[16:54, 830:944]
    assert has_colour(held[badge], theme.HOLDS)
    assert has_colour(slid[badge], theme.SLIDES)
    for area in (np.s_[320:450, 200:640], np.s_[455:460, 16:640]):
        assert has_colour(slid[area], theme.SLIDES)
    assert not has_colour(held[456:460, 16:640], theme.SLIDES)


def test_the_cone_opens_with_friction_and_is_absent_on_a_grip_floor():
    def tinted(mu: float) -> int:
        frame = replace(STANDING, mu_static=mu, mu_kinetic=mu, normal_force=1e-3)
        return int(np.sum(np.any(draw(frame)[PANEL] != bare[PANEL], axis=-1)))

    bare = draw(replace(STANDING, mu_static=math.nan, mu_kinetic=math.nan, normal_force=1e-3))
    assert tinted(math.nan) == 0
    assert 0 < tinted(0.1) < tinted(0.4) < tinted(1.2)


@pytest.mark.parametrize("cause", ["topple", "no solution"])
def test_a_walk_that_ended_says_so(cause):
    badge = np.s_[16:54, 830:944]
    going = draw(STANDING)[badge]
    ended = draw(replace(STANDING, ended=cause))[badge]
    assert has_colour(going, theme.HOLDS)
    assert has_colour(ended, theme.INK)
    assert not has_colour(ended, theme.HOLDS)


@pytest.mark.parametrize(
    "values",
    [
        {"phase": math.nan, "torque": math.inf, "floor_position": -math.inf},
        {"normal_force": 0.0, "friction_force": 0.0},
        {"normal_force": -5.0},
        {"torque": 1e6, "crank_rate": -400.0, "slide": -3.0},
        {"mu_static": 0.0, "mu_kinetic": 0.0, "zmp": math.nan},
        {"floor_position": -80.0},
    ],
)
def test_no_numbers_stop_a_picture_from_being_drawn(values):
    assert has_colour(draw(replace(STANDING, **values))[PANEL], theme.SUPPORT["main"])


def test_batches_are_refused():
    many = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), ROBOT)
    with pytest.raises(ValueError, match="batch of robots"):
        biped_picture(STANDING, many)
    with pytest.raises(ValueError, match="batch of floors"):
        stretches_of(Scene.uniform(np.array([0.1, 0.2])).floor)


def test_the_users_matplotlib_settings_do_not_matter():
    import matplotlib as mpl

    expected = draw(STANDING)
    own: Any = {"lines.linewidth": 9, "font.size": 30, "text.color": "red", "font.family": "serif"}
    with mpl.rc_context(own):
        picture = draw(STANDING)
        assert mpl.rcParams["font.size"] == 30
    assert np.array_equal(picture, expected)


@pytest.mark.parametrize("missing", ["matplotlib", "PIL"])
def test_a_missing_package_is_named_with_the_extra_to_install(monkeypatch, tmp_path, missing):
    for name in [name for name in sys.modules if name.partition(".")[0] == missing]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)
    uses = {
        "matplotlib": lambda: draw(STANDING),
        "PIL": lambda: save_animation([np.zeros((2, 2, 3), np.uint8)], tmp_path / "a.gif"),
    }
    with pytest.raises(ImportError, match=rf"{missing}.*\n?.*stickslip\[viz\]"):
        uses[missing]()
