"""The policies of the package as a table of a page."""

from __future__ import annotations

from benchmarks.report import markdown
from stickslip.agents.shipped.record import every_record


def table() -> str:
    """A row a policy, the command that trains each, and how those carried over were trained."""
    records = every_record()
    rows = [
        {
            "policy": f"`{one.name}`",
            "task": f"`{one.task.name}`",
            "score": "" if one.score is None else one.score.shown(2),
            "return": f"{one.earned_return:.4g} {one.task.unit.removeprefix('-')}".rstrip(),
            "failures": f"{one.earned['failures']:.0%}",
            "layers": " x ".join(map(str, one.layer_sizes)),
            "kB": f"{one.size / 1000:.1f}",
        }
        for one in records
    ]
    commands = "\n".join(f"    {one.command}" for one in records if not one.carried_over)
    before = "\n".join(f"- `{one.command}`" for one in records if one.carried_over)
    return (
        f"{markdown(rows)}\n\n{commands}\n\nTrained on withdrawn versions of their tasks, which "
        f"refuse training, and measured on the present ones:\n\n{before}"
    )
