"""What the commands of `stickslip` do, once their flags are read."""

from __future__ import annotations

import shlex
import signal
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.agents.biped import task as biped_task
from stickslip.agents.biped.config import flags_given, from_flags
from stickslip.agents.biped.controllers import CONTROLLERS
from stickslip.agents.biped.evaluate import MOST_EPISODES
from stickslip.agents.machines import config_kind, machine_of
from stickslip.agents.tasks.places import named_controller, places_of, read_named
from stickslip.agents.ugv.names import UGV_BASELINES, is_ugv
from stickslip.agents.view_files import (
    require_new,
    require_writable,
    show_window,
    view_files,
)
from stickslip.dynamics.checks import require_integer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from stickslip.agents.biped.evaluate import Evaluation
    from stickslip.agents.tasks.places import Named, Place

BIPED: Any = biped_task


def train_command(given: Mapping[str, Any]) -> bool:
    """`stickslip train`: whether training came to its end."""
    machine, out = given["machine"], given["out"]
    kind = config_kind(machine)
    changed = flags_given(given, kind)
    if given["resume"] and out is None:
        raise ValueError("--resume needs the run's directory; accepted: with --out DIR")
    if given["resume"] and changed:
        names = ", ".join("--" + name.replace("_", "-") for name in changed)
        raise ValueError(
            f"--resume goes on with the run's own configuration; accepted: without {names}"
        )
    from stickslip.agents.training.run import train

    config = None if given["resume"] else from_flags(given, kind)
    algorithm = config.algorithm if config else ""
    directory = Path(out or f"runs/{machine}-{algorithm}-{time.strftime('%Y%m%d-%H%M%S')}")
    with interruptible() as stop:
        trained = train(
            config, directory, resume=given["resume"], overwrite=given["overwrite"], stop=stop
        )
    if not trained.finished:
        again = f"stickslip train {machine} --out {shlex.quote(str(directory))} --resume"
        print(f"Stopped after {trained.timesteps:,} steps; go on with: {again}", file=sys.stderr)
        return False
    if not given["no_pictures"]:
        print("Drawing ...", file=sys.stderr)
        machine_of(trained.config).write_products(trained)
    print(
        f"Trained {trained.timesteps:,} steps in {trained.seconds:.0f} s; all of it in {directory}"
    )
    baselines = " ".join(UGV_BASELINES if machine == "ugv" else CONTROLLERS)
    print(f"Compare it: stickslip evaluate {directory} {baselines}")
    return True


def demo_command(given: Mapping[str, Any]) -> bool:
    """`stickslip demo`: whether it came to its end."""
    from stickslip.agents.demo import demo

    with interruptible() as stop:
        demo(given["out"], fresh=given["fresh"], stop=stop, time_limit=given["time_limit"])
        return not stop()


def evaluate_command(given: Mapping[str, Any]) -> None:
    """`stickslip evaluate`: print the tasks and the table, and write the table if asked."""
    require_integer("episodes", given["episodes"], high=MOST_EPISODES)
    targets = []
    if given["out"] is not None:
        targets = [Path(given["out"]) / f"evaluation.{kind}" for kind in ("csv", "json")]
        require_new(targets, given["overwrite"])

    def progress(line: str) -> None:
        print(f"running {line} ...", file=sys.stderr)

    kind = kind_of(given["who"])
    named = read_named(given["who"], kind)
    places = places_of(named, given, kind, "moving")
    require_writable(targets)
    for place in places:
        print(place.line())
    if kind is BIPED:
        table = evaluation(given, named, places, progress)
    else:
        from stickslip.agents.ugv import commands as ugv_commands

        table = ugv_commands.evaluation(given, named, places, progress)
    print("\n" + table.to_text())
    if targets:
        table.write_csv(targets[0])
        tasks = {place.label: place.line() for place in places}
        table.write_json(targets[1], {"tasks": tasks})
        print("Written: " + ", ".join(map(str, targets)))


def evaluation(
    given: Mapping[str, Any],
    named: Mapping[str, Named],
    places: Sequence[Place],
    progress: Callable[[str], None],
) -> Evaluation:
    """The biped's table of `stickslip evaluate`."""
    from stickslip.agents.biped.evaluate import evaluate, joined

    parts = []
    for place in places:
        for name, env in place.who.items():
            controllers = {name: named_controller(named[name], name, env, BIPED)}
            scenes, count = {place.label: place.params}, given["episodes"]
            parts.append(evaluate(env, controllers, scenes, episodes=count, progress=progress))
    return joined(parts)


def view_command(given: Mapping[str, Any]) -> None:
    """`stickslip view`: print the task, write an animation (and a plot), or show a window."""
    from stickslip.agents.biped.plots import plot_episode
    from stickslip.agents.biped.products import FPS, write_film
    from stickslip.agents.evaluation.rollout import rollout

    if given["window"] and given["out"] is not None:
        raise ValueError(f"--out {given['out']} with --window; accepted: one of them")
    require_integer("seed", given["seed"], low=0, high=2**32 - 1)
    kind, name, seconds = kind_of([given["who"]]), given["who"], given["seconds"]
    named = read_named([name], kind)
    if kind is not BIPED:
        from stickslip.agents.ugv import commands as ugv_commands

        return ugv_commands.view(given, named)
    (place,) = places_of(named, given, kind, "rest")
    files, env = view_files(given, place.label), place.who[name]
    require_writable(files.written)
    print(place.line())
    params = place.params.replace(time_limit=seconds)
    played = rollout(env, named_controller(named[name], name, env, kind), params, given["seed"])
    for path in files.plots:
        print(f"Written: {plot_episode(played, params, path, files.title)}")
    if given["window"]:
        show_window(env, played, params, files.title, FPS)
    else:
        print(f"Written: {write_film(env, played, params, files.film, seconds)}")


def kind_of(who: Sequence[str]) -> Any:
    """The tasks of the machine that the names are of: a module that is a places.Kind."""
    if not is_ugv(who):
        return BIPED
    from stickslip.agents.ugv import task as ugv_parts

    return ugv_parts


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Inside, the first Ctrl-C makes the function given return true; the second interrupts."""
    asked: list[int] = []

    def ask(number: int, frame: Any) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)
        print("\nStopping at the next step; again to stop at once.", file=sys.stderr)

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: bool(asked)
    finally:
        signal.signal(signal.SIGINT, before)
