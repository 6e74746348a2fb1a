"""The trained policies of the package.

    python -m benchmarks.policies [--only NAME ...] [--runs DIR]
    python -m benchmarks.policies --check [--only NAME ...]
    python -m benchmarks.policies --measure [--only NAME ...]
    python -m benchmarks.policies --known
    python -m benchmarks.policies --docs FILE

For each task named (default: those without a policy in the package) trains with the settings and
seeds of recipes.py by `stickslip train`, keeps the policy of the best evaluation, measures it on
the task's own episodes and puts it into the package with its record. Runs stay in --runs, so that
a command that was cut off goes on. --check: trains what is in the package again by its recorded
command and says whether it is the same to the last bit, as on the same machine and versions.
--measure: plays the task's own episodes again and writes what is earned into the policy's record.
--known: makes those the best known of their tasks that earned more than what was, in the ladder's
known.json. --docs: puts the table of policies into a page.
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
from benchmarks.policies.tables import table
from benchmarks.report import options, put_between
from benchmarks.tasks.__main__ import put
from benchmarks.tasks.measure import beside_package
from stickslip.agents.policy.file import load_policy
from stickslip.agents.registry import read_configuration
from stickslip.agents.shipped.names import policy_name, shipped_path
from stickslip.agents.shipped.record import record_of
from stickslip.envs import TASKS, task_by_name
from stickslip.envs.tasks.known import FILE, read_known

RUNS = Path("runs/policies")
MARKS = ("<!-- policies -->", "<!-- end of policies -->")


def main(arguments: list[str]) -> None:
    """Train and put into the package, or compare, or write a page."""
    parser = options("policies", __doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--runs", type=Path, default=RUNS)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--known", action="store_true")
    parser.add_argument("--docs", type=Path)
    given = parser.parse_args(arguments)
    if given.docs is not None:
        put_between(given.docs, table(), MARKS)
        return
    if given.known:
        for name, known in read_known(FILE).items():
            put(name, beside_package(task_by_name(name), dict(known)))
        return
    there = [name for name in TASKS if shipped_path(policy_name(name)) is not None]
    if given.check:  # what is carried over cannot be trained again
        there = [name for name in there if not record_of(policy_name(name)).carried_over]
    again = given.check or given.measure
    names = given.only or [name for name in TASKS if (name in there) == again]
    for name in names:
        task = task_by_name(name)
        if given.check:
            print(check(policy_name(task.name)), flush=True)
            continue
        if given.measure:
            path = measure_again(record_of(policy_name(task.name)))
        else:
            path = put_into_package(task, best_of(task, given.runs, say))
        record = record_of(policy_name(task.name))
        say(f"{path}: {path.stat().st_size} bytes, score {record.score}, {record.earned_return}")


def check(name: str) -> str:
    """Train a policy of the package again, and whether it came out the same."""
    record = record_of(name)
    config = read_configuration(json.dumps(record.trained["config"]))
    with tempfile.TemporaryDirectory() as folder:
        run = trained(config, Path(folder), say)
        again = load_policy(run.path / "policy.npz")
    if same_policy(load_policy(name), again):
        return f"{name}: the same to the last bit"
    return (
        f"{name}: another policy (trained on {record.trained['machine']}, "
        f"{record.trained['versions']})"
    )


def say(line: str) -> None:
    """Tell how it goes."""
    print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
