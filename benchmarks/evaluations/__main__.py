"""What an evaluation of a posture problem costs, by itself and beside an earlier commit.

    python -m benchmarks.evaluations [--against COMMIT] [--rounds N] [--docs docs/suite.md]

Every call is warmed up, blocks on its numbers, and is timed in turns: this state of the package,
the same with synchronous dispatch, and the commit's, each in a process of its own, so that what
else the machine does falls on all. Both wall and processor time, least of all rounds. The numbers
that the two states give are compared in the same run.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from benchmarks.evaluations import calls
from benchmarks.report import markdown, options, provenance, put_between, read_json, write_json

LAYERS = ("dynamics", "optim", "envs", "agents")
MARKS = ("<!-- evaluations -->", "<!-- end of evaluations -->")
NOW, SYNC, BEFORE = "now", "now, synchronous", "before"


@contextmanager
def state_of(commit: str) -> Iterator[Path]:
    """A folder that holds the package as it was at a commit."""
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.run(["git", "archive", commit], capture_output=True, check=True)
        tree, package = Path(folder) / "tree", Path(folder) / "path" / "stickslip"
        with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
            archive.extractall(tree, filter="data")
        package.parent.mkdir()
        (tree / "src" / "stickslip").rename(package)
        for layer in LAYERS:
            (tree / layer).rename(package / layer)
        yield package.parent


class Asked:
    """A process that answers with what calls take there."""

    def __init__(self, stack: ExitStack, path: Path | None = None, *words: str):
        environment = {**os.environ, "JAX_PLATFORMS": "cpu"}
        if path is not None:
            environment["PYTHONPATH"] = str(path)
        process = subprocess.Popen(
            [sys.executable, calls.__file__, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )
        stack.enter_context(process)
        stack.callback(process.terminate)
        if process.stdin is None or process.stdout is None:
            raise RuntimeError("no way to ask the process")
        self._questions, self._answers = process.stdin, process.stdout

    def __call__(self, problem: str, call: str) -> dict[str, Any]:
        """The answer, or RuntimeError where the process has ended."""
        self._questions.write(json.dumps([problem, call]) + "\n")
        self._questions.flush()
        answer = self._answers.readline()
        if not answer:
            raise RuntimeError(f"the process that was asked for {call!r} of {problem!r} has ended")
        return json.loads(answer)


def measured(against: str | None, rounds: int) -> dict[str, Any]:
    """Rows by problem and call, and how far the numbers are apart."""
    with ExitStack() as stack:
        sides = {NOW: Asked(stack), SYNC: Asked(stack, None, "sync")}
        if against is not None:
            sides[BEFORE] = Asked(stack, stack.enter_context(state_of(against)))
        rows, apart = [], {}
        whole = [(problem, call) for problem in calls.PROBLEMS for call in calls.CALLS]
        for problem, call in tqdm(whole, desc="calls", disable=not sys.stderr.isatty()):
            found: dict[str, list[dict[str, float]]] = {name: [] for name in sides}
            for _ in range(rounds):
                for name, side in sides.items():
                    found[name].append(side(problem, call))
            row: dict[str, Any] = {"problem": problem, "call": call}
            for name, answers in found.items():
                for kind in ("wall", "processor"):
                    row[f"{name}, {kind}"] = min(one[kind] for one in answers)
            rows.append(row)
        for problem in calls.PROBLEMS if BEFORE in sides else ():
            one, other = (sides[name](problem, "numbers") for name in (NOW, BEFORE))
            apart[problem] = {name: _apart(one[name], other[name]) for name in one}
    return {"against": against, "rounds": rounds, "rows": rows, "apart": apart}


def _apart(one: list[float], other: list[float]) -> float:
    """The greatest difference, over the greatest number."""
    return float(np.max(np.abs(np.subtract(one, other))) / np.max(np.abs(other)))


def table(content: dict[str, Any]) -> str:
    """The rows as Markdown: wall / processor time."""
    rows = []
    for row in content["rows"]:
        shown = {"problem": row["problem"], "call": row["call"]}
        for name in (BEFORE, NOW, SYNC):
            if f"{name}, wall" in row:
                each = (row[f"{name}, {kind}"] for kind in ("wall", "processor"))
                shown[f"{name} [us]"] = " / ".join(f"{one:.3g}" for one in each)
        if f"{BEFORE}, wall" in row:
            for kind in ("wall", "processor"):
                times = row[f"{BEFORE}, {kind}"] / row[f"{NOW}, {kind}"]
                shown[f"times, {kind}"] = f"{times:.1f}"
        rows.append(shown)
    return markdown(rows)


def main() -> None:
    """Do what is asked."""
    parser = options("evaluations", __doc__)
    parser.add_argument("--against", metavar="COMMIT", help="measure it beside, in turns")
    parser.add_argument("--rounds", type=int, default=5, help="of turns")
    parser.add_argument("--docs", type=Path, help="put the table into this page, from the file")
    given = parser.parse_args()
    if given.docs is None:
        content = {**provenance(), **measured(given.against, given.rounds)}
        write_json(content, given.out)
        print(table(content), content["apart"], sep="\n\n")
    else:
        put_between(given.docs, f"\n{table(read_json(given.out))}\n", MARKS)


if __name__ == "__main__":
    main()
