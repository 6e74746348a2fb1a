"""The task of a standard machine: an environment and its parameters."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Generic, NamedTuple

import numpy as np

from stickslip.agents.protocol import Env, Values
from stickslip.agents.tasks.file import in_words, plain, read_parts
from stickslip.agents.untrusted import RefusedError, refusing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from stickslip.agents.machine import Options
    from stickslip.agents.untrusted import Json


class StandardTask(NamedTuple, Generic[Env, Values]):
    """Options change the fields of their names. with_scene: (values, scene) -> values."""

    env: Env
    values: Values
    with_scene: Callable[[Values, str], Values]

    @property
    def training(self) -> Values:
        """Training is on the task itself."""
        return self.values

    @property
    def tested(self) -> Values:
        """So are evaluations."""
        return self.values

    def params(self) -> Values:
        """The environment's parameters."""
        return self.values

    def with_options(self, options: Options, scene: str | None) -> StandardTask[Env, Values]:
        """See Task."""
        values = self.values if scene is None else self.with_scene(self.values, scene)
        names = {one.name for one in fields(values)} & options.keys()
        changed = {name: options[name] for name in names if options[name] is not None}
        return self._replace(values=replace(values, **changed) if changed else values)

    def label(self, scene: str | None) -> str:
        """See Task."""
        return scene or "standard"

    def details(self) -> str:
        """The fields that are numbers."""
        values = {one.name: plain(getattr(self.values, one.name)) for one in fields(self.values)}
        words = [
            f"{name} {in_words(value)}"
            for name, value in values.items()
            if isinstance(value, int | float | list)
        ]
        return ", ".join(words).replace("_", " ")


def read_task(
    metadata: Mapping[str, Json],
    env: Env,
    with_scene: Callable[[Values, str], Values],
) -> StandardTask[Env, Values] | None:
    """The task in a policy's metadata; None where there is none. ValueError for a damaged one."""
    parts = read_parts(metadata, ("env", "values"))
    if parts is None:
        return None
    with refusing("its task"):
        if not isinstance(parts["env"], type(env)):
            raise RefusedError(f"its task's environment is no {type(env).__name__}")
        parts["env"].check_params(parts["values"])
        bounds = parts["env"].observation_bounds(parts["values"])  # for what only it knows
        if not all(np.all(np.isfinite(one)) for one in bounds):
            raise RefusedError("its task's observations have no bounds")
        return StandardTask(parts["env"], parts["values"], with_scene)
