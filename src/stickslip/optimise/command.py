"""`stickslip optimise ugv`: build a posture problem, solve it, print and write what came out."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.plain_checks import MEMORY_LIMIT
from stickslip.dynamics.ugv import PoseSolver, Track
from stickslip.envs.rendering.extras import require
from stickslip.optim import CRITERIA, METHODS, PostureProblem, PostureResult, solve
from stickslip.optim.progress import say_stage
from stickslip.optim.solving import methods_of, options_of_method
from stickslip.optimise.ground import options_of, track_of
from stickslip.optimise.products import limit_of, require_folder, write_all
from stickslip.optimise.report import (
    energies,
    result_content,
    result_units,
    rows,
    stations_table,
    table,
    warnings,
)
from stickslip.records.content import Content
from stickslip.records.table import json_text

STATIONS, RESULT, PICTURE = "stations.csv", "result.json", "drive.png"
SPACING, MOST_WAYPOINTS, POLISHED = 0.1, 5000, 2000
"""Waypoints are SPACING [m] apart, or more where there would be more than MOST_WAYPOINTS; a path of
more than POLISHED is not polished, unless it is asked for."""
NEEDS = {"cma": "cma"}
"""Packages of an extra, by the method."""


def optimise_ugv_command(flags: Mapping[str, Any]) -> Content:
    """Solve a posture problem, print and write the drive; NOTHING_FOUND without one.

    Writes DIR/stations.csv, result.json and drive.png, each under a temporary name first; without
    a drive only result.json. Wrong input is refused before anything is computed or written.
    """
    out = _folder(flags)
    require_choice("criterion", flags["criterion"], tuple(CRITERIA))
    require_choice("method", flags["method"], tuple(METHODS))
    with _flags_named():
        problem = problem_of(flags)
    if flags["pictures"]:
        require("matplotlib.figure")
    if flags["method"] in NEEDS:
        import_module(NEEDS[flags["method"]])  # where it is missing, nothing is computed in vain
    options = {name: flags[name] for name in ("angles", "seed") if flags[name] is not None}
    taken = options_of_method(methods_of(problem)[flags["method"]])
    for name in options:
        if name not in taken:
            raise ValueError(f"--{name} with --method {flags['method']}; accepted: without it")
    polish = flags["polish"]
    options["polish"] = len(problem.x) <= POLISHED if polish is None else polish
    with _flags_named():
        result = solve(problem, flags["method"], progress=True, **options)
    spent = energies(problem, result.x)
    print(table(rows(problem, result, spent)), end="")
    for warning in warnings(problem, result):
        print(f"warning: {warning}", file=sys.stderr)
    found = result_content(problem, result, spent, _asked(flags))
    files = {RESULT: json_text(found), **_drive(problem, result, flags)}
    write_all(out, files, (STATIONS, RESULT, PICTURE), flags["overwrite"])
    written = {"files": [str(out / name) for name in files]}
    status = OK if result.x is not None else NOTHING_FOUND
    return Content(facts=found | written, units=result_units(problem), status=status)


@contextmanager
def _flags_named() -> Iterator[None]:
    """Add to a refusal for want of memory which settings ask for less."""
    try:
        yield
    except ValueError as error:
        if MEMORY_LIMIT not in str(error):
            raise
        less = "a greater spacing, start and end nearer together, fewer angles, polish=false"
        raise ValueError(f"{error}; less takes {less}") from error


def spacing_of(track: Track, flags: Mapping[str, Any]) -> float:
    """Requested spacing, or the default for the track's length: see SPACING [m]."""
    if flags["spacing"] is not None:
        return flags["spacing"]
    ends = (flags["start"], track.start), (flags["end"], track.end)
    start, end = (float(np.asarray(of if given is None else given)) for given, of in ends)
    return max(SPACING, (end - start) / (MOST_WAYPOINTS - 1))


def problem_of(flags: Mapping[str, Any]) -> PostureProblem:
    """The problem that the flags describe."""
    track = track_of(flags["track"], flags["track_options"], flags["columns"])
    return PostureProblem.along(
        track,
        flags["criterion"],
        spacing=spacing_of(track, flags),
        start=flags["start"],
        end=flags["end"],
        leg_rate=limit_of("leg_rate", flags["leg_rate"], "rad/m"),
        friction=flags["friction"],
        max_torque=limit_of("--max-torque", flags["max_torque"], "N m"),
        start_angles=flags["start_angles"],
        end_angles=flags["end_angles"],
        solver=PoseSolver(overlap=flags["overlap"]),
    )


def _folder(flags: Mapping[str, Any]) -> Path:
    """Directory of the files; ValueError if it exists and may not be replaced."""
    default = f"ugv-{Path(flags['track']).stem}-{flags['criterion']}-{flags['method']}"
    out = Path("runs", default) if flags["out"] is None else Path(flags["out"])
    return require_folder(out, flags["overwrite"])


def _asked(flags: Mapping[str, Any]) -> dict[str, object]:
    return {
        "track": flags["track"],
        "track_options": options_of(flags["track_options"]),
        "columns": flags["columns"],
        "method": flags["method"],
        **{name: flags[name] for name in ("spacing", "start", "end", "angles", "polish", "seed")},
    }


def _drive(
    problem: PostureProblem, result: PostureResult, flags: Mapping[str, Any]
) -> dict[str, bytes | str]:
    """The files of a drive, their contents by name; none without one."""
    if result.x is None:
        return {}
    files: dict[str, bytes | str] = {STATIONS: stations_table(problem.stations(result.x)).csv()}
    if flags["pictures"]:
        say_stage("drawing")
        from stickslip.optimise.picture import draw_result
        from stickslip.paper.drawing import png

        name = problem.criterion.name.replace("_", " ")
        unit = "" if problem.criterion.unit == "-" else f" {problem.criterion.unit}"
        off_grid = result.details.get("grid_value", result.value) != result.value
        how = f"{result.method} and scp" if off_grid else result.method
        title = f"{name} {result.value:.5g}{unit} over {Path(flags['track']).name}, by {how}"
        files[PICTURE] = png(draw_result(problem, result), title)
    return files
