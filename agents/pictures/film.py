"""Animations of a controller's episode. Needs the extra `viz`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import jax

from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.envs.rendering import save_animation
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import numpy as np
    from jaxtyping import Array

    from stickslip.agents.protocol import Controller, Params, State
    from stickslip.envs.functional import FunctionalEnv

    T = TypeVar("T")


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

    key, steps: as for `rollout`. One picture every 1 / fps [s] of the episode, so it plays at the
    speed of life; fps at most the control rate. progress: see stickslip.optim.progress.
    """
    played = rollout(env, controller, params, key, steps)
    return save_animation(pictures(env, played, params, fps, progress), path, fps)


def write_film(
    env: FunctionalEnv[State, Params],
    played: Rollout[State],
    params: Params,
    path: Path,
    frames: float,
    seconds: float | None = None,
    progress: bool = False,
) -> Path:
    """An episode that was played, or its first seconds, as an animation at the speed of life.

    frames: pictures a second, at most one a control step. progress: see stickslip.optim.progress.
    """
    period = float(params.control_period)
    if seconds is not None:
        steps = min(int(played.length), max(1, round(seconds / period)))
        played = played._replace(length=steps)
    fps = min(frames, 1 / period)
    return save_animation(pictures(env, played, params, fps, progress), path, fps)


def pictures(
    env: FunctionalEnv[State, Params],
    played: Rollout[State],
    params: Params,
    fps: float,
    progress: bool = False,
) -> Iterator[np.ndarray]:
    """The pictures of one episode: its start, then one every 1 / fps [s], and its end."""
    played = played.trimmed()
    rate = 1 / float(params.control_period)
    if not 0 < fps <= rate * (1 + 1e-6):
        raise ValueError(f"fps = {fps}; accepted: 0 < fps <= {rate:g}, the control rate")
    renderer = env.renderer(params)
    last = int(played.length) - 1
    yield renderer.draw(env.picture(played.start_state, {}, params))
    shown = 0
    with Bar("drawing", last + 1, "step", progress) as bar:
        for index in range(last + 1):
            state, info = _row((played.state, played.info), index)
            frame = env.picture(state, info, params)
            if (index + 1) * fps / rate >= shown + 1 - 1e-9 or index == last:
                shown += 1
                yield renderer.draw(frame)
            bar.advance()


def _row(tree: T, index: int) -> T:
    return jax.tree.map(lambda leaf: leaf[index], tree)
