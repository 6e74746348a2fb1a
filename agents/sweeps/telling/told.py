"""What a machine calls what a sweep tells of."""

from __future__ import annotations

from typing import NamedTuple


class Told(NamedTuple):
    """How a machine's sweeps are told of."""

    slip: tuple[str, str] | None = None
    """Names of what slid, and of the way, where that is something to tell."""
    fails: str = "fails"
    """What an episode does that ends outside the model."""
    failures: str = "failures"
    """Such ends."""


PLAINLY = Told()
