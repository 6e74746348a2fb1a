"""Every public call that takes a user's numbers, what each argument accepts, and bad values."""

from __future__ import annotations

from tests.fuzz.environments import environments
from tests.fuzz.problems import gaits, problems
from tests.fuzz.robots import floors, walkers
from tests.fuzz.values import Plan


def plans() -> dict[str, Plan]:
    """By the name of what is called."""
    return floors() | walkers() | environments() | problems() | gaits()
