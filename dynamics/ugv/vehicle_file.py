"""Files of a vehicle. See `UGVParams.from_file`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import require_known
from stickslip.dynamics.machine_file import (
    Table,
    in_file,
    number_or_text,
    numbers_of,
    read_machine,
    table_of,
    toml_text,
)

if TYPE_CHECKING:
    from pathlib import Path

UNITS = dict.fromkeys(("body_length", "leg_length", "wheel_radius"), "m")
UNITS |= dict.fromkeys(("wheel_mass", "body_mass", "leg_mass"), "kg")
UNITS |= {"gravity": "m/s^2", "leg_angle_min": "rad", "leg_angle_max": "rad", "wheel_gap": "m"}
"""SI units of the fields of UGVParams."""
MOTOR = {"torque_limit": "N m"}
TABLES = ("vehicle", "motor")
PLACES = {f"vehicle.{name}": ("vehicle", name) for name in UNITS}
PLACES |= {f"motor.{name}": ("motor", name) for name in MOTOR}
"""Where a file has the number of a dotted name."""
ABOUT = 'A vehicle: numbers in SI units, or texts with their units, as "830 mm".'


def read_vehicle(
    path: str | Path | None, changes: Mapping[str, Any] | None = None
) -> tuple[dict[str, float], dict[str, float]]:
    """Fields of the vehicle in a file, and numbers of its motors: torque_limit [N m].

    path: None: nothing but the changes. changes: see `changed`.
    """
    tables = {} if path is None else read_machine(path, "ugv", TABLES)
    with in_file(path):
        found = _read(tables)
    return _read(changed(tables, changes)) if changes else found


def _read(tables: Table) -> tuple[dict[str, float], dict[str, float]]:
    vehicle = numbers_of(table_of(tables, "vehicle"), UNITS, "vehicle")
    return vehicle, numbers_of(table_of(tables, "motor"), MOTOR, "motor")


def changed(tables: Table, changes: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a file with single numbers changed, by the names of `PLACES`.

    Values as in a file, or their texts. ValueError for an unknown name.
    """
    require_known(changes, PLACES, "number of a vehicle")
    found = {name: dict(table_of(tables, name)) for name in TABLES}
    for name, value in changes.items():
        table, entry = PLACES[name]
        found[table][entry] = number_or_text(value)
    return found


def vehicle_text(vehicle: Mapping[str, Any]) -> str:
    """A vehicle's fields as TOML. ValueError for a batch of vehicles."""
    table = {name: vehicle[name] for name in UNITS}
    for name, value in table.items():
        if np.ndim(value):
            raise ValueError(f"{name} has shape {np.shape(value)}; accepted: one vehicle, shape ()")
    return toml_text({"machine": "ugv", "vehicle": table}, ABOUT)
