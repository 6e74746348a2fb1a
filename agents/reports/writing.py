"""Pages as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from stickslip.envs.rendering.html.data import Page

KINDS = (".html", ".htm")


def write_page(page: Page, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a page as one file, whole or not at all, and return its path.

    ValueError for another kind of file, and for one that exists unless overwrite.
    """
    from stickslip.envs.rendering.html.document import page_text

    path = Path(path)
    require_page(path)
    return write_whole(path, page_text(page), overwrite=overwrite)


def require_page(path: Path) -> None:
    """Raise ValueError for a path that is no page's."""
    if path.suffix.lower() not in KINDS:
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {', '.join(KINDS)}")
