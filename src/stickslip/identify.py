"""`stickslip identify`: friction, load and the encoder's errors from the log of a walk."""

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.agents.pictures.episodes import Line, Panel, draw_panels, panel
from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.estimation import NAMES
from stickslip.dynamics.biped.settings import precision
from stickslip.envs.rendering.sheet import save_sheet
from stickslip.optim.identification import Identified, WalkLog, identify
from stickslip.records.table import Column, Content, Table
from stickslip.report import picture_path, write_files

UNITS = {"payload": "kg", "torque_loss": "N m", "encoder_bias": "rad", "encoder_delay": "s"}


def identify_command(flags: Mapping[str, Any]) -> Content:
    """Print the intervals and draw the fit; NOTHING_FOUND where the model does not fit."""
    given = Namespace(**flags)
    path = Path(given.log)
    picture = picture_path(given.out, path, given.overwrite)
    log = WalkLog.from_file(path)
    with precision("float64"):
        robot, _ = BipedParams.with_motor(given.robot, given.changes)
    found = identify(robot, log, given.unknown, noise=given.noise, progress=True)
    known = found.parameters if found.explained else dict.fromkeys(found.parameters, [np.nan] * 3)
    columns = [Column(name, words=True) for name in ("parameter", "unit")]
    rows = [
        [name, UNITS.get(name, "-"), *(one if np.isfinite(one) else None for one in interval)]
        for name, interval in known.items()
    ]
    table = Table([*columns, *map(Column, ("value", "low", "high"))], rows)
    print(table.rounded(5).terminal())
    print("low, high: intervals of 95 %")  # and what the table does not say
    if not found.slipped:
        print("The log shows no slip: static friction is at least `low`, no more is known.")
    if not found.explained:
        print("The model does not explain the log: its angles are off by more than noise.")
        print("The noise that a short log shows may be at fault: --noise (noise=) gives it.")
    files = write_files({picture: lambda path: draw(found, log, path)})
    names = ("slipped", "explained", "noise", "disturbance")
    facts = {name: getattr(found, name) for name in names} | {"files": files}
    status = OK if found.explained else NOTHING_FOUND
    return Content({"parameters": table}, facts, {"noise": "rad", "disturbance": "N m"}, status)


def draw(found: Identified, log: WalkLog, path: Path) -> Path:
    """Plot the filter's walk and what it knew of each unknown at each time."""
    numbers = dict(zip(NAMES, found.means.T, strict=True))
    two = 2e3 * found.deviations
    measured = Line("measured less predicted", 1e3 * found.innovations)
    ends = {"+": two, "-": -two}
    bounds = (Line(f"{sign}2 deviations", one, dashed=True) for sign, one in ends.items())
    panels = [
        Panel("crank angle", "mrad", (measured, *bounds)),
        panel("crank rate", "rad/s", numbers["crank_rate"]),
        panel("foot velocity", "mm/s", 1e3 * numbers["foot_velocity"]),
    ]
    for name in found.parameters:
        if name in numbers:
            title = f"{name} so far".replace("_", " ")
            panels.append(panel(title, UNITS.get(name, "-"), numbers[name]))
    slips = numbers["foot_velocity"] != 0
    title = "Walk as the filter sees it; slips are shaded"
    return save_sheet(draw_panels(panels, log.times[1:], "time [s]", title, slips), path)
