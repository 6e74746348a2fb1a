"""The parser of the command line: options given once, settings, refusals as ValueError.

A command has flags for what is often asked and settings for the rest: `--set name=value`.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from stickslip.completing import files
from stickslip.dynamics.plain_checks import nearest, require_known, shown

MEAN_RATES = {"--mean-rate", "--commanded-rate", "--speed"}
"""What somebody may call a mean crank rate."""
SETTING = re.compile(r"[A-Za-z][\w-]*=")
"""How a word begins that gives a setting."""


class _Once(argparse.Action):
    """Refuses an option that is given twice, of which argparse would take the last."""

    given = False

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option: str | None = None,
    ) -> None:
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


class _Set(argparse.Action):
    """Hands `name=value` to the setting of that name, or to the flag that takes a value."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option: str | None = None,
    ) -> None:
        name, equals, text = str(values).partition("=")
        name = name.replace("-", "_")
        if not equals:
            raise argparse.ArgumentError(self, f"{shown(values)}; accepted: NAME=VALUE")
        action = parser._option_string_actions.get(flag_of(name))
        if not isinstance(action, argparse._StoreAction):
            settings = parser.settings if isinstance(parser, Parser) else {}
            require_known([name], settings, "setting")
            action = settings[name]
        words = [text] if action.nargs is None else text.split(",")
        if isinstance(action.nargs, int) and len(words) != action.nargs:
            accepted = f"{action.nargs} values with a comma between them"
            raise argparse.ArgumentError(action, f"{shown(text)}; accepted: {accepted}")
        action(parser, namespace, parser._get_values(action, words), option)


def flag_of(name: str) -> str:
    """The flag of a name: --na-me of na_me."""
    return "--" + name.replace("_", "-")


def truth(text: str) -> bool:
    """The value of a setting that is true or false."""
    if text not in ("true", "false"):
        raise argparse.ArgumentTypeError(f"{shown(text)}; accepted: true, false")
    return text == "true"


class _Help(argparse.HelpFormatter):
    """Shows a setting as `name=VALUE`, breaks no name at its hyphens, and leaves a text of several
    lines as it is."""

    def _format_action_invocation(self, action: argparse.Action) -> str:
        if not action.option_strings or action.option_strings[0].startswith("-"):
            return super()._format_action_invocation(action)
        values = action.metavar or action.dest.upper()
        if isinstance(values, str):
            count = action.nargs if isinstance(action.nargs, int) else 1
            values = (*[values] * count, *(["..."] if action.nargs == "+" else []))
        return f"{action.dest}={','.join(values)}"

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
        self.settings: dict[str, argparse.Action] = {}
        self._shown_last: argparse._ArgumentGroup | None = None

    def add_setting(self, name: str, **options: Any) -> argparse.Action:
        """Add a setting with the options of `add_argument`; nargs: values between commas."""
        if self._shown_last is None:
            self.add_argument(
                "--set",
                action=_Set,
                default=argparse.SUPPRESS,
                metavar="NAME=VALUE",
                help="one of the settings below; more may follow, and the flag may come again",
            )
            self._shown_last = self.add_argument_group("settings, as --set NAME=VALUE")
        if options.get("type") is truth:
            options["metavar"] = "BOOL"
        action = _StoreOnce([name], dest=name, **options)
        self.settings[name] = action
        self._shown_last._group_actions.append(action)
        if action.default is not argparse.SUPPRESS:
            self.set_defaults(**{name: action.default})
        return action

    def format_help(self) -> str:
        """As ever, with the settings behind all flags."""
        self._action_groups.sort(key=lambda group: group is self._shown_last)
        return super().format_help()

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """As ever; an option that the command does not have is told first, with the nearest."""
        words = list(sys.argv[1:] if args is None else args)
        command = self._command_in(words)
        words, passed_on = _split(words, command)
        known = {*self._option_string_actions, *command._option_string_actions}
        for word in words[: words.index("--") if "--" in words else None]:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in known:
                near = _nearest(name, known, command.settings)
                command.error(f"unrecognized arguments: {name[:200]}{near}")
        words = _names_last(_settings_apart(words), command)
        words = _values_joined(words, command._option_string_actions)
        return super().parse_args([*words, *passed_on], namespace)

    def _command_in(self, words: Sequence[str]) -> Parser:
        """The parser of the command that is called, or this one."""
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):
                return next((action.choices[one] for one in words if one in action.choices), self)
        return self

    def error(self, message: str) -> NoReturn:
        """Report an error; argparse calls this."""
        raise ValueError(f"{message} (see {self.prog} --help)")


def _split(words: list[str], command: argparse.ArgumentParser) -> tuple[list[str], Sequence[str]]:
    """Split the words into this parser's own and those that are passed on unread."""
    if any(one.nargs == argparse.REMAINDER for one in command._actions):
        begins = words.index(command.prog.split()[-1]) + 1
        for place in range(begins, len(words)):
            if not words[place].startswith("-"):
                return words[: place + 1], words[place + 1 :]
    return words, ()


def _nearest(name: str, known: set[str], settings: Iterable[str]) -> str:
    """See `nearest`; the mean crank rate is a gait's, or what a walker is commanded."""
    if other := [one for one in known if {one, name} <= MEAN_RATES]:
        return f" (did you mean {other[0]}?)"
    flags = {flag_of(one): f"--set {one}=VALUE" for one in settings}
    if name in flags:
        return f"; accepted: {flags[name]}"
    found = nearest(name, known | flags.keys())
    for flag, setting in flags.items():
        found = found.replace(f" {flag}?", f" {setting}?")
    return found


def _settings_apart(words: Sequence[str]) -> list[str]:
    """The words with `--set a=1 b=2` as `--set=a=1 --set=b=2`."""
    found: list[str] = []
    inside = False
    for place, word in enumerate(words):
        if word == "--":
            return [*found, *words[place:]]
        if inside and SETTING.match(word):
            if found[-1] == "--set":
                found.pop()
            found.append(f"--set={word}")
        else:
            found.append(word)
            inside = word == "--set"
    return found


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
