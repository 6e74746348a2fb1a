"""A robot or a vehicle of the user's, as flags give it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import read_robot, robot_text
from stickslip.dynamics.ugv import UGVParams
from stickslip.dynamics.ugv.vehicle_file import read_vehicle, vehicle_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.options import RobotOptions, TrackOptions, VehicleOptions


def robot_of(given: RobotOptions) -> BipedParams:
    """The robot of --robot and --set, by default the reference robot."""
    return BipedParams.from_file(given.robot, given.changes)


def motor_of(given: RobotOptions) -> dict[str, float]:
    """The numbers of the motor in the robot's file: torque_limit [N m], copper_loss."""
    return read_robot(given.robot, given.changes).motor


def vehicle_of(given: VehicleOptions) -> UGVParams:
    """The vehicle of --vehicle and --set, by default the chapter's."""
    return UGVParams.from_file(given.vehicle, given.changes)


def torque_limit_of(given: TrackOptions) -> float | None:
    """Torque limit of each wheel's motor [N m]: --max-torque, or the file's; None without one."""
    if given.max_torque is not None:
        return finite(given.max_torque)
    return read_vehicle(given.vehicle, given.changes)[1].get("torque_limit")


def finite(limit: float | None) -> float | None:
    """A limit, None where it is infinite."""
    return None if limit == math.inf else limit


def own_files(
    given: RobotOptions | VehicleOptions, machine: BipedParams | UGVParams
) -> dict[str, Callable[[], str]]:
    """The file of a machine that is not the default one, to keep beside a result."""
    biped = isinstance(machine, BipedParams)
    path = getattr(given, "robot" if biped else "vehicle")
    if path is None and not given.changes:
        return {}
    if biped:
        return {"robot.toml": lambda: robot_text(vars(machine))}
    return {"vehicle.toml": lambda: vehicle_text(vars(machine))}
