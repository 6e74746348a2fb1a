"""A sweep as a page: what was varied, what came of it in words, and its pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.reports.writing import REPORT, write_page
from stickslip.envs.rendering.html.data import Page

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stickslip.agents.machine import AnyMachine


def write_report(machine: AnyMachine, path: Path, text: str, drawn: Sequence[Path]) -> Path:
    """Write report.html into a sweep's directory, in place of one that is there; return its path.

    text: the sweep in words; drawn: its pictures.
    """
    page = Page(
        title=f"Sweep of the {machine.title}: {path.name}",
        lead="Each number with half its 95 % interval where there is one.",
        text=text,
        pictures=tuple((one.stem, one.read_bytes()) for one in drawn),
    )
    return write_page(page, path / REPORT, overwrite=True)
