"""The trained policies of the package.

    python -m benchmarks.policies [--only NAME ...] [--runs DIR]
    python -m benchmarks.policies --check [--only NAME ...]
    python -m benchmarks.policies --measure [--only NAME ...]
    python -m benchmarks.policies --docs docs/policies.md

For each task named (default: those without a policy in the package) trains with the settings and
seeds of recipes.py by `stickslip train`, keeps the policy of the best evaluation, measures it on
the task's own episodes and puts it into the package with its record; where it earns more than the
best known, the ladder's known.json says so. Runs stay in --runs, so that a command that was cut
off goes on. --check: trains what is in the package again by its recorded command and compares.
--measure: measures what is in the package again. --docs: puts the table of policies into a page.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

from benchmarks.policies.making import (
    best_of,
    measure_again,
    put_into_package,
    same_policy,
    trained,
)
from benchmarks.report import markdown, options, put_between
from benchmarks.tasks.__main__ import put
from benchmarks.tasks.measure import beside_package
from stickslip.agents.policy.file import load_policy
from stickslip.agents.registry import read_configuration
from stickslip.agents.shipped.names import policy_name, shipped_path
from stickslip.agents.shipped.record import every_record, record_of
from stickslip.envs import TASKS, task_by_name
from stickslip.envs.tasks.known import FILE, read_known

RUNS = Path("runs/policies")
MARKS = ("<!-- policies -->", "<!-- end of policies -->")


def table() -> str:
    """Score, return and failures of each policy."""
    return markdown(
        [
            {
                "policy": f"`{one.name}`",
                "score": "" if one.score is None else one.score.shown(2),
                "return": f"{one.earned_return:.4g} {one.task.unit.removeprefix('-')}".rstrip(),
                "failures": f"{one.earned['failures']:.0%}",
                "kB": f"{one.size / 1000:.1f}",
            }
            for one in every_record()
        ]
    )


def check(name: str) -> str:
    """Train a policy of the package again and compare."""
    record = record_of(name)
    config = read_configuration(json.dumps(record.trained["config"]))
    with tempfile.TemporaryDirectory() as folder:
        run = trained(config, Path(folder), say)
        again = load_policy(run.path / "policy.npz")
    if same_policy(load_policy(name), again):
        return f"{name}: the same to the last bit"
    where = f"{record.trained['machine']}, {record.trained['versions']}"
    return f"{name}: another policy (trained on {where})"


def say(line: str) -> None:
    """Print at once."""
    print(line, flush=True)


def main(arguments: list[str]) -> None:
    """Train and put into the package, or compare, or write a page."""
    parser = options("policies", __doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--runs", type=Path, default=RUNS)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--docs", type=Path)
    given = parser.parse_args(arguments)
    if given.docs is not None:
        put_between(given.docs, table(), MARKS)
        return
    there = [name for name in TASKS if shipped_path(policy_name(name)) is not None]
    if given.check:  # what is carried over cannot be trained again
        there = [name for name in there if not record_of(policy_name(name)).carried_over]
    again = given.check or given.measure
    for task in map(task_by_name, given.only or [n for n in TASKS if (n in there) == again]):
        if given.check:
            say(check(policy_name(task.name)))
            continue
        if given.measure:
            path = measure_again(record_of(policy_name(task.name)))
        else:
            path = put_into_package(task, best_of(task, given.runs, say))
        record = record_of(policy_name(task.name))
        say(f"{path}: {path.stat().st_size} bytes, score {record.score}, {record.earned_return}")
        if (known := read_known(FILE).get(task.name)) is not None:
            put(task.name, beside_package(task, dict(known)))


if __name__ == "__main__":
    main(sys.argv[1:])
