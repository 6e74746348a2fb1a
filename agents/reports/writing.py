"""Pages as files."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.envs.rendering.html.data import Page

REPORT = "report.html"
"""Of a command with a folder for its results."""
KINDS = (".html", ".htm")
T = TypeVar("T")


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


def written_or_told(folder: Path, write: Callable[[], T]) -> T | None:
    """What `write` returns, the last thing of a run whose data lie in a folder already.

    Where it raises, a RuntimeWarning says so, and there is None: the run is none the worse for it.
    """
    try:
        return write()
    except Exception as error:  # noqa: BLE001, whatever stands in the way of a page
        words = f"{type(error).__name__}: {error}"
        warnings.warn(
            f"{folder}: its data are whole, but {REPORT} could not be written ({words})",
            RuntimeWarning,
            stacklevel=3,
        )
        return None
