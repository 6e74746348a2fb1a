"""The built site as a reader without a network has it: every link and picture is there.

    python -m documentation.check

Of each page: addresses within the site lead to a file of it, and to an anchor where they name one;
nothing that a browser loads by itself (scripts, styles, pictures, fonts) is elsewhere.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from documentation.names import ROOT

SITE = ROOT / "build" / "site"
IMPORTED = re.compile(r"(?:url\(|@import )[\"']?(https?:)?//")
FOLLOWED = ("a", "area")
"""Tags whose addresses are loaded when a reader asks for it."""


class Page(HTMLParser):
    """The addresses and the anchors of a page."""

    def __init__(self, text: str):
        super().__init__()
        self.anchors: set[str] = set()
        self.addresses: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """See HTMLParser."""
        for name, value in attrs:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            elif name in ("href", "src") and value:
                self.addresses.append((tag, value))


def findings(site: Path) -> Iterator[str]:
    """What is wrong, a line each."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        if path.name == "404.html":  # its addresses are those of a server
            continue
        for tag, address in page.addresses:
            parts = urlsplit(address)
            named = f"{path.relative_to(site)}: {address}"
            if parts.scheme in ("data", "mailto"):
                continue
            if parts.scheme or parts.netloc:
                if tag not in FOLLOWED:
                    yield f"{named} would be fetched"
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                yield f"{named} leads to no file"
            elif target in pages and parts.fragment:
                missing = {unquote(parts.fragment)} - pages[target].anchors
                yield from (f"{named} leads to no anchor" for _ in missing)
    for path in sorted(site.rglob("*.css")):
        if IMPORTED.search(path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(site)} would fetch something"


def main() -> None:
    """Print what is wrong, and fail if anything is."""
    found = [*findings(SITE)]
    files = [path for path in SITE.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    print(*found, f"{SITE / 'index.html'}: {size:.0f} MB, {len(found)} findings", sep="\n")
    sys.exit(bool(found) or not files)


if __name__ == "__main__":
    main()
