"""Cells of tables by their length, for the style: what is brief stays on one line."""

from __future__ import annotations

import re
from html import unescape

BRIEF, LONG = 20, 60
"""Letters of a cell, or of a name in one, that does not break, and of a cell with a wide column."""
CELL = re.compile(r"<td((?: style=\"[^\"]*\")?)>(.*?)</td>", re.DOTALL)
NAME = re.compile(rf"<code>([^<]{{1,{BRIEF}}})</code>")
TAG = re.compile(r"<[^>]*>")


def with_lengths(html: str) -> str:
    """The page with class "brief" or "long" at cells of Markdown's tables and names in them."""
    return CELL.sub(_marked, html)


def _marked(cell: re.Match[str]) -> str:
    style, content = cell.groups()
    letters = len(unescape(TAG.sub("", content)))
    kind = ' class="brief"' if letters <= BRIEF else ' class="long"' if letters > LONG else ""
    return f"<td{kind}{style}>{NAME.sub(_whole, content)}</td>"


def _whole(name: re.Match[str]) -> str:
    return f'<code class="brief">{name[1]}</code>'
