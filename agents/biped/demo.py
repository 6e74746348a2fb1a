"""`stickslip demo`: train the biped on a slippery floor, and compare it with controllers.

A demo that was finished in the directory is shown again without training; one that was cut off goes
on.
"""

from __future__ import annotations

import json
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.biped.controllers import CONTROLLERS, baseline
from stickslip.agents.biped.machine import FILM, STOPPING
from stickslip.agents.biped.task import training_task
from stickslip.agents.evaluation.evaluate import evaluate
from stickslip.agents.pictures.training import TRAINED, write_products
from stickslip.agents.policy.file import load_policy
from stickslip.agents.training.directory import CONFIG, read_config
from stickslip.agents.training.run import train
from stickslip.records.files import write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.protocol import Options
    from stickslip.agents.training.configuration import Trained

ABOUT = """static friction 0.06, kinetic 0.05, commanded 3.0 rad/s on average
(at a constant 3 rad/s the foot holds from a friction of 0.08 up)."""
TABLE = "table.txt"
"""The file of a finished demo that is written last: it says that the rest is there."""
FILES = {
    "learning.png": "what was learnt when",
    "episode.png": "an episode of the policy",
    FILM: "the policy's animation",
    "policy.npz": "the policy, for stickslip evaluate and stickslip view",
    "table.csv": "the table above (table.json: every episode)",
}


def demo(
    parent: str | Path = "runs",
    *,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = print,
) -> Path:
    """Train (unless that is done), print the table, write plots and the animation; return where.

    stop: as for `train`; the next demo goes on from there. ValueError where the directory holds
    another run.
    """
    begun, directory = monotonic(), Path(parent) / "demo"
    asked = TrainConfig.of(mu_static=0.06, mu_kinetic=0.05, mean_rate=3.0)
    begins = not (directory / CONFIG).exists()
    whole = all((directory / one).exists() for one in (TABLE, *FILES))
    if not begins and whole and read_config(directory) == asked:
        say(f"{directory} holds this demo already.\n")
        text = (directory / TABLE).read_text(encoding="utf-8")
    else:
        what = f"Training the biped with {asked.algorithm.upper()}" if begins else "Going on"
        say(f"{what} in {directory}: {ABOUT}")
        trained = train(asked, directory, resume=not begins, stop=stop)
        if not trained.finished:
            so_far = f"{trained.timesteps:,} of {asked.timesteps:,} steps"
            say(f"Stopped after {so_far}; the next demo goes on from there.")
            return directory
        say("\nComparing with the baselines and drawing ...")
        text = _compared(trained)
        write_whole(directory / TABLE, text)  # last: it says that the rest is there
        say(f"The whole demo took {monotonic() - begun:.0f} s.\n")
    say(f"{text}\nWritten to {directory}:")
    for name, about in FILES.items():
        say(f"  {name:<15} {about}")
    return directory


def _compared(trained: Trained[TrainConfig]) -> str:
    """Compare the policy with the baselines, write FILES and return the table."""
    config, directory = trained.config, trained.directory
    task = training_task(config)
    players = {one: baseline(one, task.env) for one in CONTROLLERS if one != STOPPING}
    who = {**players, TRAINED: load_policy(trained.policy)}
    count = config.evaluation_episodes  # the policy's program is then compiled already
    table = evaluate(task.env, who, {"moving start": task.tested}, episodes=count)
    write_products(trained)
    about = {"config": config.digest, "timesteps": trained.timesteps}
    table.write_csv(directory / "table.csv")
    table.write_json(directory / "table.json", about)
    return table.to_text()


def demo_command(given: Options) -> Content:
    """`stickslip demo`: its table and where it is."""
    with stoppable() as stop:
        directory = demo(given["out"], stop=stop)
        if stop():
            raise stop.interrupted(f"Stopped; go on with the same command ({directory})")
    found = json.loads((directory / "table.json").read_text(encoding="utf-8"))
    units = {"rows": {"metrics": found.pop("units", {})}}
    return Content(facts={"directory": str(directory), **found}, units=units)
