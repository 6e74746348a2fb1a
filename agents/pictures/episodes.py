"""An episode sample by sample, with the panels that every machine has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

import jax
import numpy as np

from stickslip.envs.rendering.page import Episode, Event, Line, Panel
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import Scale, known_of

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import AnyRollout, Rollout
    from stickslip.agents.protocol import AnyEnv, Timed

T = TypeVar("T")


def standard_episode(
    played: AnyRollout, env: AnyEnv, params: Timed, name: str, scale: Scale | None
) -> Episode:
    """An episode of any machine without a drawing: actions, numbers of the info, reward."""
    played = played.trimmed()
    rows = {one: played.action[:, i] for i, one in enumerate(env.action_names)}
    rows |= {
        one: values
        for one, values in played.info.items()
        if np.ndim(values) == 1 and np.asarray(values).dtype.kind == "f"
    }
    panels = [panel(one.replace("_", " "), "-", from_start(values)) for one, values in rows.items()]
    ended = "ended early" if bool(played.terminated[-1]) else ""
    return Episode(
        name=name,
        period=float(params.control_period),
        panels=(*panels, *reward_panels(played, {}, "-", scale)),
        events=(Event(int(played.length), "end", ended),) if ended else (),
        numbers=tuple((one.title, one.lines[0].values, 3) for one in panels[:5]),
        ended=ended,
        facts=facts([("return", float(np.sum(played.reward, dtype=np.float64)), "-")]),
    )


def samples(played: Rollout[T]) -> tuple[T, dict[str, np.ndarray]]:
    """The states of one episode with its start before them, every leaf [n + 1], and the infos,
    zero at the start."""
    played = played.trimmed()
    states = jax.tree.map(
        lambda first, rest: np.concatenate([np.asarray(first)[None], rest]),
        played.start_state,
        played.state,
    )
    infos = {
        name: np.concatenate([np.zeros_like(rows[:1]), rows]) for name, rows in played.info.items()
    }
    return states, infos


def from_start(values: Array | np.ndarray) -> np.ndarray:
    """Values of the steps [n, ...] as those of the samples [n + 1, ...]: NaN at the start."""
    rows = np.asarray(values, float)
    return np.concatenate([np.full((1, *rows.shape[1:]), np.nan), rows])


def panel(
    title: str,
    unit: str,
    values: np.ndarray | Mapping[str, np.ndarray],
    limits: tuple[float, ...] = (),
    steps: bool = False,
) -> Panel:
    """A panel of one line, or of several by name."""
    lines = values if isinstance(values, Mapping) else {title: values}
    return Panel(title, unit, tuple(Line(*one) for one in lines.items()), limits, steps)


def reward_panels(
    played: AnyRollout, terms: Mapping[str, np.ndarray], unit: str, scale: Scale | None
) -> tuple[Panel, ...]:
    """Reward terms, the return so far, and on a named task the score so far.

    terms: of each sample, [n + 1]; {} where the reward is one. The score so far is what the
    episode would score if nothing more came.
    """
    rewards = np.asarray(played.trimmed().reward, float)
    earned = np.concatenate([[0.0], np.cumsum(rewards)])
    lines = [Line(name, values) for name, values in terms.items()]
    if len(lines) != 1:
        lines.append(Line("reward", from_start(rewards), dashed=bool(lines)))
    panels = [
        Panel("reward of each step", unit, tuple(lines), steps=True),
        panel("return so far", unit, earned),
    ]
    if scale is not None:
        score = (earned - scale.zero) / (scale.one - scale.zero)
        panels.append(
            panel("score so far (0: trivial, 1: best known)", "-", score, limits=(0.0, 1.0))
        )
    return tuple(panels)


def scale_of(task: str | None) -> Scale | None:
    """Scale of a named task's scores; None without one, or where nothing was measured."""
    known = None if task is None else known_of(task_by_name(task))
    return None if known is None else known.scale


def facts(rows: Sequence[tuple[str, float, str]]) -> tuple[tuple[str, str], ...]:
    """Format numbers of a whole episode (title, value, unit); without those that are not finite."""
    return tuple(
        (title, f"{value:.4g}".replace("-", "−") + ("" if unit == "-" else f" {unit}"))
        for title, value, unit in rows
        if np.isfinite(value)
    )
