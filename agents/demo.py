"""`stickslip demo`: train a machine on a task of its own, and compare.

The directory is `runs/demo`, or what the machine's demo says. A demo that was finished there is
shown again without training; one that was cut off goes on.
"""

from __future__ import annotations

import json
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from stickslip.agents.registry import machine_by_name, machines
from stickslip.agents.training.configuration import Configuration
from stickslip.agents.training.directory import CONFIG, read_config
from stickslip.agents.training.run import train
from stickslip.dynamics.checks import shown
from stickslip.records.files import write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.machine import Demonstration
    from stickslip.agents.protocol import Options

TABLE = "table.txt"
"""The file of a finished demo that is written last: it says that the rest is there."""


def demo(
    parent: str | Path = "runs",
    *,
    machine: str | None = None,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = print,
) -> Path:
    """Train (unless that is done), print the table, write plots and the animation; return where.

    machine: its name, the first one by default. stop: as for `train`; the next demo goes on from
    there. ValueError for a machine without a demo, and where the directory holds another run.
    """
    begun, name = monotonic(), machine or machines()[0].name
    demonstration = machine_by_name(name).demonstration()
    if demonstration is None:
        known = ", ".join(one.name for one in machines() if one.demonstration())
        raise ValueError(f"machine = {shown(name)} has no demo; accepted: {known}")
    asked: Configuration = demonstration.config()
    directory = Path(parent) / demonstration.directory
    begins = not (directory / CONFIG).exists()
    if not begins and read_config(directory) == asked and _is_shown(directory, demonstration):
        say(f"{directory} holds this demo already.\n")
        say((directory / TABLE).read_text(encoding="utf-8"))
        return _list_files(directory, demonstration, say)
    title = machine_by_name(name).title
    what = f"Training the {title} with {asked.algorithm.upper()}" if begins else "Going on"
    say(f"{what} in {directory}: {demonstration.task_in_words(asked)}")
    trained = train(asked, directory, resume=not begins, stop=stop)
    if not trained.finished:
        so_far = f"{trained.timesteps:,} of {asked.timesteps:,} steps"
        say(f"Stopped after {so_far}; the next demo goes on from there.")
        return directory
    say("\nComparing with the baselines ...")
    text = demonstration.show(trained, say)
    write_whole(directory / TABLE, text)  # last: it says that the rest is there
    say(f"\nThe whole demo took {monotonic() - begun:.0f} s.")
    return _list_files(directory, demonstration, say)


def _is_shown(directory: Path, demonstration: Demonstration[Configuration]) -> bool:
    """Whether a finished demo's products are all there."""
    return all((directory / name).exists() for name in (TABLE, *demonstration.files))


def _list_files(directory: Path, demonstration: Demonstration, say: Callable[[str], None]) -> Path:
    say(f"Written to {directory}:")
    for name, about in demonstration.files.items():
        say(f"  {name:<15} {about}")
    return directory


def demo_command(given: Options) -> Content:
    """`stickslip demo`: its table and where it is."""
    with stoppable() as stop:
        directory = demo(given["out"], machine=given["machine"], stop=stop)
        if stop():
            raise stop.interrupted(f"Stopped; go on with the same command ({directory})")
    found = json.loads((directory / "table.json").read_text(encoding="utf-8"))
    units = {"rows": {"metrics": found.pop("units", {})}}
    return Content(facts={"directory": str(directory), **found}, units=units)
