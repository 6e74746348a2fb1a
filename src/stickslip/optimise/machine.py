"""Robot, vehicle and track as flags give them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import robot_text
from stickslip.dynamics.ugv import TRACKS, Track, UGVParams
from stickslip.dynamics.ugv.vehicle_file import vehicle_text
from stickslip.optim.posture.track_file import read_track

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from stickslip.options import RobotOptions, TrackOptions, VehicleOptions


def robot_of(given: RobotOptions) -> tuple[BipedParams, dict[str, float]]:
    """The robot of --robot and --set, by default the reference robot, and its motor's numbers."""
    return BipedParams.with_motor(given.robot, given.changes)


def vehicle_of(given: TrackOptions) -> tuple[UGVParams, float | None]:
    """The vehicle of --vehicle and --set, by default the chapter's, and the torque limit of each
    wheel's motor [N m]: --max-torque, or the file's; None without one."""
    vehicle, motor = UGVParams.with_motor(given.vehicle, given.changes)
    asked = given.max_torque
    return vehicle, motor.get("max_torque") if asked is None else finite(asked)


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


def track_of(name: str, options: Iterable[str] = ()) -> Track:
    """The named track, or the one in the file of that name.

    options: "name=value" each; of Track.named, or `interpolation` for a file. ValueError for what
    is unknown, OSError where the file cannot be read.
    """
    given = track_options_of(options)
    if name in TRACKS:
        try:
            return Track.named(name, **given)
        except TypeError as error:
            raise ValueError(f"track {name!r} with {given}: {error}") from error
    path = Path(name)
    if not path.exists():
        raise ValueError(
            f"track {name!r} is neither a name nor a file; accepted: {', '.join(TRACKS)}, or a "
            "file of points (x and y, or GPX)"
        )
    unknown = [key for key in given if key != "interpolation"]
    if unknown:
        raise ValueError(f"a track in a file has no {unknown[0]!r}; accepted: interpolation")
    return read_track(path, **given)


def track_options_of(words: Iterable[str]) -> dict[str, Any]:
    """name=value words as names and numbers or text; the last one counts."""
    found: dict[str, Any] = {}
    for word in words:
        name, sign, value = map(str.strip, word.partition("="))
        if not (sign and name and value):
            raise ValueError(f"--track-option {word!r}; accepted: name=value")
        try:
            found[name] = json.loads(value)
        except ValueError:
            found[name] = value
    return found
