"""What `stickslip sweep` does once its flags are read."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from stickslip.agents.registry import machine_by_name
from stickslip.agents.reports.swept import report_sweep
from stickslip.agents.sweeps.design import design_of
from stickslip.agents.sweeps.named import played_by
from stickslip.agents.sweeps.names import FORMS
from stickslip.agents.sweeps.plan import Plan
from stickslip.agents.sweeps.playing.play import StoppedError
from stickslip.agents.sweeps.sweep import run_plan
from stickslip.agents.sweeps.telling.words import summary_table
from stickslip.agents.tasks.places import every_option
from stickslip.agents.view_files import require_folder
from stickslip.dynamics.checks import shown
from stickslip.optim.progress import say_stage
from stickslip.records.content import Content
from stickslip.records.signals import stoppable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.machine import Options
    from stickslip.agents.sweeps.sweep import Swept


def sweep_command(given: Options) -> Content:
    """`stickslip sweep`: its summary."""
    path, machine = Path(given["out"]), machine_by_name(given["machine"])
    require_folder(path)
    axes = _axes(given["axis"] or ())
    machine.swept().require_no_structure(axes)
    options = {name: given.get(name) for name in every_option()}
    options["scenes"] = None if given["scene"] is None else [given["scene"]]
    design = design_of(axes, given["samples"], given["design_seed"])
    played, about = played_by(machine, given["policy"], options, given["task"], design)
    plan = Plan.of(
        machine,
        played,
        design,
        episodes=given["episodes"],
        independent=given["independent"],
        summaries=given["summaries"],
    )
    print(about)
    print(size_in_words(plan, given["episodes"]), flush=True)
    begun = time.monotonic()
    with stoppable() as stop:
        try:
            done = run_plan(
                plan,
                path,
                **{name: given[name] for name in ("chunk", "cores", "workers", "scheduler")},
                resume=given["resume"],
                overwrite=given["overwrite"],
                progress=True,
                stop=stop,
            )
        except StoppedError:
            again = f"Stopped; go on with the same command and --resume ({path})"
            raise stop.interrupted(again) from None
    print(done_in_words(done, time.monotonic() - begun))
    told = report_sweep(
        plan,
        path,
        pictures=not given["no_pictures"],
        episodes=not given["no_episodes"],
        tell=lambda text: print("\n" + text),
        say=say_stage,
    )
    print("Written: " + ", ".join(map(str, told.files)))
    print(f'Read it: stickslip.agents.read_sweep("{path}")')
    about = {"directory": str(path), "words": told.text, "files": list(map(str, told.files))}
    return Content({"summary": summary_table(told.found, machine.swept().told)}, about)


def size_in_words(plan: Plan, asked: int) -> str:
    """Axes with units, and how many episodes of how many steps that makes. asked: episodes of a
    point."""
    words = []
    for name, one in plan.design.axes.items():
        unit = "" if plan.units[name] == "-" else f" {plan.units[name]}"
        low, high = one.ends
        count = (
            f"{one.kind}"
            if one.random
            else f"{len(one.values)} value{'s' if len(one.values) > 1 else ''}"
        )
        words.append(f"  {name}: {count}, {low:g} to {high:g}{unit}")
    tasks, policies = (len({one[i] for one in plan.definition["cases"]}) for i in (0, 1))
    steps = max(one.steps for one in plan.cases)
    words.append(
        f"{plan.total:,} episodes of up to {steps} steps: {policies} "
        f"{'policy' if policies == 1 else 'policies'} x {tasks} task{'s' if tasks > 1 else ''} x "
        f"{plan.design.points:,} point{'' if plan.design.points == 1 else 's'} x "
        f"{plan.episodes} episode{'' if plan.episodes == 1 else 's'}"
    )
    if plan.episodes != asked:
        words.append(f"1 episode a point, not {asked}: no reset draws anything")
    return "\n".join(words)


def done_in_words(done: Swept, seconds: float) -> str:
    """How many chunks were played and programs compiled, and how long it took."""
    kept = done.chunks - done.played
    words = f"Played {done.played} of {done.chunks} chunks in {seconds:.1f} s"
    words += f", {kept} were there already" if kept else ""
    if done.programs is not None:
        words += f"; {done.programs} program{'' if done.programs == 1 else 's'} compiled"
    return words


def _axes(given: Sequence[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for text in given:
        name, is_axis, values = text.partition("=")
        if not is_axis or not name:
            raise ValueError(f"--axis {shown(text)}; accepted: NAME=VALUES, with values as {FORMS}")
        if name in found:
            raise ValueError(f"--axis {name} is given twice; accepted: once")
        found[name] = values
    return found
