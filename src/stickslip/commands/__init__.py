"""The commands of `stickslip`, a module each, imported when its command is asked for.

A module has `add_flags(parser, arguments)`, which says what may be given and imports nothing heavy,
`run(given) -> Outcome`, which imports what does the work, and EXAMPLES: command lines and what each
is for, shown at the end of its help. JSON: whether the outcome holds what was found, for --json.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple, Protocol, cast

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence

    from stickslip.parser import Parser
    from stickslip.records.content import Content


OK, NOTHING_FOUND, WRONG_INPUT, READER_LEFT = 0, 1, 2, 141
"""Exit statuses. NOTHING_FOUND: no drive, no gait, or a simulated machine that did not get to the
end of what was asked. READER_LEFT: nobody reads the output any more, as shells count it."""


class Outcome(NamedTuple):
    """found: for --json, None where there is nothing to tell."""

    status: int = OK
    found: Content | None = None


class Command(Protocol):
    """Protocol of a command's module."""

    EXAMPLES: Mapping[str, str]
    JSON: bool

    def add_flags(self, parser: Parser, arguments: Sequence[str]) -> None:
        """Add the flags. arguments: all of the command line, since machines have flags of their
        own."""
        ...

    def run(self, given: argparse.Namespace) -> Outcome:
        """Do what was asked. ValueError or OSError for what cannot be done."""
        ...


COMMANDS = {
    "train": "train a policy with PPO or SAC",
    "evaluate": "compare policies and baselines in a table",
    "simulate": "a walk under a torque, or a drive with given leg angles, as data and a picture",
    "sweep": "policies at every point of a grid of frictions, loads, speeds and more, into a "
    "directory",
    "compare": "two sweeps side by side",
    "view": "an animation or a page of a policy or baseline at work",
    "demo": "train a machine on a task of its own and compare it",
    "tasks": "named tasks that never change, and the best known on each",
    "policies": "trained policies of the package, one for each task",
    "export": "a policy as ONNX, or as a NumPy archive",
    "optimise": "a UGV's leg angles along a track, or the biped's best gait",
    "reproduce": "compute the chapter's figures again and compare its claims with what comes out",
    "bench": "measure: speed, accuracy, optimisers, this package beside others",
    "completion": "what makes a shell complete commands, flags and names",
}
"""Descriptions of the commands, in the order of the help; a module has its command's name."""


def command_by_name(name: str) -> Command:
    """A command's module."""
    return cast("Command", import_module(f"{__name__}.{name}"))
