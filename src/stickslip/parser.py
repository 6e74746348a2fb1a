"""The parser of the command line: options given once, refusals as ValueError, tables in help."""

from __future__ import annotations

import argparse
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from stickslip.completing import files
from stickslip.dynamics.plain_checks import nearest, shown

MEAN_RATES = {"--mean-rate", "--commanded-rate", "--speed"}
"""What somebody may call a mean crank rate."""


class _Once(argparse.Action):
    """Refuses an option that is given twice, of which argparse would take the last."""

    given = False

    def __call__(self, parser: Any, namespace: Any, values: Any, option: Any = None) -> None:
        if option is not None and self.given:
            parser.error(f"{'/'.join(self.option_strings)} is given twice")
        self.given = True
        super().__call__(parser, namespace, values, option)


class _StoreOnce(_Once, argparse._StoreAction):
    pass


class _SwitchOnce(_Once, argparse.BooleanOptionalAction):
    pass


class Names(argparse._AppendAction):
    """An option of one value that may be given again, or followed by more of the `names` it knows.

    What follows its value and is no such name is not its own: `--scene wet firm run` takes two.
    """

    def __init__(self, *arguments: Any, names: Sequence[str], **options: Any):
        super().__init__(*arguments, **options)
        self.names = tuple(names)


class _Help(argparse.HelpFormatter):
    """Breaks no name at its hyphens, and leaves a text of several lines as it is."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return text if "\n" in text else super()._fill_text(text, width, indent)


class Parser(argparse.ArgumentParser):
    """Raises ValueError where argparse would print the usage and exit, and for options that are
    given twice or shortened. A parser reads one command line."""

    def __init__(self, *arguments: Any, **options: Any):
        options = {"formatter_class": _Help, "allow_abbrev": False} | options
        super().__init__(*arguments, **options)
        for name in (None, "store"):
            self.register("action", name, _StoreOnce)
        self.register("action", argparse.BooleanOptionalAction, _SwitchOnce)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """As ever; an option that the command does not have is told first, with the nearest."""
        words = list(sys.argv[1:] if args is None else args)
        command = self._command_in(words)
        words, passed_on = _split(words, command)
        known = {*self._option_string_actions, *command._option_string_actions}
        for word in words[: words.index("--") if "--" in words else None]:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in known:
                command.error(f"unrecognized arguments: {name[:200]}{_nearest(name, known)}")
        words = _values_joined(_names_last(words, command), command._option_string_actions)
        return super().parse_args([*words, *passed_on], namespace)

    def _command_in(self, words: Sequence[str]) -> argparse.ArgumentParser:
        """The parser of the command that is called, or this one."""
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                return next((action.choices[one] for one in words if one in action.choices), self)
        return self

    def error(self, message: str) -> NoReturn:
        """What argparse calls."""
        raise ValueError(f"{message} (see {self.prog} --help)")


def _split(words: list[str], command: argparse.ArgumentParser) -> tuple[list[str], Sequence[str]]:
    """What this parser reads, and what a command that runs another passes on to it unread."""
    if any(one.nargs == argparse.REMAINDER for one in command._actions):
        begins = words.index(command.prog.split()[-1]) + 1
        for place in range(begins, len(words)):
            if not words[place].startswith("-"):
                return words[: place + 1], words[place + 1 :]
    return words, ()


def _nearest(name: str, known: Iterable[str]) -> str:
    """See `nearest`; the mean crank rate is a gait's, or what a walker is commanded."""
    other = [one for one in known if {one, name} <= MEAN_RATES]
    return f" (did you mean {other[0]}?)" if other else nearest(name, known)


def add_tables(parser: argparse.ArgumentParser, tables: Mapping[str, Mapping[str, str]]) -> None:
    """Names and what each means, by title, at the end of a command's help."""
    width = max(60, shutil.get_terminal_size().columns - 2)
    blocks = []
    for title, rows in tables.items():
        column = max(map(len, rows)) + 2
        style: dict[str, Any] = {"width": width, "subsequent_indent": " " * (2 + column)}
        style["break_on_hyphens"] = False
        lines = [textwrap.fill(f"  {name:<{column}}{text}", **style) for name, text in rows.items()]
        blocks.append("\n".join([f"{title}:", *lines]))
    parser.epilog = "\n\n".join(blocks)


def add_examples(parser: argparse.ArgumentParser, examples: Mapping[str, str]) -> None:
    """Command lines, and what each is for, at the end of a command's help, behind the tables."""
    blocks = "\n".join(f"  {about}:\n    {line}" for line, about in examples.items())
    rest = f"{parser.epilog}\n\n" if parser.epilog else ""
    parser.epilog = f"{rest}examples:\n{blocks}"


def completes(action: argparse.Action | None, names: Iterable[str]) -> None:
    """Names that a shell offers for an argument; where none begins as what is typed, it offers
    files. None: nothing to complete."""
    known = tuple(names)

    def beginning(prefix: str, **_: object) -> list[str]:
        return [name for name in known if name.startswith(prefix)] or files(prefix)

    if action is not None:
        action.completer = beginning  # type: ignore[attr-defined], argcomplete looks for it


def _values_joined(words: Sequence[str], known: Mapping[str, argparse.Action]) -> list[str]:
    """The words with a value that begins with a minus joined to its option: argparse would take it
    for an option (`--torque -crank_rate`)."""
    found: list[str] = []
    for word in words:
        action = known.get(found[-1]) if found else None
        takes_one = isinstance(action, argparse._StoreAction) and action.nargs is None
        if takes_one and word.startswith("-") and word not in known and "--" not in found:
            found[-1] += f"={word}"
        else:
            found.append(word)
    return found


def _names_last(words: Sequence[str], command: argparse.ArgumentParser) -> list[str]:
    """The words with each value of a Names option behind all others, and the option before it.

    What follows a name there, looks like a name misspelt and is no file, is refused.
    """
    others: list[str] = []
    named: list[str] = []
    option: Names | None = None
    begun = False
    for place, word in enumerate(words):
        if word == "--":
            return [*others, *named, *words[place:]]
        if word.startswith("-"):
            action = command._option_string_actions.get(word)
            option, begun = (action if isinstance(action, Names) else None), False
            (others if option is None else named).append(word)
        elif option is None:
            others.append(word)
        elif not begun:
            named.append(word)
            begun = True
        elif word in option.names:
            named += [option.option_strings[0], word]
        else:
            if (near := nearest(word, option.names)) and not Path(word).exists():
                flag = option.option_strings[0]
                command.error(f"argument {flag}: {shown(word)} is unknown{near}")
            others.append(word)
            option = None
    return [*others, *named]
