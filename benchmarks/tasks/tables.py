"""Tables of the tasks' known scores for docs/tasks.md."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.report import markdown
from stickslip.agents.evaluation.table import mean_interval
from stickslip.agents.shipped.names import policy_name, shipped_path
from stickslip.agents.shipped.record import record_of
from stickslip.envs import TASKS, known_of

if TYPE_CHECKING:
    from stickslip.envs.tasks.known import Bound, Earned, Known, Learned


def long_table() -> str:
    """Scores and returns of each task, and a paragraph for each."""
    rows: list[dict[str, Any]] = []
    for task in TASKS.values():
        known = known_of(task)
        if known is None:
            continue
        learned = known.learned
        rows.append(
            {
                "task": f"`{task.name}`",
                "idle (0)": f"{known.trivial.value:.4g}",
                "best by hand": _cell(known, known.by_hand),
                "PPO": "" if learned is None else _learned(known, learned),
                "shipped": _shipped(task.name),
                "best known (1)": known.best.shown,
                "if steady, no slip": _at_most(known.assumed),
                "proved: at most": _at_most(known.bound),
            }
        )
    return f"{markdown(rows)}\n\n{_in_words()}"


def _in_words() -> str:
    """Title, description and picture of each task."""
    found = []
    for task in TASKS.values():
        if known_of(task) is not None:
            asked = f"**{task.name}**: {task.title} [{task.unit}]. {task.about}"
            found.append(f"{asked}\n\n![{task.name}](tasks/{task.name}.png)")
    return "\n\n".join(found)


def _cell(known: Known, earned: Earned) -> str:
    return f"{known.score_of(earned).shown(2)}: {earned.shown}, {earned.policy}"


def _shipped(task: str) -> str:
    """The score of the package's policy."""
    if shipped_path(policy_name(task)) is None:
        return ""
    score = record_of(policy_name(task)).score
    return "" if score is None else score.shown(2)


def _learned(known: Known, learned: Learned) -> str:
    return mean_interval([known.scale.score(one) for one in learned.returns]).shown(2)


def _at_most(bound: Bound | None) -> str:
    return "" if bound is None else f"{bound.value:.4g}"
