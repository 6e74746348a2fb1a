"""Vehicle and ground of a drive as flags give them."""

from __future__ import annotations

import json
import math
from argparse import Namespace
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.machine_file import quantity
from stickslip.dynamics.ugv import TRACKS, Track, UGVParams
from stickslip.optim.columns import is_number
from stickslip.optim.posture import TREATMENTS
from stickslip.optim.posture.track_file import Survey, read_survey
from stickslip.records.table import Column, Table
from stickslip.report import one_row

ROLLS = 1.1
"""Radius of the default envelope in wheel radii: at 1 a wheel would touch whole arcs at once."""


def vehicle_on_track(given: Namespace) -> tuple[UGVParams, Survey, dict[str, Any]]:
    """Vehicle, ground and limits of a drive: those that PostureProblem takes by name.

    The motors' torque limit is --max-torque, else that of the vehicle's file.
    """
    vehicle, motor = UGVParams.with_motor(given.vehicle, given.changes)
    treatments = treatments_of(given.ground, vehicle)
    survey = survey_of(given.track, given.track_options, treatments)
    torque = motor.get("max_torque", math.inf) if given.max_torque is None else given.max_torque
    limits = {"leg_rate": finite(given.leg_rate), "max_torque": finite(torque)}
    return vehicle, survey, {**limits, "friction": given.friction}


def finite(limit: float) -> float | None:
    """A limit, None where it is infinite."""
    return None if limit == math.inf else limit


def survey_of(
    name: str, options: Iterable[str] = (), treatments: dict[str, Any] | None = None
) -> Survey:
    """The named track, or the one in the file of that name with its points. options: "name=value"
    each, of Track.named, or `interpolation` of a file. treatments: of the file's points."""
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
    for word in [] if text is None else text.split(","):
        name, sign, value = map(str.strip, word.partition("="))
        require_choice("--ground", name, tuple(TREATMENTS))
        if not sign and name in defaults:
            found[name] = defaults[name]
        else:
            length = float(value) if is_number(value) else value
            found[name] = quantity(f"--ground {name}", length, "m")
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
