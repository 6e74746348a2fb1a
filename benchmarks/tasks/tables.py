"""What is known of the tasks, as tables for pages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.report import markdown
from stickslip.agents.evaluation.statistics import mean_interval
from stickslip.agents.shipped.names import policy_name, shipped_path
from stickslip.agents.shipped.record import record_of
from stickslip.envs import TASKS, known_of
from stickslip.envs.tasks import WITHDRAWN

if TYPE_CHECKING:
    from stickslip.envs.tasks.known import Bound, Earned, Known, Learned


def short_table() -> str:
    """A row a task: what is asked, the best by hand, what was learnt and the best known."""
    rows = []
    for task in TASKS.values():
        known = known_of(task)
        if known is None:
            continue
        hand, learned = known.by_hand, known.learned
        rows.append(
            {
                "task": f"`{task.name}`",
                "asked": task.title,
                "by hand": f"{known.score_of(hand).shown(2)}, {hand.policy}",
                "PPO": "not measured" if learned is None else _learned(known, learned),
                "shipped": _shipped(task.name),
                "1 is": f"{known.best.value:.4g}{_unit(task.unit)}",
            }
        )
    return markdown(rows)


def long_table() -> str:
    """A row a task with returns, intervals, failures and scores of everybody."""
    rows: list[dict[str, Any]] = []
    for task in TASKS.values():
        known = known_of(task)
        if known is None:
            continue
        planned = max(known.planners, key=lambda one: one.value, default=None)
        learned = known.learned
        rows.append(
            {
                "task": f"`{task.name}`",
                "episodes": f"{known.episodes}",
                "idle (0)": f"{known.trivial.value:.4g}",
                "best by hand": _cell(known, known.by_hand),
                "best planner": "" if planned is None else _cell(known, planned),
                "PPO": "not measured" if learned is None else _learned(known, learned),
                "shipped": _shipped(task.name),
                "best known (1)": known.best.shown,
                "if steady, no slip": _at_most(known.assumed),
                "proved: at most": _at_most(known.bound),
            }
        )
    return f"{markdown(rows)}\n\n{_in_words()}"


def _in_words() -> str:
    """A paragraph a task: what makes it hard, and where its best known comes from; its picture."""
    found = []
    for task in TASKS.values():
        known = known_of(task)
        if known is not None:
            asked = f"**{task.name}**: {task.title} [{task.unit}]. {task.about}"
            picture = f"![{task.title}](tasks/{task.name}.png)"
            found.append(f"{asked} Its 1 was earned by {known.how}.\n\n{picture}")
    found += [f"**{name}**: withdrawn, refused: {reason}." for name, reason in WITHDRAWN.items()]
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


def _unit(unit: str) -> str:
    return "" if unit == "-" else f" {unit}"
