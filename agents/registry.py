"""Registry of machines by name. stickslip.agents registers its own when it is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.training.configuration import UNNAMED, Configuration, content_of
from stickslip.agents.untrusted import RefusedError
from stickslip.dynamics.checks import nearest, require_choice, shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.protocol import AnyEnv
    from stickslip.agents.untrusted import Json

_MACHINES: dict[str, AnyMachine] = {}


def register(machine: AnyMachine) -> None:
    """Make a machine known to training, evaluation, policy files and the command line.

    ValueError where its name, its environment or a baseline's name is another machine's; a machine
    of a name and class that are registered takes the place of the one before.
    """
    for other in _MACHINES.values():
        if other.name == machine.name and type(other).__name__ == type(machine).__name__:
            continue
        taken = {other.name, other.environment, *other.baselines}
        if common := taken & {machine.name, machine.environment, *machine.baselines}:
            raise ValueError(
                f"{', '.join(sorted(common))} is known from the {other.title}; accepted: names, "
                "environments and baselines that no other machine has"
            )
    _MACHINES[machine.name] = machine


def unregister(name: str) -> None:
    """Forget a machine. ValueError for an unknown name."""
    machine_by_name(name)
    del _MACHINES[name]


def machines() -> tuple[AnyMachine, ...]:
    """All machines in order of their registration; the first one is meant where none is named."""
    return tuple(_MACHINES.values())


def machine_by_name(name: str) -> AnyMachine:
    """The machine of a name. ValueError for an unknown one."""
    require_choice("machine", name, tuple(_MACHINES))
    return _MACHINES[name]


def machine_among(arguments: Sequence[str]) -> AnyMachine:
    """The machine that the arguments of `stickslip train` name, before they are parsed, or that
    their task is of. ValueError for an unknown task."""
    named = next((name for name in arguments if name in _MACHINES), None)
    if named is None and (task := _task_among(arguments)) is not None:
        from stickslip.envs.tasks.definition import task_by_name

        named = task_by_name(task).machine
    return machines()[0] if named is None else _MACHINES[named]


def _task_among(arguments: Sequence[str]) -> str | None:
    """Value of --task in the arguments, in either form."""
    for word, after in zip(arguments, (*arguments[1:], None), strict=True):
        if word == "--task" or word.startswith("--task="):
            return after if word == "--task" else word.partition("=")[2]
    return None


def machine_of_env(env: AnyEnv) -> AnyMachine:
    """The machine of an environment, or of what its class inherits from. ValueError for none."""
    kinds = (machine_of_environment(kind.__name__) for kind in type(env).__mro__)
    found = next((one for one in kinds if one is not None), None)
    if found is None:
        known = ", ".join(one.environment for one in machines())
        raise ValueError(f"env is a {type(env).__name__}; accepted: {known}")
    return found


def machine_of_environment(environment: Json) -> AnyMachine | None:
    """The machine whose environment's class has that name, if there is one."""
    return next((one for one in machines() if one.environment == environment), None)


def machine_of_baseline(name: str) -> AnyMachine | None:
    """The machine that has a baseline of that name, if there is one."""
    return next((one for one in machines() if name in one.baselines), None)


def read_configuration(text: str) -> Configuration:
    """The configuration in a JSON text, of whichever machine, or ValueError."""
    name = content_of(text).get("machine", UNNAMED)
    if not isinstance(name, str) or name not in _MACHINES:
        near = nearest(name, _MACHINES) if isinstance(name, str) else ""
        raise RefusedError(f"its machine is {shown(name)}, not one of {', '.join(_MACHINES)}{near}")
    return _MACHINES[name].configuration.from_json(text)
