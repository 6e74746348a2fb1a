"""A drive of the UGV as tables: stations, criteria."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.optim import CRITERIA
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from stickslip.optim import PostureProblem, Station

STATIONS = "stations.csv"
FRONT_WHEEL, REAR_LEG, FRONT_LEG = "front wheel", "rear leg angle", "front leg angle"
"""Columns that define a drive; all others follow from them."""
UNITS: dict[str, str] = {"leg_range": "rad", "start_angles": "rad", "end_angles": "rad"}
UNITS |= {"leg_rate": "rad/m", "grip": "N", "normal": "N", "clearance": "m", "wheels": "m"}
UNITS |= {"torque": "N m", "pose": "waypoints"}
"""Units of PostureProblem.residuals."""


def stations_table(found: Station) -> Table:
    """A row a waypoint, numbers in SI units and radians, every digit."""
    columns: dict[Column, object] = {
        Column(FRONT_WHEEL, "m"): found.x,
        Column(REAR_LEG, "rad"): found.leg_angles[:, 0],
        Column(FRONT_LEG, "rad"): found.leg_angles[:, 1],
        Column("torque on each wheel", "N m"): found.torque,
        Column("turn of both wheels", "rad"): found.turn,
        Column("rear leg torque", "N m"): found.leg_torques[:, 0],
        Column("front leg torque", "N m"): found.leg_torques[:, 1],
        Column("F_rear", "N"): found.F_rear,
        Column("N_rear", "N"): found.N_rear,
        Column("F_front", "N"): found.F_front,
        Column("N_front", "N"): found.N_front,
        Column("least grip margin", "N"): found.grip,
        Column("clearance", "m"): found.clearance,
        Column("between the wheels", "m"): found.wheel_clearance,
    }
    numbers = [np.asarray(values, float).tolist() for values in columns.values()]
    status = [Status(int(code)).name for code in np.asarray(found.status)]
    head = [*columns, Column("status", words=True)]
    return Table(head, list(zip(*numbers, status, strict=True)))


def criteria_table(problem: PostureProblem, x: np.ndarray) -> Table:
    """Value of the drive by every criterion: the lower the better."""
    heads = [Column("criterion", words=True), Column("value"), Column("unit", words=True)]
    rows = []
    for name in CRITERIA:
        own = replace(problem, criterion=name)
        rows.append([name, own.objective(x), own.criterion.unit])
    return Table(heads, rows)
