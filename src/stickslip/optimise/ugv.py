"""`stickslip optimise ugv`: build a posture problem, solve it, print and write what came out."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.ugv import PoseSolver, Track
from stickslip.envs.rendering.extras import require
from stickslip.optim import CRITERIA, METHODS, PostureProblem, PostureResult, solve
from stickslip.optim.problem import methods_of, options_of_method
from stickslip.optim.progress import say_stage
from stickslip.optimise.flags import PostureOptions
from stickslip.optimise.report import (
    STATIONS,
    energies,
    result_content,
    result_units,
    rows,
    stations_table,
    table,
    warnings,
)
from stickslip.optimise.shared import require_folder, track_of, track_options_of, write_all
from stickslip.parser import options_of
from stickslip.records.table import Content, json_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from jaxtyping import Float

RESULT, PICTURE = "result.json", "drive.png"
ASKED = (
    *("track", "track_options", "columns", "method"),
    *("spacing", "start", "end", "angles", "polish", "seed"),
)
"""Options that result.json repeats; the others stand in its problem."""
SPACING, MOST_WAYPOINTS, POLISHED = 0.1, 5000, 2000
"""Waypoints are SPACING [m] apart, or more where there would be more than MOST_WAYPOINTS; a path of
more than POLISHED is not polished, unless it is asked for."""


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Solve a posture problem, print and write the drive; NOTHING_FOUND without one.

    Writes DIR/stations.csv, result.json and drive.png, each under a temporary name first; without
    a drive only result.json. Wrong input is refused before anything is computed or written.
    """
    given = options_of(PostureOptions, flags)
    default = f"runs/ugv-{Path(given.track).stem}-{given.criterion}-{given.method}"
    out = require_folder(given.out or default, given.overwrite)
    require_choice("criterion", given.criterion, tuple(CRITERIA))
    require_choice("method", given.method, tuple(METHODS))
    problem = problem_of(given)
    if given.pictures:
        require("matplotlib.figure")
    if given.method == "cma":
        import cma  # noqa: F401  (where it is missing, nothing is computed in vain)
    options = _method_options(given, problem)
    result = solve(problem, given.method, progress=True, **options)
    spent = energies(problem, result.x)
    print(table(rows(problem, result, spent)), end="")
    for warning in [] if result.x is None else warnings(problem, result):
        print(f"warning: {warning}", file=sys.stderr)
    asked = asdict(given) | {"track_options": track_options_of(given.track_options)}
    found = result_content(problem, result, spent, {name: asked[name] for name in ASKED})
    files: dict[str, bytes | str] = {RESULT: json_text(found)}
    if result.x is not None:
        files[STATIONS] = stations_table(problem.stations(result.x)).csv()
        if given.pictures:
            files[PICTURE] = _picture(problem, result, result.x, Path(given.track).name)
    write_all(out, files, (STATIONS, RESULT, PICTURE), given.overwrite)
    written = {"files": [str(out / name) for name in files]}
    status = OK if result.x is not None else NOTHING_FOUND
    return Content(facts=found | written, units=result_units(problem), status=status)


def _method_options(given: PostureOptions, problem: PostureProblem) -> dict[str, Any]:
    """Options of the method. ValueError for one that it does not take."""
    asked = {"angles": given.angles, "seed": given.seed}
    options: dict[str, Any] = {name: one for name, one in asked.items() if one is not None}
    taken = options_of_method(methods_of(problem)[given.method])
    for name in options:
        if name not in taken:
            raise ValueError(f"--{name} with --method {given.method}; accepted: without it")
    polish = given.polish
    return options | {"polish": len(problem.x) <= POLISHED if polish is None else polish}


def spacing_of(track: Track, given: PostureOptions) -> float:
    """Requested spacing, or the default for the track's length: see SPACING [m]."""
    if given.spacing is not None:
        return given.spacing
    start = float(track.start) if given.start is None else given.start
    end = float(track.end) if given.end is None else given.end
    return max(SPACING, (end - start) / (MOST_WAYPOINTS - 1))


def problem_of(given: PostureOptions) -> PostureProblem:
    """The problem that the flags describe."""
    track = track_of(given.track, given.track_options, given.columns)
    return PostureProblem.along(
        track,
        given.criterion,
        spacing=spacing_of(track, given),
        start=given.start,
        end=given.end,
        leg_rate=given.leg_rate,
        friction=given.friction,
        max_torque=given.max_torque,
        start_angles=given.start_angles,
        end_angles=given.end_angles,
        solver=PoseSolver(overlap=given.overlap),
    )


def _picture(
    problem: PostureProblem, result: PostureResult, x: Float[np.ndarray, "n"], track: str
) -> bytes:
    from stickslip.envs.rendering.sheet import png
    from stickslip.optimise.picture import draw_drive

    say_stage("drawing")
    unit = "" if problem.criterion.unit == "-" else f" {problem.criterion.unit}"
    name = problem.criterion.name.replace("_", " ")
    title = f"{name} {result.value:.5g}{unit} over {track}, by {result.method}"
    return png(draw_drive(problem, x), title)
