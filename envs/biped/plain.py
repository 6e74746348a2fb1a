"""The biped's parameters from plain values, as JSON holds them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.scene import Scene
from stickslip.envs.biped.params import Randomisation

if TYPE_CHECKING:
    from stickslip.envs.plain import Entries, Given

FLOORS = ("uniform", "patches")
"""Constructors of Scene that take numbers alone."""


def from_plain(parameters: Entries) -> Given:
    """Arguments of `BipedEnv.make_params` from plain values.

    scene: a name, or {"uniform": {...}} or {"patches": {...}} with the constructor's arguments.
    randomisation: ranges as pairs, by the names of Randomisation. Numbers stay as they are.
    """
    given = dict(parameters)
    scene = given.get("scene")
    if isinstance(scene, dict):
        ((kind, numbers),) = scene.items()
        require_choice("scene", kind, FLOORS)
        given["scene"] = getattr(Scene, kind)(**numbers)
    if "randomisation" in given:
        ranges = {name: tuple(ends) for name, ends in given["randomisation"].items()}
        given["randomisation"] = Randomisation(**ranges)
    return given
