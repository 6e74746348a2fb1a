"""The README's animation: constant crank speed slips where computed torque does not.

    python -m benchmarks.walks [--out docs/walk.gif]

Two walks from rest on one floor (0.03 static, 0.02 kinetic, half as much as the scene slippery),
one above the other, at the speed of life. The picture is the environment's, smaller.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.agents.biped.controllers import ComputedTorque, CrankSpeedPI
from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.film import pictures
from stickslip.dynamics import Scene
from stickslip.envs import BipedEnv
from stickslip.envs.rendering import BipedRenderer, save_animation

MU_STATIC, MU_KINETIC = 0.03, 0.02
SECONDS, FPS = 3.2, 9.0
WIDTH, HEIGHT = 800, 375
"""Of one walk's picture [px]."""
NAME = (567, 54)
"""Where the controller's name ends, and its top [px]."""
CONTROLLERS = {
    "constant crank speed": CrankSpeedPI(),
    "computed torque": ComputedTorque(friction=MU_KINETIC),
}


class SmallBipedEnv(BipedEnv):
    """With smaller pictures."""

    def renderer(self, params: Any) -> BipedRenderer:
        """See BipedEnv."""
        return BipedRenderer(
            params.robot.params, params.scene, width=WIDTH, height=HEIGHT, torque_limit=4.0
        )


def walks() -> dict[str, tuple[Rollout, Any]]:
    """Each controller's episode and its parameters."""
    env = BipedEnv()
    params = env.make_params(scene=Scene.uniform(MU_STATIC, MU_KINETIC), time_limit=SECONDS)
    return {
        name: (rollout(env, controller, params, 0), params)
        for name, controller in CONTROLLERS.items()
    }


def stacked() -> Iterator[np.ndarray]:
    """Pictures of both walks, the first controller's above."""
    films = [
        named(name, pictures(SmallBipedEnv(), played, params, FPS))
        for name, (played, params) in walks().items()
    ]
    for both in zip(*films, strict=True):
        yield np.concatenate(both)


def named(name: str, frames: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """Pictures with a name at the upper right of the walk."""
    from matplotlib import font_manager
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans:bold"), 15)
    for frame in frames:
        image = Image.fromarray(frame)
        ImageDraw.Draw(image).text(NAME, name, fill=(30, 42, 54), font=font, anchor="rt")
        yield np.asarray(image)


def main() -> None:
    """Write the animation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/walk.gif"))
    path = save_animation(stacked(), parser.parse_args().out, FPS)
    print(f"Written: {path}, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
