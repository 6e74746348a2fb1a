"""The policies of the package as a table of a page."""

from __future__ import annotations

from benchmarks.report import markdown
from stickslip.agents.shipped.record import every_record


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
