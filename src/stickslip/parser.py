"""The parser of the command line: options given once, settings, refusals as ValueError.

A command has flags for what is often asked and settings for the rest: `--set name=value`.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import shutil
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, field, fields
from functools import partial
from itertools import takewhile
from typing import Any, NoReturn, TypeVar, get_args, get_origin, get_type_hints

from stickslip.dynamics.checks import nearest, require_known, shown

T = TypeVar("T")


def option(default: Any = MISSING, about: str = "", **how: Any) -> Any:
    """A field of a dataclass of options, see `add_options`.

    how: names: completed by shells; group: title in the help; flag: where
    it is not the field's name; and options of `add_argument`.
    """
    metadata = {"about": about, "how": how}
    if default is MISSING:
        return field(metadata=metadata, kw_only=True)
    if isinstance(default, list):
        return field(default_factory=list, metadata=metadata, kw_only=True)
    return field(default=default, metadata=metadata, kw_only=True)


set_option = partial(option, setting=True)
"""A field that is set by `--set name=value`."""


def changes_option(*parts: str) -> Any:
    """A field with the texts of `--set PART.NAME=VALUE` by dotted names; {} without any."""
    return field(default_factory=dict, metadata={"parts": parts}, kw_only=True)


def add_options(parser: Parser, kind: type) -> None:
    """Add a flag or a setting for each field of a dataclass of options.

    bool: a switch, --no-NAME where it is true by default. list[X]: one or more values. tuple[X, X]:
    two values. X | None: a value. A default that is not None ends the help.
    """
    hints = get_type_hints(kind)
    groups: dict[str, argparse._ArgumentGroup] = {}
    for one in fields(kind):
        if "parts" in one.metadata:
            parser.add_parts(one.name, one.metadata["parts"])
            continue
        how: dict[str, Any] = dict(one.metadata["how"])
        name, about = one.name, one.metadata["about"].replace("%", "%%")
        setting, names = how.pop("setting", False), how.pop("names", ())
        title, flag = how.pop("group", ""), how.pop("flag", flag_of(name))
        default = [] if one.default is MISSING and one.default_factory is list else one.default
        how = _form(hints[name], default, setting) | how
        if how.get("action") == "append":
            del how["nargs"]
        if default is MISSING:
            how["required"] = True
        elif isinstance(default, int | float | str) and not isinstance(default, bool):
            about += f" (default: {default})"
        if setting:
            completes(parser.add_setting(name, help=about, **how), names)
            continue
        if default is True:
            flag = f"--no-{flag[2:]}"
        if title and title not in groups:
            groups[title] = parser.add_argument_group(title)
        where = groups[title] if title else parser
        completes(where.add_argument(flag, dest=name, help=about, **how), names)


def options_of(kind: type[T], flags: Mapping[str, Any]) -> T:
    """The dataclass of options from parsed flags by name."""
    return kind(**{one.name: flags[one.name] for one in fields(kind)})  # type: ignore[arg-type]


def _form(hint: Any, default: Any, setting: bool) -> dict[str, Any]:
    """Options of `add_argument` for a type."""
    if hint is bool and not setting:
        return {"action": "store_false" if default is True else "store_true"}
    found: dict[str, Any] = {} if default is MISSING else {"default": default}
    inner = next((one for one in get_args(hint) if one is not type(None)), hint)
    kind = inner if get_origin(hint) not in (list, tuple) else hint
    if get_origin(kind) in (list, tuple):
        found["nargs"] = "+" if get_origin(kind) is list else len(get_args(kind))
        inner = get_args(kind)[0]
    return found | {"type": truth if inner is bool else inner}


class _Once(argparse._StoreAction):
    """Refuses an option that is given twice, of which argparse would take the last."""

    given = False

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        if option_string is not None and self.given:
            parser.error(f"{'/'.join(self.option_strings)} is given twice")
        self.given = True
        super().__call__(parser, namespace, values, option_string)


class _Set(argparse.Action):
    """Hands each `name=value` to the setting of that name, or to the flag that takes a value."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        for word in values:
            name, equals, text = word.partition("=")
            name = name.replace("-", "_")
            if not equals:
                raise argparse.ArgumentError(self, f"{shown(word)}; accepted: NAME=VALUE")
            if isinstance(parser, Parser) and name.partition(".")[0] in parser.parts:
                changes: dict[str, str] = getattr(namespace, parser.parts[name.partition(".")[0]])
                if name in changes:
                    parser.error(f"{name} is given twice")
                changes[name] = text
                continue
            action = parser._option_string_actions.get(flag_of(name))
            if not isinstance(action, argparse._StoreAction):
                settings = parser.settings if isinstance(parser, Parser) else {}
                require_known([name], settings, "setting")
                action = settings[name]
            words = [text] if action.nargs is None else text.split(",")
            if isinstance(action.nargs, int) and len(words) != action.nargs:
                accepted = f"{action.nargs} values with a comma between them"
                raise argparse.ArgumentError(action, f"{shown(text)}; accepted: {accepted}")
            action(parser, namespace, parser._get_values(action, words), option_string)


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
            self.register("action", name, _Once)
        self.settings: dict[str, argparse.Action] = {}
        self.parts: dict[str, str] = {}
        self.machines: Mapping[str, str] = {}
        self._instead: tuple[str, ...] = ()
        self._shown_last: argparse._ArgumentGroup | None = None

    def add_setting(self, name: str, **options: Any) -> argparse.Action:
        """Add a setting with the options of `add_argument`; nargs: values between commas."""
        group = self._settings_group()
        if options.get("type") is truth:
            options["metavar"] = "BOOL"
        action = _Once([name], dest=name, **options)
        self.settings[name] = action
        group._group_actions.append(action)
        if action.default is not argparse.SUPPRESS:
            self.set_defaults(**{name: action.default})
        return action

    def add_parts(self, name: str, parts: Sequence[str]) -> None:
        """Take `--set PART.NAME=VALUE` for these parts, as texts by dotted names under `name`."""
        self._settings_group()
        self.parts |= dict.fromkeys(parts, name)
        self.set_defaults(**{name: {}})

    def _settings_group(self) -> argparse._ArgumentGroup:
        """The group of the settings, with the flag that sets them."""
        if self._shown_last is None:
            self.add_argument(
                "--set",
                action=_Set,
                nargs="+",
                default=argparse.SUPPRESS,
                metavar="NAME=VALUE",
                help="settings below; the flag may come again",
            )
            self._shown_last = self.add_argument_group("settings, as --set NAME=VALUE")
        return self._shown_last

    def add_machine(
        self, machines: Mapping[str, str], arguments: Sequence[str], *instead: str
    ) -> bool:
        """Add the argument that names a machine; return whether the arguments name one.

        machines: names, and what the command does with each. instead: flags that name it, too. A
        line that names none is refused; without a machine the help lists them and no flags.
        """
        self.machines, self._instead = machines, instead
        how: dict[str, Any] = {"nargs": "?"} if instead else {}
        self.add_argument("machine", choices=machines, help=", ".join(machines), **how)
        if self._names_machine(arguments):
            return True
        helps = {f"{self.prog} {name} --help": about for name, about in machines.items()}
        add_tables(self, {"machines, each with flags of its own": helps})
        return False

    def _names_machine(self, words: Sequence[str]) -> bool:
        flags = {word.partition("=")[0] for word in words}
        return not flags.isdisjoint((*self.machines, *self._instead))

    def _require_machine(self, words: Sequence[str]) -> None:
        """Refuse a line without a machine before any of its flags."""
        asks = "_ARGCOMPLETE" in os.environ or not {"-h", "--help"}.isdisjoint(words)
        if not self.machines or asks or self._names_machine(words):
            return
        known = ", ".join(f"{name} ({about})" for name, about in self.machines.items())
        first = words[0] if words and not words[0].startswith("-") else None
        said = "no machine is named"
        if first is not None:
            said = f"{shown(first)} is no machine{nearest(first, self.machines)}"
        self.error(f"{said}; accepted: {known}")

    def format_help(self) -> str:
        """Format the help with the settings behind all flags."""
        self._action_groups.sort(key=lambda group: group is self._shown_last)
        return super().format_help()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """Parse; unknown options are refused before all else, with the nearest known one.

        A value may begin with a minus, as in `--torque -crank_rate`.
        """
        self._negative_number_matcher = re.compile("-[^-]")
        self._has_negative_number_optionals: list[bool] = []
        if self._subparsers is None:
            self._require_machine(list(args or ()))
            self._require_known(list(args or ()))
        return super().parse_known_args(args, namespace)

    def _require_known(self, words: Sequence[str]) -> None:
        words = list(takewhile(lambda word: word != "--", words))
        if any(one.nargs == argparse.REMAINDER for one in self._actions):
            words = list(takewhile(lambda word: word.startswith("-"), words))
        for word in words:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in self._option_string_actions:
                self.error(f"unrecognized arguments: {name[:200]}{self._nearest(name)}")

    def _nearest(self, name: str) -> str:
        flags = {flag_of(one): f"--set {one}=VALUE" for one in self.settings}
        if name in flags:
            return f"; accepted: {flags[name]}"
        found = nearest(name, self._option_string_actions.keys() | flags.keys())
        for flag, setting in flags.items():
            found = found.replace(f" {flag}?", f" {setting}?")
        return found

    def error(self, message: str) -> NoReturn:
        """Report an error; argparse calls this."""
        raise ValueError(f"{message} (see {self.prog} --help)")


def flag_of(name: str) -> str:
    """The flag of a name: --na-me of na_me."""
    return "--" + name.replace("_", "-")


def truth(text: str) -> bool:
    """The value of a setting that is true or false."""
    if text not in ("true", "false"):
        raise argparse.ArgumentTypeError(f"{shown(text)}; accepted: true, false")
    return text == "true"


def limit(text: str) -> float:
    """The value of an option that may be none: infinite then."""
    if text == "none":
        return math.inf
    try:
        return float(text)
    except ValueError:
        message = f"{shown(text)}; accepted: a number > 0, or none"
        raise argparse.ArgumentTypeError(message) from None


def add_tables(parser: argparse.ArgumentParser, tables: Mapping[str, Mapping[str, str]]) -> None:
    """Add tables of names and meanings, by title, at the end of a command's help."""
    parser.epilog = tables_text(tables)


def tables_text(tables: Mapping[str, Mapping[str, str]]) -> str:
    """Format tables of names and meanings by title."""
    width = max(60, shutil.get_terminal_size().columns - 2)
    blocks = []
    for title, rows in tables.items():
        column = max(map(len, rows)) + 2
        style: dict[str, Any] = {"width": width, "subsequent_indent": " " * (2 + column)}
        style["break_on_hyphens"] = False
        lines = [textwrap.fill(f"  {name:<{column}}{text}", **style) for name, text in rows.items()]
        blocks.append("\n".join([f"{title}:", *lines]))
    return "\n\n".join(blocks)


def examples_text(examples: Mapping[str, str]) -> str:
    """Format command lines and their purposes."""
    return "\n".join(
        ["examples:", *(f"  {about}:\n    {line}" for line, about in examples.items())]
    )


def completes(action: argparse.Action | None, names: Iterable[str]) -> None:
    """Offer names for an argument in shells; where none begins as what is typed, files."""
    known = tuple(names)

    def beginning(prefix: str, **_: object) -> list[str]:
        from argcomplete.completers import FilesCompleter

        return [name for name in known if name.startswith(prefix)] or FilesCompleter()(prefix)

    if action is not None and known:
        action.completer = beginning  # type: ignore[attr-defined], argcomplete looks for it
