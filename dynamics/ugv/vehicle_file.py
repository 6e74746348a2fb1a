"""Files of a vehicle. See `UGVParams.from_file`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip.dynamics.machine_file import MachineFile, toml_text

UNITS = dict.fromkeys(("body_length", "leg_length", "wheel_radius"), "m")
UNITS |= dict.fromkeys(("wheel_mass", "body_mass", "leg_mass"), "kg")
UNITS |= {"gravity": "m/s^2", "leg_angle_min": "rad", "leg_angle_max": "rad", "wheel_gap": "m"}
UNITS |= {"rolling_resistance": "", "drive_efficiency": "", "regeneration_efficiency": ""}
UNITS |= {"holding_loss": "J/(N m)^2/m"}
"""SI units of the fields of UGVParams."""
ENTRIES = {f"vehicle.{name}": unit for name, unit in UNITS.items()} | {"motor.torque_limit": "N m"}
VEHICLE = MachineFile("ugv", "vehicle", ENTRIES, {name: name for name in ENTRIES}, {})
"""What the file of a vehicle may have."""
ABOUT = 'A vehicle: numbers in SI units, or texts with their units, as "830 mm".'


def vehicle_text(vehicle: Mapping[str, Any], max_torque: float | None = None) -> str:
    """A vehicle's fields but for those that are None as TOML, max_torque [N m] as its motors'.

    ValueError for a batch.
    """
    for name in UNITS:
        if shape := np.shape(vehicle[name]):
            raise ValueError(f"{name} has shape {shape}; accepted: one vehicle, shape ()")
    numbers = {f"vehicle.{name}": one for name in UNITS if (one := vehicle[name]) is not None}
    numbers |= {} if max_torque is None else {"motor.torque_limit": max_torque}
    return toml_text("ugv", numbers, ABOUT)
