"""`stickslip demo`: train a machine on a task of its own, and compare.

The directory is `runs/demo`, or what the machine's demo says. A demo that was finished there is
shown again without training; one that was cut off goes on.
"""

from __future__ import annotations

import json
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.agents.evaluation.evaluate import evaluate
from stickslip.agents.machine import machine_by_name, machines
from stickslip.agents.pictures.training import TRAINED, write_products
from stickslip.agents.policy.file import load_policy
from stickslip.agents.training.directory import CONFIG, read_config
from stickslip.agents.training.run import train
from stickslip.dynamics.checks import shown
from stickslip.records.files import write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.protocol import Options
    from stickslip.agents.training.configuration import Trained

TABLE = "table.txt"
"""The file of a finished demo that is written last: it says that the rest is there."""


class Demonstration(NamedTuple):
    """One machine's demo. about: text of the task. baselines: in the table, beside the policy.
    scene: name of the table's scene. directory: name of the run's directory."""

    config: Any
    about: str
    baselines: Sequence[str]
    scene: str
    directory: str = "demo"

    def files(self, machine: AnyMachine) -> dict[str, str]:
        """Products in the run's directory with their descriptions."""
        return {
            "learning.png": "what was learnt when",
            "episode.png": "an episode of the policy",
            machine.film: "the policy's animation",
            "policy.npz": "the policy, for stickslip evaluate and stickslip view",
            "table.csv": "the table above (table.json: every episode)",
        }

    def show(self, trained: Trained[Any]) -> str:
        """Compare the policy with the baselines, write `files` and return the table."""
        config, directory = trained.config, trained.directory
        machine = machine_by_name(config.machine)
        task = machine.training_task(config)
        players = {one: machine.baseline(one, task.env) for one in self.baselines}
        players[TRAINED] = load_policy(trained.policy)
        count = config.evaluation_episodes  # the policy's program is then compiled already
        table = evaluate(task.env, players, {self.scene: task.tested}, episodes=count)
        write_products(trained)
        about = {"config": config.digest, "timesteps": trained.timesteps}
        table.write_csv(directory / "table.csv")
        table.write_json(directory / "table.json", about)
        return table.to_text()


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
    begun, whose = monotonic(), machine_by_name(machine or machines()[0].name)
    demonstration = whose.demonstration()
    if demonstration is None:
        known = ", ".join(one.name for one in machines() if one.demonstration())
        raise ValueError(f"machine = {shown(whose.name)} has no demo; accepted: {known}")
    asked = demonstration.config
    directory, files = Path(parent) / demonstration.directory, demonstration.files(whose)
    begins = not (directory / CONFIG).exists()
    whole = all((directory / one).exists() for one in (TABLE, *files))
    if not begins and whole and read_config(directory) == asked:
        say(f"{directory} holds this demo already.\n")
        text = (directory / TABLE).read_text(encoding="utf-8")
    else:
        what = f"Training the {whose.title} with {asked.algorithm.upper()}"
        say(f"{what if begins else 'Going on'} in {directory}: {demonstration.about}")
        trained = train(asked, directory, resume=not begins, stop=stop)
        if not trained.finished:
            so_far = f"{trained.timesteps:,} of {asked.timesteps:,} steps"
            say(f"Stopped after {so_far}; the next demo goes on from there.")
            return directory
        say("\nComparing with the baselines and drawing ...")
        text = demonstration.show(trained)
        write_whole(directory / TABLE, text)  # last: it says that the rest is there
        say(f"The whole demo took {monotonic() - begun:.0f} s.\n")
    say(f"{text}\nWritten to {directory}:")
    for name, about in files.items():
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
