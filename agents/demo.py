"""`stickslip demo`: train a walker for a floor too slippery for constant speed, and compare.

The directory of the demo is `runs/demo`. A demo that was finished there is shown again without
training; one that was cut off goes on; after a change of the configuration, or with `fresh`, a new
directory `runs/demo-2`, `-3`, ... is begun.
"""

from __future__ import annotations

import math
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import jax

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.biped.controllers import CONTROLLERS
from stickslip.agents.biped.evaluate import evaluate
from stickslip.agents.biped.products import write_products
from stickslip.agents.biped.training import make_task
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.pictures.film import plot_comparison
from stickslip.agents.policy import load_policy
from stickslip.agents.training.checkpoint import list_checkpoints
from stickslip.agents.training.directory import read_config
from stickslip.agents.training.run import Trained, train
from stickslip.dynamics.checks import require_number
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.biped.training import Task

PRODUCTS = 6.0
"""About how long table and pictures take, in durations of the first evaluation."""


def demo_config() -> TrainConfig:
    """mu_s = 0.06, mu_k = 0.05, 3 rad/s: the defaults."""
    return TrainConfig.of(mu_static=0.06, mu_kinetic=0.05, commanded_rate=3.0)


def demo(
    parent: str | Path = "runs",
    *,
    fresh: bool = False,
    config: TrainConfig | None = None,
    stop: Callable[[], bool] = lambda: False,
    time_limit: float | None = None,
    say: Callable[[str], None] = print,
) -> Path:
    """Train (unless that is done), print the table, write plots and the animation; return where.

    time_limit [s]: of training, None for none; the best policy so far is then shown, in a table and
    pictures that say how far it is, and the next demo goes on with it. stop: as for `train`.
    """
    begun, limit = monotonic(), math.inf if time_limit is None else time_limit
    if time_limit is not None:
        require_number("time_limit", limit, low=0.0, strict=True, accepted="None, or seconds > 0")
    config = demo_config() if config is None else config
    directory, known = find_directory(Path(parent), config, fresh)
    if known and _is_shown(directory, config):
        say(f"{directory} holds this demo already (--fresh for a new one).\n")
        say((directory / TABLE).read_text(encoding="utf-8"))
        return _list_files(directory, say)
    (directory / TABLE).unlink(missing_ok=True)  # of a policy that is trained further now
    say(_introduction(config, directory, known))
    trained = train(
        None if known else config,
        directory,
        resume=known,
        stop=lambda: stop() or monotonic() - begun > limit,
        after=PRODUCTS,
    )
    so_far = f"{trained.timesteps:,} of {config.timesteps:,} steps ({trained.percent} %)"
    if stop() or not trained.policy.exists():
        say(f"Stopped after {so_far}; the next demo goes on from there.")
        return directory
    if not trained.finished:
        say(f"Time is up after {so_far}; the next demo goes on from there.")
    show(trained, say)
    say(f"\nThe whole demo took {monotonic() - begun:.0f} s.")
    return _list_files(directory, say)


TABLE = "table.txt"
FILES = {
    "learning.png": "what was learnt when",
    "comparison.png": "the policy beside the baselines, from rest",
    "episode.png": "the policy's torque, speed and friction, from rest",
    "walk.gif": "the policy walking",
    "policy.npz": "the policy, for stickslip evaluate and stickslip view",
    "table.csv": "the table above (table.json: every episode)",
}
"""What is shown at the end, all of it in the run's directory."""


def show(trained: Trained, say: Callable[[str], None]) -> None:
    """Compare the policy with the baselines: print the table, write it, plots and the animation."""
    task = make_task(trained.config)
    controllers: dict[str, Any] = {name: kind() for name, kind in CONTROLLERS.items()}
    controllers[trained.name] = load_policy(trained.policy)
    say("\nComparing with the baselines ...")
    count = trained.config.evaluation_episodes  # the policy's program is then compiled already
    moving = evaluate(task.env, controllers, {"moving start": task.moving}, episodes=count)
    played = {name: rollout(task.env, one, task.rest, 0) for name, one in controllers.items()}
    width = max(map(len, played))
    lines = [
        f"{moving.to_text().rstrip()}\n",
        f"{count} episodes of 10 s from any phase and crank rate up to the commanded one. The "
        "baselines\nread the true state and masses, the policy its observation. From rest:",
        *(_line(f"{name:<{width}}", one, task) for name, one in played.items()),
    ]
    if not trained.finished:
        lines += ["", _unfinished(trained)]
    text = "\n".join(lines) + "\n"
    say("\n" + text)
    say("Drawing ...")
    directory = trained.directory
    title = "From rest on a slippery floor"
    title += "" if trained.finished else f"; {trained.name}"
    plot_comparison(played, task.rest, directory / "comparison.png", title)
    write_products(trained, played[trained.name])
    moving.write_csv(directory / "table.csv")
    about = {"timesteps": trained.timesteps, "of": trained.config.timesteps}
    about |= {"finished": trained.finished}
    moving.write_json(
        directory / "table.json", {"config": trained.config.digest, "training": about}
    )
    write_whole(directory / TABLE, text)  # last: it says that the rest is there


def _is_shown(directory: Path, config: TrainConfig) -> bool:
    """Whether a finished demo's products are all there."""
    checkpoints = list_checkpoints(directory / "checkpoints")
    whole = all((directory / name).exists() for name in (TABLE, *FILES))
    return whole and bool(checkpoints) and int(checkpoints[-1].name) >= config.timesteps


def _list_files(directory: Path, say: Callable[[str], None]) -> Path:
    say(f"Written to {directory}:")
    for name, about in FILES.items():
        say(f"  {name:<15} {about}")
    return directory


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


def _unfinished(trained: Trained) -> str:
    done, of = trained.timesteps, trained.config.timesteps
    return f"The training is NOT finished: {done:,} of {of:,} steps ({trained.percent} %)."


def _line(name: str, played: Any, task: Task) -> str:
    """An episode from rest in a line."""
    last = jax.tree.map(lambda leaf: float(leaf[-1]), played.state.totals)
    seconds = int(played.length) * float(task.rest.control_period)
    return (
        f"  {name} return {last.reward:6.2f}  {last.walked / seconds:6.3f} m/s  "
        f"walked {last.walked:6.3f} m, slid {last.slid:6.4f} m, took {last.energy:5.1f} J "
        f"in {seconds:.1f} s"
    )
