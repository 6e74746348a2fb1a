"""The arrow that a force is drawn as."""

from __future__ import annotations

from math import atan2, cos, sin

import numpy as np

HEAD, HEAD_WIDTH, SHAFT_WIDTH = 12.0, 10.0, 3.6
"""Of an arrow, in page units."""


def arrow(tail: np.ndarray, force: np.ndarray, length: float, scale: float) -> np.ndarray:
    """Outline of an arrow of `length` [m] from `tail`; its widths are in page units."""
    direction = atan2(force[1], force[0])
    head = min(HEAD / scale, length)
    shaft, barb = SHAFT_WIDTH / 2 / scale, HEAD_WIDTH / 2 / scale
    neck = length - head
    along = np.array([0, neck, neck, length, neck, neck, 0])
    across = np.array([-shaft, -shaft, -barb, 0, barb, shaft, shaft])
    c, s = cos(direction), sin(direction)
    return tail + np.stack([c * along - s * across, s * along + c * across], axis=-1)
