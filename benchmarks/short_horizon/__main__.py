"""Short-horizon actor-critic beside PPO at equal time, and where gradients mislead.

    python -m benchmarks.short_horizon [--parts slopes curves] [--algorithms ppo shac sac] [--again]
    python -m benchmarks.short_horizon --redraw

slopes: derivatives of what a policy earns, through the simulator and by differences, on five
floors. curves: three seeds of each algorithm on three tasks, for the same seconds of learning.
What the JSON has already is left as it is (--again measures it anew), so a run that was cut off
goes on. --redraw writes tables and picture of docs/short_horizon.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from benchmarks.report import options, provenance, put_between, read_json, write_json
from benchmarks.short_horizon import compare, slopes, tables
from stickslip.envs import task_by_name

PAGE, PICTURE = Path("docs/short_horizon.md"), Path("docs/short_horizon.png")
CURVES = ("<!-- curves -->", "<!-- end of curves -->")
SLOPES = ("<!-- slopes -->", "<!-- end of slopes -->")
PARTS = ("slopes", "curves")


def main(arguments: list[str]) -> None:
    """Measure and write, or write what was measured into the page."""
    parser = options("short_horizon", __doc__)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--algorithms", nargs="+", choices=compare.ALGORITHMS)
    parser.add_argument("--only", nargs="+", metavar="TASK", default=list(compare.TASKS))
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--redraw", action="store_true")
    given = parser.parse_args(arguments)
    if given.redraw:
        redraw(read_json(given.out))
        return
    if "slopes" in given.parts:
        for name in slopes.GROUNDS:
            if given.again or name not in read_json(given.out).get("slopes", {}):
                print(f"slopes: {name}", flush=True)
                _keep(given.out, "slopes", name, slopes.measure(name))
    if "curves" in given.parts:
        for name in given.only:
            for algorithm in given.algorithms or ("ppo", "shac"):
                _curve(given.out, name, algorithm, given.again)


def _curve(out: Path, name: str, algorithm: str, again: bool) -> None:
    task = task_by_name(name)
    entries = read_json(out).get("curves", {}).get(task.name, {})
    there = entries.get(algorithm, {}).get("digest") == task.digest
    if not compare.offered(task, algorithm) or (there and not again):
        return
    print(f"curves: {task.name}, {algorithm}", flush=True)
    found = compare.measure(algorithm, task, lambda line: print("  " + line, flush=True))
    _keep(out, "curves", task.name, {**entries, algorithm: found})


def _keep(out: Path, part: str, name: str, entry: dict[str, Any]) -> None:
    now = provenance()
    content = {**read_json(out), **now}
    content.setdefault(part, {})[name] = entry
    own = {name: now[name] for name in ("commit", "measured")}
    content["parts"] = {**content.get("parts", {}), part: own}
    write_json(content, out)


def redraw(content: dict[str, Any]) -> None:
    """Write the page's tables and its picture."""
    from benchmarks.short_horizon.picture import draw

    bodies = {"curves": (tables.curves_body, CURVES), "slopes": (tables.slopes_body, SLOPES)}
    for part, (body, marks) in bodies.items():
        if part in content:
            put_between(PAGE, body(content), marks)
    draw(content, PICTURE)


if __name__ == "__main__":
    main(sys.argv[1:])
