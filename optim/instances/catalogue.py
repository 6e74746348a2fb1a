"""The instances of the suite by id. A definition never changes: a change gets a new version."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from stickslip.dynamics.checks import require_choice

if TYPE_CHECKING:
    from stickslip.optim.instances.instance import Instance

FAMILIES = ("posture", "split", "gait", "shooting", "gains", "design", "goals")
"""Families of instances (docs/suite.md)."""
MACHINES = ("stickslip.optim.instances.ugv", "stickslip.optim.instances.biped")
"""Modules whose `instances()` the suite holds, and whose WITHDRAWN it refuses."""


def suite(*families: str) -> dict[str, Instance]:
    """All instances by id, or those of some of FAMILIES.

    Making them costs nothing: problems are built when they are used.
    """
    for one in families:
        require_choice("family", one, FAMILIES)
    return {name: one for name, one in _all().items() if not families or one.family in families}


def instance(name: str) -> Instance:
    """One of them by its id. ValueError, with the nearest ids, for an unknown one, and with the
    reason for a withdrawn one."""
    if name in withdrawn():
        stem = name.rpartition("-v")[0]
        latest = [one for one in _all() if one.rpartition("-v")[0] == stem]
        raise ValueError(
            f"id = {name} is withdrawn: {withdrawn()[name]}; accepted: "
            f"{', '.join(latest) or 'another one'}"
        )
    require_choice("id", name, tuple(_all()))
    return _all()[name]


def withdrawn() -> dict[str, str]:
    """Reasons of withdrawn instances, by id. They are listed and refused."""
    return {
        name: why for machine in MACHINES for name, why in import_module(machine).WITHDRAWN.items()
    }


@cache
def _all() -> dict[str, Instance]:
    return {one.id: one for machine in MACHINES for one in import_module(machine).instances()}
