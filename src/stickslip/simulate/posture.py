"""Leg angles of a drive: two numbers, or a file as `stickslip optimise ugv` writes it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.columns import ColumnSpec, accepted_table, read_columns
from stickslip.optimise.command import STATIONS
from stickslip.optimise.report import FRONT_LEG, FRONT_WHEEL, REAR_LEG

if TYPE_CHECKING:
    from jaxtyping import Float

COLUMNS = (
    ColumnSpec(FRONT_WHEEL, "m", ("x",)),
    ColumnSpec(REAR_LEG, "rad", ("rear",)),
    ColumnSpec(FRONT_LEG, "rad", ("front",)),
)
OF_OPTIMISE = f"{STATIONS} of `stickslip optimise ugv`, its directory, or "


class Posture(NamedTuple):
    """Leg angles [K, 2] [rad], rear and front, with the front wheel at x [K] [m]."""

    x: Float[np.ndarray, "K"]
    angles: Float[np.ndarray, "K 2"]


def read_posture(text: str) -> Posture:
    """The drive in a file. ValueError naming the file and the line of what will not do."""
    path = Path(text)
    path = path / STATIONS if path.is_dir() else path
    if path.suffix.lower() != ".csv":
        raise ValueError(
            f"{path} ends in {path.suffix!r}; accepted: {OF_OPTIMISE}a .csv, "
            f"{accepted_table(COLUMNS)}"
        )
    found = read_columns(path, COLUMNS, also=OF_OPTIMISE)
    if len(found) < 2:
        raise ValueError(f"{path}: one row; accepted: 2 or more")
    return Posture(found[:, 0], found[:, 1:])
