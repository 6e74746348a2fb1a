"""The leaderboard: every method on the named tasks.

    python -m benchmarks.leaderboard [--docs docs/leaderboard.md]

Puts together what known.json has of baselines and dynamic programming, the five seeds of PPO, the
package's policies and the results in docs/leaderboard; writes the page's tables and picture.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.report import RESULTS, markdown, options, put_between, read_json
from benchmarks.tasks import by_value_iteration
from stickslip.agents.evaluation import ranking
from stickslip.agents.evaluation.results import Method, Result, measured, read_results
from stickslip.agents.policy.file import every_record
from stickslip.envs import TASKS
from stickslip.envs.tasks.known import Earned, earned_in

PAGE = Path("docs/leaderboard.md")
PICTURE = "leaderboard.png"
PPO, PACKAGE = "ppo", "policies of the package"


def in_repository() -> list[Method]:
    """Methods whose results the repository holds elsewhere."""
    found: dict[str, list[Result]] = {}
    for name in TASKS:
        known = measured(name)
        for one in (*known.baselines, *by_value_iteration(known)):
            found.setdefault(one.policy, []).append(of_earned(name, one))
    for record in every_record():
        earned = earned_in({"policy": record.name, **record.earned})
        found.setdefault(PACKAGE, []).append(of_earned(record.task.name, earned))
    for name, entry in read_json(RESULTS / "training.json")["tasks"].items():
        took = {"steps": entry["steps"][-1], "processor_seconds": entry["processor_seconds"][-1]}
        seeds = [Result(name, (returns[-1],), **took) for returns in entry["returns"]]
        found.setdefault(PPO, []).extend(seeds)
    return [Method(name, tuple(its)) for name, its in found.items()]


def of_earned(task: str, one: Earned) -> Result:
    """What was measured of a baseline or policy, as a result."""
    return Result(task, one.returns or (one.value,), one.cost, one.failures)


def pivot(methods: Sequence[Method], machine: str) -> str:
    """Scores on a machine's tasks, a column for each method."""
    tasks = [name for name in TASKS if TASKS[name].machine == machine]
    there = {one.name: one.by_task() for one in methods}
    who = [name for name, runs in there.items() if runs.keys() & set(tasks)]
    rows = [
        {"task": f"`{task}`"}
        | {name: ranking.score_of(its) if (its := there[name].get(task)) else "" for name in who}
        for task in tasks
    ]
    return markdown(rows) + "\n"


def main(arguments: list[str]) -> None:
    """Run the command."""
    parser = options("leaderboard", __doc__)
    parser.add_argument("--docs", type=Path, default=PAGE)
    page = parser.parse_args(arguments).docs
    handed_in = sorted((page.parent / page.stem).glob("*.json"))
    methods = [*in_repository(), *map(read_results, handed_in)]
    unlimited = [name for name in TASKS if TASKS[name].cost_limit is None]
    found = ranking.comparisons(methods, least=unlimited)
    short = ranking.aggregate_table(methods, found).markdown(aligned=True)
    parts = [short, f"![]({PICTURE})\n", *(pivot(methods, one.machine) for one in found)]
    put_between(page, "\n".join(parts).rstrip(), "leaderboard")
    print(f"Written: {page}, {ranking.draw_profiles(found, page.with_name(PICTURE))}")


if __name__ == "__main__":
    main(sys.argv[1:])
