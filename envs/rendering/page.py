"""An HTML page of one file that plays episodes in a browser, without a network.

Python computes every position; the page interpolates between samples and draws.
"""

from __future__ import annotations

import base64
import hashlib
import json
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
from string import Template

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Picture
from stickslip.records.table import jsonable

MOST_SAMPLES = 20_000
"""Samples of one episode."""
FOLDER = Path(__file__).parent / "html"
SCRIPTS = (*("data.js", "draw.js", "scene.js", "charts.js", "card.js", "player.js", "main.js"),)
"""Scripts of a page, in order."""


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
    """Something that happened by a sample. kind: "slip", "stick", "support" or "end"."""

    sample: int
    kind: str
    words: str


@dataclass(frozen=True, kw_only=True)
class Episode(Picture):
    """An episode of one player, sample by sample. period: between samples [s]. name: of the player.

    facts: titles and values. axis: of plots, title with unit and values [n]; None: time.
    """

    name: str
    period: float
    panels: tuple[Panel, ...]
    events: tuple[Event, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    axis: tuple[str, np.ndarray] | None = None

    @property
    def samples(self) -> int:
        """The first state and one after every step."""
        return len(self.panels[0].lines[0].values)


@dataclass(frozen=True)
class Page:
    """Contents of a page. lead: below the title."""

    title: str
    lead: str = ""
    episodes: tuple[Episode, ...] = ()

    def __post_init__(self):
        for one in self.episodes:
            if not 2 <= one.samples <= MOST_SAMPLES:
                raise ValueError(
                    f"an episode of {one.samples} samples; accepted: 2 to {MOST_SAMPLES} on a page"
                )


def page_text(page: Page) -> str:
    """The page as HTML. Names are text in it, whatever characters they hold."""
    plain = jsonable({"episodes": page.episodes}, _packed)
    text = json.dumps(plain, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for one in "&<>":  # which could end the script or begin a comment in it
        text = text.replace(one, f"\\u{ord(one):04x}")
    return html_of(page.title, page.lead, text)


def html_of(title: str, lead: str, data: str) -> str:
    """The page of a title, a lead and the episodes' JSON.

    Its policy on contents allows the package's two scripts by their digests and nothing else, so
    neither a name nor a picture can bring a script or a request with it.
    """
    library = f"/*\n{_read('vendor/uPlot.LICENSE')}*/\n{_read('vendor/uPlot.iife.min.js')}"
    program = '"use strict";\n(() => {\n' + "\n".join(map(_read, SCRIPTS)) + "})();\n"
    return Template(_read("page.html")).substitute(
        title=escape(title),
        policy=escape(_policy(library, program)),
        style=_colours() + _read("vendor/uPlot.min.css") + _read("page.css"),
        lead=f'<p class="lead">{escape(lead)}</p>' if lead else "",
        data=data,
        library=library,
        program=program,
    )


def _colours() -> str:
    """Variables of CSS: by day, by night where the system or the reader asks for it."""
    day, night = "".join(f"--{name}:{one};" for name, one in theme.DAY.items()), _read("night.css")
    return (
        f":root{{color-scheme:light;{day}}}\n"
        "@media (prefers-color-scheme:dark){:root:not([data-theme=light])"
        f"{{color-scheme:dark;{night}}}}}\n"
        f":root[data-theme=dark]{{color-scheme:dark;{night}}}\n"
    )


def _policy(*scripts: str) -> str:
    digests = (hashlib.sha256(one.encode()).digest() for one in scripts)
    allowed = " ".join(f"'sha256-{base64.b64encode(one).decode()}'" for one in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _packed(array: np.ndarray) -> dict[str, object]:
    """Its shape, and base64 of little-endian float32."""
    data = base64.b64encode(array.astype("<f4").tobytes()).decode()
    return {"shape": list(array.shape), "data": data}


@cache
def _read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
