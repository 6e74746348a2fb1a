"""Errors and costs of settings, which `recommend` and the presets promise.

    python -m benchmarks.tradeoff [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.tradeoff --redraw

population: each setting's errors on hundreds of seeded walks. costs: processor time of a simulated
second. Only the parts named are measured; the JSON keeps the other, with its commit. --update also
writes the module that `recommend` reads, the tables of docs/accuracy.md and the picture; --redraw
does that without measuring.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.report import measured_by_command, put_between
from benchmarks.tradeoff import recommended
from benchmarks.tradeoff.costs import costs
from benchmarks.tradeoff.promises import population, samples
from stickslip.records.files import write_whole

RESULTS = Path("benchmarks/results/tradeoff.json")
DOCUMENT = Path("docs/accuracy.md")
PICTURE = Path("docs/tradeoff.png")
DATA = Path("dynamics/biped/measured.json")
PARTS: dict[str, Any] = {"samples": samples, "population": population, "costs": costs}


def update(content: dict[str, Any]) -> None:
    """Write the data of `recommend`, the page's tables and the picture."""
    recommended.draw(content, PICTURE)
    write_whole(DATA, recommended.source(content))
    put_between(DOCUMENT, recommended.body(content))


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    measured_by_command("tradeoff", __doc__, PARTS, update, arguments)


if __name__ == "__main__":
    main()
