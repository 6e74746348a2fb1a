"""`stickslip demo`: train a machine on a task of its own, and compare.

The directory is `runs/demo`, or what the machine's demo says. A demo that was finished there is
shown again without training; one that was cut off goes on.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, Generic

from stickslip.agents.evaluation.evaluate import evaluate
from stickslip.agents.evaluation.rollout import planned, rollout
from stickslip.agents.machine import machine_by_name, machines
from stickslip.agents.pictures.plots import plot_comparison
from stickslip.agents.pictures.training import TRAINED, write_products
from stickslip.agents.policy.file import load_policy
from stickslip.agents.training.configuration import Config
from stickslip.agents.training.directory import CONFIG, read_config
from stickslip.agents.training.run import train
from stickslip.dynamics.checks import shown
from stickslip.records.files import write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.machine import AnyMachine, TrainingTask
    from stickslip.agents.protocol import Options, Timed
    from stickslip.agents.training.configuration import Trained

TABLE = "table.txt"
"""The file of a finished demo that is written last: it says that the rest is there."""


@dataclass(frozen=True)
class Demonstration(Generic[Config]):
    """One machine's demo: what is trained, and how the policy is compared and shown."""

    config: Config
    about: str
    """Text of the task."""
    tabled: Sequence[str]
    """Baselines in the table, beside the policy."""
    compared: Sequence[str]
    """Baselines in the one episode that is shown."""
    shown_of: Callable[[TrainingTask[Any, Any]], Timed]
    """Parameters of that episode."""
    note: Callable[[Config], str]
    """Text between the table and the episode's lines."""
    lines: Callable[[Mapping[str, AnyRollout], Any, Any], Sequence[str]]
    """A line for each player of the episode."""
    panels: Callable[[Any], Mapping[str, str]]
    """Panels of comparison.png, with their scales."""
    title: str
    """Title of comparison.png."""
    scene: str
    """Name of the table's scene."""
    directory: str = "demo"
    """Name of the run's directory."""

    def files(self, machine: AnyMachine) -> dict[str, str]:
        """Products in the run's directory with their descriptions."""
        return {
            "learning.png": "what was learnt when",
            "comparison.png": f"the policy beside the others: {self.title}",
            "episode.png": "the same of the policy alone, in more panels",
            machine.film: "the policy's animation",
            "policy.npz": "the policy, for stickslip evaluate and stickslip view",
            "table.csv": "the table above (table.json: every episode)",
        }

    def show(self, trained: Trained[Config], say: Callable[[str], None]) -> str:
        """Compare the policy with the baselines, say so, write `files` and return what was said."""
        config, directory = trained.config, trained.directory
        machine, policy = machine_by_name(config.machine), {TRAINED: load_policy(trained.policy)}
        task = machine.training_task(config)
        env, params = task.env, self.shown_of(task)
        players = {one: machine.baseline(one, env) for one in (*self.tabled, *self.compared)}
        tabled = {one: players[one] for one in self.tabled} | policy
        count = config.evaluation_episodes  # the policy's program is then compiled already
        table = evaluate(env, tabled, {self.scene: task.tested}, episodes=count)
        say("Playing the episode that is shown ...")
        compared = {one: players[one] for one in self.compared} | policy
        played = {
            name: rollout(env, planned(env, one, params, 0), params, 0)
            for name, one in compared.items()
        }
        lines = self.lines(played, env, params)
        text = "\n".join([f"{table.to_text().rstrip()}\n", self.note(config), *lines]) + "\n"
        say("\n" + text)
        say("Drawing ...")
        episodes = [machine.as_episode(of, env, params, name) for name, of in played.items()]
        plot_comparison(episodes, self.panels(env), directory / "comparison.png", self.title)
        write_products(trained, played[TRAINED], params)
        about = {"config": config.digest, "timesteps": trained.timesteps}
        table.write_csv(directory / "table.csv")
        table.write_json(directory / "table.json", about)
        return text


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
        say((directory / TABLE).read_text(encoding="utf-8"))
        return _list_files(directory, files, say)
    what = f"Training the {whose.title} with {asked.algorithm.upper()}" if begins else "Going on"
    say(f"{what} in {directory}: {demonstration.about}")
    trained = train(asked, directory, resume=not begins, stop=stop)
    if not trained.finished:
        so_far = f"{trained.timesteps:,} of {asked.timesteps:,} steps"
        say(f"Stopped after {so_far}; the next demo goes on from there.")
        return directory
    say("\nComparing with the baselines ...")
    text = demonstration.show(trained, say)
    write_whole(directory / TABLE, text)  # last: it says that the rest is there
    say(f"\nThe whole demo took {monotonic() - begun:.0f} s.")
    return _list_files(directory, files, say)


def _list_files(directory: Path, files: Mapping[str, str], say: Callable[[str], None]) -> Path:
    say(f"Written to {directory}:")
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
