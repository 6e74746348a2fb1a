"""The Gymnasium ids and their keyword arguments.

Registering needs the ids only: the environments are imported when the first one is made.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

from stickslip import envs
from stickslip.envs.tasks.definition import ENVIRONMENTS, TASKS, task_by_name
from stickslip.envs.tasks.known import threshold

if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec

    from stickslip.envs.adapters.gym import GymEnv, GymVectorEnv
    from stickslip.envs.tasks.definition import Made

Options: TypeAlias = dict[str, Any]
"""Arguments of the environment and of its `make_params`, by name."""

IDS = {"BipedEnv": "stickslip/Biped-v0", "UGVEnv": "stickslip/UGV-v0"}
"""Id of each class of environments, with options."""
LIMIT = "an integer >= 1, None or -1 (the parameters' own time limit)"
"""Accepted values of max_episode_steps."""


def make(
    environment: str = "", task: str = "", render_mode: str | None = None, **options: Any
) -> GymEnv:
    """One environment of a class, or of a task.

    options: of a class, its static choices (setting, criterion, ...) and entries of its
    `make_params` (scene, track, randomisation, ...); of a task (see stickslip.envs.tasks), none.
    """
    return envs.GymEnv(*_made(environment, task, options), render_mode)


make.__dict__["metadata"] = {"render_modes": ["rgb_array"], "render_fps": 50}
"""So that Gymnasium shows `render_mode="human"` by its own wrapper."""


def make_vec(
    environment: str = "",
    task: str = "",
    num_envs: int = 1,
    autoreset_mode: Any = "next_step",
    render_mode: str | None = None,
    max_episode_steps: int | None = None,
    **options: Any,
) -> GymVectorEnv:
    """n environments in one compiled call; options as in `make`.

    max_episode_steps: as `gymnasium.make` takes it, -1 or None for the parameters' own time limit;
    a longer one changes nothing.
    """
    from stickslip.dynamics.checks import require_integer
    from stickslip.envs.functional import horizon

    if "autoreset" in options:
        raise ValueError(f"autoreset = {options['autoreset']!r}; accepted: autoreset_mode instead")
    env, params = _made(environment, task, options)
    if max_episode_steps not in (None, -1):
        steps = require_integer("max_episode_steps", max_episode_steps, accepted=LIMIT)
        params = params.shortened(steps) if steps < horizon(params) else params
    return envs.GymVectorEnv(env, params, num_envs, autoreset_mode, render_mode)


def _made(environment: str, task: str, options: Options) -> Made:
    """The functional environment, without autoreset unless asked for, and its parameters."""
    from dataclasses import fields

    from stickslip.dynamics.checks import require_known
    from stickslip.dynamics.pytrees import refuse_after_fork

    refuse_after_fork()
    if task:
        found = task_by_name(task)
        if options:
            raise ValueError(
                f"{', '.join(options)} with {found.id}, which is fixed; accepted: render_mode (and "
                f"for vectors num_envs, autoreset_mode), or {IDS[found.environment]} with options"
            )
        return found.make()
    kind = getattr(envs, environment)
    static = tuple(field.name for field in fields(kind))
    require_known(options, static + kind.parameter_names(), f"option of {kind.__name__}")
    choices = {"autoreset": "disabled"} | {k: v for k, v in options.items() if k in static}
    env = kind(**choices)
    return env, env.make_params(**{k: v for k, v in options.items() if k not in static})


def register() -> None:
    """Tell Gymnasium of the environments; done by `import stickslip`, safe to repeat.

    The two general ids are registered without max_episode_steps, since TimeLimit would cut what
    longer parameters ask for; `spec` of what is made says it.
    """
    import gymnasium

    general: dict[str, Options] = {
        IDS[name]: {"kwargs": {"environment": name}} for name in ENVIRONMENTS
    }
    tasks: dict[str, Options] = {
        task.id: {
            "reward_threshold": threshold(task),
            "max_episode_steps": task.max_episode_steps,
            "kwargs": {"task": task.name},
        }
        for task in TASKS.values()
    }
    for name, about in (general | tasks).items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"{__name__}:make",
                vector_entry_point=f"{__name__}:make_vec",
                **about,
            )


class _Watch:
    """A finder on sys.meta_path that runs `act` when a package has been imported."""

    def __init__(self, package: str, act: Callable[[], None]):
        self.package, self.act = package, act

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """The other finders' spec, with a loader that runs `act` after the package."""
        if name != self.package:
            return None
        others = (one.find_spec(name, path, target) for one in sys.meta_path if one is not self)
        spec = next(filter(None, others), None)
        loader: Any = None if spec is None else spec.loader

        def load(module: ModuleType) -> None:
            type(loader).exec_module(loader, module)
            if self in sys.meta_path:
                sys.meta_path.remove(self)
            self.act()

        if loader is not None:
            loader.exec_module = load
        return spec


def when_imported(package: str, act: Callable[[], None]) -> None:
    """Call `act` now if the package is imported, else right after its import."""
    if package in sys.modules:
        act()
    else:
        sys.meta_path.insert(0, _Watch(package, act))
