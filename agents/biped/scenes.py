"""Scenes by the names that the command line knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip import dynamics
from stickslip.agents.built import Built
from stickslip.dynamics.names import SCENES as NAMES
from stickslip.dynamics.plain_checks import require_choice

if TYPE_CHECKING:
    from stickslip.dynamics import Scene


SCENE = "slippery"
"""The floor where none is named."""
HOLDS = "grip"
"""The floor that has no friction: nothing slips on it."""
SCENES: Built[Scene] = Built({name: lambda name=name: dynamics.Scene.named(name) for name in NAMES})
"""See Scene.named."""


def scene_by_name(name: str) -> Scene:
    """The scene of that name, or ValueError listing the names."""
    require_choice("scene", name, SCENES)
    return SCENES[name]
