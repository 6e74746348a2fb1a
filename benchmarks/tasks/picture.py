"""One sheet with a picture of every task: an instant of the best baseline's first episode."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.evaluation.rollout import planned, rollout, without_resets
from stickslip.agents.registry import machine_by_name
from stickslip.envs import TASKS, known_of
from stickslip.records.files import writing

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.envs import TaskDefinition

COLUMNS = 3
SCENE = 0.69
"""Share of a frame's width without the strips over time."""
LETTERS = 56
"""In a line of a title."""
INSTANT = {"biped": 60, "ugv": 32}
"""Steps before the picture."""


def draw_sheet(path: Path) -> None:
    """Write the sheet as a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(TASKS) // COLUMNS)
    figure = Figure(figsize=(4.2 * COLUMNS, 3.75 * rows), layout="constrained", dpi=80)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for ax in axes:
        ax.set_axis_off()
    for ax, task in zip(axes, TASKS.values(), strict=False):
        ax.imshow(picture(task), interpolation="lanczos")
        ax.set_title(f"{task.name}\n{textwrap.fill(task.title, LETTERS)}", fontsize=9)
    with writing(path) as file:
        figure.savefig(file, format="png")


def picture(task: TaskDefinition) -> np.ndarray:
    """An instant of an episode [height, width, 3]."""
    env, params = task.make()
    env, machine = without_resets(env), machine_by_name(task.machine)
    known = known_of(task)
    name = machine.baselines[0] if known is None else known.by_hand.policy
    steps = INSTANT[task.machine]
    controller = planned(env, machine.baseline(name, env), params, 0)
    played = rollout(env, controller, params, 0, steps).trimmed()
    state, info = _last(played.state), _last(played.info)
    renderer = env.renderer(params)
    page = renderer.draw(env.picture(state, info, params))
    return page[:, : round(SCENE * page.shape[1])]


def _last(tree: Any) -> Any:
    import jax

    return jax.tree.map(lambda leaf: leaf[-1], tree)
