"""The Gymnasium ids and their keyword arguments.

Registering needs the ids only: the environments are imported when the first one is made.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any, TypeAlias

from stickslip import envs
from stickslip.envs.tasks.definition import TASKS, task_by_name
from stickslip.envs.tasks.known import threshold

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

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


def make_ugv(render_mode: str | None = None, **options: Any) -> GymEnv:
    """The single UGV. Options: static choices of UGVEnv (criterion, preview, ...) and entries of
    UGVEnv.make_params (track, friction, randomisation, leg_rate, ...)."""
    return _single(envs.UGVEnv, options, render_mode)


def make_task(task: str, render_mode: str | None = None, **options: object) -> GymEnv:
    """A task of the ladder (see stickslip.envs.tasks): nothing of it can be changed."""
    return envs.GymEnv(*_fixed(task, options).make(), render_mode)


def make_biped_vec(num_envs: int = 1, **options: Any) -> GymVectorEnv:
    """n bipeds in one compiled call; options as for the single one, and `autoreset_mode`,
    `render_mode` and `max_episode_steps`."""
    return _vector(num_envs, options, lambda own: _resetting(envs.BipedEnv, own))


def make_ugv_vec(num_envs: int = 1, **options: Any) -> GymVectorEnv:
    """n UGVs in one compiled call; options as those of make_biped_vec."""
    return _vector(num_envs, options, lambda own: _resetting(envs.UGVEnv, own))


def make_task_vec(task: str, num_envs: int = 1, **options: Any) -> GymVectorEnv:
    """n environments of a task in one compiled call."""
    return _vector(num_envs, options, lambda own: _fixed(task, own).make())


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


def _vector(num_envs: int, options: Options, make: Callable[[Options], Made]) -> GymVectorEnv:
    """Several environments. max_episode_steps: as `gymnasium.make` takes it, -1 or None for the
    parameters' own time limit; a longer one changes nothing."""
    from stickslip.dynamics.checks import require_integer
    from stickslip.envs.params import horizon

    limit = options.pop("max_episode_steps", None)
    how = options.pop("autoreset_mode", "next_step"), options.pop("render_mode", None)
    env, params = make(options)
    if limit not in (None, -1):
        steps = require_integer("max_episode_steps", limit, accepted=LIMIT)
        params = params.shortened(steps) if steps < horizon(params) else params
    return envs.GymVectorEnv(env, params, num_envs, *how)


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


class _Watch:
    """A finder that waits on sys.meta_path for one package, and leaves when that is imported."""

    def __init__(self, package: str, act: Callable[[], None]):
        self.package, self.act = package, act

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Spec of the other finders, with a loader that runs `act` after the package."""
        if name != self.package:
            return None
        others = (one for one in sys.meta_path if one is not self and hasattr(one, "find_spec"))
        specs = (finder.find_spec(name, path, target) for finder in others)
        spec = next((spec for spec in specs if spec is not None), None)
        loader: Any = None if spec is None else spec.loader
        if hasattr(loader, "exec_module"):

            def load_and_act(module: ModuleType) -> None:
                del loader.exec_module  # the loader's own is behind it
                loader.exec_module(module)
                if self in sys.meta_path:
                    sys.meta_path.remove(self)
                self.act()

            loader.exec_module = load_and_act
        return spec


def when_imported(package: str, act: Callable[[], None]) -> None:
    """Call `act` where the package is imported already, else right after it is."""
    if package in sys.modules:
        act()
    else:
        sys.meta_path.insert(0, _Watch(package, act))
