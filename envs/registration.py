"""The Gymnasium ids and their keyword arguments.

Registering needs the ids only: the environments are imported when the first one is made.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, TypeAlias

from stickslip import envs
from stickslip.envs.tasks.definition import TASKS, task_by_name
from stickslip.envs.tasks.known import threshold

if TYPE_CHECKING:
    from collections.abc import Collection

    from gymnasium.vector import AutoresetMode

    from stickslip.envs.adapters.gym import GymEnv
    from stickslip.envs.adapters.vector import GymVectorEnv
    from stickslip.envs.tasks.definition import Made, TaskDefinition

    Kind: TypeAlias = type[envs.BipedEnv] | type[envs.UGVEnv]

Options: TypeAlias = dict[str, Any]
"""Arguments of the environment and of its `make_params`, by name."""

LIMIT = "an integer >= 1, None or -1 (the parameters' own time limit)"
"""Accepted values of max_episode_steps."""
BIPED_ID = "stickslip/Biped-v0"
UGV_ID = "stickslip/UGV-v0"


def make_biped(render_mode: str | None = None, **options: Any) -> GymEnv:
    """The single biped. Options: static choices of BipedEnv (setting, see_patch, ...)
    and entries of BipedEnv.make_params (scene, robot, randomisation, mean_rate, ...)."""
    return _single(envs.BipedEnv, options, render_mode)


def make_biped_vec(
    num_envs: int = 1,
    *,
    autoreset_mode: str | AutoresetMode = "next_step",
    render_mode: str | None = None,
    max_episode_steps: int | None = None,
    **options: Any,
) -> GymVectorEnv:
    """n bipeds in one compiled call; options as for the single one."""
    how = num_envs, autoreset_mode, render_mode
    return _vector(_resetting(envs.BipedEnv, options), how, max_episode_steps)


def make_ugv(render_mode: str | None = None, **options: Any) -> GymEnv:
    """The single UGV. Options: static choices of UGVEnv (criterion, preview, ...) and entries of
    UGVEnv.make_params (track, friction, randomisation, leg_rate, ...)."""
    return _single(envs.UGVEnv, options, render_mode)


def make_ugv_vec(
    num_envs: int = 1,
    *,
    autoreset_mode: str | AutoresetMode = "next_step",
    render_mode: str | None = None,
    max_episode_steps: int | None = None,
    **options: Any,
) -> GymVectorEnv:
    """n UGVs in one compiled call; options as for the single one."""
    how = num_envs, autoreset_mode, render_mode
    return _vector(_resetting(envs.UGVEnv, options), how, max_episode_steps)


def make_task(task: str, render_mode: str | None = None, **options: object) -> GymEnv:
    """A task of the ladder (see stickslip.envs.tasks): nothing of it can be changed."""
    return envs.GymEnv(*_fixed(task, options).make(), render_mode)


def make_task_vec(
    task: str,
    num_envs: int = 1,
    *,
    autoreset_mode: str | AutoresetMode = "next_step",
    render_mode: str | None = None,
    max_episode_steps: int | None = None,
    **options: object,
) -> GymVectorEnv:
    """n environments of a task in one compiled call."""
    how = num_envs, autoreset_mode, render_mode
    return _vector(_fixed(task, options).make(), how, max_episode_steps)


def _fixed(task: str, options: Collection[str]) -> TaskDefinition:
    """The task of a name; ValueError for options, which would make another one of it."""
    require_unforked()
    found = task_by_name(task)
    if options:
        general = BIPED_ID if found.machine == "biped" else UGV_ID
        raise ValueError(
            f"{', '.join(options)} with {found.id}, which is fixed; accepted: render_mode (and for "
            f"vectors num_envs, autoreset_mode), or {general} with options"
        )
    return found


def _single(kind: Kind, options: Options, render_mode: str | None) -> GymEnv:
    """One environment, without autoreset unless asked for."""
    return envs.GymEnv(*split_options(kind, {"autoreset": "disabled"} | options), render_mode)


def _resetting(kind: Kind, options: Options) -> Made:
    """An environment that resets as autoreset_mode alone says, and its parameters."""
    if "autoreset" in options:
        raise ValueError(f"autoreset = {options['autoreset']!r}; accepted: autoreset_mode instead")
    return split_options(kind, options)


def _vector(
    made: Made, how: tuple[int, str | AutoresetMode, str | None], max_episode_steps: int | None
) -> GymVectorEnv:
    """Several environments. max_episode_steps: as `gymnasium.make` takes it, -1 or None for the
    parameters' own time limit; a longer one changes nothing."""
    from stickslip.dynamics.checks import require_integer
    from stickslip.envs.params import horizon

    env, params = made
    if max_episode_steps not in (None, -1):
        steps = require_integer("max_episode_steps", max_episode_steps, accepted=LIMIT)
        params = params.shortened(steps) if steps < horizon(params) else params
    return envs.GymVectorEnv(env, params, *how)


def split_options(kind: Kind, options: Options) -> Made:
    """A functional environment of a kind (BipedEnv, UGVEnv) and its parameters from one set of
    options; ValueError for unknown ones."""
    from dataclasses import fields

    from stickslip.dynamics.plain_checks import require_known

    require_unforked()
    static = tuple(field.name for field in fields(kind))
    require_known(options, static + kind.parameter_names(), f"option of {kind.__name__}")
    env = kind(**{name: value for name, value in options.items() if name in static})
    return env, env.make_params(**{k: v for k, v in options.items() if k not in static})


def register() -> None:
    """Tell Gymnasium of the environments; done by `import stickslip`, safe to repeat.

    The two general ids are registered without max_episode_steps, since TimeLimit would cut what
    longer parameters ask for; `spec` of what is made says it.
    """
    import gymnasium

    for name, maker in ((BIPED_ID, "make_biped"), (UGV_ID, "make_ugv")):
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"stickslip.envs.registration:{maker}",
                vector_entry_point=f"stickslip.envs.registration:{maker}_vec",
            )
    for task in TASKS.values():
        if task.id not in gymnasium.registry:
            gymnasium.register(
                task.id,
                entry_point="stickslip.envs.registration:make_task",
                vector_entry_point="stickslip.envs.registration:make_task_vec",
                reward_threshold=threshold(task),
                max_episode_steps=task.max_episode_steps,
                kwargs={"task": task.name},
            )


_process: int | None = None
"""The process that the first environment by name was made in; a fork inherits it."""


def require_unforked() -> None:
    """RuntimeError where an environment was made before this process was forked.

    What Gymnasium's AsyncVectorEnv does on Linux: it makes one environment, then forks the others.
    """
    global _process
    if _process is None:
        _process = os.getpid()
    if _process != os.getpid():
        raise RuntimeError(
            "an environment in a process forked after another one was made, where JAX waits for "
            "ever; accepted: processes that are spawned (AsyncVectorEnv(..., context='spawn'), "
            "make_vec(..., vectorization_mode='async', vector_kwargs={'context': 'spawn'})), or "
            "make_vec without a vectorization_mode: all of them in one compiled call"
        )
