"""From what a page shows to its text: one file that loads nothing else."""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.html.encode import script_text

if TYPE_CHECKING:
    from stickslip.envs.rendering.html.data import Page

FOLDER = Path(__file__).parent
SCRIPTS = (*("data.js", "draw.js", "scene.js", "charts.js", "card.js", "player.js", "main.js"),)
"""Of a page, in the order in which they stand in it, as one script."""
LIBRARY = "uPlot.iife.min.js"


def page_text(page: Page) -> str:
    """The whole page as HTML. Names and words are text in it, whatever characters they hold.

    Its policy on contents allows the two scripts of this package by their digests and nothing from
    anywhere else, so neither a name nor a picture can bring a script or a request with it.
    """
    library, program = _library(), _program()
    return Template(_read("page.html")).substitute(
        title=escape(page.title),
        policy=escape(_policy(library, program)),
        style=_colours() + _read("vendor/uPlot.min.css") + _read("page.css"),
        lead=f'<p class="lead">{escape(page.lead)}</p>' if page.lead else "",
        tables="".join(table.html(title) for title, table in page.tables),
        data=script_text({"episodes": page.episodes}),
        library=library,
        program=program,
    )


def _colours() -> str:
    """Variables of CSS: by day, by night where the system or the reader asks for it."""
    day, night = (
        "".join(f"--{name}:{colour};" for name, colour in one.items())
        for one in (theme.DAY, theme.NIGHT)
    )
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


@cache
def _library() -> str:
    licence = _read("vendor/uPlot.LICENSE")
    return f"/*\n{licence}*/\n{_read('vendor/' + LIBRARY)}"


@cache
def _program() -> str:
    body = "\n".join(_read(name) for name in SCRIPTS)
    return f'"use strict";\n(() => {{\n{body}}})();\n'


@cache
def _read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
