"""Animations of episodes, and plots of panels of curves. Needs the extra `viz`, no display."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.episodes import samples
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.animation import save_animation
from stickslip.envs.rendering.sheet import LEVEL, legend, make_sheet, name_panel, save_sheet, styled
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.protocol import AnyEnv, Controller, Params, State, Timed
    from stickslip.envs.functional import FunctionalEnv
    from stickslip.envs.rendering.page import Episode, Panel


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


ROW = 1.55
"""Height of a panel [inches]."""
HEADROOM = 0.3
"""Share of a panel's range that is added above the curves for the legend."""


def plot_episode(episode: Episode, path: str | Path, title: str) -> Path:
    """Plot all panels of an episode over its axis; return the path. Slips are shaded."""
    time = episode.period * np.arange(episode.samples)
    below, x = episode.axis or ("time [s]", time)
    return plot_panels(episode.panels, x, below, path, title, episode.slips)


@styled
def plot_panels(
    panels: Sequence[Panel],
    x: np.ndarray,
    below: str,
    path: str | Path,
    title: str,
    slips: np.ndarray | None = None,
) -> Path:
    """Plot panels over x [n], labelled `below`; return the path. slips: shaded where true [n], from
    the sample before each slip to its last one."""
    figure, axes = make_sheet(len(panels), 1, (9, ROW * len(panels) + 0.8), title)
    for axis, panel in zip(axes, panels, strict=True):
        style = "steps-pre" if panel.steps else "default"
        for line, colour in zip(panel.lines, theme.PLAYERS, strict=False):
            look = LEVEL if line.dashed else {"color": colour, "lw": 1.2}
            axis.plot(x, line.values, drawstyle=style, label=line.name, **look)
        name_panel(axis, f"{panel.title} [{panel.unit}]")
        for level in panel.limits:
            axis.axhline(level, **LEVEL)
        if len(panel.lines) > 1:
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + HEADROOM * (high - low))
            legend(axis, ncols=len(panel.lines), loc="upper right")
        if slips is not None:
            edges = np.flatnonzero(np.diff(slips.astype(int), prepend=0, append=0)).reshape(-1, 2)
            for begin, end in edges:
                ends = float(x[max(begin - 1, 0)]), float(x[end - 1])
                axis.axvspan(*ends, color=theme.SLIDES, alpha=0.18, lw=0)
    axes[-1].set_xlabel(below)
    axes[-1].set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    return save_sheet(figure, path)
