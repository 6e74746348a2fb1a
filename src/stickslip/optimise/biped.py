"""`stickslip optimise biped`: find the best gait, replay it, print and write what came out."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.checks import shown
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.extras import require
from stickslip.optim import GaitProblem, GaitResult, Replay, replay, solve
from stickslip.optim.problem import require_scalar
from stickslip.optim.progress import say_stage
from stickslip.optimise.flags import GaitOptions
from stickslip.optimise.gait_report import GAIT_UNITS, gait_content, gait_csv, gait_rows
from stickslip.optimise.report import table
from stickslip.optimise.shared import require_folder, write_all
from stickslip.parser import options_of
from stickslip.records.table import Content, json_text

if TYPE_CHECKING:
    from collections.abc import Mapping

NODES, RESULT, PICTURE = "gait.csv", "result.json", "gait.png"
WALKED = 3
"""Steps that a periodic gait is replayed for."""
FILES = ("out", "overwrite", "pictures")
NOT_WALKED = (
    "no replay walks this gait, on the edge of what the model covers; the settings min_normal, "
    "zmp and reserve keep away from it"
)
VALUES = ("value", "lower_bound", "every_bound", "held_value")


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Find a gait, replay it, print and write it; NOTHING_FOUND without one.

    Writes DIR/gait.csv, result.json and gait.png, each under a temporary name first; without a gait
    only result.json. Wrong input is refused before anything is computed or written.
    """
    given = options_of(GaitOptions, flags)
    problem = gait_problem_of(given)
    default = f"runs/biped-{given.objective.replace('=', '').replace(',', '-')}"
    out = require_folder(given.out or default, given.overwrite)
    require_scalar("feedback", given.feedback, low=0.0, accepted="a finite number >= 0 [1/rad]")
    if given.pictures:
        require("matplotlib.figure")
    result = solve(problem, progress=True)
    replays = _replays(problem, result, given)
    print(table(gait_rows(problem, result, replays)), end="")
    if replays and all(one.status > Status.SLIP_ONSET for one in replays.values()):
        print(f"warning: {NOT_WALKED}", file=sys.stderr)
    asked = {name: value for name, value in asdict(given).items() if name not in FILES}
    found = gait_content(problem, result, replays, asked)
    files: dict[str, bytes | str] = {RESULT: json_text(found)}
    if result.gait is not None:
        files[NODES] = gait_csv(problem, result)
        if given.pictures:
            files[PICTURE] = _picture(problem, result)
    write_all(out, files, (NODES, RESULT, PICTURE), given.overwrite)
    written = {"files": [str(out / name) for name in files]}
    units = {"result": GAIT_UNITS | dict.fromkeys(VALUES, problem.goal.unit)}
    status = OK if result.gait is not None else NOTHING_FOUND
    return Content(facts=found | written, units=units, status=status)


def _picture(problem: GaitProblem, result: GaitResult) -> bytes:
    from stickslip.envs.rendering.sheet import png
    from stickslip.optimise.picture import draw_gait

    say_stage("drawing")
    unit = "" if problem.goal.unit in ("-", "weighted") else f" {problem.goal.unit}"
    title = f"least {problem.goal.words}: {result.value:.5g}{unit}"
    return png(draw_gait(problem, result), title)


def gait_problem_of(given: GaitOptions) -> GaitProblem:
    """The problem that the flags describe."""
    share = "a share from 0 to below 1"
    require_scalar("reserve", given.reserve, low=0.0, high=0.999, accepted=share)
    robot = BipedParams.from_bars(payload=given.payload, gravity=given.gravity)
    mu: list[float] | float | None = None
    if given.mu is not None:
        left = [one * (1 - given.reserve) for one in given.mu]
        mu = left[0] if len(left) == 1 else left
    objective = _objective(given.objective)
    limits = {
        "mu": mu,
        "torque_limit": given.torque_limit,
        "mean_rate": given.mean_rate,
        "min_normal": given.min_normal,
        "zmp": given.zmp,
        "copper_loss": given.copper_loss,
        "steps": given.cells,
    }
    if given.steps is not None:
        start = 0.0 if given.start is None else given.start
        ends = {"start_rate": start, "end_rate": given.end}
        return GaitProblem.transfer(robot, given.steps, objective, **ends, **limits)
    for name, value in (("start", given.start), ("end", given.end)):
        if value is not None:
            raise ValueError(f"{name} without --steps; accepted: with a walk of --steps N")
    if isinstance(mu, list):
        raise ValueError(f"mu has shape ({len(mu)},); accepted: one number without --steps")
    return GaitProblem.periodic(robot, objective, **limits)


def _objective(text: str) -> str | dict[str, float]:
    """A name, or names and weights: time=1,energy=0.2."""
    if "=" not in text:
        return text
    try:
        pairs = (part.split("=") for part in text.split(","))
        return {name.strip(): float(weight) for name, weight in pairs}
    except ValueError:
        accepted = "a name, or name=weight with commas between"
        raise ValueError(f"--objective {shown(text)}; accepted: {accepted}") from None


def _replays(problem: GaitProblem, result: GaitResult, given: GaitOptions) -> dict[str, Replay]:
    """The gait walked open loop and with feedback, on a floor of the friction asked for; of several
    frictions the foot is held, and the replay says how much it used."""
    if result.gait is None or not result.best.duration < float("inf"):
        return {}
    mu = given.mu[0] if given.mu is not None and len(set(given.mu)) == 1 else None
    steps = WALKED if problem.is_periodic else None
    kinds = {"open loop": 0.0, f"feedback {given.feedback:g}/rad": float(given.feedback)}
    return {
        name: replay(
            problem.params, result.best, mu=mu, feedback=gain, walk_steps=steps, zmp=problem.zmp
        )
        for name, gain in kinds.items()
    }
