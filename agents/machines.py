"""Which machine a training run is of, and what training has to know of it."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

from stickslip.agents.foreign.reading import RefusedError
from stickslip.agents.training.configuration import BIPED, Configuration, content_of
from stickslip.dynamics.plain_checks import shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

MACHINES = (BIPED, "ugv")
"""The names that the command line knows; the first one is meant where none is given."""
CONFIGS = {BIPED: ("biped.config", "TrainConfig"), "ugv": ("ugv.config", "UGVTrainConfig")}
"""Module of stickslip.agents and class of each machine's configuration."""


class Machine(Protocol):
    """The module <machine>.machine of stickslip.agents."""

    EVALUATED: tuple[str, ...]
    """What evaluations.csv holds of each evaluation; "return" among it."""
    EPISODE: tuple[str, ...]
    """What metrics.csv holds of the training episodes."""

    def make_task(self, config: Any) -> Any:
        """Something with env (static) and training (its parameters). ValueError if impossible."""
        ...

    def about(self, task: Any) -> dict[str, Any]:
        """The task as JSON values, for the policy's file."""
        ...

    def evaluate_policy(self, task: Any, policy: Any, config: Any) -> dict[str, float]:
        """A row of evaluations.csv."""
        ...

    def summary(self, ended: Sequence[dict[str, Any]], period: float) -> dict[str, float]:
        """EPISODE of the last infos of one or more training episodes; period: of a step [s]."""
        ...

    def beside_bar(self, row: Mapping[str, float]) -> str:
        """How training episodes go, in a few characters."""
        ...

    def line(self, row: Mapping[str, float]) -> str:
        """An evaluation in a line."""
        ...

    def write_products(self, trained: Any) -> list[Path]:
        """Write what a finished run leaves to look at, and return the paths."""
        ...


def machine_named(arguments: Sequence[str]) -> str:
    """The machine that the arguments of `stickslip train` name, before they are parsed."""
    return next((name for name in arguments if name in MACHINES), BIPED)


def machine_of(config: Configuration) -> Machine:
    """The machine that a configuration is of."""
    found: Any = import_module(f"stickslip.agents.{config.machine}.machine")
    return found


def config_kind(machine: str) -> type[Configuration]:
    """The class of a machine's configuration."""
    module, name = CONFIGS[machine]
    return getattr(import_module(f"stickslip.agents.{module}"), name)


def read_configuration(text: str) -> Any:
    """The configuration in a JSON text, of whichever machine, or ValueError."""
    machine = content_of(text).get("machine", BIPED)
    if machine not in MACHINES:
        raise RefusedError(f"its machine is {shown(machine)}, not one of {', '.join(MACHINES)}")
    return config_kind(machine).from_json(text)
