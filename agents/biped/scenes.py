"""Scenes by the names that the command line knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip import dynamics
from stickslip.agents.built import Built
from stickslip.dynamics.plain_checks import require_choice

if TYPE_CHECKING:
    from stickslip.dynamics import Scene


SCENE = "slippery"
"""The floor where none is named."""
SCENES: Built[Scene] = Built(
    {
        "slippery": lambda: dynamics.Scene.uniform(0.06, 0.05),
        "grip": lambda: dynamics.Scene.grip(),
        "firm": lambda: dynamics.Scene.uniform(0.5, 0.4),
        "wet": lambda: dynamics.Scene.uniform(0.2, 0.15),
        "ice-patch": lambda: dynamics.Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5], [0.4, 0.04, 0.4]),
    }
)
"""slippery: 0.06 static, 0.05 kinetic, the default of BipedEnv, on which a constant crank rate of
3 rad/s slips. wet: 0.2, 0.15. firm: 0.5, 0.4. ice-patch: firm, with 0.05, 0.04 from 0.3 m to 0.6 m.
grip: a floor on which nothing slips; no slip equation is compiled."""


def scene_by_name(name: str) -> Scene:
    """The scene of that name, or ValueError listing the names."""
    require_choice("scene", name, SCENES)
    return SCENES[name]
