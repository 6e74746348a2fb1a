"""Those named on the command line on a task of the ladder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.scored import in_words
from stickslip.agents.policy.file import policy_path
from stickslip.agents.policy.mlp import MLPPolicy
from stickslip.agents.registry import machine_by_name, machines
from stickslip.agents.tasks.places import controller_of, every_option, read_named
from stickslip.envs.tasks.known import known_of
from stickslip.envs.tasks.ladder import task_by_name

if TYPE_CHECKING:
    from stickslip.agents.machine import AnyMachine, Options
    from stickslip.agents.protocol import AnyPlayer


def named_on(options: Options) -> dict[str, AnyPlayer]:
    """Who plays the task options["task"], by the names of options["who"].

    ValueError for an unknown task, for options that would change it, for the baselines and policies
    of another machine, and for a policy that observes something else.
    """
    task = task_by_name(options["task"])
    machine = machine_by_name(task.machine)
    given = [f"--{name}" for name in ("scene",) if options["scenes"]]
    given += [one.flag for name, (one, _) in every_option().items() if options[name] is not None]
    if given:
        raise ValueError(
            f"{', '.join(given)} with --task {task.name}, which is fixed; accepted: one or the "
            "other"
        )
    _require_own(options["who"], machine, task.name)
    named = read_named(options["who"], machine)  # before anything is compiled
    env, params = task.make()
    seen = len(env.observation_bounds(params)[0])
    found: dict[str, AnyPlayer] = {}
    for name, one in named.items():
        if isinstance(one.policy, MLPPolicy):
            _require_size(name, one.policy, seen, task.name)
        found[name] = controller_of(one, name, without_resets(env), params, machine)
    return found


def task_in_words(name: str) -> str:
    """What the task is, and what its scores are."""
    task = task_by_name(name)
    known = known_of(task)
    scores = "nothing is known of it" if known is None else in_words(known, task.unit)
    return f"{task.name}: {task.title}\n  {scores}"


def earned_in_words(name: str, earned: float) -> str:
    """A mean return on the task, and its score."""
    task = task_by_name(name)
    known, unit = known_of(task), "" if task.unit == "-" else f" {task.unit}"
    score = "" if known is None else f"score {known.scale.score(earned):.3f}, "
    return f"{score}mean return {earned:.4g}{unit}"


def _require_own(who: list[str], machine: AnyMachine, task: str) -> None:
    """ValueError for a baseline of another machine; policies are looked at when they are read."""
    for name in who:
        others = [one for one in machines() if name in one.baselines and one is not machine]
        if others:
            raise ValueError(
                f"{name!r} is a baseline of the {others[0].title}, {task} is the {machine.title}'s;"
                f" accepted: {', '.join(machine.baselines)}, or a policy file"
            )


def _require_size(name: str, policy: MLPPolicy, seen: int, task: str) -> None:
    if policy.layer_sizes[0] != seen:
        raise ValueError(
            f"{policy_path(name)} observes {policy.layer_sizes[0]} numbers, {task} has {seen}; "
            "accepted: a policy trained on what the task observes"
        )
