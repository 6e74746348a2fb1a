"""What decides a sweep's results, as JSON values."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class AxisEntry(TypedDict, total=False):
    """An axis. kind, log: as of `Axis`. values: of a grid. low, high, digest: of random ones, the
    last of the values that were drawn. sets: dotted fields. unit: of the first."""

    kind: str
    log: bool
    values: list[float]
    low: float
    high: float
    digest: str
    sets: list[str]
    unit: str


class Design(TypedDict):
    """The points. samples: 0 without random axes."""

    axes: dict[str, AxisEntry]
    samples: int
    design_seed: int


class Definition(Design):
    """All of it. tasks, policies: digests by name. cases: task and policy of each. draws: "common"
    or "independent". rows: "episodes" or "summaries"."""

    machine: str
    tasks: dict[str, str]
    policies: dict[str, str]
    cases: list[list[str]]
    episodes: int
    draws: str
    rows: str


class Whole(TypedDict):
    """What is read of sweep.json. units: of axes and of what is kept. drawn: the
    tasks whose resets draw."""

    definition: Definition
    digest: str
    layout: dict[str, int]
    chunks: int
    units: dict[str, str]
    finished: NotRequired[list[str]]
    drawn: NotRequired[list[str]]
