"""What the commands of `stickslip` do for the UGV, once their flags are read."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stickslip.agents.policy_file import choices_of
from stickslip.agents.rollout import episode_key, rollout
from stickslip.agents.ugv_config import UGVTrainConfig
from stickslip.agents.ugv_evaluate import evaluate_ugv, first_state
from stickslip.agents.ugv_names import read_ugv_policies, ugv_baseline
from stickslip.agents.ugv_task import make_ugv_task
from stickslip.agents.view_files import show_window, view_files

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from stickslip.agents.evaluate import Evaluation
    from stickslip.envs.ugv import UGVEnv
    from stickslip.envs.ugv_params import UGVEnvParams

TRACKS = "random-bump"
"""The ground where none is named."""
NUMBERS = ("leg_rate", "spacing", "preview_length", "preview_noise")
"""Of the task, taken from the policy's file."""
OF_THE_BIPED = ("mu_static", "mu_kinetic", "payload", "commanded_rate", "start")


def evaluation(given: Mapping[str, Any], progress: Callable[[str], None]) -> Evaluation:
    """The table of `stickslip evaluate`."""
    policies, about = read_ugv_policies(given["who"])
    tasks = {name: read_task(given, about, name) for name in given["scenes"] or [TRACKS]}
    env = next(iter(tasks.values()))[0]
    controllers = {
        name: policies[name] if name in policies else ugv_baseline(name, env)
        for name in given["who"]
    }
    tracks = {name: params for name, (_, params) in tasks.items()}
    return evaluate_ugv(env, controllers, tracks, episodes=given["episodes"], progress=progress)


def view(given: Mapping[str, Any]) -> None:
    """`stickslip view`: write an animation (and a plot), or show a window."""
    from stickslip.agents.ugv_products import FPS, plot_drive, write_drive

    seconds, (track,) = given["seconds"], given["scenes"] or ["bump"]
    files = view_files(given, track)
    policies, about = read_ugv_policies([given["who"]])
    env, params = read_task(given, about, track)
    controller = policies.get(given["who"]) or ugv_baseline(given["who"], env)
    if hasattr(controller, "path"):
        controller = controller.path(env, params, first_state(env, params, given["seed"]))
    played = rollout(env, controller, params, episode_key(given["seed"]))
    for path in files.plots:
        print(f"Written: {plot_drive(played, env, params, path, files.title)}")
    if given["window"]:
        rate = min(FPS, 1 / float(params.control_period))
        show_window(env, played, params, files.title, rate)
    else:
        print(f"Written: {write_drive(env, played, params, files.film, seconds)}")


def read_task(
    given: Mapping[str, Any], about: Mapping[str, Any], track: str
) -> tuple[UGVEnv, UGVEnvParams]:
    """The task that the flags and a policy's file describe (about: {} without a policy)."""
    for name in OF_THE_BIPED:
        if given[name] is not None:
            flag = "--" + name.replace("_", "-")
            raise ValueError(f"{flag} is for the biped; accepted: --friction, --criterion, --scene")
    choices = choices_of(about)
    asked: dict[str, Any] = {name: about[name] for name in NUMBERS if name in about}
    if "spacing" in asked:
        asked["spacing"] *= 1 + 1e-6  # evenly spaced already: rounding must not add a step
    asked |= {name: choices[name] for name in ("criterion", "preview") if name in choices}
    asked |= {name: given[name] for name in ("criterion", "friction") if given[name] is not None}
    task = make_ugv_task(UGVTrainConfig.of(tracks=track, **asked))
    return replace(task.env, autoreset="disabled"), task.test
