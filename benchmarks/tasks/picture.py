"""A picture of each task: the machine along one episode, and what counts in it."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from benchmarks.tasks import picture_biped, picture_ugv
from stickslip.agents.evaluation.rollout import horizon, planned, rollout, without_resets
from stickslip.agents.registry import machine_by_name
from stickslip.agents.shown_names import shown_name
from stickslip.envs import known_of
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.paper import drawing
from stickslip.records.files import writing

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from stickslip.envs import TaskDefinition

MACHINES = {"biped": picture_biped, "ugv": picture_ugv}
SCENE, STRIP, WIDTH = 1.35, 0.75, 9.0
"""Heights of the scene and of what counts, and the width of both [inches]."""
DPI, COLOURS = 90, 64
SEEDS = range(8)
"""The first episode of these that lasts is shown."""


def draw_task(task: TaskDefinition, path: Path) -> None:
    """Write the task's picture as a PNG of few colours."""
    figure = _figure(task)
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI)
    image = require("PIL.Image").open(drawn).convert("RGB").quantize(COLOURS, dither=0)
    with writing(path) as file:
        image.save(file, format="PNG", optimize=True)


def _figure(task: TaskDefinition) -> Figure:
    env, params = task.make()
    env, machine = without_resets(env), machine_by_name(task.machine)
    known = known_of(task)
    if known is None:
        raise ValueError(f"{task.name} is not measured; accepted: a task that is")
    there = [one for one in (known.by_hand, *known.planners) if one.policy in machine.baselines]
    shown = max(there, key=lambda one: one.value)
    player = machine.baseline(shown.policy, env)
    played: Any = None
    for seed in SEEDS:
        controller = planned(env, player, params, seed)
        played = rollout(env, controller, params, seed, horizon(params)).trimmed()
        if not played.terminated[-1]:
            break
    figure, axes = drawing.sheet(2, height=(SCENE + STRIP) / 2, height_ratios=[SCENE, STRIP])
    figure.set_size_inches(WIDTH, SCENE + STRIP + 0.35)
    MACHINES[task.machine].draw(*axes[:, 0], env, params, played)
    top, below = axes[:, 0]
    drawing.name_panel(top, task.title)
    who = {"ha": "right", "va": "top", "fontsize": 8, "color": theme.MUTED, "zorder": 9}
    top.text(0.995, 0.97, shown_name(shown.policy), transform=top.transAxes, **who)
    below.tick_params(pad=2)
    return figure
