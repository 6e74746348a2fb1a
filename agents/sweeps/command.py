"""`stickslip sweep` after its flags are read."""

from __future__ import annotations

import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.evaluation.players import every_option
from stickslip.agents.machine import machine_by_name
from stickslip.agents.sweeps.cases import cases_named
from stickslip.agents.sweeps.cells import StoppedError
from stickslip.agents.sweeps.data import summary_table, sweep_arrays
from stickslip.agents.sweeps.pictures import write_pictures
from stickslip.agents.sweeps.plan import FORMS, Plan, axes_of
from stickslip.agents.sweeps.sweep import run_plan
from stickslip.dynamics.checks import shown
from stickslip.records.files import require_folder
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from stickslip.agents.protocol import Options


def sweep_command(given: Options) -> Content:
    """Play the sweep, print its summary and draw it."""
    path, plan = Path(given["out"]), _planned(given)
    begun = time.monotonic()
    with stoppable() as stop:
        try:
            done = run_plan(plan, path, resume=given["resume"], progress=True, stop=stop)
        except StoppedError:
            message = f"Stopped; go on with the same command and --resume ({path})"
            raise stop.interrupted(message) from None
    print(f"Played {done.played} of {done.cells} cells in {time.monotonic() - begun:.1f} s")
    slip, found = plan.machine.swept().slip, sweep_arrays(path)
    table, files = summary_table(found, slip), list[Path]()
    print("\n" + table.rounded(4).terminal())
    if not given["no_pictures"] and find_spec("matplotlib"):
        files = write_pictures(found, path, slip)
    print("Written: " + ", ".join(map(str, [path, *files])))
    facts = {"directory": str(path), "files": list(map(str, files))}
    return Content({"summary": table}, facts)


def _planned(given: Options) -> Plan:
    """Check the arguments and print the plan."""
    require_folder(given["out"])
    machine, axes = machine_by_name(given["machine"]), {}
    for text in given["axis"]:
        name, _, values = text.partition("=")
        if not name or not values or name in axes:
            raise ValueError(
                f"--axis {shown(text)}; accepted: NAME=VALUES, each name once, with values as "
                f"{FORMS}"
            )
        axes[name] = values
    options = {name: given.get(name) for name in every_option()}
    options["changes"] = given.get("changes")  # none of a machine without parts
    options["numbers"] = {}  # which an axis of one value sets
    options["scenes"] = None if given["scene"] is None else [given["scene"]]
    grid = axes_of(axes)
    cases, about = cases_named(machine, given["policy"], options, given["task"], grid)
    plan = Plan.of(machine, cases, grid, given["episodes"])
    print(about)
    for name, values in grid.items():
        unit = "" if plan.units[name] == "-" else f" {plan.units[name]}"
        sets = ", ".join(plan.cases[0].fields[name])
        span = f"{len(values)} values, {min(values):g} to {max(values):g}{unit}"
        print(f"  {name}: {span}, in place of the task's {sets}")
    print(
        f"{plan.total:,} episodes of up to {max(one.steps for one in plan.cases)} steps: "
        f"{len(plan.cases)} cases (policy on task) x {plan.points:,} points x {plan.episodes} "
        "episodes",
        flush=True,
    )
    if plan.episodes != given["episodes"]:
        print(f"1 episode a point, not {given['episodes']}: no reset draws anything", flush=True)
    return plan
