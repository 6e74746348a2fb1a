"""Leg angles of a drive: two numbers, or a file as `stickslip optimise ugv` writes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optimise.command import STATIONS
from stickslip.optimise.report import FRONT_LEG, FRONT_WHEEL, REAR_LEG
from stickslip.simulate.columns import read_columns

if TYPE_CHECKING:
    from jaxtyping import Float

ACCEPTED = (
    f"{STATIONS} of `stickslip optimise ugv`, its directory, or a .csv with {FRONT_WHEEL} "
    f"[m], {REAR_LEG} [rad] and {FRONT_LEG} [rad], finite numbers and places that increase"
)


class Posture(NamedTuple):
    """Leg angles [K, 2] [rad], rear and front, with the front wheel at x [K] [m]."""

    x: Float[np.ndarray, "K"]
    angles: Float[np.ndarray, "K 2"]


def read_posture(text: str) -> Posture:
    """The drive in a file. ValueError naming the file and the line of what will not do."""
    path = Path(text)
    path = path / STATIONS if path.is_dir() else path
    if path.suffix.lower() != ".csv":
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {ACCEPTED}")
    units = {FRONT_WHEEL: "m", REAR_LEG: "rad", FRONT_LEG: "rad"}
    found = read_columns(path, units, ACCEPTED)
    x, angles = found[:, 0], found[:, 1:]
    wrong = np.flatnonzero(np.diff(x) <= 0)
    if len(x) < 2 or wrong.size:
        why = f"row {int(wrong[0]) + 2} does not lie ahead" if wrong.size else "one row"
        raise ValueError(f"{path}: {why}; accepted: {ACCEPTED}")
    return Posture(x, angles)
