"""Robot, vehicle and track as flags give them."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import robot_text
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.ugv import TRACKS, Track, UGVParams
from stickslip.dynamics.ugv.vehicle_file import vehicle_text
from stickslip.optim.columns import UNITS, is_number
from stickslip.optim.posture import TREATMENTS
from stickslip.optim.posture.survey import Survey
from stickslip.optim.posture.track_file import read_survey
from stickslip.records.table import Column, Table
from stickslip.report import one_row

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from stickslip.options import RobotOptions, TrackOptions, VehicleOptions

ROLLS = 1.1
"""Radius of the default envelope in wheel radii: at 1 a wheel would touch whole arcs at once."""
LENGTH = re.compile(r"(.*\d\.?)\s*(mm|cm|m|km)?")


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
    given: RobotOptions | VehicleOptions,
    machine: BipedParams | UGVParams,
    motor: Mapping[str, float | None],
) -> dict[str, Callable[[], str]]:
    """The file of a machine that is not the default one, to keep beside a result. motor: numbers of
    the result's motor, None for no limit."""
    biped = isinstance(machine, BipedParams)
    path = getattr(given, "robot" if biped else "vehicle")
    if path is None and not given.changes:
        return {}
    if biped:
        own = {name: value for name, value in motor.items() if value is not None}
        return {"robot.toml": lambda: robot_text(vars(machine), own)}
    return {"vehicle.toml": lambda: vehicle_text(vars(machine), motor["max_torque"])}


def track_of(name: str, options: Iterable[str] = ()) -> Track:
    """`survey_of` without treatments: the track alone."""
    return survey_of(name, options).track


def survey_of(
    name: str, options: Iterable[str] = (), treatments: dict[str, Any] | None = None
) -> Survey:
    """The named track, or the one in the file of that name with its points.

    options: "name=value" each; of Track.named, or `interpolation` for a file. treatments: of the
    file's points. ValueError for what is unknown, OSError where the file cannot be read.
    """
    given, path = track_options_of(options), Path(name)
    if name in TRACKS:
        if treatments:
            raise ValueError(f"--ground with track {name!r}; accepted: with a file of points")
        try:
            return Survey(Track.named(name, **given), np.empty((0, 2)), np.empty((0, 2)), {})
        except TypeError as error:
            raise ValueError(f"track {name!r} with {given}: {error}") from error
    if not path.exists():
        raise ValueError(
            f"track {name!r} is neither a name nor a file; accepted: {', '.join(TRACKS)}, or a "
            "file of points (x and y, or GPX)"
        )
    unknown = [key for key in given if key != "interpolation"]
    if unknown:
        raise ValueError(f"a track in a file has no {unknown[0]!r}; accepted: interpolation")
    return read_survey(path, **given, **(treatments or {}))


def treatments_of(text: str | None, params: UGVParams) -> dict[str, float]:
    """The lengths [m] in --ground's "name=length,name", by the treatments' names."""
    found: dict[str, float] = {}
    defaults = {"merge": 0.0, "envelope": ROLLS * float(params.wheel_radius)}
    for word in (text or "").split(",") if text is not None else ():
        name, sign, value = map(str.strip, word.partition("="))
        require_choice("--ground", name, tuple(TREATMENTS))
        length = LENGTH.fullmatch(value)
        if not sign and name in defaults:
            found[name] = defaults[name]
        elif length and is_number(length[1]):
            times, by = UNITS["m"][length[2] or "m"]
            found[name] = float(length[1]) * times / by
        else:
            raise ValueError(f"--ground {word!r}; accepted: {name}=LENGTH, as 0.2, 0.2m or 20cm")
    return found


def ground_table(survey: Survey) -> Table:
    """One row: what the treatments did to the points."""
    whole = ("points", "reordered", "dropped", "merged", "filled", "knots")
    units = {name: "-" if name in whole else "m" for name in survey.changes}
    return one_row({Column(name, units[name]): of for name, of in survey.changes.items()})


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
