"""MP4: every picture, one at a time, and nothing lost where ffmpeg is missing or fails."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stickslip.envs.rendering.animation import find_ffmpeg, save_animation


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
    def never():
        pytest.fail("a picture was asked for")
        yield

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
    env = gymnasium.wrappers.RecordVideo(
        env, str(tmp_path / "films"), episode_trigger=lambda _: True
    )
    env.reset(seed=0)
    for _ in range(3):
        env.step([0.1])
    env.close()
    (film,) = tmp_path.glob("films/*.mp4")
    assert read_back(ffmpeg, film, 540, 960).shape[0] == 4
