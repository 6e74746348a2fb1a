"""Animations on disk: every frame, its colours, and nothing lost when writing fails."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.dynamics.biped.params import BipedParams
from stickslip.envs.rendering.animation import save_animation
from stickslip.envs.rendering.biped import BipedRenderer
from tests.envs.rendering.frames import SCENE, walk

pytest.importorskip("matplotlib")
pytest.importorskip("PIL")


@pytest.fixture(scope="module")
def film():
    renderer = BipedRenderer(BipedParams.from_bars(), SCENE)
    frames = [renderer.draw(frame) for frame in walk(6, slide_per_frame=0.002)]
    return [*frames, frames[-1]]  # a picture that stands still is shown for longer


@pytest.mark.parametrize("suffix", [".gif", ".png"])
def test_an_animation_has_every_frame_and_its_colours(film, tmp_path, suffix):
    from PIL import Image

    path = save_animation((frame for frame in film), tmp_path / f"walk{suffix}", fps=20)
    with Image.open(path) as picture:
        assert getattr(picture, "n_frames", 1) == len(film) - 1
        assert picture.info["loop"] == 0
        for i, frame in enumerate(film[:-1]):
            picture.seek(i)
            assert picture.info["duration"] == pytest.approx(50 if i < 5 else 100)
            back = np.asarray(picture.convert("RGB")).astype(int)
            assert np.abs(back - frame).mean() < 0.3
            assert np.abs(back - frame).max() < 80
    assert list(tmp_path.iterdir()) == [path]


def test_a_webp_is_close_to_every_colour(film, tmp_path):
    from PIL import Image, features

    if not features.check("webp"):
        pytest.skip("this Pillow has no WebP")
    with Image.open(save_animation(film[:4], tmp_path / "walk.webp")) as picture:
        assert getattr(picture, "n_frames", 1) == 4
        for i, frame in enumerate(film[:4]):
            picture.seek(i)
            back = np.asarray(picture.convert("RGB")).astype(int)
            assert np.abs(back - frame).mean() < 2


@pytest.mark.parametrize("name", ["walk.avi", "walk", "walk.jpg"])
def test_other_suffixes_are_refused_before_any_frame_is_drawn(tmp_path, name):
    def never():
        pytest.fail("a frame was asked for")
        yield

    with pytest.raises(ValueError, match=r"accepted: \.gif, \.png, \.webp"):
        save_animation(never(), tmp_path / name)


def test_a_failure_leaves_the_file_that_was_there(tmp_path):
    def breaks():
        yield np.zeros((4, 4, 3), np.uint8)
        raise RuntimeError("drawing failed")

    path = tmp_path / "walk.gif"
    path.write_bytes(b"the old one")
    with pytest.raises(RuntimeError, match="drawing failed"):
        save_animation(breaks(), path)
    wrong = [np.zeros((4, 4, 3), np.uint8), np.zeros((5, 4, 3), np.uint8)]
    for frames in (wrong, [], [np.zeros((4, 4))]):
        with pytest.raises(ValueError, match="accepted"):
            save_animation(frames, path)
    with pytest.raises(ValueError, match="fps"):
        save_animation(wrong[:1], path, fps=100)
    assert path.read_bytes() == b"the old one"
    assert list(tmp_path.iterdir()) == [path]
