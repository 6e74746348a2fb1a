"""What a page shows, as plain arrays. Pages compute nothing but what lies between two samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stickslip.records.table import Table

MOST_SAMPLES = 20_000
"""Of one episode; a page has room for fewer, see `thinning`."""
ROLES = (
    *("ink", "muted", "page", "panel", "hip", "hip-edge", "motor"),
    *("main", "mid", "slim", "tyre", "rim", "holds", "slides"),
)
"""The colours that a part may have; the page has each twice, in light and in dark."""
EVENTS = ("slip", "stick", "support", "patch", "end")


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
    """Something that happened by a sample. kind: one of EVENTS. time: when [s], None for the
    sample's."""

    sample: int
    kind: str
    words: str
    time: float | None = None

    def __post_init__(self):
        if self.kind not in EVENTS:
            raise ValueError(f"kind = {self.kind!r}; accepted: {', '.join(EVENTS)}")


@dataclass(frozen=True)
class Part:
    """A thing to draw: exactly one of bars, dots and outline.

    role: its colour, one of ROLES. bars: pairs of indices of points. dots: indices of points.
    outline: [k, 2] m in the axes of `body`. width: of a bar or a dot, in parts of 960 of the
    picture's width. group: of a leg, None for what is always there: see Drawing.active. edge: role
    of an outline's or a dot's edge.
    """

    role: str
    bars: tuple[tuple[int, int], ...] = ()
    dots: tuple[int, ...] = ()
    outline: np.ndarray | None = None
    body: int | None = None
    width: float = 1.0
    group: int | None = None
    edge: str | None = None

    def __post_init__(self):
        for role in filter(None, (self.role, self.edge)):
            if role not in ROLES:
                raise ValueError(f"role = {role!r}; accepted: {', '.join(ROLES)}")


@dataclass(frozen=True)
class Contact:
    """Where the ground pushes. Every entry [n] but place, [n, 2] m.

    slope: of the ground [rad]. friction, normal: force along and out of the ground [N].
    mu_static, mu_kinetic: [-], NaN where nothing can slip. slips: whether it slips.
    """

    place: np.ndarray
    slope: np.ndarray
    friction: np.ndarray
    normal: np.ndarray
    mu_static: np.ndarray
    mu_kinetic: np.ndarray
    slips: np.ndarray

    def __post_init__(self):
        _exactly(self, "place")


@dataclass(frozen=True)
class Stretch:
    """Ground from start to end [m] of one friction. words: its label. icy: drawn with glints."""

    start: float
    end: float
    colour: str
    words: str
    icy: bool = False


@dataclass(frozen=True)
class Mark:
    """Where a foot slid, low to high [m], from one sample to another."""

    first: int
    last: int
    low: float
    high: float


@dataclass(frozen=True)
class Drawing:
    """A machine in its place, sample by sample. Places are kept in single precision.

    points: [n, p, 2] m. bodies: x, y [m] and angle [rad], [n, b, 3]. parts: back to front. active:
    [n], the group of parts that is drawn in full colours, the other one pale; None without groups.
    contacts: see Contact. ground: [k, 2] m, its profile. stretches: of it. marks: slides, each with
    its length; smears: what was slid over by each sample, [n, 2] m, NaN for nothing. focus: what
    the camera follows, [n, 2] m, its height only with follow_height. left: where that is in the
    picture's width, 0 to 1; low: how far the picture reaches down from it; span, height: what it
    must hold [m]. reach: length of the friction cones, and force: of the arrow of a force that
    equals `weight` [m, N]. seen: points of the ground that are observed, [n, k, 2] m. legend: roles
    with their words.
    """

    points: np.ndarray
    bodies: np.ndarray
    parts: tuple[Part, ...]
    contacts: tuple[Contact, ...]
    ground: np.ndarray
    stretches: tuple[Stretch, ...]
    focus: np.ndarray
    span: float
    height: float
    left: float
    low: float
    reach: float
    force: float
    weight: float
    marks: tuple[Mark, ...] = ()
    smears: np.ndarray | None = None
    active: np.ndarray | None = None
    follow_height: bool = True
    seen: np.ndarray | None = None
    legend: tuple[tuple[str, str], ...] = ()

    def __post_init__(self):
        _exactly(self, "points", "bodies", "ground", "smears", "focus", "seen")


@dataclass(frozen=True)
class Shown:
    """An episode of one player. period: between samples [s]. name: of the player.

    numbers: title with unit, value [n] and digits, what stands above the picture. slips: [n],
    whether it slips by then. spans: from when to when it slips [k, 2] s, None for `slips`. ended:
    what ended it, "" for its time. facts: of the whole, in words. timing: how exact the times of
    events are. states: the two that `slips` tells apart, in words, the one that slips second.
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
    spans: np.ndarray | None = None
    timing: str = ""
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


def _exactly(owner: Contact | Drawing, *names: str) -> None:
    """Have arrays kept in single precision: 16 bits are too few for places after a long way."""
    for name in names:
        value = getattr(owner, name)
        if value is not None:
            object.__setattr__(owner, name, np.asarray(value, np.float32))


@dataclass(frozen=True)
class Curve:
    """A panel over an axis of its own. x: [n], rising. log: drawn evenly in its logarithm."""

    axis: str
    x: np.ndarray
    panel: Panel
    log: bool = False


@dataclass(frozen=True)
class Page:
    """Everything that a page holds. lead: a sentence below the title. tables, pictures: with their
    titles; a picture is the bytes of a PNG file. text: as it stands in a
    terminal. over: the heading of the curves, where there are episodes, too. closing: tables below
    all else."""

    title: str
    lead: str = ""
    facts: tuple[tuple[str, str], ...] = ()
    episodes: tuple[Shown, ...] = ()
    tables: tuple[tuple[str, Table], ...] = ()
    curves: tuple[Curve, ...] = ()
    pictures: tuple[tuple[str, bytes], ...] = ()
    notes: tuple[str, ...] = ()
    text: str = ""
    over: str = "All episodes"
    closing: tuple[tuple[str, Table], ...] = ()
