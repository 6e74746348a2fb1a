"""Those named on the command line on a task of the ladder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.policy.file import named_task_of, policy_path
from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.registry import machine_by_name, machine_of_baseline, machines
from stickslip.agents.tasks.places import controller_of, every_option, read_named
from stickslip.agents.tasks.players import naming, read_about
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from stickslip.agents.machine import AnyMachine, Options
    from stickslip.agents.protocol import AnyPlayer
    from stickslip.envs.tasks.definition import TaskDefinition
    from stickslip.envs.tasks.known import Known


def named_on(options: Options) -> dict[str, AnyPlayer]:
    """Players of the task options["task"], by the names of options["who"].

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


def common_task(options: Options) -> str | None:
    """The task options["task"], or else the named one that all policies of options["who"] were
    trained on: None where there is none, or where an option changes it.

    ValueError for a file that is damaged, and where its task is another one here.
    """
    if options.get("task") is not None:
        return options["task"]
    if options["scenes"] or any(options[name] is not None for name in every_option()):
        return None
    found: list[TaskDefinition | None] = []
    who = options["who"]
    for name in [who] if isinstance(who, str) else who:
        if machine_of_baseline(name) is None and (path := policy_path(name)).is_file():
            with naming(path):
                found.append(named_task_of(read_about(path)))
    first = found[0] if found else None
    return None if first is None or any(one != first for one in found) else first.name


def measured_before(name: str) -> str:
    """Known scores of the task's own episodes, as a table."""
    task = task_by_name(name)
    known = known_of(task)
    if known is None:
        return "Nothing was measured on it before."
    unit = "" if task.unit == "-" else f" [{task.unit}]"
    columns = [Column("controller", words=True), Column("score"), Column(f"return{unit}")]
    everybody = (known.trivial, *known.baselines, *known.planners, known.best)
    rows = [
        [one.policy, known.score_of(one).shown(3), one.shown] for one in dict.fromkeys(everybody)
    ]
    return "Measured before on the same episodes:\n\n" + Table(columns, rows).terminal()


def title_of(name: str) -> str:
    """The task's name and what it asks."""
    task = task_by_name(name)
    return f"{task.name}: {task.title}"


def task_in_words(name: str) -> str:
    """Text of the task and its scores."""
    task = task_by_name(name)
    known = known_of(task)
    scores = "nothing is known of it" if known is None else _known_in_words(known, task.unit)
    return f"{title_of(name)}\n  {scores}"


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


def _known_in_words(known: Known, unit: str) -> str:
    """Text of what 0 and 1 are, and of the proved bounds, under assumptions and without."""
    unit = "" if unit == "-" else f" {unit}"
    words = (
        f"score 0: {known.trivial.policy}, {known.trivial.value:.4g}{unit}; 1: the best known, "
        f"{known.best.value:.4g}{unit} over {known.episodes} episode"
        f"{'s' if known.episodes > 1 else ''}, earned in replay by {known.how}, no proof that no "
        "more can be"
    )
    if known.assumed is not None:
        one = known.assumed
        words += f"; proved under assumptions: at most {one.value:.4g}{unit}, by {one.reason}"
    if known.bound is None:
        return words + "; no bound is known"
    return f"{words}; proved: at most {known.bound.value:.4g}{unit}, as {known.bound.reason}"
