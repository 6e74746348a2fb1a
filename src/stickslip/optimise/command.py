"""`stickslip optimise ugv`: build a posture problem, solve it, print and write what came out."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from stickslip.dynamics.checks import require_choice
from stickslip.envs.rendering.extras import require
from stickslip.optim import CRITERIA, METHODS, PostureProblem, PostureResult, solve
from stickslip.optimise.ground import options_of, track_of
from stickslip.optimise.report import energies, result_json, rows, stations_csv, table, warnings
from stickslip.records.files import write_whole

STATIONS, RESULT, PICTURE = "stations.csv", "result.json", "drive.png"
NO_LIMIT = "none"
NEEDS = {"cma": "cma"}
"""Packages of an extra, by the method."""


def optimise_command(given: Mapping[str, Any]) -> bool:
    """The command with its flags read; whether a drive was found.

    Writes DIR/stations.csv, result.json and drive.png, each under a temporary name first; without
    a drive only result.json. Wrong input is refused before anything is computed or written.
    """
    out = _folder(given)
    require_choice("criterion", given["criterion"], tuple(CRITERIA))
    require_choice("method", given["method"], tuple(METHODS))
    problem = problem_of(given)
    if given["pictures"]:
        require("matplotlib.figure")
    if given["method"] in NEEDS:
        import_module(NEEDS[given["method"]])  # where it is missing, nothing is computed in vain
    options = {name: given[name] for name in ("angles", "seed") if given[name] is not None}
    options["polish"] = given["polish"]
    result = solve(problem, given["method"], progress=sys.stderr.isatty(), **options)
    spent = energies(problem, result)
    print(table(rows(problem, result, spent)), end="")
    for warning in warnings(problem, result):
        print(f"warning: {warning}", file=sys.stderr)
    files = _files(problem, result, spent, given)
    if given["overwrite"]:  # nothing of an earlier result stays beside this one
        for name in {STATIONS, RESULT, PICTURE} - set(files):
            (out / name).unlink(missing_ok=True)
    for name, content in files.items():
        write_whole(out / name, content, overwrite=given["overwrite"])
    print(f"{', '.join(files)}: {out}", file=sys.stderr)
    return result.x is not None


def problem_of(given: Mapping[str, Any]) -> PostureProblem:
    """The problem that the flags describe."""
    track = track_of(given["track"], given["track_options"])
    return PostureProblem.along(
        track,
        given["criterion"],
        spacing=given["spacing"],
        start=given["start"],
        end=given["end"],
        leg_rate=_rate(given["leg_rate"]),
        friction=given["friction"],
        start_angles=given["start_angles"],
        end_angles=given["end_angles"],
    )


def _rate(text: str) -> float | None:
    """A leg rate [rad/m], or None for no limit."""
    if text == NO_LIMIT:
        return None
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"--leg-rate {text!r}; accepted: a number > 0 [rad/m], or {NO_LIMIT}"
        ) from None


def _folder(given: Mapping[str, Any]) -> Path:
    """Where the files go; ValueError if something is there and may not be replaced."""
    default = f"ugv-{Path(given['track']).stem}-{given['criterion']}-{given['method']}"
    out = Path("runs", default) if given["out"] is None else Path(given["out"])
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; accepted: a directory, or a new path, for --out")
    if not given["overwrite"] and out.is_dir() and any(out.iterdir()):
        raise ValueError(f"{out} exists; accepted: another --out, or --overwrite to replace")
    return out


def _files(
    problem: PostureProblem,
    result: PostureResult,
    spent: Mapping[str, float],
    given: Mapping[str, Any],
) -> dict[str, bytes | str]:
    """The files' contents by name."""
    asked = {
        "track": given["track"],
        "track_options": options_of(given["track_options"]),
        "method": given["method"],
        **{name: given[name] for name in ("spacing", "start", "end", "angles", "polish", "seed")},
    }
    files: dict[str, bytes | str] = {RESULT: result_json(problem, result, spent, asked)}
    if result.x is None:
        return files
    files[STATIONS] = stations_csv(problem, result)
    if given["pictures"]:
        from stickslip.optimise.picture import draw_result
        from stickslip.paper.drawing import png

        unit = "" if problem.criterion.unit == "-" else f" {problem.criterion.unit}"
        off_grid = result.details.get("grid_value", result.value) != result.value
        how = f"{result.method} and scp" if off_grid else result.method
        title = (
            f"{problem.criterion.name} {result.value:.5g}{unit} over {Path(given['track']).name}, "
            f"by {how}"
        )
        files[PICTURE] = png(draw_result(problem, result), title)
    return files
