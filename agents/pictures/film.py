"""Animations of a controller's episode, in files and in a window. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax

from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.envs.rendering.animation import save_animation
from stickslip.envs.rendering.window import Window
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Iterator
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
    fps = min(fps, 1 / period)
    return save_animation(_pictures(env, played, params, fps, progress), path, fps)


def show_window(env: AnyEnv, played: Rollout[Any], params: Timed, title: str, fps: float) -> None:
    """Show an episode in real time, until its end or until the window is closed."""
    fps = min(fps, 1 / float(params.control_period))
    window = Window(title, fps=fps)
    try:
        for picture in _pictures(env, played, params, fps):
            if not window.show(picture):
                break
    finally:
        window.close()


def _pictures(
    env: AnyEnv, played: Rollout[Any], params: Timed, fps: float, progress: bool = False
) -> Iterator[np.ndarray]:
    """The pictures of one episode: its start, then one every 1 / fps [s], and its end."""
    played = played.trimmed()
    last, drawn = int(played.length) - 1, 0
    renderer = env.renderer(params)
    yield renderer.draw(env.picture(played.start_state, {}, params))
    with Bar("drawing", last + 1, "step", progress) as bar:
        for i in range(last + 1):
            if (i + 1) * fps * float(params.control_period) >= drawn + 1 - 1e-9 or i == last:
                state, info = jax.tree.map(lambda leaf, i=i: leaf[i], (played.state, played.info))
                drawn += 1
                yield renderer.draw(env.picture(state, info, params))
            bar.advance()
