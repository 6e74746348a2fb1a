"""`stickslip optimise biped`: find the best gait, replay it, print and write what came out."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.checks import shown
from stickslip.envs.rendering.extras import require
from stickslip.optim import GaitProblem, GaitResult, Replay, replay, solve
from stickslip.optim.gait.goal import goal_of
from stickslip.optim.options import require_scalar
from stickslip.optimise.gait_report import gait_csv, gait_json, gait_rows
from stickslip.optimise.report import table
from stickslip.records.files import write_whole

NODES, RESULT, PICTURE = "gait.csv", "result.json", "gait.png"
NO_LIMIT = "none"
WALKED = 3
"""Steps that a periodic gait is replayed for."""


def optimise_gait_command(flags: Mapping[str, Any]) -> bool:
    """The command with its flags read; whether a gait was found.

    Writes DIR/gait.csv, result.json and gait.png, each under a temporary name first; without a gait
    only result.json. Wrong input is refused before anything is computed or written.
    """
    problem = gait_problem_of(flags)
    out = _folder(flags)
    require_scalar("feedback", flags["feedback"], low=0.0, accepted="a finite number >= 0 [1/rad]")
    if flags["pictures"]:
        require("matplotlib.figure")
    result = solve(problem, progress=sys.stderr.isatty())
    replays = _replays(problem, result, flags)
    print(table(gait_rows(problem, result, replays)), end="")
    files: dict[str, bytes | str] = {RESULT: gait_json(problem, result, replays, _asked(flags))}
    if result.gait is not None:
        files[NODES] = gait_csv(problem, result)
        if flags["pictures"]:
            from stickslip.optimise.gait_picture import draw_gait
            from stickslip.paper.drawing import png

            unit = "" if problem.goal.unit in ("-", "weighted") else f" {problem.goal.unit}"
            title = f"least {problem.goal.words}: {result.value:.5g}{unit}"
            files[PICTURE] = png(draw_gait(problem, result), title)
    if flags["overwrite"]:  # nothing of an earlier result stays beside this one
        for name in {NODES, RESULT, PICTURE} - set(files):
            (out / name).unlink(missing_ok=True)
    for name, content in files.items():
        write_whole(out / name, content, overwrite=flags["overwrite"])
    print(f"{', '.join(files)}: {out}", file=sys.stderr)
    return result.gait is not None


def gait_problem_of(flags: Mapping[str, Any]) -> GaitProblem:
    """The problem that the flags describe."""
    require_scalar("payload", flags["payload"], low=0.0, accepted="a finite mass >= 0 [kg]")
    require_scalar("gravity", flags["gravity"], low=0.0, strict=True, accepted="finite, > 0")
    rule = {"low": 0.0, "high": 0.999, "accepted": "a share from 0 to below 1"}
    require_scalar("reserve", flags["reserve"], **rule)
    robot = BipedParams.from_bars(payload=flags["payload"], gravity=flags["gravity"])
    mu = flags["mu"]
    if mu is not None:
        for one in mu:
            require_scalar("mu", one, low=0.0, accepted="a finite number >= 0")
        mu = [one * (1 - flags["reserve"]) for one in mu]
        mu = mu[0] if len(mu) == 1 else mu
    common: dict[str, Any] = {
        "objective": _objective(flags["objective"]),
        "mu": mu,
        "torque_limit": _torque(flags["torque_limit"]),
        "mean_rate": flags["speed"],
        "min_normal": flags["min_normal"],
        "zmp": flags["zmp"],
        "copper_loss": flags["copper_loss"],
        "steps": flags["cells"],
    }
    if flags["steps"] is None:
        for name in ("start", "end"):
            if flags[name] is not None:
                raise ValueError(f"--{name} without --steps; accepted: with a walk of --steps N")
        return GaitProblem.periodic(robot, **common)
    start = 0.0 if flags["start"] is None else flags["start"]
    walk = {"start_rate": start, "end_rate": flags["end"]}
    return GaitProblem.transfer(robot, flags["steps"], **walk, **common)


def _objective(text: str) -> str | dict[str, float]:
    """A name, or names and weights: time=1,energy=0.2."""
    if "=" not in text:
        goal_of(text, 0.5)
        return text
    found: dict[str, float] = {}
    for part in text.split(","):
        name, sign, number = part.partition("=")
        try:
            found[name.strip()] = float(number)
        except ValueError:
            sign = ""
        if not sign:
            raise ValueError(
                f"--objective {shown(text)}; accepted: a name, or name=weight with commas between"
            )
    return found


def _torque(text: str) -> float | None:
    """A torque [N m], or None for no limit."""
    if text == NO_LIMIT:
        return None
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"--torque-limit {shown(text)}; accepted: a number > 0 [N m], or {NO_LIMIT}"
        ) from None


def _replays(
    problem: GaitProblem, result: GaitResult, flags: Mapping[str, Any]
) -> dict[str, Replay]:
    """The gait walked open loop and with feedback, on a floor of the friction asked for; of several
    frictions the foot is held, and the replay says how much it used."""
    if result.gait is None or not result.best.duration < float("inf"):
        return {}
    given = flags["mu"]
    mu = given[0] if given is not None and len(set(given)) == 1 else None
    steps = WALKED if problem.is_periodic else None
    kinds = {"open loop": 0.0, f"feedback {flags['feedback']:g}/rad": float(flags["feedback"])}
    return {
        name: replay(
            problem.params, result.best, mu=mu, feedback=gain, walk_steps=steps, zmp=problem.zmp
        )
        for name, gain in kinds.items()
    }


def _asked(flags: Mapping[str, Any]) -> dict[str, Any]:
    names = ("objective", "mu", "speed", "torque_limit", "payload", "gravity", "min_normal", "zmp")
    names += ("copper_loss", "reserve", "steps", "start", "end", "cells", "feedback")
    return {name: flags[name] for name in names}


def _folder(flags: Mapping[str, Any]) -> Path:
    """Where the files go; ValueError if something is there and may not be replaced."""
    default = f"biped-{flags['objective'].replace('=', '').replace(',', '-')}"
    out = Path("runs", default) if flags["out"] is None else Path(flags["out"])
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; accepted: a directory, or a new path, for --out")
    if not flags["overwrite"] and out.is_dir() and any(out.iterdir()):
        raise ValueError(f"{out} exists; accepted: another --out, or --overwrite to replace")
    return out
