"""An episode sample by sample, and the panels that every machine's page has."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import jax
import numpy as np

from stickslip.envs.rendering.html.data import MOST_SAMPLES, Line, Panel
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import AnyRollout, Rollout
    from stickslip.envs.tasks.known import Scale

T = TypeVar("T")


def samples(played: Rollout[T]) -> tuple[T, dict[str, np.ndarray]]:
    """The states of one episode with its start before them, every leaf [n + 1], and the infos,
    zero at the start. ValueError for more than a page holds."""
    played = played.trimmed()
    if not 1 <= int(played.length) < MOST_SAMPLES:
        raise ValueError(
            f"an episode of {int(played.length)} steps; accepted: 1 to {MOST_SAMPLES - 1} for a "
            "page, fewer with --seconds"
        )
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
    """Values of the steps [n, ...] as those of the samples [n + 1, ...]: none at the start."""
    rows = np.asarray(values, float)
    return np.concatenate([np.full((1, *rows.shape[1:]), np.nan), rows])


def total(values: Array | np.ndarray) -> np.ndarray:
    """Sums so far of what each step brought, [n + 1], zero at the start."""
    return np.concatenate([[0.0], np.cumsum(np.asarray(values, float))])


def panel(
    title: str,
    unit: str,
    values: np.ndarray,
    limits: tuple[float, ...] = (),
    steps: bool = False,
) -> Panel:
    """A panel of one line."""
    return Panel(title, unit, (Line(title, values),), limits, steps)


def reward_panels(
    played: AnyRollout, terms: Mapping[str, np.ndarray], unit: str, scale: Scale | None
) -> tuple[Panel, ...]:
    """Reward terms, the return so far, and on a named task the score so far.

    terms: of each sample, [n + 1]; {} where the reward is one. The score so far is what the
    episode would score if nothing more came.
    """
    rewards = played.trimmed().reward
    earned = total(rewards)
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
    """Of a named task's scores; None without one, or where nothing was measured."""
    known = None if task is None else known_of(task_by_name(task))
    return None if known is None else known.scale


def facts(rows: Sequence[tuple[str, float, str]]) -> tuple[tuple[str, str], ...]:
    """Numbers of a whole episode in words: title, value, unit; those that are none left out."""
    return tuple(
        (title, f"{value:.4g}".replace("-", "−") + ("" if unit == "-" else f" {unit}"))
        for title, value, unit in rows
        if np.isfinite(value)
    )
