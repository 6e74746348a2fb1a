"""A window on the screen, drawn by the processor alone."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np


class Window:
    """Shows pictures at a steady pace for `render_mode="human"`.

    title: of the window. fps: pictures a second; `show` waits for its turn.

    The window opens with the first picture. Without a display (Linux without DISPLAY and
    WAYLAND_DISPLAY) it is an invisible one, unless SDL_VIDEODRIVER names a driver. Someone who
    closes the window ends the showing, not the process: `show` then does nothing until `close` was
    called. pygame has one window a process: the last Window to open has it. Needs the extra `viz`.
    """

    def __init__(self, title: str = "stickslip", *, fps: float = 50.0):
        with _environment(PYGAME_HIDE_SUPPORT_PROMPT="1"):
            self._pygame = require("pygame")
        self._title, self._fps = title, fps
        self._surface: Any = None
        self._clock = self._pygame.time.Clock()
        self._dismissed = False

    @property
    def is_open(self) -> bool:
        """True while there is a window, visible or not."""
        return self._surface is not None and self._pygame.display.get_surface() is self._surface

    def show(self, picture: np.ndarray) -> bool:
        """Show uint8 [height, width, 3] and wait for the next turn; False once dismissed."""
        if self._dismissed:
            return False
        height, width, _ = picture.shape
        if not self.is_open or self._surface.get_size() != (width, height):
            self._open(width, height)
        image = self._pygame.image.frombuffer(picture.tobytes(), (width, height), "RGB")
        self._surface.blit(image, (0, 0))
        self._pygame.display.flip()
        pygame = self._pygame
        if any(
            event.type == pygame.QUIT
            or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE)
            for event in pygame.event.get()
        ):
            self.close()
            self._dismissed = True
            return False
        self._clock.tick(self._fps)
        return True

    def close(self) -> None:
        """Close the window; calling it again does nothing. A later `show` opens a new one."""
        if self.is_open:
            self._pygame.display.quit()
        self._surface = None
        self._dismissed = False

    def _open(self, width: int, height: int) -> None:
        settings = {"SDL_FRAMEBUFFER_ACCELERATION": "0"}  # a plain surface, no OpenGL below it
        screens = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
        if sys.platform.startswith("linux") and not screens:
            settings["SDL_VIDEODRIVER"] = "dummy"
        try:
            with _environment(**settings):
                self._pygame.display.init()
                self._surface = self._pygame.display.set_mode((width, height))
        except self._pygame.error as error:
            raise RuntimeError(
                f'no window could be opened ({error}); use render_mode="rgb_array", or set '
                "SDL_VIDEODRIVER=dummy to go on without a display"
            ) from error
        self._pygame.display.set_caption(self._title)


@contextmanager
def _environment(**settings: str) -> Iterator[None]:
    """Environment variables for a moment; those that are set already keep their value."""
    before = dict(os.environ)
    os.environ.update({name: value for name, value in settings.items() if name not in before})
    try:
        yield
    finally:
        for name in settings.keys() - before.keys():
            os.environ.pop(name, None)
