"""Animations of a controller's episode. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.episodes import samples
from stickslip.envs.rendering.animation import save_animation
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    import numpy as np
    from jaxtyping import Array

    from stickslip.agents.protocol import AnyEnv, Controller, Params, State, Timed
    from stickslip.envs.functional import FunctionalEnv


def film(
    env: FunctionalEnv[State, Params],
    controller: Controller[Any, State, Params],
    params: Params,
    key: Array | int,
    path: str | Path,
    *,
    fps: float = 25,
    steps: int | None = None,
    progress: bool = False,
) -> Path:
    """Write an animation of one episode (.gif, .png, .webp or .mp4) and return its path.

    key, steps: as for `rollout`. fps: pictures a second of the episode, which plays in real time,
    at most one a control step. progress: see stickslip.optim.progress.
    """
    played = rollout(env, controller, params, key, steps)
    return write_film(env, played, params, path, fps, progress=progress)


def write_film(
    env: AnyEnv,
    played: Rollout[Any],
    params: Timed,
    path: str | Path,
    fps: float,
    seconds: float | None = None,
    progress: bool = False,
) -> Path:
    """Write an animation of an episode, or of its first seconds; see `film`."""
    period = float(params.control_period)
    if seconds is not None:
        steps = min(int(played.length), max(1, round(seconds / period)))
        played = played._replace(length=steps)
    draw, last = env.pictures(*samples(played), params), int(played.length)
    return write_pictures(draw, last, period, path, fps, progress)


def write_pictures(
    draw: Callable[[int], np.ndarray],
    last: int,
    period: float,
    path: str | Path,
    fps: float,
    progress: bool = False,
) -> Path:
    """Write an animation of the pictures 0 to `last`, `period` [s] apart; see `film`."""
    fps = min(fps, 1 / period)

    def pictures() -> Iterator[np.ndarray]:
        """The first picture, then one every 1 / fps [s], and the last one."""
        drawn = 0
        yield draw(0)
        with Bar("drawing", last, "step", progress) as bar:
            for i in range(1, last + 1):
                if i * fps * period >= drawn + 1 - 1e-9 or i == last:
                    drawn += 1
                    yield draw(i)
                bar.advance()

    return save_animation(pictures(), path, fps)
