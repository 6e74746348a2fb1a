"""`stickslip completion`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import Outcome
from stickslip.completing import SHELLS
from stickslip.parser import add_tables

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

JSON = False
EXAMPLES = {
    "stickslip completion bash >> ~/.bashrc": "for good, in bash",
    "stickslip completion zsh >> ~/.zshrc": "in zsh",
    "stickslip completion fish >> ~/.config/fish/config.fish": "in fish",
}
HOW = {
    "bash": 'eval "$(stickslip completion bash)", in ~/.bashrc',
    "zsh": 'eval "$(stickslip completion zsh)", in ~/.zshrc',
    "fish": "stickslip completion fish | source, in ~/.config/fish/config.fish",
}


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """For which shell."""
    del arguments
    parser.add_argument("shell", choices=SHELLS, help="that reads what is printed")
    add_tables(parser, {"where it goes": HOW})


def run(given: argparse.Namespace) -> Outcome:
    """Print what the shell is to read."""
    from stickslip.completing import script

    print(script(given.shell), end="")
    return Outcome()
