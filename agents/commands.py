"""What the commands of `stickslip` do, once their flags are read."""

from __future__ import annotations

import shlex
import signal
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.agents.config import TrainConfig, flags_given, from_flags
from stickslip.agents.controllers import CONTROLLERS, controller_by_name
from stickslip.agents.machines import config_kind, machine_of
from stickslip.agents.policy import load_policy, read_metadata
from stickslip.agents.policy_file import choices_of, policy_path
from stickslip.agents.train_task import from_anywhere, make_scene
from stickslip.agents.ugv_names import UGV_BASELINES, is_ugv
from stickslip.agents.view_files import require_new, show_window, view_files
from stickslip.envs.biped import BipedEnv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from stickslip.agents.protocol import Controller
    from stickslip.envs.biped_params import BipedEnvParams

SCENE = "slippery"
"""The floor where none is named."""
SIGHTS = ("see_friction", "see_patch")
TRAINING_TIME = 225.0
"""Seconds after its start at which the demo stops training, whatever the machine."""


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
    from stickslip.agents.train import train

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
        demo(given["out"], fresh=given["fresh"], stop=stop, time_for_training=TRAINING_TIME)
        return not stop()


def evaluate_command(given: Mapping[str, Any]) -> None:
    """`stickslip evaluate`: print the table, and write it if asked."""
    if given["episodes"] < 1:
        raise ValueError(f"episodes = {given['episodes']}; accepted: an integer >= 1")
    targets = []
    if given["out"] is not None:
        targets = [Path(given["out"]) / f"evaluation.{kind}" for kind in ("csv", "json")]
        require_new(targets, given["overwrite"])

    def progress(line: str) -> None:
        print(f"running {line} ...", file=sys.stderr)

    if is_ugv(given["who"]):
        from stickslip.agents.ugv_commands import evaluation

        table = evaluation(given, progress)
    else:
        from stickslip.agents.evaluate import evaluate

        env, controllers = read_controllers(given["who"])
        scenes = {name: read_params(env, given, name) for name in given["scenes"] or [SCENE]}
        table = evaluate(env, controllers, scenes, episodes=given["episodes"], progress=progress)
    print(table.to_text())
    if targets:
        table.write_csv(targets[0])
        table.write_json(targets[1])
        print("Written: " + ", ".join(map(str, targets)))


def view_command(given: Mapping[str, Any]) -> None:
    """`stickslip view`: write an animation (and a plot), or show a window."""
    from stickslip.agents.plots import plot_episode
    from stickslip.agents.rollout import rollout
    from stickslip.agents.train_products import FPS, write_film

    if is_ugv([given["who"]]):
        from stickslip.agents.ugv_commands import view

        return view(given)
    seconds, (scene,) = given["seconds"], given["scenes"] or [SCENE]
    files = view_files(given, scene)
    env, controllers = read_controllers([given["who"]])
    params = read_params(env, given, scene).replace(time_limit=seconds)
    played = rollout(env, controllers[given["who"]], params, given["seed"])
    for path in files.plots:
        print(f"Written: {plot_episode(played, params, path, files.title)}")
    if given["window"]:
        show_window(env, played, params, files.title, FPS)
    else:
        print(f"Written: {write_film(env, played, params, files.film, seconds)}")


def read_controllers(who: Sequence[str]) -> tuple[BipedEnv, dict[str, Controller]]:
    """Policies and baselines by name, and an environment that shows them what they were trained on.

    who: names of baselines, policy files, or directories of runs.
    """
    controllers: dict[str, Controller] = {}
    sights: dict[str, dict[str, bool]] = {}
    for name in who:
        if name in CONTROLLERS:
            controllers[name] = controller_by_name(name)
            continue
        path = policy_path(name)
        if not path.exists():
            raise ValueError(
                f"{name!r} is neither a baseline nor a file; accepted: "
                f"{', '.join(CONTROLLERS)}, a policy file, or the directory of a run with one"
            )
        controllers[name] = load_policy(path)
        about = read_metadata(path)
        if about.get("environment", "BipedEnv") != "BipedEnv":
            raise ValueError(
                f"{name!r} is a policy of {about['environment']}; accepted: policies of one machine"
            )
        choices = choices_of(about)
        sights[name] = {sight: choices.get(sight) is True for sight in SIGHTS}
    first = next(iter(sights.values()), {})
    if other := [name for name, seen in sights.items() if seen != first]:
        raise ValueError(
            f"{other[0]!r} was trained on other observations than {next(iter(sights))!r}; "
            "accepted: policies with the same ones, or one at a time"
        )
    friction, patch = (first.get(sight, False) for sight in SIGHTS)
    return BipedEnv(see_friction=friction, see_patch=patch), controllers


def read_params(env: BipedEnv, given: Mapping[str, Any], scene: str) -> BipedEnvParams:
    """The task that the flags describe."""
    for name in ("friction", "criterion"):
        if given[name] is not None:
            raise ValueError(f"--{name} is for the UGV; accepted: a policy or baseline of the UGV")
    names = ("mu_static", "mu_kinetic", "payload", "commanded_rate")
    known = {name: given[name] for name in names if given[name] is not None}
    config = TrainConfig.of(scene=scene, **known)
    params = env.make_params(scene=make_scene(config), commanded_rate=config.commanded_rate)
    start = given["start"] or ("moving" if "episodes" in given else "rest")
    return from_anywhere(params) if start == "moving" else params


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
