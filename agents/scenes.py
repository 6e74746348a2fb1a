"""Scenes by the names that the command line knows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.scene import Scene


class Scenes(Mapping[str, Scene]):
    """A mapping from name to Scene. A scene is built when it is asked for, so that its numbers have
    the precision that is then switched on."""

    def __init__(self, builders: dict[str, Callable[[], Scene]]):
        self._builders = builders

    def __getitem__(self, name: str) -> Scene:
        return self._builders[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._builders)

    def __len__(self) -> int:
        return len(self._builders)


SCENES = Scenes(
    {
        "slippery": lambda: Scene.uniform(0.06, 0.05),
        "grip": Scene.grip,
        "firm": lambda: Scene.uniform(0.5, 0.4),
        "wet": lambda: Scene.uniform(0.2, 0.15),
        "ice-patch": lambda: Scene.patches([0.3, 0.6], [0.5, 0.05, 0.5], [0.4, 0.04, 0.4]),
    }
)
"""slippery: 0.06 static, 0.05 kinetic, the default of BipedEnv, on which a constant crank rate of
3 rad/s slips. wet: 0.2, 0.15. firm: 0.5, 0.4. ice-patch: firm, with 0.05, 0.04 from 0.3 m to 0.6 m.
grip: a floor on which nothing slips; no slip equation is compiled."""


def scene_by_name(name: str) -> Scene:
    """The scene of that name, or ValueError listing the names."""
    require_choice("scene", name, SCENES)
    return SCENES[name]
