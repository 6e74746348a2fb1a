"""The window that shows pictures: no display needed, nothing of the process changed."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
import pytest

from stickslip.envs.rendering.window import Window


@pytest.fixture
def window(monkeypatch):
    pytest.importorskip("pygame")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    if not sys.platform.startswith("linux"):
        monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Window(fps=1000)
    yield window
    window.close()


def test_a_window_works_without_a_display_and_leaves_the_environment_alone(window):
    import pygame

    before = dict(os.environ)
    picture = np.arange(40 * 60 * 3, dtype=np.uint8).reshape(40, 60, 3)
    assert window.show(picture)
    assert pygame.display.get_driver() == "dummy"
    surface: Any = pygame.display.get_surface()
    shown = pygame.surfarray.array3d(surface)
    assert np.array_equal(shown.swapaxes(0, 1), picture)
    assert dict(os.environ) == before
    assert window.show(np.zeros((50, 30, 3), np.uint8))
    surface = pygame.display.get_surface()
    assert surface.get_size() == (30, 50)


def test_closing_the_window_ends_the_showing_and_not_the_process(window):
    import pygame

    picture = np.zeros((40, 60, 3), np.uint8)
    assert window.show(picture)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert not window.show(picture)
    assert not window.is_open
    assert not window.show(picture)
    window.close()
    window.close()
    assert window.show(picture)
