"""An episode sample by sample, its panels, and its film. Films need the extra `viz`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import jax
import numpy as np

from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.protocol import Controller, Params, State
from stickslip.envs.functional import AnyEnv, FunctionalEnv, Timed
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.animation import save_animation
from stickslip.envs.rendering.page import Episode, Event, Line, Panel
from stickslip.envs.rendering.sheet import LEVEL, make_sheet, name_panel, save_sheet, styled
from stickslip.envs.tasks.known import Scale, measured
from stickslip.optim.progress import Bar
from stickslip.records.table import with_unit

if TYPE_CHECKING:
    from jaxtyping import Array
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

T = TypeVar("T")


def standard_episode(
    rollout: Rollout, env: AnyEnv, params: Timed, name: str, scale: Scale | None
) -> Episode:
    """An episode of any machine without a drawing: actions, numbers of the info, reward."""
    rollout = rollout.trimmed()
    rows = {one: rollout.action[:, i] for i, one in enumerate(env.action_names)}
    infos = {one: np.asarray(values) for one, values in rollout.info.items()}
    rows |= {one: of for one, of in infos.items() if of.ndim == 1 and of.dtype.kind == "f"}
    panels = [panel(one.replace("_", " "), "-", from_start(values)) for one, values in rows.items()]
    ended = "ended early" if bool(rollout.terminated[-1]) else ""
    return Episode(
        name=name,
        period=float(params.control_period),
        panels=(*panels, *reward_panels(rollout, {}, "-", scale)),
        events=(Event(int(rollout.length), "end", ended),) if ended else (),
        numbers=tuple((one.title, one.lines[0].values, 3) for one in panels[:5]),
        ended=ended,
        facts=facts([("return", float(np.sum(rollout.reward, dtype=np.float64)), "-")]),
    )


def samples(rollout: Rollout[T]) -> tuple[T, dict[str, np.ndarray]]:
    """States of an episode with its start, leaves [n + 1], and the infos, zero at the start."""
    rollout = rollout.trimmed()
    both = rollout.start_state, rollout.state
    states = jax.tree.map(lambda one, on: np.concatenate([np.asarray(one)[None], on]), *both)
    infos = {
        name: np.concatenate([np.zeros_like(rows[:1]), rows]) for name, rows in rollout.info.items()
    }
    return states, infos


def from_start(values: Array | np.ndarray) -> np.ndarray:
    """Values of the steps [n, ...] as those of the samples [n + 1, ...]: NaN at the start."""
    rows = np.asarray(values, float)
    return np.concatenate([np.full((1, *rows.shape[1:]), np.nan), rows])


def panel(
    title: str,
    unit: str,
    values: ArrayLike | Mapping[str, ArrayLike],
    limits: tuple[float, ...] = (),
    steps: bool = False,
) -> Panel:
    """A panel of one line, or of several by name."""
    lines = values if isinstance(values, Mapping) else {title: values}
    named = tuple(Line(name, np.asarray(of)) for name, of in lines.items())
    return Panel(title, unit, named, limits, steps)


def beside(
    title: str, unit: str, line: Line, name: str, other: np.ndarray | None, dashed: bool = True
) -> Panel:
    """A panel of a line, and of another one where there is one."""
    lines = () if other is None else (Line(name, other, dashed=dashed),)
    return Panel(title, unit, (line, *lines))


def reward_panels(
    rollout: Rollout, terms: Mapping[str, np.ndarray], unit: str, scale: Scale | None
) -> tuple[Panel, ...]:
    """Reward terms, the return so far, and on a named task the score so far.

    terms: of each sample, [n + 1]; {} where the reward is one. The score so far is what the
    episode would score if nothing more came.
    """
    rewards = np.asarray(rollout.trimmed().reward, float)
    earned = np.concatenate([[0.0], np.cumsum(rewards)])
    lines = [Line(name, values) for name, values in terms.items()]
    if len(lines) != 1:
        lines.append(Line("reward", from_start(rewards), dashed=bool(lines)))
    panels = [Panel("reward of each step", unit, tuple(lines), steps=True)]
    panels.append(panel("return so far", unit, earned))
    if scale is not None:
        title = "score so far (0: trivial, 1: best known)"
        panels.append(panel(title, "-", scale.score(earned), limits=(0.0, 1.0)))
    return tuple(panels)


def slip_events(
    slips: np.ndarray, begins: Callable[[int], str], ends: str, ended: str, *others: Event
) -> tuple[Event, ...]:
    """Slips and stops by the sample among the other events, and an early end. slips: [n], whether
    it slips by then; begins: a slip in words, by its sample."""
    found = [*others]
    for i in (np.flatnonzero(np.diff(slips.astype(int))) + 1).tolist():
        found.append(Event(i, "slip", begins(i)) if slips[i] else Event(i, "stick", ends))
    found.sort(key=lambda one: one.sample)
    if ended:
        found.append(Event(len(slips) - 1, "end", f"ended: {ended}"))
    return tuple(found)


def scale_of(task: str | None) -> Scale | None:
    """Scale of a named task's scores; None without one."""
    return None if task is None else measured(task).scale


def facts(rows: Sequence[tuple[str, float, str]]) -> tuple[tuple[str, str], ...]:
    """Format numbers of a whole episode (title, value, unit); without those that are not finite."""
    return tuple(
        (title, with_unit(value, unit, 4).replace("-", "−"))
        for title, value, unit in rows
        if np.isfinite(value)
    )


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
    episode = rollout(env, controller, params, key, steps)
    return write_film(env, episode, params, path, fps, progress=progress)


def write_film(
    env: AnyEnv,
    rollout: Rollout[Any],
    params: Timed,
    path: str | Path,
    fps: float,
    seconds: float | None = None,
    progress: bool = False,
) -> Path:
    """Write an animation of an episode, or of its first seconds; see `film`."""
    period = float(params.control_period)
    if seconds is not None:
        steps = min(int(rollout.length), max(1, round(seconds / period)))
        rollout = rollout._replace(length=steps)
    draw, last = env.pictures(*samples(rollout), params), int(rollout.length)
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
    below, x = episode.axis or ("time [s]", episode.period * np.arange(episode.samples))
    return save_sheet(draw_panels(episode.panels, x, below, title, episode.slips), path)


@styled
def draw_panels(
    panels: Sequence[Panel],
    x: np.ndarray,
    below: str,
    title: str = "",
    slips: np.ndarray | None = None,
) -> Figure:
    """Panels over x [n], labelled `below`. slips [n]: shaded, from the sample before each."""
    figure, axes = make_sheet(len(panels), 1, (9, ROW * len(panels) + 0.8), title)
    marker = "" if x[-1] > x[0] else "o"
    for axis, panel in zip(axes, panels, strict=True):
        style = "steps-pre" if panel.steps else "default"
        for line, colour in zip(panel.lines, theme.PLAYERS, strict=False):
            look = LEVEL if line.dashed else {"color": colour, "lw": 1.2}
            axis.plot(x, line.values, drawstyle=style, marker=marker, label=line.name, **look)
        name_panel(axis, f"{panel.title} [{panel.unit}]")
        for level in panel.limits:
            axis.axhline(level, **LEVEL)
        if len(panel.lines) > 1:
            low, high = axis.get_ylim()
            axis.set_ylim(low, high + HEADROOM * (high - low))
            axis.legend(ncols=len(panel.lines), loc="upper right")
        if slips is not None:
            edges = np.flatnonzero(np.diff(slips.astype(int), prepend=0, append=0)).reshape(-1, 2)
            for begin, end in edges:
                ends = float(x[max(begin - 1, 0)]), float(x[end - 1])
                axis.axvspan(*ends, color=theme.SLIDES, alpha=0.18, lw=0)
    axes[-1].set_xlabel(below)
    axes[-1].set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    return figure
