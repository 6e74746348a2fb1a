"""Checks of the arguments of evaluations and rollouts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol, Self, TypeVar

from stickslip.agents.protocol import Controller, Planner
from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.functional import FunctionalEnv

if TYPE_CHECKING:
    from stickslip.agents.protocol import AnyEnv


class Validated(Protocol):
    """Protocol of objects that validate themselves, or raise ValueError."""

    def validate(self) -> Self:
        """Itself."""
        ...


Given = TypeVar("Given", bound=Validated)
CONTROLLER = "a controller (init, act and validate; help(stickslip.agents.Controller))"


def require_places(env: AnyEnv, scenes: Mapping[str, object]) -> None:
    """Raise ValueError unless these are an environment and its parameters by name."""
    require_kind("env", env, FunctionalEnv, "a BipedEnv, a UGVEnv or another functional one")
    require_named("scenes", scenes, f"{{name: parameters of the {type(env).__name__}}}")
    for name, params in scenes.items():
        env.check_params(params, f"scenes[{name!r}]")


def require_named(name: str, given: object, accepted: str) -> None:
    """Raise ValueError unless `given` is a dict, or like one, of something by its name."""
    require_kind(name, given, Mapping, f"a dict, {accepted}")
    for key in given if isinstance(given, Mapping) else ():
        require_kind(f"a name in {name}", key, str, "text")


def validated_player(name: str, given: Given) -> Given:
    """A controller or a planner that has found its own numbers right. ValueError otherwise."""
    return _validated(name, given, (Controller, Planner), f"{CONTROLLER}, or a planner")


def validated_controller(name: str, given: Given) -> Given:
    """The same without planners, whose path is one episode's."""
    return _validated(name, given, Controller, CONTROLLER)


def _validated(name: str, given: Given, kinds: type | tuple[type, ...], accepted: str) -> Given:
    if isinstance(given, type) and hasattr(given, "validate"):
        raise ValueError(f"{name} = {shown(given)} is a class; accepted: {given.__name__}(...)")
    require_kind(name, given, kinds, accepted)
    return given.validate()


@contextmanager
def made_for(player: object, env: AnyEnv, *own: object) -> Iterator[None]:
    """Raise ValueError where a player reads what the environment, or its state or parameters in
    `own`, do not have: it was made for another machine."""
    try:
        yield
    except AttributeError as error:
        if type(error.obj) not in {type(env), *map(type, own)}:
            raise
        raise ValueError(
            f"{type(player).__name__} reads {error.name!r} of a {type(error.obj).__name__}, which "
            f"has none; accepted: a controller that was made for {type(env).__name__}"
        ) from error
