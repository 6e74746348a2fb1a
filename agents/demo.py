"""`stickslip demo`: train a walker for a floor too slippery for constant speed, and compare.

The directory of the demo is `runs/demo`. A demo that was finished there is shown again without
training; one that was cut off goes on; after a change of the configuration, or with `fresh`, a new
directory `runs/demo-2`, `-3`, ... is begun.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.agents.config import TrainConfig
from stickslip.agents.controllers import CONTROLLERS
from stickslip.agents.evaluate import Evaluation, evaluate
from stickslip.agents.film import plot_comparison
from stickslip.agents.policy import load_policy
from stickslip.agents.rollout import rollout
from stickslip.agents.train import Trained, train
from stickslip.agents.train_products import write_products
from stickslip.agents.train_run import read_config
from stickslip.agents.train_task import make_task

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.train_task import Task

POLICY = "trained policy"


def demo_config() -> TrainConfig:
    """mu_s = 0.06, mu_k = 0.05, 3 rad/s: the defaults."""
    return TrainConfig.of(mu_static=0.06, mu_kinetic=0.05, commanded_rate=3.0)


def demo(
    parent: str | Path = "runs",
    *,
    fresh: bool = False,
    config: TrainConfig | None = None,
    stop: Callable[[], bool] = lambda: False,
    time_for_training: float = np.inf,
    say: Callable[[str], None] = print,
) -> Path:
    """Train (unless that is done), print the table, write plots and the animation; return where.

    time_for_training [s]: training stops there, and the best policy so far is shown; the next demo
    goes on with it. stop: as for `train`.
    """
    begun = time.monotonic()
    config = demo_config() if config is None else config
    directory, known = find_directory(Path(parent), config, fresh)
    say(_introduction(config, directory, known))
    trained = train(
        None if known else config,
        directory,
        resume=known,
        stop=lambda: stop() or time.monotonic() - begun > time_for_training,
    )
    if stop() or not trained.policy.exists():
        say(f"Stopped after {trained.timesteps:,} steps; the next demo goes on from there.")
        return directory
    if not trained.finished:
        say(f"Time is up after {trained.timesteps:,} steps; the next demo goes on from there.")
    table = show(trained, say)
    table.write_csv(directory / "table.csv")
    table.write_json(directory / "table.json", {"config": config.digest})
    say(f"\nThe whole demo took {time.monotonic() - begun:.0f} s. Written to {directory}:")
    for name, about in FILES.items():
        say(f"  {name:<15} {about}")
    return directory


FILES = {
    "learning.png": "what was learnt when",
    "comparison.png": "the policy beside the baselines, from rest",
    "episode.png": "the policy's torque, speed and friction, from rest",
    "walk.gif": "the policy walking",
    "policy.npz": "the policy, for stickslip evaluate and stickslip view",
    "table.csv": "the table above (table.json: every episode)",
}


def show(trained: Trained, say: Callable[[str], None]) -> Evaluation:
    """Compare the policy with the baselines: print the table, write plots and the animation."""
    task = make_task(trained.config)
    controllers: dict[str, Any] = {name: kind() for name, kind in CONTROLLERS.items()}
    controllers[POLICY] = load_policy(trained.policy)
    say("\nComparing with the baselines ...")
    count = trained.config.evaluation_episodes  # the policy's program is then compiled already
    moving = evaluate(task.env, controllers, {"moving start": task.moving}, episodes=count)
    say(f"\n{moving.to_text()}")
    say(
        f"\n{count} episodes of 10 s from any phase and crank rate up to the commanded one. The "
        "baselines\nread the true state and masses, the policy its observation. From rest:"
    )
    played = {name: rollout(task.env, one, task.rest, 0) for name, one in controllers.items()}
    for name, one in played.items():
        say(_line(name, one, task))
    say("\nDrawing ...")
    plot_comparison(
        played, task.rest, trained.directory / "comparison.png", "From rest on a slippery floor"
    )
    write_products(trained, played[POLICY])
    return moving


def find_directory(parent: Path, config: TrainConfig, fresh: bool) -> tuple[Path, bool]:
    """Where the demo runs, and whether a run of this configuration is there already."""
    index = 1
    while True:
        path = parent / ("demo" if index == 1 else f"demo-{index}")
        if not path.exists() or (path.is_dir() and not any(path.iterdir())):
            return path, False
        if not fresh and _is_run_of(path, config):
            return path, True
        index += 1


def _is_run_of(path: Path, config: TrainConfig) -> bool:
    try:
        return read_config(path) == config
    except ValueError:
        return False


def _introduction(config: TrainConfig, directory: Path, known: bool) -> str:
    floor = f"static friction {config.mu_static}, kinetic {config.mu_kinetic}"
    what = "Going on in" if known else f"Training a walker with {config.algorithm.upper()} in"
    return (
        f"{what} {directory}: {floor}, commanded {config.commanded_rate} rad/s on average\n"
        "(at a constant 3 rad/s the foot holds from a friction of 0.08 up)."
    )


def _line(name: str, played: Any, task: Task) -> str:
    """An episode from rest in a line."""
    last = jax.tree.map(lambda leaf: float(leaf[-1]), played.state.totals)
    seconds = int(played.length) * float(task.rest.control_period)
    return (
        f"  {name:<16} return {last.reward:6.2f}  {last.walked / seconds:6.3f} m/s  "
        f"walked {last.walked:6.3f} m, slid {last.slid:6.4f} m, took {last.energy:5.1f} J "
        f"in {seconds:.1f} s"
    )
