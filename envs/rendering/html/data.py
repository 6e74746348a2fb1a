"""What a page shows, as plain arrays. Pages compute nothing but what lies between two samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering.drawing import Drawing

if TYPE_CHECKING:
    from stickslip.records.table import Table

MOST_SAMPLES = 20_000
"""Of one episode."""
EVENTS = ("slip", "stick", "support", "end")


@dataclass(frozen=True)
class Line:
    """One curve. values: [n], NaN where there is none."""

    name: str
    values: np.ndarray
    dashed: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves over one axis. limits: levels that are drawn dashed, in the panel's unit. steps: a
    value holds from the sample before to its own, as a torque does."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    limits: tuple[float, ...] = ()
    steps: bool = False


@dataclass(frozen=True)
class Event:
    """Something that happened by a sample. kind: one of EVENTS."""

    sample: int
    kind: str
    words: str

    def __post_init__(self):
        if self.kind not in EVENTS:
            raise ValueError(f"kind = {self.kind!r}; accepted: {', '.join(EVENTS)}")


@dataclass(frozen=True)
class Shown:
    """An episode of one player. period: between samples [s]. name: of the player.

    numbers: title with unit, value [n] and digits, what stands above the picture. slips: [n],
    whether it slips by then. ended: what ended it, "" for its time. facts: of the whole, in words.
    states: the two that `slips` tells apart, in words, the one that slips second.
    """

    name: str
    period: float
    panels: tuple[Panel, ...]
    events: tuple[Event, ...] = ()
    numbers: tuple[tuple[str, np.ndarray, int], ...] = ()
    slips: np.ndarray | None = None
    drawing: Drawing | None = None
    ended: str = ""
    facts: tuple[tuple[str, str], ...] = ()
    states: tuple[str, str] = ("STICK", "SLIP")

    def __post_init__(self):
        if not 0 < self.period < np.inf:
            raise ValueError(f"period = {self.period}; accepted: > 0 s")
        if not self.panels or not self.panels[0].lines:
            raise ValueError("panels is empty; accepted: at least one with a line")
        if not 2 <= self.samples <= MOST_SAMPLES:
            raise ValueError(
                f"an episode of {self.samples} samples; accepted: 2 to {MOST_SAMPLES}, fewer with "
                "a shorter episode"
            )

    @property
    def samples(self) -> int:
        """The first state and one after every step."""
        return len(self.panels[0].lines[0].values)


@dataclass(frozen=True)
class Page:
    """Everything that a page holds. lead: below the title; tables: with their titles."""

    title: str
    lead: str = ""
    episodes: tuple[Shown, ...] = ()
    tables: tuple[tuple[str, Table], ...] = ()
