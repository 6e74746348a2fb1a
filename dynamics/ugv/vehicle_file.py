"""Files of a vehicle. See `UGVParams.from_file`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip.dynamics.machine_file import MachineFile, toml_text
from stickslip.dynamics.pytrees import require_one

UNITS = dict.fromkeys(("body_length", "leg_length", "wheel_radius"), "m")
UNITS |= dict.fromkeys(("wheel_mass", "body_mass", "leg_mass"), "kg")
UNITS |= {"gravity": "m/s^2", "leg_angle_min": "rad", "leg_angle_max": "rad", "wheel_gap": "m"}
UNITS |= {"rolling_resistance": "", "drive_efficiency": "", "regeneration_efficiency": ""}
UNITS |= {"holding_loss": "J/(N m)^2/m"}
"""SI units of the fields of UGVParams."""
MOTOR = {"motor.torque_limit": "N m", "motor.max_power": "W", "motor.speed": "m/s"}
ENTRIES = {f"vehicle.{name}": unit for name, unit in UNITS.items()} | MOTOR
VEHICLE = MachineFile("ugv", "vehicle", ENTRIES, {name: name for name in ENTRIES}, {})
"""What the file of a vehicle may have."""
ABOUT = 'A vehicle: numbers in SI units, or texts with their units, as "830 mm".'


def max_torque_of(numbers: Mapping[str, Any], wheel_radius: float) -> float | None:
    """Torque limit of each wheel's motor [N m], None without any, from the numbers of a file.

    Of max_power P it is P r / speed, the torque at which a wheel that rolls at that speed needs P.
    Neglected: that a wheel rolls faster or slower while its leg swings.
    """
    limits = [one for one in [numbers.get("motor.torque_limit")] if one is not None]
    power, speed = numbers.get("motor.max_power"), numbers.get("motor.speed")
    if (power is None) != (speed is None):
        raise ValueError(
            f"motor.max_power = {power} [W] with motor.speed = {speed} [m/s]; accepted: both, or "
            "neither"
        )
    if power is not None and speed is not None:
        how: dict[str, Any] = {"low": 0.0, "strict": True, "accepted": "a finite number > 0"}
        power = require_one("motor.max_power", power, **how)
        limits.append(power * wheel_radius / require_one("motor.speed", speed, **how))
    return min(limits, default=None)


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
