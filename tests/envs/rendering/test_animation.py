"""Animations on disk: every frame, its colours, and nothing lost where writing or ffmpeg fails."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stickslip.dynamics.biped.params import BipedParams
from stickslip.envs.biped.picture import biped_picture
from stickslip.envs.rendering.animation import find_ffmpeg, save_animation
from stickslip.envs.rendering.scene import paint
from tests.envs.rendering.frames import walk_rows

pytest.importorskip("matplotlib")
pytest.importorskip("PIL")


@pytest.fixture(scope="module")
def film():
    walk = biped_picture(walk_rows(6, slide_per_frame=0.002), BipedParams.from_bars())
    frames = [paint(walk, i) for i in range(6)]
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
            assert np.abs(np.asarray(picture.convert("RGB")).astype(int) - frame).mean() < 2


def never():
    pytest.fail("a frame was asked for")
    yield


@pytest.mark.parametrize("name", ["walk.avi", "walk", "walk.jpg"])
def test_other_suffixes_are_refused_before_any_frame_is_drawn(tmp_path, name):
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
    for count, fps, words in ((1, 100, "fps"), (2, 25, "picture 1")):
        with pytest.raises(ValueError, match=words):
            save_animation([*shades(1), *shades(1, 9)][:count], path, fps)
    assert path.read_bytes() == b"the old one"
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture
def ffmpeg() -> str:
    try:
        return find_ffmpeg()
    except ValueError:
        pytest.skip("no ffmpeg here")


def shades(count: int, height: int = 48, width: int = 64) -> list[np.ndarray]:
    """Grey pictures, each lighter than the one before."""
    return [np.full((height, width, 3), 20 + 20 * i, np.uint8) for i in range(count)]


def read_back(ffmpeg: str, path: Path, height: int, width: int) -> np.ndarray:
    """The film's pictures as ffmpeg decodes them, and no other number of them."""
    wanted = "-f rawvideo -pix_fmt rgb24 -"
    command = [ffmpeg, "-loglevel", "error", "-i", str(path), *wanted.split()]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3)


def test_a_film_has_every_picture_in_its_order(ffmpeg, tmp_path):
    path = save_animation(iter(shades(9)), tmp_path / "walk.mp4", fps=12.5)
    back = read_back(ffmpeg, path, 48, 64)
    assert back.shape[0] == 9
    np.testing.assert_allclose(back.mean(axis=(1, 2, 3)), [20 + 20 * i for i in range(9)], atol=3)
    said = subprocess.run([ffmpeg, "-i", str(path)], capture_output=True, check=False).stderr
    assert b"12.50 fps" in said
    assert b"yuv420p" in said  # what browsers and slides play
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(os.name == "nt", reason="a shell script stands for ffmpeg")
@pytest.mark.parametrize("lines", ["echo No space left on device >&2; exit 1", "exit 3"])
def test_an_ffmpeg_that_fails_is_an_error_with_its_last_line(tmp_path, monkeypatch, lines):
    stand_in = tmp_path / "bin" / "ffmpeg"
    stand_in.parent.mkdir()
    stand_in.write_text(f"#!/bin/sh\n{lines}\n")
    stand_in.chmod(0o755)
    monkeypatch.setenv("PATH", str(stand_in.parent))
    path = tmp_path / "films" / "walk.mp4"
    with pytest.raises(OSError, match=r"ffmpeg failed: (No space left on device|3)"):
        save_animation(shades(3, 480, 640), path)
    assert list(path.parent.iterdir()) == []


def test_without_ffmpeg_an_mp4_is_refused_before_any_picture_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ValueError, match=r"needs ffmpeg, and there is none; accepted: pip install"):
        save_animation(never(), tmp_path / "walk.mp4")
    assert list(tmp_path.iterdir()) == []


def test_gymnasium_records_an_environment_as_it_is(ffmpeg, tmp_path):
    pytest.importorskip("moviepy")
    import gymnasium

    import stickslip  # noqa: F401

    env = gymnasium.make("stickslip/Biped-v0", render_mode="rgb_array")
    folder = str(tmp_path / "films")
    env = gymnasium.wrappers.RecordVideo(env, folder, episode_trigger=lambda _: True)
    env.reset(seed=0)
    for _ in range(3):
        env.step([0.1])
    env.close()
    (film,) = tmp_path.glob("films/*.mp4")
    assert read_back(ffmpeg, film, 540, 960).shape[0] == 4
